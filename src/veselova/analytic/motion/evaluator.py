"""One solution by one method: its states at given times, and how far they may be off. What does not
depend on times is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.attitude.sensitivity import MOST_LOCAL
from veselova.analytic.dense_output.output_array import Samples
from veselova.analytic.motion.error_bound import ErrorBound
from veselova.analytic.motion.evaluation_plan import EvaluationPlan
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.time_map.rate import TimeMap
from veselova.mechanics.core.times import TimeGrid

__all__ = ["METHODS", "Evaluator"]

Array = NDArray[np.float64]

#: The routes from phases to attitude; sums at every time, by products of matrices or transforms,
#: are never cheaper than windows.
METHODS = ("theta", "products", "nufft", "angles")


@dataclass(frozen=True)
class Evaluator:
    """A solution, and the method of its attitudes; None for its default one."""

    solution: Solution
    given: str | None = None

    @cached_property
    def method(self) -> str:
        """Return the method."""
        return self.given or self.solution.default_method()

    def to(self, times: TimeGrid) -> EvaluationPlan:
        """Return what the times ask for."""
        return EvaluationPlan(self.solution, times.doubles, self.given, times.remainders)

    def evaluate(
        self, plan: EvaluationPlan, time_map: TimeMap, most_local: int = MOST_LOCAL
    ) -> tuple[Samples, Array]:
        """Return the motion, (q̇, frame) its series, after them λ where the angles of few times
        have it; and its error.

        Otherwise λ is left to the problem, which has it from q: where two coordinates nearly meet
        they turn sharply, and the rest does not. The error is that by sensitivities at the times
        themselves up to ``most_local`` of them.
        """
        windows = plan.windows(time_map.name)
        with_coordinates = self.method == "angles" and windows.inversions == plan.times.size
        evaluation = self._with_coordinates if with_coordinates else self._states
        along = windows.interpolate(time_map, self.solution.in_tau1.rates, evaluation)
        error = self._bound.at(plan, along.tau1, time_map, most_local)
        error += along.error
        if self.method == "nufft":
            error += along.series[2]
            along = replace(along, series=along.series[:2])
        return along, error

    @cached_property
    def _bound(self) -> ErrorBound:
        return ErrorBound(self.solution, self.method)

    @cached_property
    def terms(self) -> int:
        """Return the terms of a theta sum, or of the transforms; zero in angles."""
        if self.method == "angles":
            return 0
        return (
            self.solution.transforms if self.method == "nufft" else self.solution.quotients.theta
        ).size

    @cached_property
    def _pace_in_angles(self) -> bool:
        # Windows alone ask for dt/dτ₁: products and nufft have none, and angles have it from the
        # attitude.
        return self.method == "theta" and self.solution.takes_rate_from_angles(self.method)

    def _states(self, tau1: Array, z: Array) -> tuple[Array, tuple[Array, ...]]:
        """Return dt/dτ₁, and q̇ and the frame, after them the rounding of transforms."""
        solution = self.solution
        further: tuple[Array, ...] = ()
        if self.method == "nufft":
            attitude, rounding = solution.transforms.at(tau1, z)
            further = (rounding,)
        else:
            attitude = solution.attitude(z, self.method)
        rate, *series = solution.states(attitude)
        return solution.rate_at(z, in_angles=True) if self._pace_in_angles else 1 / rate, (
            *series,
            *further,
        )

    def _with_coordinates(self, tau1: Array, z: Array) -> tuple[Array, tuple[Array, ...]]:
        """Return dt/dτ₁, and q̇, the frame and λ, in angles."""
        attitude = self.solution.attitude(z, self.method)
        rate, *series = self.solution.states(attitude)
        return 1 / rate, (*series, self.solution.spheroconic(attitude))
