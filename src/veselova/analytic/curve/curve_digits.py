"""A hyperelliptic curve with real branch points to many digits: working digits are added until
every number has those asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.curve.curve_values import CurveValues
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.decimals import Decimals, Later
from veselova.mechanics.core.enclosures import Pair, decimal_pair
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.results.curve import QUASI_PERIODS

__all__ = ["CurveDigits"]

#: Calibrated: working digits beyond those asked for, attempts, each with twice as many of them, and
#: digits of the midpoints beyond those asked for.
_SPARE = 10
_ATTEMPTS = 6
_SHOWN = 3

#: Where radii are compared, whatever the caller's context of decimals.
_COMPARED = Context(traps=[])


class CurveDigits:
    """One curve to ``digits`` digits, with radii, proven where ``certified``.

    Radii are below 10^−digits: of T and of images absolutely, or of their largest entry where that
    is above 1; of periods by the largest of their row, of coefficients by that of their column, of
    branch points by the largest of all.
    """

    def __init__(self, doubles: CurveValues, digits: int, certified: bool) -> None:
        self._curve, self._digits, self._certified = doubles.curve, digits, certified
        self._at = cache(
            lambda working: CurveValues(doubles.curve, balls(working, certified), doubles)
        )

    @cached_property
    def of_curve(self) -> Decimals:
        """Return what belongs to the curve itself, each computed when it is first asked for."""
        made: dict[str, tuple[Callable[[CurveValues], Values], Any, int]] = {
            "riemann_matrix": (lambda fine: fine.periods.riemann_matrix, None, 1),
            "a_periods": (lambda fine: fine.cycles[0], 1, 0),
            "b_periods": (lambda fine: fine.cycles[1], 1, 0),
            "normalized_differentials": (lambda fine: fine.normalized_differentials, 0, 0),
        }
        for i, name in enumerate(QUASI_PERIODS):
            made[name] = (lambda fine, i=i: fine.quasi_periods[i], 1, 0)  # type: ignore[misc]
        return self._decimals({name: partial(self._find, *how) for name, how in made.items()})

    def abel(self, points: Sequence[Fraction | complex], sheets: Sequence[complex]) -> Decimals:
        """Return ``abel``, (N, g, 2): real and imaginary parts of the images of points."""
        places = list(zip(points, sheets, strict=True))

        def compute(fine: CurveValues) -> Values:
            images = [fine.image(*place) for place in iterate(places)]
            return np.array(images, dtype=object).reshape(-1, self._curve.genus, 2)

        return self._decimals({"abel": partial(self._find, compute, (1, 2), 1)})

    def invert(self, z: Sequence[Sequence[Fraction]]) -> Decimals:
        """Return ``points`` λ and the ``signs`` of w, (N, g), at points z of the real torus."""
        size = Decimal(max(abs(b) for b in self._curve.points).__ceil__() or 1)
        found = list[Values]()

        def compute(fine: CurveValues) -> Values:
            points, signs = fine.invert(fine.arithmetic.array(z))
            found.append(signs)
            return points

        pair = self._find(compute, None, size)
        signs = np.vectorize(Decimal, otypes=[object])(found[-1])
        return self._decimals({"points": pair, "signs": (signs, 0 * signs)})

    def _decimals(self, pairs: dict[str, Pair | Callable[[], Pair]]) -> Decimals:
        """Return numbers by name, of which the first is bounded."""
        both = Later(pairs, 0), Later(pairs, 1)
        return Decimals(self._digits, self._certified, *both, (next(iter(pairs)),))

    def _find(self, compute: Callable[[CurveValues], Values], axes: Any, least: Any) -> Pair:
        """Return the midpoints and radii of what a curve in balls gives, with enough digits; radii
        are compared with the largest midpoint along ``axes``, or with ``least``.

        Raises Unsolved (``no-digit-left``) where the most working digits do not suffice.
        """
        spare = _SPARE
        for _ in range(_ATTEMPTS):
            fine = self._at(self._digits + spare)
            with fine.arithmetic:
                try:
                    middle, radius = decimal_pair(compute(fine), self._digits + _SHOWN)
                except ZeroDivisionError:  # a ball that should be away from zero holds it
                    radius = None
            with localcontext(_COMPARED):
                if radius is not None:
                    size = np.max(np.abs(middle), axis=axes, keepdims=True, initial=least)
                    if np.all(radius <= size * Decimal(10) ** -self._digits):
                        return middle, radius
            spare = 2 * spare
        digits = self._digits
        reason = f"{digits} digits were not reached with {digits + spare // 2} working digits"
        raise Unsolved("no-digit-left", reason)
