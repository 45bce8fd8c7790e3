"""Inversion of increasing functions, many at once: Newton's method kept inside a bracket."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.errors import InternalContradiction

__all__ = ["increasing_root"]

Array = NDArray[np.float64]

#: Bisection alone needs 53 steps from any bracket to one rounding.
_MOST_STEPS = 80


def increasing_root(
    function: Callable[[Array], tuple[Array, Array]], guess: Array, low: Array, high: Array, settled: float
) -> Array:
    """Return the zeros of increasing functions, one per entry, each between its low and high.

    ``function`` gives values and slopes, or what else a step divides a value by (Halley's method). Iteration ends when every
    step is below ``settled``: the error left is of the order of its square, so choose it near the root of the wanted accuracy.
    """
    x = guess
    with np.errstate(divide="ignore", invalid="ignore"):  # no slope, no step: what is not inside the bracket is not taken
        for _ in range(_MOST_STEPS):
            value, slope = function(x)
            low, high = np.where(value <= 0, x, low), np.where(value >= 0, x, high)
            trial = x - value / slope
            outside = ~((trial >= low) & (trial <= high))
            if bisected := outside.any():
                trial = np.where(outside, (low + high) / 2, trial)
            step, x = np.abs(trial - x), trial
            if (step <= settled).all() and not (bisected and (outside & (high - low > settled)).any()):
                return x
    raise InternalContradiction("inversion of an increasing function did not settle")
