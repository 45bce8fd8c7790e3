"""Numbers beyond double precision, as every trajectory carries them: decimals, each
with a radius.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from typing import Any

import numpy as np

from veselova.mechanics.core.enclosures import Objects, Pair, enclose, working_digits

__all__ = [
    "FEWEST_DIGITS",
    "MOST_DIGITS",
    "Decimals",
    "Later",
    "beyond_double",
    "decimals_of",
]

#: Digits that can be asked for; the fewest are those of double precision.
FEWEST_DIGITS = 15
MOST_DIGITS = 1000


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
