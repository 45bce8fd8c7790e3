"""One solution by one method: its states at given times, and how far they may be off. What does not
depend on times is kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.attitude.sensitivity import MOST_LOCAL
from veselova.analytic.dense_output.output_array import Samples
from veselova.analytic.motion.error_bound import ErrorBound
from veselova.analytic.motion.evaluation_plan import EvaluationPlan
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.motion.transverse_path import FourierPath, PanelPath, TransversePath
from veselova.analytic.time_map.rate import TimeMap
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.systems.rolling_veselova import RollingVeselova

__all__ = ["METHODS", "Evaluator"]

Array = NDArray[np.float64]

#: The routes from phases to the attitude.
METHODS = ("theta", "angles")


#: Roundings of a displacement: of the speed, of its product with the time, and of those with ℜ.
_ROUNDINGS = 6.0


@dataclass(frozen=True)
class Evaluator:
    """A solution, and the method of its attitudes; None for its default one."""

    solution: Solution
    given: str | None = None

    @cached_property
    def method(self) -> str:
        """Return the method."""
        return self.given or self.solution.default_method()

    def plan(self, times: TimeGrid, time_map: str | None = None) -> EvaluationPlan:
        """Return the plan for times, with the time map given or the cheaper one."""
        return EvaluationPlan.of(
            self.solution, times.doubles, self.given, time_map, times.remainders
        )

    def evaluate(
        self, plan: EvaluationPlan, time_map: TimeMap, most_local: int = MOST_LOCAL
    ) -> tuple[Samples, Array]:
        """Return the motion, (q̇, frame) its series, after them λ where the angles of few times
        have it; and its error.

        Otherwise λ is left to the problem, which has it from q: where two coordinates nearly meet
        they turn sharply, and the rest does not. The error is that by sensitivities at the times
        themselves up to ``most_local`` of them.
        """
        at_every_time = plan.intervals.inversions == plan.times.size
        with_coordinates = plan.method == "angles" and at_every_time

        path = self._path(time_map.name) if self.rolls else None

        def evaluation(tau1: Array, z: Array) -> tuple[Array, tuple[Array, ...]]:
            """Return dt/dτ₁, and the series, at Neumann times and their phases z (N, g)."""
            attitude = self.solution.attitude(z, plan.method)
            rate, *series = self.solution.states(attitude)
            if with_coordinates:
                series.append(self.solution.spheroconic(attitude))
            if path is not None:
                series.append(path.at(tau1, z))
            if plan.method == "theta" and plan.rate_in_angles:
                return self.solution.rate_at(z, in_angles=True), tuple(series)
            return 1 / rate, tuple(series)

        samples = plan.intervals.interpolate(time_map, self.solution.in_tau1.rates, evaluation)
        error = self._bound.at(plan, samples, most_local) + samples.error
        if path is None:
            return samples, error
        across = self._bound.of_path(plan, samples, path) + samples.error
        displacement = self._displacement(samples.series[-1], plan)
        # the products with ℜ, and the speed along the momentum
        rounding = _ROUNDINGS * np.finfo(float).eps * np.max(np.abs(displacement), axis=1)
        error = np.maximum(error, math.sqrt(self.solution.curve.genus) * across + rounding)
        return replace(samples, series=(*samples.series[:-1], displacement)), error

    @property
    def rolls(self) -> bool:
        """Return whether the displacement of a ball stands after the other series."""
        return isinstance(self.solution.problem, RollingVeselova)

    def _path(self, time_map: str) -> TransversePath:
        """Return the path across the momentum: by Fourier series or on panels, as the time map."""
        if time_map not in self._paths:
            self._paths[time_map] = (
                FourierPath(self.solution)
                if time_map == "fourier"
                else PanelPath(self.solution, self.method)
            )
        return self._paths[time_map]

    @cached_property
    def _paths(self) -> dict[str, TransversePath]:
        return {}

    def _displacement(self, across: Array, plan: EvaluationPlan) -> Array:
        """Return ∫(e_k, q̇) dt = Σ_j y_j ℜ_jk, y_γ growing with the speed along the momentum."""
        problem = self.solution.problem
        assert isinstance(problem, RollingVeselova)
        along = problem.speed * plan.times
        if plan.remainders is not None:
            along = along + problem.speed * plan.remainders
        return np.concatenate([across, along[:, None]], axis=1) @ self.solution.rotation

    @cached_property
    def _bound(self) -> ErrorBound:
        return ErrorBound(self.solution, self.method)

    @cached_property
    def terms(self) -> int:
        """Return the terms of a theta sum; zero in angles."""
        return 0 if self.method == "angles" else self.solution.quotients.theta.size
