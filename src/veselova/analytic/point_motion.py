"""The reduced rank-one system in a separable potential, any n, in closed form."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.separable_orbit import SeparableOrbit
from veselova.analytic.separated_curve import SeparableStart
from veselova.mechanics.separable_veselova import SeparableVeselova
from veselova.mechanics.times import validated_times
from veselova.mechanics.trajectory import Provenance, Trajectory

__all__ = ["PointMotion"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PointMotion:
    """A motion that can be asked for times. Raises Unsolved as SeparableMotion does."""

    problem: SeparableVeselova

    def __getstate__(self) -> dict[str, Any]:
        return {"problem": self.problem}  # what was computed stays behind when it is pickled

    @cached_property
    def _order(self) -> NDArray[np.intp]:
        """Return the axes by increasing I."""
        return np.array(sorted(range(self.problem.n), key=lambda i: -self.problem.exact.A[i]))

    @cached_property
    def _start(self) -> SeparableStart:
        exact, betas = self.problem.exact, self.problem.potential[2]
        inverse, q, v, walls = (
            tuple(values[i] for i in self._order) for values in ([1 / a for a in exact.A], exact.q, exact.tangent, betas)
        )
        size = sum((x * x for x in q), 0 * q[0])
        # q̇ belongs to |q| = 1, and the start takes it scaled as q is: its square by (q,q).
        return SeparableStart(inverse, q, v, self.problem.polynomial, walls, size)

    @cached_property
    def _orbit(self) -> SeparableOrbit:
        return SeparableOrbit(self._start)

    def __call__(self, times: Any) -> Trajectory:
        """Return the trajectory at times."""
        began, grid = time.perf_counter(), validated_times(times)
        if not self.problem.moves:
            provenance = Provenance.since(began, "analytic", "rest", {"regime": "rest"})
            return Trajectory.at_rest(self.problem, grid, provenance, self)
        orbit = self._orbit
        clock = orbit.clock(grid)
        tau, z = clock.tau1(grid)
        phi = orbit.inversion.invert(z)
        at = orbit.motion.attitude(phi)
        velocity = np.sum(at.normals * at.components[:, None, :], axis=2) / orbit.rate.at(phi)[:, None]
        series = {name: np.empty_like(values) for name, values in (("q", at.q), ("q_dot", velocity))}
        series["q"][:, self._order], series["q_dot"][:, self._order] = at.q, velocity
        details = {
            "clock": clock.name,
            "clock_size": clock.size,
            "degree": len(self._start.factor) + self._start.centrifugal.count(0),
        }
        provenance = Provenance.since(began, "analytic", "angles", details)
        return Trajectory(self.problem, grid, orbit.error(tau, clock)[0], series, provenance, dense=self)
