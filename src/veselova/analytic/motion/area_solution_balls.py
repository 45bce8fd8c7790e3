"""The motion of a body with an area constant in balls, on the torus of its rank-one problem:
direction of the flow and time as ``AreaSolution`` has them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.curve.periods import Periods
from veselova.analytic.motion.area_solution import AreaSolution
from veselova.analytic.motion.path_balls import Along, integrals
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.motion.torus_solution_balls import SolutionInBalls
from veselova.analytic.time_map.analyticity_strip import GeneralOrbit, Orbit
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
        self._area = coarse
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
        return GeneralOrbit(
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
        own = time_rate(self.spectrum, self.problem.time, self.arithmetic)(attitude.q)
        if attitude.q.shape[1] < 3:
            return own
        return np.asarray(own / (1 - self._ratio(attitude)))

    def _odd_rate(self, attitude: Attitude) -> Values:
        """Return the part of dt/dτ₁ that changes sign with u."""
        own = time_rate(self.spectrum, self.problem.time, self.arithmetic)(attitude.q)
        return np.asarray(-self._ratio(attitude) / own)

    def _ratio(self, attitude: Attitude) -> Values:
        """Return tilt (u,A'v)/(v,A'v)."""
        xp: Any = self.arithmetic
        A = xp.array(self.moving.A)
        across = (attitude.normals[:, :, 0] * attitude.q) @ (A - 1)
        along = (attitude.q * attitude.q) @ A
        tilt = self._side * xp.number(self.problem.exact_tilt)
        return np.asarray(tilt * across / along)

    def _displacement(self, times: Values, tau1: Values) -> Values:
        """Return the coefficients of n and e_⊥ in the path of a ball, (N, 2)."""
        xp: Any = self.arithmetic
        problem = self.problem
        result = xp.array(np.zeros((len(times), 2)))
        result[:, 0] = xp.number(problem.exact_uniform) * times
        if self.frame.periods.genus < 2:
            return np.asarray(result)
        side = self.body.rotation[:, 0]
        # (q',n_2) to the sign of u, and the odd part of the time over what it may be
        largest = xp.number(2 * (self._area.odd_peak or 1.0))
        functions: list[Along] = [
            lambda attitude: attitude.components @ side,
            lambda attitude: self._odd_rate(attitude) / largest,
        ]
        if not self._area.odd_peak:
            functions = functions[:1]
        found = integrals(self.orbit, self.attitude, functions, tau1, self._costs)
        result[:, 1] = problem.sign * found[:, 0]
        if self._area.odd_peak:
            result[:, 0] = result[:, 0] - xp.number(problem.exact_across) * largest * found[:, 1]
        return np.asarray(result)

    @property
    def _side(self) -> int:
        """Return the sign of u against n_2."""
        n_2 = self.moving.directions @ self.body.normals[:, 0].astype(float)
        return 1 if n_2 @ self.problem.u > 0 else -1


def solution_in_balls(
    coarse: Solution, digits: int, certified: bool, method: str, reach: float
) -> SolutionInBalls:
    """Return the solution of a problem on a torus in balls."""
    if isinstance(coarse, AreaSolution):
        return AreaSolutionInBalls(coarse, digits, certified, method, reach)
    return SolutionInBalls(coarse, digits, certified, method, reach)
