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
from veselova.analytic.motion.displacement import Displacement, displacement_of
from veselova.analytic.motion.error_bound import ErrorBound
from veselova.analytic.motion.evaluation_plan import EvaluationPlan, Samples
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.motion.transverse_path import FourierPath, PanelPath, TransversePath
from veselova.analytic.time_map.rate import TimeMap
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.times import TimeGrid

__all__ = ["METHODS", "Evaluator"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Budget: times evaluated at once. It bounds the memory.
_AT_ONCE = 32768

#: The routes from phases to the attitude.
METHODS = ("theta", "angles")


@dataclass(frozen=True)
class Evaluator:
    """A solution, and the method of its attitudes; None for its default one."""

    solution: Solution
    given: str | None = None

    @cached_property
    def method(self) -> str:
        """Return the method."""
        return self.solution.choose_method(self.given)

    def plan(self, times: TimeGrid, time_map: str | None = None) -> EvaluationPlan:
        """Return the plan for times, with the time map given or the cheaper one."""
        return EvaluationPlan.of(
            self.solution, times.doubles, self.given, time_map, times.remainders
        )

    def evaluate(
        self, plan: EvaluationPlan, time_map: TimeMap, most_local: int = MOST_LOCAL
    ) -> tuple[Samples, Array]:
        """Return the motion, (q̇, frame) its series, after them λ where angles have it; and its
        error.

        Otherwise λ is left to the problem, which has it from q. The error is that by sensitivities
        at the times themselves up to ``most_local`` of them.
        """
        path = self._path(time_map.name) if self.rolls else None

        def evaluate(few: slice) -> list[Array]:
            """Return τ₁ and the series at some of the times."""
            remainders = None if plan.remainders is None else plan.remainders[few]
            tau1, z = time_map.tau1(plan.times[few], remainders)
            attitude = self.solution.attitude(z, plan.method)
            _, *series = self.solution.states(attitude)
            if plan.method == "angles":
                series.append(self.solution.spheroconic(attitude))
            if path is not None:
                series.append(self._pace * path.at(tau1, z))
            return [tau1, *series]

        starts = range(0, plan.times.size, _AT_ONCE)
        parts = [evaluate(slice(first, first + _AT_ONCE)) for first in iterate(starts, "motion")]
        tau1, *series = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        samples = Samples(tau1, tuple(series), time_map)
        error = self._bound.at(plan, samples, most_local)
        if path is None or self._displacement is None:
            return samples, error
        errors = self._bound.of_path(plan, samples, path, self._displacement.bounds)
        errors += _EPSILON / self._pace
        integrals = samples.series[-1] / self._pace
        found = self._displacement.at(plan.times, plan.remainders, integrals)
        error = np.maximum(error, self._displacement.error(found, errors))
        return replace(samples, series=(*samples.series[:-1], found)), error

    @property
    def rolls(self) -> bool:
        """Return whether the displacement of a ball stands after the other series."""
        return self._displacement is not None

    @cached_property
    def _displacement(self) -> Displacement | None:
        return displacement_of(self.solution)

    @cached_property
    def _pace(self) -> float:
        """Return a power of two, one or near the most cycles in a unit of τ₁: integrals of what is
        of the order of one are of its inverse, and so is their rounding.
        """
        fastest = float(np.max(np.abs(self.solution.in_tau1.rates)))
        return 2.0 ** max(0, math.floor(math.log2(fastest)))

    def _path(self, time_map: str) -> TransversePath:
        """Return the path across the momentum: by Fourier series or on panels, as the time map."""
        assert self._displacement is not None
        if time_map not in self._paths:
            self._paths[time_map] = (
                FourierPath(self._displacement)
                if time_map == "fourier"
                else PanelPath(self._displacement, self.method)
            )
        return self._paths[time_map]

    @cached_property
    def _paths(self) -> dict[str, TransversePath]:
        return {}

    @cached_property
    def _bound(self) -> ErrorBound:
        return ErrorBound(self.solution, self.method)

    @cached_property
    def terms(self) -> int:
        """Return the terms of a theta sum; zero in angles."""
        return 0 if self.method == "angles" else self.solution.quotients.theta.size
