"""Numbers beyond double precision: Arb's balls, and the decimals with radii that every trajectory
carries. What follows from decimals has radii that hold it.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from decimal import MAX_EMAX, MAX_PREC, MIN_EMIN, ROUND_CEILING, Context, Decimal
from fractions import Fraction
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import acquire

__all__ = [
    "SHOWN_DIGITS",
    "BallSeries",
    "Decimals",
    "Later",
    "Objects",
    "Pair",
    "decimal_pair",
    "decimals_of",
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


def decimals_of(texts: Any) -> Objects:
    """Return the decimals that texts state, an array or nested lists of them."""
    return np.asarray(np.vectorize(Decimal, otypes=[object])(np.asarray(texts, dtype=object)))


class Later(Mapping[str, Objects]):
    """The midpoints (side 0) or radii (side 1) of series that become decimals when they are first
    asked for, both together.

    pairs: by name, what makes the pair; both sides share it, and it is replaced by what it made
    """

    def __init__(self, pairs: dict[str, Pair | Callable[[], Pair]], side: int) -> None:
        self._pairs = pairs
        self._side = side

    def __getitem__(self, name: str) -> Objects:
        pair = self._pairs[name]
        if not isinstance(pair, tuple):
            pair = self._pairs[name] = pair()
        return pair[self._side]

    def __contains__(self, name: object) -> bool:
        return name in self._pairs

    def __iter__(self) -> Iterator[str]:
        return iter(self._pairs)

    def __len__(self) -> int:
        return len(self._pairs)

    def __reduce__(self) -> tuple[type, tuple[dict[str, Objects]]]:
        return dict, (dict(self),)


@dataclass(frozen=True, repr=False)
class Decimals:
    """The series of a trajectory to more digits than a double has, or with certified errors.

    - midpoints, radii: by the name of the series, object arrays of ``decimal.Decimal`` of its
      shape, made when they are first read. The exact value lies within midpoint ± radius, proven
      where ``certified``, and otherwise up to truncations that are estimated
    - bounded: the names of the series whose every component ``error`` bounds
    - error: (N,) the largest of their radii at each time
    """

    digits: int
    certified: bool
    midpoints: Mapping[str, Objects]
    radii: Mapping[str, Objects]
    bounded: tuple[str, ...] = ("frame",)

    @classmethod
    def of_geodesics(cls, digits: int, certified: bool, pairs: Mapping[str, Pair]) -> Decimals:
        """Return those of geodesics from midpoints and radii by name; ``error`` is that of the
        point at a length, P2, or of the length, s12.
        """
        middles, radii = ({name: pair[side] for name, pair in pairs.items()} for side in (0, 1))
        return cls(digits, certified, middles, radii, ("P2" if "P2" in pairs else "s12",))

    @cached_property
    def error(self) -> Objects:
        """Return the largest radius of the bounded series at each time, (N,)."""
        radii = [np.atleast_1d(self.radii[name]) for name in self.bounded]
        at_times = zip(*radii, strict=True)
        return np.array([max(max(np.ravel(values)) for values in each) for each in at_times])

    def choose(self, names: Sequence[str]) -> Decimals:
        """Return the series of the given names alone."""
        middles, radii = (
            {name: numbers[name] for name in names} for numbers in (self.midpoints, self.radii)
        )
        return replace(self, midpoints=middles, radii=radii)

    def join(self, parts: Sequence[Decimals]) -> Decimals:
        """Return the series of several decimals as those of one."""
        middles, radii = (
            {name: numbers[name] for numbers in sides for name in numbers}
            for sides in ([p.midpoints for p in parts], [p.radii for p in parts])
        )
        return replace(self, midpoints=middles, radii=radii)

    def strings(self, name: str, radii: bool = False) -> Any:
        """Return a series, or its radii, as nested lists of decimal strings."""
        return np.vectorize(str, otypes=[object])(
            (self.radii if radii else self.midpoints)[name]
        ).tolist()

    def mpmath(self, name: str) -> Objects:
        """Return the midpoints of a series as mpmath numbers of so many digits."""
        import mpmath

        context = mpmath.MPContext()
        context.dps = self.digits + 5
        return np.asarray(
            np.vectorize(lambda x: context.mpf(str(x)), otypes=[object])(self.midpoints[name])
        )

    def flint(self, name: str) -> Objects:
        """Return a series as python-flint balls that hold midpoint ± radius."""
        with working_digits(self.digits):
            return enclose(self.midpoints[name], self.radii[name])

    def __repr__(self) -> str:
        kind = "certified" if self.certified else "estimated"
        return f"<Decimals: {self.digits} digits, {kind} error ≤ {max(self.error):.2g}>"
