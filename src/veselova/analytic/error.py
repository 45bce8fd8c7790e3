"""The error of a closed-form state: rounding of the evaluation, and phase errors times the steepness of the attitude in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.clock import Clock
from veselova.analytic.solution import Solution

__all__ = ["estimated_error"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Rounding of one evaluation of the attitude, in ε; largest seen over the problem tables: 8 by angles, 20 by theta quotients, and
#: there for each unit of the largest entry of T, whose rounding stands in an exponent. That of transforms comes on top.
_EVALUATION = {"angles": 16.0, "theta": 40.0, "products": 40.0, "nufft": 40.0}

#: Rounding of a phase in ε: the start's Abel map, the reduced advance, Newton's residual.
_PHASE = 8.0

#: Relative rounding of f, F_0 and the clock in ε; periods of random problems agree with extended precision to 2 ε.
_RATE = 4.0

#: The same where they carry guard digits: 30 digits in the leading and the following double.
_GUARDED_RATE = 1e-30

#: Times at which the steepness of the attitude is looked at besides, near a separatrix and for wide A's.
_ON_ORBIT = 24

#: By how much dt/dτ₁ may vary before it is looked at, and times beyond which it is at so many of them.
_WIDE, _MANY = 10.0, 10_000

#: Rounding of the principal axes and of the data along them, in units of the conditioning floor.
_AXES_ROUNDING = 8.0


def estimated_error(solution: Solution, times: Array, tau1: Array, clock: Clock, method: str) -> Array:
    """Return a bound on every component of q and frame at each time, shape (N,)."""
    steepness = solution.steepness
    if solution.near_separatrix or not solution.is_even:  # the frame turns within a hundredth of the torus, which samples miss
        rows = np.linspace(0, times.size - 1, min(times.size, _ON_ORBIT)).astype(int)
        steepness = steepness.joined(solution.steepness_at(solution.in_tau1.phases(tau1[rows])))
    frequencies = np.abs(solution.in_tau1.rates)
    rounding = _GUARDED_RATE if solution.is_guarded(times) else _RATE * _EPSILON
    # A rounding of f_k moves phase k alone; an error of the clock moves all phases along the flow.
    # Angles take a rounding of the start's angles to the phases and back again; theta functions see the phases as they are, and
    # so does the clock.
    at_once = _PHASE * _EPSILON * float(steepness.by_phase.sum())
    if method != "angles":
        at_once += float(solution.start_rounding @ steepness.by_phase) + solution.quotients.rounding
    with_time = rounding * (float(frequencies @ steepness.by_phase) + steepness.along_flow)
    of_clock = clock.error(tau1, _PHASE * _EPSILON + solution.start_rounding, rounding * frequencies)
    evaluation = _EVALUATION[method] * (1.0 if method == "angles" else max(1.0, solution.largest_period))
    error = np.abs(tau1)  # in place from here on: fresh memory costs more than sums
    error *= with_time
    error += of_clock * steepness.along_flow
    if (slowness := _slowness(solution, tau1)) is not None:
        error *= slowness
    error += evaluation * _EPSILON + at_once
    if solution.problem.axes is not None:  # principal axes of a matrix are doubles, and so is what is seen along them
        error = error + _AXES_ROUNDING * solution.problem.conditioning_floor(times)
    return np.asarray(error)


def _slowness(solution: Solution, tau1: Array) -> Array | None:
    """Return F_0 over dt/dτ₁, where that is more than one, for A's by which the rate varies much; None for others.

    An error of t is one of τ₁ divided by the rate at that time, and clocks state theirs by the mean.
    """
    if solution.moving.rate_variation < _WIDE:
        return None
    rows = slice(None) if tau1.size <= _MANY else np.linspace(0, tau1.size - 1, _MANY).astype(int)
    rates = solution.rate_at(solution.in_tau1.phases(tau1[rows]))
    slowness = np.maximum(1.0, solution.mean_rate / rates)
    return slowness if tau1.size <= _MANY else np.asarray(np.max(slowness))
