"""The motions in separable potentials in closed form: the reduced rank-one system in any n, and the
Veselova system on T SO(3) with (Ω,γ) = 0 in the potentials (3.5).

Of a body γ and Ω come from the quadratures; e_2 and e_3 are carried along γ without turning about
it, ė = −(γ∧γ̇)e, so they turn against the coordinate lines by one more integral along the orbit.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.base import BETWEEN, Attitude, Motion
from veselova.analytic.curve.moving_part import rational, rationals
from veselova.analytic.separable.curve import SeparableStart, separate
from veselova.analytic.separable.inversion import SeparableMotion
from veselova.analytic.separable.orbit import Course, SeparableOrbit
from veselova.analytic.time_map.panels import error_of_phases, integrate_displaced
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.exact_input import exact_number, exact_vector
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.geometry.sphere import exact_cross
from veselova.mechanics.potentials.separable import family_polynomial
from veselova.mechanics.systems.separable_veselova import SeparableVeselova
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["BodyMotion", "PointMotion"]

Array = NDArray[np.float64]

P = TypeVar("P", bound=Problem)

#: Calibrated: what bounds made of samples and of typical rounding may miss: with it the true error
#: is at most the reported one. Largest true error over an error without it, in all draws of
#: ``benchmarks/adversarial.py``: 1.05, next to a separatrix.
_SAFETY = 2.0

#: Derived: step of a difference quotient in a phase.
_STEP = 1e-6


class _InPotential(Motion[P]):
    """A motion as a function of time. Raises Unsolved as SeparableMotion does."""

    @property
    @abstractmethod
    def _order(self) -> list[int]:
        """Return the axes by increasing I."""

    @abstractmethod
    def _start(self) -> SeparableStart:
        """Return the exact start along these axes."""

    @abstractmethod
    def _numbers(self, at: Attitude) -> Array:
        """Return the numbers of attitudes whose error is bounded, (N, …)."""

    @cached_property
    def _orbit(self) -> SeparableOrbit:
        return SeparableOrbit(SeparableMotion(self._start()))

    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        orbit, times = self._orbit, grid.doubles
        course = orbit.course(times, grid.late)
        series, error = self._states(times, course, *orbit.state_at(course.phi, course.rate))
        self.problem.require_digit(times, error, "phases in double precision are not known better")
        details = {"time_map": course.name, "time_map_size": course.size}
        details["degree"] = orbit.motion.start.degree
        return series, _SAFETY * error, "angles", details

    @abstractmethod
    def _states(
        self, times: Array, course: Course, at: Attitude, velocity: Array
    ) -> tuple[Series, Array]:
        """Return the series at times and their error."""

    def _to_axes(self, values: Array) -> Array:
        """Return vectors (N, n), or columns (N, n, k), along sorted axes in the problem's."""
        result = np.empty_like(values)
        result[:, self._order] = values
        return result


class PointMotion(_InPotential[SeparableVeselova]):
    """The reduced rank-one system in a separable potential, any n."""

    @cached_property
    def _order(self) -> list[int]:
        return sorted(range(self.problem.n), key=lambda i: -self.problem.exact.A[i])

    def _start(self) -> SeparableStart:
        """In a unit of A near the largest: the kinetic energy has A to the power 2−n, and where V
        has it too, the motion is the same.
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
        parts = (rationals(x) for x in (separate(inverse), q, v, polynomial, walls))
        I, x, w, V, beta = parts
        return SeparableStart(I, x, w, V, beta, size)

    def _numbers(self, at: Attitude) -> Array:
        return np.asarray(at.q)

    def _states(
        self, times: Array, course: Course, at: Attitude, velocity: Array
    ) -> tuple[Series, Array]:
        series = {"q": self._to_axes(at.q), "q_dot": self._to_axes(velocity)}
        return series, self._orbit.error(course, self._numbers)


class BodyMotion(_InPotential[VeselovaSO3]):
    """A body. Raises Unsolved too where the potential is not of (3.5, printed 4.10), (Ω,γ) ≠ 0."""

    @cached_property
    def _order(self) -> list[int]:
        return sorted(range(3), key=lambda i: self.problem.moments[i])

    def _start(self) -> SeparableStart:
        problem, order = self.problem, self._order
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
        return SeparableStart(*map(rationals, (moments, x, w, v, walls)))

    def _numbers(self, at: Attitude) -> Array:
        return np.concatenate([at.q[:, :, None], at.normals], axis=2)

    def _states(
        self, times: Array, course: Course, at: Attitude, velocity: Array
    ) -> tuple[Series, Array]:
        orbit, tau = self._orbit, course.tau
        orbit.require_panels(times)
        slopes, largest = self._turning
        # Rounding of the phases is in the values, and near a separatrix these turn fast.
        noise = float(orbit.start_rounding @ slopes) / largest if largest else 0.0
        ends = min(tau[0], 0.0), max(tau[-1], 0.0)
        displaced = integrate_displaced(self._turning_at, orbit.in_tau, *ends, largest, noise)
        panels = displaced[0]
        # Beside a pole of the coordinate lines they turn thousands of times faster than in the
        # mean.
        turning = np.abs(panels.integrand(tau))
        error = orbit.error(course, self._numbers, turning)
        error = error + panels.error(tau) + (panels.mean_size + turning) * course.lag
        roundings = orbit.start_rounding, orbit.rate_rounding
        error = error + error_of_phases(displaced, tau, *roundings)
        gamma, gamma_dot, lines = (self._to_axes(x) for x in (at.q, velocity, at.normals))
        frame = self._frame(gamma, lines, -panels.at(tau))
        return {"Omega": np.cross(gamma_dot, gamma), "frame": frame}, error

    def _to_axes(self, values: Array) -> Array:
        result, axes = super()._to_axes(values), self.problem.axes
        return result if axes is None else np.asarray(np.einsum("ij,nj...->ni...", axes, result))

    def _frame(self, gamma: Array, lines: Array, rotated: Array) -> Array:
        """Return the frame: e_2 and e_3 turned by ``rotated`` against the coordinate lines."""
        motion = self._orbit.motion
        start = self._to_axes(motion.attitude(motion.angles[None, :]).normals)[0]
        cosine, sine = np.cos(rotated), np.sin(rotated)
        turn = np.stack(
            [np.stack([cosine, -sine], axis=1), np.stack([sine, cosine], axis=1)], axis=1
        )
        rest = lines @ turn @ (start.T @ self.problem.frame[:, 1:])
        return np.concatenate([gamma[:, :, None], rest], axis=2)

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
