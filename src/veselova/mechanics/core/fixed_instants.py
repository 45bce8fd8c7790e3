"""Fixed instants at which a motion is looked at, whatever times are asked for.

What is found at the instants up to a time is a function of that time alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["fixed_instants", "fixed_instants_until"]

Array = NDArray[np.float64]

#: Radians of turning between instants, how many are equally far apart, and by how much the
#: following ones are farther off.
_STEP, _EVEN, _GROWTH = 0.25, 256, 1.02


def fixed_instants(first: int, count: int) -> Array:
    """Return ``count`` instants from number ``first`` on, in radians of turning; number 0 is zero.

    They are evenly apart at first, then farther and farther.
    """
    numbers = np.arange(first, first + count)
    farther = _GROWTH ** np.maximum(numbers - _EVEN, 0)
    return np.asarray(_STEP * np.where(numbers <= _EVEN, numbers, _EVEN * farther))


def fixed_instants_until(farthest: float, every: int = 1) -> Array:
    """Return the instants from zero to at most ``farthest`` radians, or every second, third …"""
    count = farthest / _STEP
    if count > _EVEN:
        count = _EVEN + np.log(count / _EVEN) / np.log(_GROWTH)
    found = fixed_instants(0, int(count) + 2)[::every]
    return found[found <= farthest]
