"""The reduced rank-one system in a separable potential, any n, in closed form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.base import Attitude, Motion
from veselova.analytic.separable.curve import SeparableStart, separate
from veselova.analytic.separable.inversion import SeparableMotion
from veselova.analytic.separable.orbit import PHASES_LOST, SAFETY, SeparableOrbit
from veselova.analytic.spectrum.moving_part import rational, rationals
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.potentials.separable import family_polynomial
from veselova.mechanics.systems.separable_veselova import SeparableVeselova

__all__ = ["PointMotion"]

Array = NDArray[np.float64]


class PointMotion(Motion[SeparableVeselova]):
    """A motion as a function of time. Raises Unsolved as SeparableMotion does."""

    @cached_property
    def _order(self) -> NDArray[np.intp]:
        """Return the axes by increasing I."""
        return np.array(sorted(range(self.problem.n), key=lambda i: -self.problem.exact.A[i]))

    @cached_property
    def _motion(self) -> SeparableMotion:
        """Return the motion of the exact start along these axes, in a unit of A near the largest.

        The kinetic energy has A to the power 2−n. Where V has it too, the motion is the same.
        """
        exact, n = self.problem.exact, self.problem.n
        quartic, quadratic, betas = self.problem.potential
        unit = Fraction(2) ** math.frexp(float(max(exact.A)))[1]
        energy = unit ** (n - 2)
        inverse, q, v, walls = (
            [values[i] for i in self._order]
            for values in (
                [unit / a for a in exact.A],
                exact.q,
                exact.tangent,
                [energy * beta for beta in betas],
            )
        )
        polynomial = family_polynomial(
            inverse, energy * quartic / unit**2, energy * quadratic / unit
        )
        # q̇ belongs to |q| = 1, and the start takes it scaled as q is: its square by (q,q).
        size = rational(sum(x * x for x in q))
        apart = rationals(separate(inverse))
        start = SeparableStart(
            apart, rationals(q), rationals(v), rationals(polynomial), rationals(walls), size
        )
        return SeparableMotion(start)

    @cached_property
    def _orbit(self) -> SeparableOrbit:
        return SeparableOrbit(self._motion)

    @cached_property
    def _sensitivity(self) -> Array:
        return self._orbit.sensitivity(_positions)

    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        orbit = self._orbit
        time_map = orbit.time_map(grid.doubles)
        tau, z = time_map.tau1(grid.doubles)
        at, velocity, rate = orbit.states(z)
        series = self._series(at, velocity)
        lag = orbit.lag(grid.doubles, tau, rate, time_map) + grid.late / rate
        error = orbit.error(tau, lag, *orbit.sensitivities(self._sensitivity, z, _positions))
        self.problem.require_digit(grid.doubles, error, PHASES_LOST)
        return series, SAFETY * error, "angles", orbit.details(time_map)

    def _series(self, at: Attitude, velocity: Array) -> Series:
        """Return q and q_dot along the axes of the problem."""
        series = {
            name: np.empty_like(values) for name, values in (("q", at.q), ("q_dot", velocity))
        }
        series["q"][:, self._order], series["q_dot"][:, self._order] = at.q, velocity
        return series


def _positions(at: Attitude) -> Array:
    return np.asarray(at.q)
