"""The times of a request, and how many there are."""

from __future__ import annotations

from typing import Any

from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.times import TimeGrid

__all__ = ["stated_count", "time_grid"]


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
