"""Series beyond double precision as Arb's balls: what follows from decimals with radii has radii
that hold it.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from decimal import MAX_EMAX, MAX_PREC, MIN_EMIN, ROUND_CEILING, Context, Decimal
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import acquire

__all__ = [
    "SHOWN_DIGITS",
    "BallSeries",
    "Objects",
    "Pair",
    "decimal_pair",
    "enclose",
    "exact_as",
    "precision",
    "rational",
    "working_digits",
]

Objects = NDArray[np.object_]

#: Midpoints and radii of one series.
Pair: TypeAlias = tuple[Objects, Objects]

#: Digits in which products are formed beyond those of the decimals.
_SPARE_DIGITS = 30

#: Significant digits given out beyond those asked for.
SHOWN_DIGITS = 3

#: Where midpoints are formed, and radii rounded, whatever the caller's context of decimals.
_EXACT = Context(prec=MAX_PREC, Emin=MIN_EMIN, Emax=MAX_EMAX, traps=[])
_UPWARDS = Context(prec=6, rounding=ROUND_CEILING, Emin=MIN_EMIN, Emax=MAX_EMAX, traps=[])

#: Digits that Arb gives beyond those it is asked for, the last of them rounded towards zero, and
#: their power of ten.
_UNASKED_DIGITS = 5
_UNASKED = 10**5
_HALF = _UNASKED // 2

#: The working precision is one global of the process.
_LOCK = threading.RLock()


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Compute with so many bits in the block, other threads kept out; nests."""
    import flint

    acquire(_LOCK)
    before = flint.ctx.prec
    flint.ctx.prec = bits
    try:
        yield
    finally:
        flint.ctx.prec = before
        _LOCK.release()


def working_digits(digits: int) -> AbstractContextManager[None]:
    """Compute what follows from decimals of so many digits in the block."""
    return precision(math.ceil((digits + _SPARE_DIGITS) * math.log2(10)))


def decimal_pair(balls: Any, digits: int) -> Pair:
    """Return midpoints rounded to so many significant digits, and radii that cover the rounding."""
    middles, radii = np.frompyfunc(lambda x: _decimal(x, digits), 1, 2)(balls)
    return np.asarray(middles, dtype=object), np.asarray(radii, dtype=object)


def _decimal(x: Any, digits: int) -> tuple[Decimal, Decimal]:
    """Return the midpoint, and a radius that covers its rounding: the larger of the two has so many
    digits.
    """
    from flint import arb

    if not isinstance(x, arb):
        x = arb(x)
    if not x.is_finite():
        return Decimal(0), Decimal("Infinity")
    middle, radius, exponent = map(int, x.mid_rad_10exp(digits))
    rounded, rest = divmod(middle + _HALF, _UNASKED)
    radius += abs(rest - _HALF)
    shown = Decimal(rounded).scaleb(exponent + _UNASKED_DIGITS, _EXACT) if rounded else Decimal(0)
    return shown, Decimal(radius).scaleb(exponent, _UPWARDS) if radius else Decimal(0)


def enclose(midpoints: Any, radii: Any = 0) -> Objects:
    """Return the balls of rationals, decimals or doubles in the precision in force; one of infinite
    radius encloses every number.
    """
    return np.asarray(np.frompyfunc(_ball, 2, 1)(midpoints, radii), dtype=object)


def _ball(middle: Any, radius: Any) -> Any:
    from flint import arb, fmpq

    if isinstance(radius, Decimal) and not radius.is_finite():
        return arb("nan")
    centre = arb(fmpq(*middle.as_integer_ratio()))
    return centre + arb(0, arb(fmpq(*radius.as_integer_ratio())).upper()) if radius else centre


class BallSeries(dict[str, Any]):
    """Series by name as balls, each made from its midpoints and radii when it is first read, in the
    precision that is then in force.
    """

    def __init__(self, midpoints: Mapping[str, Objects], radii: Mapping[str, Objects]) -> None:
        super().__init__()
        self._sides = (midpoints, radii)

    def __missing__(self, name: str) -> Any:
        self[name] = enclose(*(side[name] for side in self._sides))
        return self[name]


def rational(ball: Any) -> Fraction:
    """Return the midpoint of a ball, exactly."""
    mantissa, exponent = ball.mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def exact_as(series: Any, exact: Any) -> Any:
    """Return rationals, nested in lists of any depth, as numbers of the kind of a series: balls
    beside balls, floats beside floats.
    """
    numbers = np.asarray(exact, dtype=object)
    if series.dtype != object:
        return numbers.astype(np.float64)
    return enclose(numbers)
