"""The error of a closed-form state: rounding of the evaluation, and phase errors times the steepness of the attitude in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.clock import Clock
from veselova.analytic.solution import Solution

__all__ = ["estimated_error"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Rounding of one evaluation of the attitude, in ε; largest seen over the problem tables: 8 by angles, 20 by theta quotients.
_EVALUATION = {"angles": 16.0, "theta": 40.0}

#: Rounding of a phase in ε: the start's Abel map, the reduced advance, Newton's residual.
_PHASE = 8.0

#: Relative rounding of f, F_0 and the clock in ε; periods of random problems agree with extended precision to 2 ε.
_RATE = 4.0


def estimated_error(solution: Solution, times: Array, tau1: Array, clock: Clock, method: str) -> Array:
    """Return a bound on every component of q and frame at each time, shape (N,)."""
    steepness = solution.steepness
    frequencies, elapsed = np.abs(solution.in_tau1.rates), np.abs(tau1)
    rounding = 0.0 if solution.is_guarded(times) else _RATE * _EPSILON
    # A rounding of f_k moves phase k alone; an error of the clock moves all phases along the flow.
    phase = _PHASE * _EPSILON + rounding * elapsed[:, None] * frequencies
    along_flow = rounding * elapsed + clock.error(tau1)
    speed = float(np.max(np.abs(steepness @ solution.in_tau1.rates)))
    return np.asarray(_EVALUATION[method] * _EPSILON + phase @ np.max(np.abs(steepness), axis=0) + speed * along_flow)
