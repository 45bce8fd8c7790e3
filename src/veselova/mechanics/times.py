"""The times at which a motion is asked for: finite and strictly increasing; t = 0 is the start, negative times are fine."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.errors import InvalidInput
from veselova.mechanics.exact import exact_vector, to_float

__all__ = ["MOST_TIMES", "exact_times", "uniform_times", "validated_times"]

Array = NDArray[np.float64]

#: Times of one call: their frames alone take a gigabyte for n = 4.
MOST_TIMES = 10_000_000


def validated_times(times: Any) -> Array:
    """Return the times as a read-only float64 array; raises InvalidInput unless finite and strictly increasing."""
    array = np.array(times) if _are_doubles(times) else to_float(exact_vector(times, ("times",)))
    array.setflags(write=False)
    # NaN is greater than nothing: where each is greater than the one before it, all are finite if the first and the last are.
    if array.size and (array[1:] > array[:-1]).all() and np.isfinite(array[[0, -1]]).all():
        return array
    if not np.isfinite(array).all():
        exact_vector(times, ("times",))  # raises, and says which is not
    if array.size == 0:
        raise InvalidInput(("times",), "at least one time", "none")
    i = int(np.argmax(array[1:] <= array[:-1])) + 1
    raise InvalidInput(("times", i), f"a time greater than the one before it ({float(array[i - 1])!r})", repr(float(array[i])))


def _are_doubles(times: Any) -> bool:
    """Return whether times are doubles as they stand, in an array or a list: they need no detour by rationals."""
    if type(times) is list:
        return all(type(time) is float for time in times)
    return isinstance(times, np.ndarray) and not isinstance(times, np.ma.MaskedArray) and times.ndim == 1 and times.dtype == float


def exact_times(times: Any) -> tuple[tuple[Fraction | float, ...], Array]:
    """Return the times as exact numbers, doubles that stand for themselves or rationals, and as validated doubles.

    Raises InvalidInput as above.
    """
    grid = validated_times(times)
    return tuple(grid.tolist()) if _are_doubles(times) else exact_vector(times, ("times",)), grid


def uniform_times(start: float, stop: float, count: int) -> Array:
    """Return ``count`` equally spaced times from start to stop, both included; raises InvalidInput as above."""
    if count < 1:
        raise InvalidInput(("times", "count"), "at least 1", str(count))
    if count > MOST_TIMES:
        raise InvalidInput(("times", "count"), f"at most {MOST_TIMES} times", str(count)[:30])
    if count > 1 and not start < stop:
        raise InvalidInput(("times", "stop"), f"a time greater than start ({start!r})", repr(stop))
    if not np.isfinite(stop - start):
        raise InvalidInput(("times", "stop"), "a span within the range of a float", f"{start!r} to {stop!r}")
    return validated_times(np.linspace(start, stop, count))
