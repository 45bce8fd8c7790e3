"""The motion of a body with an area constant in balls, on the torus of its rank-one problem:
direction of the flow and time as ``AreaVeselova`` has them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.closed.area import side_of
from veselova.analytic.closed.base import Attitude
from veselova.analytic.digits.in_doubles import InDoubles
from veselova.analytic.digits.solution import SolutionInBalls
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.systems.area_veselova import AreaVeselova

__all__ = ["AreaSolutionInBalls"]


class AreaSolutionInBalls(SolutionInBalls):
    """The solution of an ``AreaVeselova`` problem in balls; raises Unsolved (``too-far``) on a
    separatrix.
    """

    problem: AreaVeselova
    has_fourier_map = False  # dt/dτ₁ has an odd part too

    def __init__(self, coarse: InDoubles, *rest: Any) -> None:
        if coarse.kernel.on_separatrix:
            reason = "on a separatrix motions with an area constant have 15 digits"
            raise Unsolved("too-far", reason)
        super().__init__(coarse, *rest)

    @property
    def integrals(self) -> int:
        """Return how many integrals make the path, the last one that of the odd part."""
        rolls = "displacement" in self.problem.outputs and self.frame.periods.genus > 1
        return 2 if rolls else 0

    def _rates(self, z: Values) -> Values:
        """Return dt/dτ₁ at phases z (N, g)."""
        return np.asarray(1 / self._time_rate(self._attitude(z)))

    def _time_rate(self, attitude: Attitude) -> Values:
        """Return dτ₁/dt = dτ₁/dt'/(1 − tilt (u,A'v)/(v,A'v))."""
        own = super()._time_rate(attitude)
        return own if attitude.q.shape[1] < 3 else np.asarray(own / (1 - self._ratio(attitude)))

    def _ratio(self, attitude: Attitude) -> Values:
        """Return tilt (u,A'v)/(v,A'v)."""
        A = self.arithmetic.array(self.moving.A)
        across = (attitude.normals[:, :, 0] * attitude.q) @ (A - 1)
        along = (attitude.q * attitude.q) @ A
        n_2 = self.moving.directions @ self.body.normals[:, 0].astype(float)
        tilt = side_of(self.problem, n_2) * self.arithmetic.number(self.problem.tilt)
        return np.asarray(tilt * across / along)

    def _path_rates(self, attitude: Attitude) -> Values:
        """Return (q',n_2) to the sign of u, and the odd part of dt/dτ₁, (N, 2)."""
        across = attitude.components @ self.body.rotation[:, 0]
        odd = -self._ratio(attitude) / super()._time_rate(attitude)
        return np.stack([across, odd], axis=1)

    def _displacement(self, times: Values, integrals: Values) -> Values:
        """Return the coefficients of n and e_⊥ in the path of a ball, (N, 2)."""
        xp, problem = self.arithmetic, self.problem
        result = xp.array(np.zeros((len(times), 2)))
        result[:, 0] = xp.number(problem.uniform) * times
        if self.integrals:
            result[:, 0] = result[:, 0] - xp.number(problem.across) * integrals[:, 1]
            result[:, 1] = problem.sign * integrals[:, 0]
        return np.asarray(result)
