"""A motion on a torus in doubles as a function of time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.base import Motion
from veselova.analytic.closed.motion import KernelMotion, kernel_motion
from veselova.analytic.closed.quotients import ByTheta
from veselova.analytic.closed.states import States
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["TorusMotion"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TorusMotion(Motion[TorusProblem]):
    """The motion by ``method`` and ``time_map`` of ``solve``; ``proven``: of ``kernel_motion``."""

    method: str | None = None
    time_map: str | None = None
    proven: bool = True

    @cached_property
    def kernel(self) -> KernelMotion:
        """Return the motion by the kernel."""
        return kernel_motion(self.problem, self.proven)

    def states(self, times: Array, late: Array) -> tuple[States, str, dict[str, Any]]:
        """Return the states at increasing times, the method, and details of it: by ψ, and by theta
        functions beside a separatrix, where ψ says too little; ``late``: what times are off by.
        """
        if not self.kernel.on_separatrix:
            try:
                other = self._theta if self.method == "theta" else None
                found, details = self.kernel.states(times, late, self.time_map, other)
                if other is not None:
                    details["theta_terms"] = other.terms
                return found, self.method or "angles", details
            except Unsolved as refusal:
                if refusal.outcome != "narrow-gap":
                    raise
        if self.method == "angles":
            reason = "angles in doubles do not resolve the orbit; theta quotients do, for n ≤ 8"
            raise Unsolved("narrow-gap", reason)
        return self._theta.on_panels(times, late), "theta", {"time_map": "panels"}

    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        found, method, details = self.states(grid.doubles, grid.late)
        series, error, of_motion = self.kernel.series(grid, found)
        return self.problem.complete(series), error, method, {**of_motion, **details}

    @cached_property
    def _theta(self) -> ByTheta:
        return ByTheta(self.kernel)
