"""Numbers beyond double precision, as every trajectory carries them: decimals, each
with a radius.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import BackendMissing

__all__ = [
    "FEWEST_DIGITS",
    "MOST_DIGITS",
    "Decimals",
    "Later",
    "Objects",
    "Pair",
    "beyond_double",
    "decimals_of",
    "derive_position_pair",
    "derive_velocity_pair",
]

Objects = NDArray[np.object_]

#: Midpoints and radii of one series.
Pair: TypeAlias = tuple[Objects, Objects]

#: Digits that can be asked for; the fewest are those of double precision.
FEWEST_DIGITS = 15
MOST_DIGITS = 1000

#: Digits in which products are formed beyond those kept: what is rounded there is far below their
#: radii.
_SPARE_DIGITS = 30


def beyond_double(digits: int, certified: bool) -> bool:
    """Return whether an answer with so many digits, or with certified errors, has decimals and
    takes its data exactly.
    """
    return digits > FEWEST_DIGITS or certified


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

    @cached_property
    def error(self) -> Objects:
        """Return the largest radius of the bounded series at each time, (N,)."""
        radii = [self.radii[name] for name in self.bounded]
        return np.array(
            [max(max(values.ravel()) for values in at_time) for at_time in zip(*radii, strict=True)]
        )

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
        """Return a series as python-flint balls; raises BackendMissing without python-flint."""
        try:
            from flint import arb
        except ImportError:
            raise BackendMissing("python-flint", "balls", "pip install python-flint") from None

        bits = math.ceil((self.digits + _SPARE_DIGITS) * math.log2(10))

        def ball(middle: Any, radius: Any) -> Any:
            # From integers, exactly: arb's own rounding follows the precision that the caller
            # happens to have set.
            near = math.floor(Fraction(middle) * 2**bits)
            beyond = math.ceil(Fraction(radius) * 2**bits) + 1
            return arb((near, -bits), arb((beyond, -bits)))

        return np.asarray(
            np.vectorize(ball, otypes=[object])(self.midpoints[name], self.radii[name])
        )

    def __repr__(self) -> str:
        kind = "certified" if self.certified else "estimated"
        return f"<Decimals: {self.digits} digits, {kind} error ≤ {max(self.error):.2g}>"


def derive_velocity_pair(
    midpoints: Mapping[str, Objects], radii: Mapping[str, Objects], digits: int
) -> Pair:
    """Return ω = q∧q̇ with radii |q|r̊ + |q̇|r + r r̊, from the decimals of q_dot and frame."""
    q = midpoints["frame"][:, :, 0]
    q_dot = midpoints["q_dot"]
    r = radii["frame"][:, :, 0]
    r_dot = radii["q_dot"]
    with localcontext(Context(prec=digits + _SPARE_DIGITS)):
        product = q[:, :, None] * q_dot[:, None, :]
        spread = (
            np.abs(q)[:, :, None] * r_dot[:, None, :]
            + r[:, :, None] * (np.abs(q_dot) + r_dot)[:, None, :]
        )
        return product - np.swapaxes(product, 1, 2), spread + np.swapaxes(spread, 1, 2)


def derive_position_pair(A: Sequence[Fraction], q: Objects, radii: Objects, digits: int) -> Pair:
    """Return X = Aq/S, S = √(q,Aq), with radii, from decimals q (N, n).

    Within the radii r of q, S ≥ S₀ with S₀² = Σ A_j max(|q_j|−r_j, 0)². There
    |∂X_i/∂q_j| ≤ (A_i δ_ij + A_i|q_i| A_j|q_j|/S₀²)/S₀.
    """
    with localcontext(Context(prec=digits + _SPARE_DIGITS)):
        squares = np.array([Decimal(a.numerator) / Decimal(a.denominator) for a in A])
        root = np.frompyfunc(Decimal.sqrt, 1, 1)
        most = np.abs(q) + radii
        least = np.abs(q) - radii
        least = least * (least > 0)
        low = root(np.sum(squares * least * least, axis=1))[:, None]
        along = np.sum(squares * most * radii, axis=1)[:, None]
        spread = (squares * radii + squares * most * along / (low * low)) / low
        position = squares * q / root(np.sum(squares * q * q, axis=1))[:, None]
        rounding = np.frompyfunc(
            lambda x: Decimal((0, (1,), x.adjusted() - digits - 10)) if x else Decimal(0), 1, 1
        )(position)
        return position, spread + rounding
