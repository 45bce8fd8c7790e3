"""The Veselova system on T SO(3) with (Ω,γ) = 0 in the separable potentials (3.5), in closed form.

γ and Ω come from the quadratures; e_2 and e_3 are carried along γ without turning about it, ė =
−(γ∧γ̇)e, so they turn against the coordinate lines by one more integral along the orbit.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.base import BETWEEN, Attitude, Motion
from veselova.analytic.separable.curve import SeparableStart, separate
from veselova.analytic.separable.inversion import SeparableMotion
from veselova.analytic.separable.orbit import PHASES_LOST, SAFETY, SeparableOrbit
from veselova.analytic.spectrum.moving_part import rationals
from veselova.analytic.time_map.panels import error_of_phases, integrate_displaced
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.exact_input import exact_number, exact_vector
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.geometry.sphere import exact_cross
from veselova.mechanics.potentials.separable import family_polynomial
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["BodyMotion"]

Array = NDArray[np.float64]

#: Derived: step of a difference quotient in a phase.
_STEP = 1e-6


class BodyMotion(Motion[VeselovaSO3]):
    """A motion as a function of time. Raises Unsolved where the potential is not of (3.5, printed
    4.10) or (Ω,γ) ≠ 0.
    """

    @cached_property
    def _order(self) -> NDArray[np.intp]:
        """Return the principal axes by increasing moment."""
        return np.array(sorted(range(3), key=lambda i: self.problem.moments[i]))

    @cached_property
    def _motion(self) -> SeparableMotion:
        """Return the motion of the exact start along these axes."""
        problem = self.problem
        order = self._order
        if problem.without_closed_form:
            raise Unsolved("not-separable", problem.without_closed_form)
        given = problem.potential.given or {}
        alphas = (
            list(exact_vector(given["family"], ("potential", "family"), 5))
            if "family" in given
            else [Fraction(0)] * 5
        )
        alphas[1] += exact_number(given.get("clebsch", 0), ("potential", "clebsch"))
        moments = list(separate([problem.moments[i] for i in order]))
        gamma, Omega = problem.to_axes()
        velocity = exact_cross(gamma, Omega)  # scaled as γ is
        x, w = ([vector[i] for i in order] for vector in (gamma, velocity))
        v = family_polynomial(moments, *alphas[:2])
        walls = [alphas[2 + i] for i in order]
        return SeparableMotion(SeparableStart(*map(rationals, (moments, x, w, v, walls))))

    @cached_property
    def _orbit(self) -> SeparableOrbit:
        return SeparableOrbit(self._motion)

    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        orbit = self._orbit
        orbit.require_panels(grid.doubles)  # e_2 and e_3 turn by an integral along the orbit
        time_map = orbit.time_map(grid.doubles)
        tau, z = time_map.tau1(grid.doubles)
        slopes, largest = self._turning
        low = min(tau[0], 0.0)
        high = max(tau[-1], 0.0)
        # Rounding of the phases is in the values, and near a separatrix these turn fast.
        noise = float(orbit.start_rounding @ slopes) / largest if largest else 0.0
        displaced = integrate_displaced(self._turning_at, orbit.in_tau, low, high, largest, noise)
        panels = displaced[0]
        at, velocity, rate = orbit.states(z)
        series = self._series(at, velocity, panels.at(tau))
        lag = orbit.lag(grid.doubles, tau, rate, time_map) + grid.late / rate
        # Beside a pole of the coordinate lines they turn thousands of times faster than in the
        # mean.
        turning = np.abs(panels.integrand(tau))
        sensitivities = orbit.sensitivities(self._sensitivity, z, _frames, turning)
        error = orbit.error(tau, lag, *sensitivities)
        error = error + panels.error(tau) + (panels.mean_size + turning) * lag
        roundings = orbit.start_rounding, orbit.rate_rounding
        error = error + error_of_phases(displaced, tau, *roundings)
        self.problem.require_digit(grid.doubles, error, PHASES_LOST)
        return series, SAFETY * error, "angles", orbit.details(time_map)

    def _series(self, at: Attitude, velocity: Array, rotated: Array) -> Series:
        """Return Ω and the frame where the coordinate lines have turned by ``rotated``."""
        gamma, gamma_dot, lines = (self._to_body(values) for values in (at.q, velocity, at.normals))
        frame = self._frame(gamma, lines, -rotated)
        return {"Omega": np.cross(gamma_dot, gamma), "frame": frame}

    def _to_body(self, values: Array) -> Array:
        """Return vectors (N, 3), or columns (N, 3, k), along sorted axes in those of the body."""
        result = np.empty_like(values)
        result[:, self._order] = values
        axes = self.problem.axes
        return result if axes is None else np.asarray(np.einsum("ij,nj...->ni...", axes, result))

    def _frame(self, gamma: Array, lines: Array, rotated: Array) -> Array:
        """Return the frame: e_2 and e_3 turned by ``rotated`` against the coordinate lines."""
        start = self._to_body(self._motion.attitude(self._motion.angles[None, :]).normals)[0]
        cosine = np.cos(rotated)
        sine = np.sin(rotated)
        turn = np.stack(
            [np.stack([cosine, -sine], axis=1), np.stack([sine, cosine], axis=1)], axis=1
        )
        rest = lines @ turn @ (start.T @ self.problem.frame[:, 1:])
        return np.concatenate([gamma[:, :, None], rest], axis=2)

    @cached_property
    def _sensitivity(self) -> Array:
        return self._orbit.sensitivity(_frames)

    def _turning_at(self, z: Array) -> Array:
        """Return how fast the frame turns against the coordinate lines at phases z (N, g)."""
        return np.asarray(self._orbit.motion.turning(self._orbit.inversion.invert(z)))

    @cached_property
    def _turning(self) -> tuple[Array, float]:
        """Return the largest |∂/∂z_k| of the turning over a cycle, shape (g,), and its largest
        value, over the samples.
        """
        sample = self._orbit.sample
        here = self._turning_at(sample)
        steps = _STEP * np.eye(sample.shape[1])
        moves = [np.max(np.abs(self._turning_at(sample + step) - here)) for step in steps]
        return BETWEEN / _STEP * np.array(moves), float(np.max(np.abs(here)))


def _frames(at: Attitude) -> Array:
    return np.concatenate([at.q[:, :, None], at.normals], axis=2)
