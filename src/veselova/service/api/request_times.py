"""The times of a request: how many there are, and what is wrong with them."""

from __future__ import annotations

from typing import Any

from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.times import MOST_TIMES, TimeGrid

__all__ = ["stated_count", "time_faults", "time_grid"]

#: Points of longer grids are not built to find what is wrong with them.
_FEW_TIMES = 1000


def stated_count(times: Any) -> int:
    """Return how many times a list or a grid of a request has, 0 where it is neither."""
    count = times.get("count") if isinstance(times, dict) else times
    if isinstance(count, int):
        return count
    return len(count) if isinstance(count, list) else 0


def time_grid(times: Any, exact: bool = False) -> TimeGrid:
    """Return the times that a request asks for; raises InvalidInput located at ``times``."""
    # Python takes a single number too, the schema of requests does not
    if not isinstance(times, (list, dict)):
        required = "a list of numbers, or exactly the fields start, stop, count"
        raise InvalidInput(("times",), required, show(times))
    return TimeGrid.of(times, exact)


def time_faults(times: Any, exact: bool = False) -> list[InvalidInput]:
    """Return what is wrong with the times of a request; the points of long grids are not built."""
    if isinstance(times, dict) and _FEW_TIMES < stated_count(times) <= MOST_TIMES:
        times = {**times, "count": 2}
    faults = Faults()
    faults.attempt(time_grid, times, exact)
    return faults.found
