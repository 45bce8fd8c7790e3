"""Arithmetic of decimals with radii: what follows from the decimals of a trajectory has proven
radii where they have.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from typing import Any

import numpy as np

from veselova.mechanics.core.decimals import Objects, Pair

__all__ = ["DecimalBalls", "cross"]

#: Digits in which midpoints are formed beyond those asked for, and digits of a radius.
_SPARE_DIGITS = 40
_RADIUS_DIGITS = 12

#: Digits given out beyond those asked for.
_SHOWN_DIGITS = 3

#: Exponents of midpoints and radii never leave their range.
_EXPONENTS = 999_999


class DecimalBalls:
    """The arithmetic of balls midpoint ± radius for answers of so many digits: arrays of them take
    NumPy's operations.
    """

    def __init__(self, digits: int) -> None:
        self.digits = digits
        self.middle = Context(prec=digits + _SPARE_DIGITS, Emax=_EXPONENTS, Emin=-_EXPONENTS)
        self.above = Context(
            prec=_RADIUS_DIGITS, rounding=ROUND_CEILING, Emax=_EXPONENTS, Emin=-_EXPONENTS
        )
        self.below = Context(
            prec=_RADIUS_DIGITS, rounding=ROUND_FLOOR, Emax=_EXPONENTS, Emin=-_EXPONENTS
        )
        self.unit = Decimal(1).scaleb(-digits - _SPARE_DIGITS + 1)

    def array(self, midpoints: Objects, radii: Objects) -> Any:
        """Return an array of balls."""
        return np.frompyfunc(
            lambda middle, radius: _Ball(middle, self.above.plus(radius), self), 2, 1
        )(midpoints, radii)

    def of(self, numbers: Any) -> Any:
        """Return an array of balls around rationals."""
        return np.frompyfunc(self._of_rational, 1, 1)(np.asarray(numbers, dtype=object))

    def _of_rational(self, value: Fraction) -> _Ball:
        middle = self.middle.divide(Decimal(value.numerator), Decimal(value.denominator))
        return self.round_midpoint(middle, Decimal(0))

    def round_midpoint(self, middle: Decimal, radius: Decimal) -> _Ball:
        """Return the ball of a midpoint that was rounded in ``middle``: its rounding is added to
        the radius.
        """
        return _Ball(middle, self.above.fma(abs(middle), self.unit, radius), self)

    def pair(self, balls: Any) -> Pair:
        """Return midpoints rounded to three digits beyond those asked for, and radii that include
        this rounding.
        """
        split = np.frompyfunc(self._show, 1, 2)
        return split(balls)  # type: ignore[no-any-return]

    def _show(self, ball: _Ball) -> tuple[Decimal, Decimal]:
        context = Context(prec=self.digits + _SHOWN_DIGITS, Emax=_EXPONENTS, Emin=-_EXPONENTS)
        middle = context.plus(ball.middle)
        return middle, self.above.add(
            ball.radius, self.above.abs(self.above.subtract(ball.middle, middle))
        )


@dataclass(frozen=True, slots=True)
class _Ball:
    """The numbers within ``radius`` of ``middle``."""

    middle: Decimal
    radius: Decimal
    arithmetic: DecimalBalls

    def __add__(self, other: _Ball | int) -> _Ball:
        if isinstance(other, int):  # the zero that sums begin with
            return self
        own = self.arithmetic
        return own.round_midpoint(
            own.middle.add(self.middle, other.middle), own.above.add(self.radius, other.radius)
        )

    __radd__ = __add__

    def __neg__(self) -> _Ball:
        return _Ball(self.middle.copy_negate(), self.radius, self.arithmetic)

    def __sub__(self, other: _Ball) -> _Ball:
        return self + -other

    def __mul__(self, other: _Ball) -> _Ball:
        own = self.arithmetic
        a = abs(self.middle)
        b = abs(other.middle)
        radius = own.above.fma(
            a, other.radius, own.above.multiply(self.radius, own.above.add(b, other.radius))
        )
        return own.round_midpoint(own.middle.multiply(self.middle, other.middle), radius)

    def __truediv__(self, other: _Ball) -> _Ball:
        """Return the quotient x/y: |x/y − m| ≤ (r_x + |m| r_y)/(|y| − r_y) for the quotient m of
        the midpoints.
        """
        own = self.arithmetic
        least = self.arithmetic.below.subtract(abs(other.middle), other.radius)
        quotient = own.middle.divide(self.middle, other.middle) if least > 0 else Decimal(0)
        spread = own.above.fma(own.above.abs(quotient), other.radius, self.radius)
        return own.round_midpoint(
            quotient, own.above.divide(spread, least) if least > 0 else Decimal("Infinity")
        )


def cross(a: Any, b: Any) -> Any:
    """Return the vector products of vectors (N, 3)."""
    return np.stack(
        [a[:, i - 2] * b[:, i - 1] - a[:, i - 1] * b[:, i - 2] for i in range(3)], axis=1
    )
