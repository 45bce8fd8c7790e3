"""The motion of a body with an area constant in balls, on the torus of its rank-one problem:
direction of the flow and time as ``AreaSolution`` has them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.curve.periods import Periods
from veselova.analytic.motion.area_solution import AreaSolution
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.motion.torus_solution_balls import SolutionInBalls
from veselova.analytic.time_map.analyticity_strip import Orbit
from veselova.analytic.time_map.rate import time_rate
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.systems.area_veselova import AreaVeselova

__all__ = ["AreaSolutionInBalls", "solution_in_balls"]


class AreaSolutionInBalls(SolutionInBalls):
    """The solution of an ``AreaVeselova`` problem in balls; raises Unsolved (``too-far``) on a
    separatrix.
    """

    problem: AreaVeselova

    def __init__(
        self, coarse: AreaSolution, digits: int, certified: bool, method: str, reach: float = 0.0
    ) -> None:
        if coarse.separatrices:
            reason = "on a separatrix motions with an area constant have 15 digits"
            raise Unsolved("too-far", reason)
        super().__init__(coarse, digits, certified, method, reach)
        self._costs = replace(self._costs, rate_of_state=True)

    def _frequencies(self, periods: Periods) -> Values:
        """Return f = a⁻¹du, du = (−μ2, ς) for the forms dλ/2w, λdλ/2w; for the nodal ones the node
        of the gap enters, and where one direction is frozen λ_2 stays at its I.
        """
        xp: Any = self.arithmetic
        problem = self._coarse.problem
        assert isinstance(problem, AreaVeselova)
        sign = xp.number(problem.sign)
        mu2 = xp.number(problem.mu2 / self.moving.unit)
        if periods.genus == 1:
            frozen = xp.number(self.moving.unit) / xp.number(self.moving.frozen[0])
            return np.asarray(periods.inverse_cycles @ np.array([sign + mu2 * frozen]))
        points = periods.curve.branch_points
        node = (points[2] + points[3]) / 2
        return np.asarray(periods.inverse_cycles @ np.array([-mu2, sign + node * mu2]))

    def _adapt(self, orbit: Orbit) -> Orbit:
        """Return the orbit whose rates are those of attitudes."""
        of_neumann = orbit.rate.inversion.periods.frequencies
        paces = [max(abs(float(f)) for f in rates) for rates in (of_neumann, orbit.frequencies)]
        return AreaOrbit(
            orbit.spectrum,
            orbit.rate,
            orbit.start,
            orbit.frequencies,
            orbit.time_rate,
            orbit.coarse_rates,
            self._rates,
            paces[0] / paces[1],
        )

    def _rates(self, z: Values) -> Values:
        """Return dt/dτ₁ at phases z (N, g)."""
        return np.asarray(1 / self._time_rate(self.attitude(z)))

    def _time_rate(self, attitude: Attitude) -> Values:
        """Return dτ₁/dt = dτ₁/dt'/(1 − tilt (u,A'v)/(v,A'v))."""
        xp: Any = self.arithmetic
        own = time_rate(self.spectrum, self.problem.time, xp)(attitude.q)
        if attitude.q.shape[1] < 3:
            return own
        A = xp.array(self.moving.A)
        across = (attitude.normals[:, :, 0] * attitude.q) @ (A - 1)
        along = (attitude.q * attitude.q) @ A
        tilt = self._side * xp.number(self.problem.exact_tilt)
        return np.asarray(own / (1 - tilt * across / along))

    @property
    def _side(self) -> int:
        """Return the sign of u against n_2."""
        n_2 = self.moving.directions @ self.body.normals[:, 0].astype(float)
        return 1 if n_2 @ self.problem.u > 0 else -1


@dataclass(frozen=True)
class AreaOrbit(Orbit):
    """The orbit of a motion with an area constant.

    - rates_at: dt/dτ₁ at phases (N, g)
    - slower: by how much its τ₁ is longer than that of Neumann's flow on this torus, about
    """

    rates_at: Callable[[Values], Values]
    slower: float

    has_fourier_map: ClassVar[bool] = False

    def rates(self, tau1: Values) -> Values:
        """Return dt/dτ₁ at Neumann times (N,)."""
        return self.rates_at(self.phases(tau1))

    @property
    def strip(self) -> tuple[float, Any]:
        """Return about how wide the strip is where dt/dτ₁ is analytic, not a bound, and its scale:
        that of Neumann's flow.
        """
        width, largest = super().strip
        return width * self.slower, largest


def solution_in_balls(
    coarse: Solution, digits: int, certified: bool, method: str, reach: float
) -> SolutionInBalls:
    """Return the solution of a problem on a torus in balls."""
    if isinstance(coarse, AreaSolution):
        return AreaSolutionInBalls(coarse, digits, certified, method, reach)
    return SolutionInBalls(coarse, digits, certified, method, reach)
