"""The times at which a motion is asked for: finite, in any order, repeated or not; t = 0 is the
start, negative times are fine.

A time is taken exactly as it is stated. In doubles it is the nearest one, and what that is off by
enters the error; beyond, arithmetic takes the rational.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import partial
from itertools import pairwise
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import as_given
from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    missing_fields,
    show,
    unknown_fields,
)
from veselova.mechanics.core.exact_input import (
    LARGEST_WHOLE_DOUBLE,
    as_doubles,
    exact_number,
    exact_vector,
    is_double,
    plain,
    read_only,
    to_float,
)

__all__ = ["MOST_TIMES", "TimeGrid", "as_request"]

Array = NDArray[np.float64]

Exact = Fraction | float

#: Times of one call: their frames alone take a gigabyte for n = 4.
MOST_TIMES = 10_000_000

#: The fields of a grid.
_FIELDS = ("start", "stop", "count")

_REQUIRED = "a number, a list of numbers, or exactly the fields start, stop, count"


@dataclass(frozen=True, eq=False)
class TimeGrid:
    """The different requested times in increasing order, and the place of each requested time among
    them.

    - doubles: (N,) nearest to the exact times, increasing; two different times may have one
      double
    - late: (N,) by what the exact times are off the doubles, at most
    - places: (M,) of the M requested times, None where these are the N times in this order
    - rationals: what makes the exact times of arithmetic beyond double precision
    """

    doubles: Array
    late: Array
    places: NDArray[np.intp] | None
    rationals: Callable[[], Sequence[Exact]]

    @classmethod
    def of(cls, times: Any, exact: bool = False) -> TimeGrid:
        """Return the times that a number, a list or an array states, or a mapping of start, stop
        and count.

        A grid of start, stop and count has the points of ``numpy.linspace`` where both ends are
        doubles. Where an end is a text, a Fraction or a Decimal, or where ``exact`` asks for it,
        the points are start + k(stop − start)/(count − 1) exactly. Raises InvalidInput, located at
        ``times``, unless all are finite and there is one at least.
        """
        if isinstance(times, TimeGrid):
            return times
        times = as_given(times)
        if isinstance(times, Mapping):
            return _uniform(times, exact)
        if np.ma.is_masked(times):
            raise InvalidInput(("times",), _REQUIRED, "masked entries")
        if _is_number(times):
            times = [times]
        doubles = _as_doubles(times)
        if doubles is not None:
            return _of_doubles(doubles, times)
        if isinstance(times, (str, bytes)) or not isinstance(times, (Sequence, np.ndarray)):
            raise InvalidInput(("times",), _REQUIRED, show(times))
        return _of_rationals(exact_vector(times, ("times",)))

    @property
    def exact(self) -> tuple[Exact, ...]:
        """Return the N times as exact numbers: doubles that stand for themselves, or rationals."""
        return tuple(self.rationals())

    @property
    def asked(self) -> Array:
        """Return the doubles nearest to the times asked for, (M,)."""
        return self.doubles if self.places is None else self.doubles[self.places]


def as_request(times: Any) -> Any:
    """Return valid times as the JSON of a request states them, without rounding; raises
    InvalidInput as ``TimeGrid.of``.
    """
    TimeGrid.of(times)
    stated = plain(times)
    return stated if isinstance(stated, (list, dict)) else [stated]


def _is_number(times: Any) -> bool:
    if isinstance(times, str):
        try:
            exact_number(times, ("times",))
        except InvalidInput:
            raise InvalidInput(("times",), _REQUIRED, show(times)) from None
        return True
    return isinstance(times, (Real, Decimal, np.number))


def _as_doubles(times: Any) -> Array | None:
    """Return a copy of times that are doubles as they stand, or whole numbers that are; None for
    others.
    """
    if type(times) is list:
        return (
            np.array(times, dtype=np.float64)
            if all(isinstance(time, float) for time in times)
            else None
        )
    if isinstance(times, range):
        within = all(abs(end) <= LARGEST_WHOLE_DOUBLE for end in (*times[:1], *times[-1:]))
        return np.arange(times.start, times.stop, times.step, dtype=np.float64) if within else None
    return as_doubles(times) if isinstance(times, np.ndarray) and times.ndim == 1 else None


def _of_doubles(doubles: Array, times: Any) -> TimeGrid:
    if doubles.size == 0:
        raise InvalidInput(("times",), "at least one time", "none")
    places = None
    # NaN is greater than nothing: where each is greater than the one before it, all are finite if
    # the first and the last are.
    increasing = bool((doubles[1:] > doubles[:-1]).all())
    if not (increasing and math.isfinite(doubles[0]) and math.isfinite(doubles[-1])):
        if not np.isfinite(doubles).all():
            exact_vector(times, ("times",))  # raises, and says which is not
        doubles, places = np.unique(doubles, return_inverse=True)
    return TimeGrid(read_only(doubles), np.zeros(doubles.size), places, doubles.tolist)


def _of_rationals(numbers: Sequence[Fraction]) -> TimeGrid:
    if not numbers:
        raise InvalidInput(("times",), "at least one time", "none")
    places = None
    if any(later <= earlier for earlier, later in pairwise(numbers)):
        found = sorted(set(numbers))
        place_of = {number: place for place, number in enumerate(found)}
        numbers, places = found, np.array([place_of[number] for number in numbers])
    doubles = np.array(to_float(numbers))
    pairs = zip(numbers, doubles.tolist(), strict=True)
    off = np.array([number != Fraction(double) for number, double in pairs])
    return TimeGrid(read_only(doubles), _rounding(doubles) * off, places, lambda: numbers)


def _rounding(doubles: Array) -> Array:
    """Return half a unit in the last place."""
    return np.asarray(np.spacing(np.abs(doubles)) / 2)


def _uniform(grid: Mapping[str, Any], exact: bool) -> TimeGrid:
    """Return the grid of a mapping with start, stop and count, both ends included."""
    faults = Faults()
    faults.found += unknown_fields(("times",), grid, _FIELDS)
    faults.found += missing_fields(("times",), grid, _FIELDS)
    start, stop = (
        faults.attempt(exact_number, grid.get(key, 0), ("times", key)) for key in _FIELDS[:2]
    )
    count = faults.attempt(_count, grid.get("count", 1))
    faults.require_none()
    ends = (start, stop)
    if count > 1 and not start < stop:
        raise InvalidInput(
            ("times", "stop"),
            f"a time greater than start ({show(grid['start'])})",
            show(grid["stop"]),
        )
    low, high = to_float(ends).tolist()
    if not np.isfinite(high - low):
        raise InvalidInput(
            ("times", "stop"), "a span within the range of a float", f"{low!r} to {high!r}"
        )
    if not exact and all(is_double(grid[key]) for key in ("start", "stop")):
        return _of_doubles(np.linspace(low, high, count), [])
    step = (stop - start) / max(count - 1, 1)
    unit = math.lcm(start.denominator, step.denominator)
    first, by = (x.numerator * (unit // x.denominator) for x in (start, step))
    nearest = ((first + k * by) / unit for k in range(count))  # of whole numbers, rounded once
    doubles = np.fromiter(nearest, np.float64, count)
    points = partial(_points, start, step, count)
    return TimeGrid(read_only(doubles), _rounding(doubles), None, points)


def _count(given: Any) -> int:
    """Return the number of times of a grid."""
    if isinstance(given, (bool, np.bool_)) or not isinstance(given, (int, np.integer)):
        raise InvalidInput(("times", "count"), "a whole number", show(given))
    if given < 1:
        raise InvalidInput(("times", "count"), "at least 1", str(given))
    if given > MOST_TIMES:
        raise InvalidInput(("times", "count"), f"at most {MOST_TIMES} times", show(given))
    return int(given)


def _points(start: Fraction, step: Fraction, count: int) -> list[Fraction]:
    return [start + k * step for k in range(count)]
