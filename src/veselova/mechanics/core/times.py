"""The times at which a motion is asked for: finite, in any order, repeated or not; t = 0 is the
start, negative times are fine.

A time is taken exactly as it is stated. In doubles it is the nearest one, and the error includes
the difference; more digits take the rational.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import as_doubles, as_given, read_only, whole_number
from veselova.mechanics.core.errors import Faults, InvalidInput, field_faults, show
from veselova.mechanics.core.exact_input import exact_number, exact_vector, is_double, plain

__all__ = ["MOST_TIMES", "TimeGrid", "as_request"]

Array = NDArray[np.float64]

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
    - late: (N,) the largest difference between the exact times and the doubles
    - places: (M,) of the M requested times, None where these are the N times in this order
    - numbers: (N,) the exact times: the doubles where they stand for themselves, else rationals
    """

    doubles: Array
    late: Array
    places: NDArray[np.intp] | None
    numbers: NDArray[Any]

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
            times = _points(times, exact)
        elif isinstance(times, (str, Real, Decimal, np.number)):
            number = exact_number(times, ("times",))
            times = np.array([float(number)]) if is_double(times) else [number]
        elif not isinstance(times, (Sequence, np.ndarray)):
            raise InvalidInput(("times",), _REQUIRED, show(times))
        numbers = _as_doubles(times)
        if numbers is None or not np.isfinite(numbers).all():
            numbers = np.array(exact_vector(times, ("times",)), dtype=object)
        if not numbers.size:
            raise InvalidInput(("times",), "at least one time", "none")
        places = None
        if not (numbers[1:] > numbers[:-1]).all():
            numbers, places = np.unique(numbers, return_inverse=True)
        doubles = np.array(numbers, dtype=np.float64)
        late, off = np.zeros(doubles.size), doubles != numbers
        late[off] = np.spacing(np.abs(doubles[off])) / 2  # half a unit in the last place
        return cls(read_only(doubles), late, places, numbers)

    @property
    def increasing(self) -> TimeGrid:
        """Return the N times, asked for once and in this order."""
        return replace(self, places=None)

    @property
    def exact(self) -> tuple[Fraction | float, ...]:
        """Return the N times as exact numbers: doubles that stand for themselves, or rationals."""
        return tuple(self.numbers.tolist())

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


def _as_doubles(times: Any) -> NDArray[Any] | None:
    """Return a copy of times that are doubles as they stand, or whole numbers that are; None for
    others.
    """
    if isinstance(times, range) or (type(times) is list and {float}.issuperset(map(type, times))):
        times = np.array(times)
    return as_doubles(times) if isinstance(times, np.ndarray) and times.ndim == 1 else None


def _points(grid: Mapping[str, Any], exact: bool) -> Array | list[Fraction]:
    """Return the points of a mapping with start, stop and count, both ends included."""
    faults = Faults()
    faults.found += field_faults(("times",), grid, _FIELDS, _FIELDS)
    start, stop = (
        faults.attempt(exact_number, grid.get(key, 0), ("times", key)) for key in _FIELDS[:2]
    )
    count = faults.attempt(whole_number, grid.get("count", 1), ("times", "count"), 1, MOST_TIMES)
    faults.require_none()
    if count > 1 and not start < stop:
        required = f"a time greater than start ({show(grid['start'])})"
        raise InvalidInput(("times", "stop"), required, show(grid["stop"]))
    span = float(stop) - float(start)  # beyond doubles as infinity
    if not exact and all(is_double(grid[key]) for key in _FIELDS[:2]) and np.isfinite(span):
        return np.linspace(float(start), float(stop), count)
    step = (stop - start) / max(count - 1, 1)
    return [start + k * step for k in range(count)]
