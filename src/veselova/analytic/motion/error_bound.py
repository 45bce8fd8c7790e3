"""The error of a closed-form state: rounding of the evaluation, and phase errors times the
steepness of the attitude in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.attitude.sensitivity import Sensitivity
from veselova.analytic.motion.evaluation_plan import EvaluationPlan
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.time_map.rate import TimeMap

__all__ = ["ErrorBound"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Rounding of one evaluation of the attitude, in ε, largest seen over the problem tables: 8 by
#: angles, 20 by theta quotients, and there for each unit of the largest entry of T, whose rounding
#: stands in an exponent. That of transforms comes on top.
_EVALUATION = {"angles": 8.0, "theta": 20.0, "products": 20.0, "nufft": 20.0}

#: Rounding of a phase in ε: the reduced advance, and in angles Newton's residual. Those of
#: different phases add in squares.
_PHASE = {"angles": 4.0, "theta": 2.0, "products": 2.0, "nufft": 2.0}

#: Rounding of a phase at the start in ε, the Abel map, as clocks take it.
_START_PHASE = 4.0

#: Relative rounding of f, F_0 and the clock in ε; periods of random problems agree with extended
#: precision to 2 ε.
_RATE = 2.0

#: The same where they carry guard digits: 30 digits in the leading and the following double.
_GUARDED_RATE = 1e-30

#: Times at which the steepness of the attitude is looked at besides, near a separatrix and for wide
#: A's.
_ON_ORBIT = 24

#: By how much dt/dτ₁ may vary before it is looked at, and times beyond which it is at so many of
#: them.
_WIDE = 10.0
_MANY = 10_000

#: Rounding of the principal axes and of a given frame along them, in ε, besides one for each term
#: of a scalar product.
_AXES_ROUNDING = 8.0


@dataclass(frozen=True)
class ErrorBound:
    """A bound on every component of q and frame of one solution by one method; what does not depend
    on times is kept.
    """

    solution: Solution
    method: str

    def at(self, plan: EvaluationPlan, tau1: Array, time_map: TimeMap) -> Array:
        """Return the bound at each time of a horizon, (N,), from the Neumann times there."""
        solution = self.solution
        sensitivity = self.solution.sensitivity
        at_once = self._at_once
        if self._is_looked_at:
            rows = np.linspace(0, tau1.size - 1, min(tau1.size, _ON_ORBIT)).astype(int)
            sensitivity = sensitivity.maximum(
                solution.steepness_at(solution.in_tau1.phases(tau1[rows]))
            )
            at_once = self._of_one_evaluation(sensitivity)
        rounding = _GUARDED_RATE if plan.is_guarded else _RATE * _EPSILON
        lag = self._lag(plan, tau1, time_map, rounding)
        error = (
            self._of_point(tau1, lag, rounding)
            if solution.problem.time == "s"
            else np.zeros_like(tau1)
        )
        if (
            slowness := _slowness(solution, tau1, solution.takes_rate_from_angles(self.method))
        ) is not None:
            lag *= slowness
        # A rounding of f_k moves phase k alone; an error of the clock moves all phases along the
        # flow.
        lag *= sensitivity.along_flow
        lag += (rounding * sensitivity.by_rates) * np.abs(tau1) + at_once
        np.maximum(error, lag, out=error)
        # back along the body axes, scalar products of n terms
        if solution.problem.axes is not None:
            error += (solution.problem.n + _AXES_ROUNDING) * _EPSILON
        return error

    def _lag(self, plan: EvaluationPlan, tau1: Array, time_map: TimeMap, rounding: float) -> Array:
        """Return the error of t over F_0, (N,): the rounding of dt/dτ₁ is one of the time elapsed,
        not of F_0|τ₁|.
        """
        of_clock, drift = time_map.error(tau1, self._of_start, rounding * self._frequencies)
        result = np.abs(plan.times / self.solution.mean_rate)
        result *= rounding + drift
        result += of_clock
        return result

    def _of_point(self, tau1: Array, lag: Array, rounding: float) -> Array:
        """Return the error of the point of a geodesic, (N,), which moves with unit speed however
        fast its normal turns.

        X_i is as accurate relative to √A_i as the normal is: on a flat side both q_i and √(q,Aq)
        are small.
        """
        solution = self.solution
        sensitivity = self.solution.steepness_of_point
        at_once = self._of_one_evaluation(
            sensitivity, size=float(np.sqrt(np.max(solution.problem.A)))
        )
        moved = (rounding * sensitivity.by_rates) * np.abs(tau1)
        return np.asarray(lag * solution.mean_rate + moved + at_once)

    @cached_property
    def _is_looked_at(self) -> bool:
        # There the frame turns within a hundredth of the torus, which samples miss.
        return self.solution.near_separatrix or not self.solution.is_even

    @cached_property
    def _frequencies(self) -> Array:
        return np.abs(self.solution.in_tau1.rates)

    @cached_property
    def _of_start(self) -> Array:
        return _START_PHASE * _EPSILON + self.solution.start_rounding

    @cached_property
    def _at_once(self) -> float:
        return self._of_one_evaluation(self.solution.sensitivity)

    def _of_one_evaluation(self, sensitivity: Sensitivity, size: float = 1.0) -> float:
        """Return the error of one evaluation at phases that are known to a few roundings, of
        numbers of that size.

        Angles take a rounding of the start's angles to the phases and back again; theta functions
        see the phases as they are, and so does the clock.
        """
        solution = self.solution
        evaluation = size * _EVALUATION[self.method]
        result = _PHASE[self.method] * _EPSILON * sensitivity.together
        if self.method == "angles":
            return result + evaluation * _EPSILON
        result += (
            float(solution.start_rounding @ sensitivity.by_phase)
            + size * solution.quotients.rounding
        )
        return result + evaluation * max(1.0, solution.largest_period) * _EPSILON


def _slowness(solution: Solution, tau1: Array, in_angles: bool) -> Array | None:
    """Return F_0 over dt/dτ₁, where that is more than one, for A's by which the rate varies much;
    None for others.

    An error of t is one of τ₁ divided by the rate at that time, and clocks state theirs by the
    mean.
    """
    if solution.moving.rate_variation < _WIDE:
        return None
    rows = slice(None) if tau1.size <= _MANY else np.linspace(0, tau1.size - 1, _MANY).astype(int)
    rates = solution.rate_at(solution.in_tau1.phases(tau1[rows]), in_angles)
    slowness = np.maximum(1.0, solution.mean_rate / rates)
    return slowness if tau1.size <= _MANY else np.asarray(np.max(slowness))
