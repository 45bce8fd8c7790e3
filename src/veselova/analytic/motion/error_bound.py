"""The error of a closed-form state: rounding of the evaluation, and phase errors times the
steepness of the attitude in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.attitude.sensitivity import MOST_LOCAL, Sensitivity, combine_bounds
from veselova.analytic.motion.evaluation_plan import EvaluationPlan, Samples
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.motion.transverse_path import TransversePath
from veselova.analytic.time_map.rate import TimeMap

__all__ = ["ErrorBound"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Calibrated: rounding of one evaluation of the attitude, in ε, largest seen over the problem
#: tables: 8 by angles, 20 by theta quotients, and there for each unit of the largest entry of T,
#: whose rounding stands in an exponent.
_EVALUATION = {
    "angles": 8.0,
    "theta": 20.0,
}

#: Calibrated: the same for each factor of a product of n ratios, by angles, where that is more;
#: largest seen 1.6, beside an equilibrium.
_FOR_EACH_FACTOR = 3.0

#: Calibrated: the same of the point of a geodesic, relative to the longest semi-axis, or n where
#: that is more; largest seen 2, at the tips of needles.
_EVALUATION_OF_POINT = 8.0

#: Calibrated: rounding of a phase in ε: the reduced advance, and in angles Newton's residual. Those
#: of different phases add in squares.
_PHASE = {"angles": 4.0, "theta": 2.0}

#: Calibrated: rounding of a phase at the start in ε, the Abel map, as time maps take it.
_START_PHASE = 4.0

#: Calibrated: relative rounding of f, F_0 and the time map in ε; periods of random problems agree
#: with extended precision to 2 ε.
_RATE = 2.0

#: Derived: the same where they carry guard digits: 30 digits in the leading and the following
#: double.
_GUARDED_RATE = 1e-30

#: Calibrated: by how much dt/dτ₁ may vary before it is looked at.
_WIDE = 10.0

#: Budget: times at which it is looked at.
_MANY = 10_000

#: Derived: rounding of the principal axes and of a given frame along them, in ε, besides one for
#: each term of a scalar product.
_AXES_ROUNDING = 8.0


@dataclass(frozen=True)
class ErrorBound:
    """A bound on every component of q and frame of one solution by one method; what does not depend
    on times is kept.
    """

    solution: Solution
    method: str

    def at(self, plan: EvaluationPlan, samples: Samples, most_local: int = MOST_LOCAL) -> Array:
        """Return the bound at each time of a plan, (N,).

        Up to ``most_local`` times the sensitivities are those at the times, where the samples do
        not represent the orbit; for more times they are the largest ones.
        """
        solution = self.solution
        tau1 = samples.tau1
        of_frame, of_point = solution.sensitivity, self._largest_of_point
        moved = self._moved(plan, samples)
        if not self._is_looked_at:
            return self._to_axes(self._by(of_frame, of_point, moved))
        count = tau1.size if tau1.size <= most_local else min(tau1.size, MOST_LOCAL)
        rows = np.linspace(0, tau1.size - 1, count).astype(int)
        frame_there, point_there = solution.sensitivities_at(solution.in_tau1.phases(tau1[rows]))
        of_frame = of_frame.maximum(frame_there.largest())
        of_point = of_point and of_point.maximum(point_there.largest())
        result = self._by(of_frame, of_point, moved)
        if tau1.size <= most_local:
            local = self._by(frame_there, of_point and point_there, moved)
            result = combine_bounds(result, local)
        return self._to_axes(result)

    def of_path(
        self, plan: EvaluationPlan, samples: Samples, path: TransversePath, bounds: Array
    ) -> Array:
        """Return the bound of the integrals of a path at each time, (N, K), from ``bounds`` (K,) of
        what is integrated, but for one rounding.
        """
        rounding = _rate_rounding(plan)
        of_phases = path.error(samples.tau1, self._of_start, rounding * self._frequencies)
        along_flow = self._moved(plan, samples).along_flow
        return np.asarray(along_flow[:, None] * bounds + of_phases)

    def _moved(self, plan: EvaluationPlan, samples: Samples) -> _Moved:
        """Return how far the state is from where it should be.

        A rounding of f_k moves phase k alone; an error of the time map moves all phases along the
        flow.
        """
        tau1 = samples.tau1
        lag = self._lag(plan, samples.time_map, tau1)
        slowness = _slowness(self.solution, tau1, plan.rate_in_angles)
        moved = _rate_rounding(plan) * np.abs(tau1)
        return _Moved(lag, lag if slowness is None else lag * slowness, moved)

    def _lag(self, plan: EvaluationPlan, time_map: TimeMap, tau1: Array) -> Array:
        """Return the errors of the times over F_0. The rounding of dt/dτ₁ is one of the time
        elapsed, not of F_0|τ₁|.
        """
        rounding = _rate_rounding(plan)
        of_map, drift = time_map.error(tau1, self._of_start, rounding * self._frequencies)
        lag = np.abs(plan.times / self.solution.mean_rate)
        lag *= rounding + drift
        lag += of_map
        return np.asarray(lag)

    def _by(self, of_frame: Sensitivity, of_point: Sensitivity | None, moved: _Moved) -> Array:
        """Return the error by sensitivities at each time, or by the largest ones.

        The point of a geodesic moves with unit speed however fast its normal turns. X_i is as
        accurate relative to √A_i as the normal is: on a flat side both q_i and √(q,Aq) are small.
        """
        result = moved.along_flow * of_frame.along_flow
        result += moved.frequencies * of_frame.by_rates
        n = self.solution.problem.n
        evaluation = _EVALUATION[self.method]
        if self.method == "angles":
            evaluation = max(evaluation, _FOR_EACH_FACTOR * n)
        result += self._of_one_evaluation(of_frame, evaluation)
        if of_point is not None:
            size = float(np.sqrt(np.max(self.solution.problem.A)))
            error = moved.lag * self.solution.mean_rate
            error += moved.frequencies * of_point.by_rates
            error += self._of_one_evaluation(of_point, max(_EVALUATION_OF_POINT, n), size)
            np.maximum(result, error, out=result)
        return np.asarray(result)

    def _to_axes(self, error: Array) -> Array:
        """Return the error back along the body axes: of scalar products of n terms."""
        if self.solution.problem.axes is None:
            return error
        return error + (self.solution.problem.n + _AXES_ROUNDING) * _EPSILON

    @property
    def _largest_of_point(self) -> Sensitivity | None:
        return self.solution.sensitivity_of_point if self.solution.problem.time == "s" else None

    @cached_property
    def _is_looked_at(self) -> bool:
        # There the frame turns within a hundredth of the torus, which samples miss; on flat or
        # needle-like ellipsoids they say little of where the motion is.
        solution = self.solution
        is_wide = solution.rate_variation >= _WIDE
        return solution.near_separatrix or not solution.is_even or is_wide

    @cached_property
    def _frequencies(self) -> Array:
        return np.abs(self.solution.in_tau1.rates)

    @cached_property
    def _of_start(self) -> Array:
        return _START_PHASE * _EPSILON + self.solution.start_rounding

    def _of_one_evaluation(
        self, sensitivity: Sensitivity, evaluation: float, size: float = 1.0
    ) -> Array:
        """Return the error of one evaluation at phases that are known to a few roundings, of
        numbers of that size.

        Angles take a rounding of the start's angles to the phases and back again; theta functions
        see the phases as they are, and so does the time map.
        """
        solution = self.solution
        result = _PHASE[self.method] * _EPSILON * sensitivity.together
        if self.method == "angles":
            return result + size * evaluation * _EPSILON
        result = result + sensitivity.by_start + size * solution.quotients.rounding
        return result + size * evaluation * max(1.0, solution.largest_period) * _EPSILON


@dataclass(frozen=True)
class _Moved:
    """Errors of where a state is, at each of N times.

    - lag: of the time over F_0
    - along_flow: of τ₁, by the rate at the time
    - frequencies: relative rounding of f times |τ₁|
    """

    lag: Array
    along_flow: Array
    frequencies: Array


def _rate_rounding(plan: EvaluationPlan) -> float:
    return _GUARDED_RATE if plan.is_guarded else _RATE * _EPSILON


def _slowness(solution: Solution, tau1: Array, in_angles: bool) -> Array | None:
    """Return F_0 over dt/dτ₁, where that is more than one, for A's by which the rate varies much;
    None for others.

    An error of t is one of τ₁ divided by the rate at that time, and time maps state theirs by the
    mean.
    """
    if solution.rate_variation < _WIDE:
        return None
    rows = slice(None) if tau1.size <= _MANY else np.linspace(0, tau1.size - 1, _MANY).astype(int)
    rates = solution.rate_at(solution.in_tau1.phases(tau1[rows]), in_angles)
    slowness = np.maximum(1.0, solution.mean_rate / rates)
    return slowness if tau1.size <= _MANY else np.asarray(np.max(slowness))
