"""Inversion of increasing functions, many at once: Newton's method inside a bracket; beyond
doubles, with a last interval.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import InternalContradiction

__all__ = [
    "Rows",
    "doublings",
    "increasing_root",
    "interval_step",
    "is_shown",
]

Array = NDArray[np.float64]

#: Entries along the first axis: all of them, or some by their places.
Rows = slice | NDArray[np.intp]

#: Derived: Newton's steps double the digits from those of a double, but for what they lose.
_FIRST_DIGITS = 12
_LOST_DIGITS = 2

#: Derived: part of the slope at an approximate root that is certain next to it.
_SLOPE = 0.5

#: Derived: bisection alone needs 53 steps from any bracket to one rounding.
_MOST_STEPS = 80


def increasing_root(
    function: Callable[[Array, Rows], tuple[Array, Array]],
    guess: Array,
    low: Array,
    high: Array,
    converged: float,
) -> Array:
    """Return the zeros of increasing functions, one per entry, each between its low and high.

    ``function`` gives values and slopes at entries, of rows along the first axis. Iteration ends
    with steps of at most ``converged``, after which values are not formed again: the error left is
    of its square. It ends with brackets as narrow too, where values are too rough, or slopes too
    small, for such a step.
    """
    rows: Rows = slice(None)
    result = guess
    x = guess
    before = high - low
    # no slope, no step: what is not inside the bracket is not taken
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(_MOST_STEPS):
            checkpoint()
            value, slope = function(x, rows)
            step = value / slope
            moved = x - step
            size = np.abs(step)
            small = size <= converged
            found = np.minimum(np.maximum(moved, low), high)
            if small.all():
                return _with(result, rows, found)
            low = np.where(value <= 0, x, low)
            high = np.where(value >= 0, x, high)
            # steps that do not shrink may go in circles
            taken = (2 * size <= before) & (moved >= low) & (moved <= high)
            trial = np.where(taken, moved, (low + high) / 2)
            before = np.maximum(np.abs(trial - x), 2 * converged)
            x = np.where(small, found, trial)
            open_ = np.asarray(~(small | (high - low <= converged)).reshape(len(x), -1).all(axis=1))
            if not open_.any():
                return _with(result, rows, x)
            # those that are settled are left, when that saves more than it costs
            if 2 * np.count_nonzero(open_) <= len(open_):
                result = _with(result, rows, x)
                rows = np.flatnonzero(open_) if isinstance(rows, slice) else rows[open_]
                low = low[open_]
                high = high[open_]
                before = before[open_]
                x = x[open_]
    raise InternalContradiction("inversion of an increasing function did not settle")


def doublings(digits: int) -> list[int]:
    """Return the digits of Newton's steps from a root in doubles to the one before the last."""
    half = math.ceil(digits / 2) + _LOST_DIGITS
    return [*doublings(half), half] if half > _FIRST_DIGITS else []


def interval_step(
    value: Values, slope: Values, bend: Any, arithmetic: Any
) -> tuple[Values, Values]:
    """Return what takes approximate roots to balls that hold them, and balls around zero that hold
    the distances.

    ``bend``: how much slopes change with the root, at most. Of a slope half has to be certain as
    far as a root may be, which is shown where the distance times the bend is below the other half.
    """
    reach = arithmetic.zero_ball(value / (_SLOPE * slope))
    return np.asarray(value / arithmetic.add_error(slope, reach * bend)), np.asarray(reach)


def is_shown(reach: Values, slope: Values, bend: Any, arithmetic: Any) -> bool:
    """Return whether half of the slopes is certain as far as that."""
    rest = arithmetic.zero_ball((1 - _SLOPE) * arithmetic.at_least(slope))
    return bool(arithmetic.contained_in(reach * bend, rest).all())


def _with(result: Array, rows: Rows, found: Array) -> Array:
    """Return the result with what was found for some rows."""
    if isinstance(rows, slice):
        return found
    result[rows] = found
    return result
