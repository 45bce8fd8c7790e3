"""The closed-form motion of one problem: everything that does not depend on the times, and the
states at any of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.attitude.frame import Attitude, Differences, Frame
from veselova.analytic.attitude.sensitivity import Sensitivity
from veselova.analytic.attitude.sensitivity_sampling import (
    BETWEEN,
    FEW,
    SensitivitySampling,
    sample_phases,
)
from veselova.analytic.curve.abel_jacobi import NARROW_GAP, AbelJacobi
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.initial_angles import Start, start
from veselova.analytic.curve.periods import resolve_periods
from veselova.analytic.motion.theta_quotients import ThetaQuotients
from veselova.analytic.spectrum.branch_points import Spectrum, resolve_spectrum
from veselova.analytic.spectrum.moving_part import Moving, moving_part
from veselova.analytic.time_map.cost_model import estimate_modes
from veselova.analytic.time_map.fourier import FourierTimeMap
from veselova.analytic.time_map.fourier_modes import TorusSeries
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.rate import TIME_RATE_POWERS, TimeRate, time_rate
from veselova.mechanics.bodies.wide_axes import AXES_KNOWN
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.tunings import RATE_CYCLES, RATE_GENUS, RATE_TERMS, THETA_GENUS

__all__ = ["WIDEST_RATE", "Solution"]

Array = NDArray[np.float64]

#: Calibrated: entries of T from which angles are the more accurate route: a cut of relative width
#: 1e-10 has 8.
_LARGE_PERIOD = 8.0

#: Calibrated: cancellation in the Abel map from which angles, which undo it, are the more accurate
#: route.
_LARGE_CANCELLATION = 10.0

#: Calibrated: above THETA_GENUS a gap goes to theta quotients below this, up to there below
#: NARROW_GAP: at 1e-12 angles still give 1e-12; and the largest genus at which theta sums are taken
#: there.
_NARROW_GAP_HIGH_GENUS = 1e-12
_SEPARATRIX_GENUS = 7

#: Calibrated: by how much dt/dτ₁ may vary for a Fourier time map.
WIDEST_RATE = 1e10

#: A rotation this near to a matrix of signs, in every entry and per dimension, is one.
_SIGN_ROUNDING = 32 * DOUBLE.epsilon


class Solution:
    """The closed-form motion of a moving body: its moving part, in units of its largest I, and the
    frame around it.

    ``distance`` moves a start on a separatrix, where branch points coincide, by that much relative
    to itself (see analytic.spectrum.moving_part). Raises Unsolved at rest, where there is no curve.
    """

    def __init__(self, problem: TorusProblem, distance: Fraction | None = None) -> None:
        if not problem.moves:
            raise Unsolved("at-rest", "nothing moves, so there is neither a curve nor a torus")
        found, self.periods = resolve_periods(self._moving_part(problem, distance), distance)
        self.curve: Curve = self.periods.curve
        self.problem = problem
        self.moving = found.moving
        self.spectrum = found.spectrum
        self.separatrices = found.separatrices or self._joined_axes(found.spectrum, problem)
        self.inversion = AbelJacobi(self.periods)
        self.start: Start = start(self.spectrum, self.curve)
        self.frame = Frame(self.periods, self.start.signs)
        self._origin: Array = self.inversion.map(self.start.angles[None, :])[0]
        #: √(A that counts as 1): τ₁ in the problem's units is this times τ₁ here, where the largest
        #: I is 1.
        self.tau1_unit = math.sqrt(found.moving.unit)

    def _moving_part(self, problem: TorusProblem, distance: Fraction | None) -> Moving:
        """Return what moves of the problem, by ``distance`` off a separatrix that the digits of its
        principal axes leave open.
        """
        moving = moving_part(problem)
        if distance is None or problem.axes is None or moving.size < 3:
            return moving
        found = resolve_spectrum(moving, DOUBLE.digits)
        if found.separatrices or found.moving.size < moving.size:
            return moving
        for axis in self._joined_axes(found.spectrum, problem):
            moving = moving.perturb(axis, distance)
        return moving

    @staticmethod
    def _joined_axes(spectrum: Spectrum, problem: TorusProblem) -> tuple[int, ...]:
        """Return the moving axes i where c_k is I_i as far as the principal axes are known."""
        if problem.axes is None:
            return ()
        points = spectrum.branch_points
        gaps = (
            (points[j], points[j + 1], spectrum.widths[j]) for j in range(2, len(points) - 1, 2)
        )
        return tuple(
            lower[2] if lower[1] == "I" else upper[2]
            for lower, upper, width in gaps
            if Fraction(width) < AXES_KNOWN and lower[1] != upper[1]
        )

    @property
    def regime(self) -> str:
        """Return ``separatrix``, ``closed-cut`` (two A's coincide, or some direction is frozen) or
        ``generic``.
        """
        if self.separatrices:
            return "separatrix"
        return "closed-cut" if self.moving.rotated or self.moving.frozen else "generic"

    @cached_property
    def rate(self) -> TimeRate:
        """Return dt/dτ₁ on the torus, in double precision."""
        return TimeRate.of(self.spectrum, self.inversion, self.problem.time)

    def rate_at(self, z: Array, in_angles: bool) -> Array:
        """Return dt/dτ₁ at phases z (N, g), inverted to angles or by theta functions."""
        if in_angles:
            return np.asarray(self.rate.at(self.inversion.invert(z)))
        return np.asarray(
            self.rate_constant * self.quotients.time_rate(z) ** TIME_RATE_POWERS[self.problem.time]
        )

    def takes_rate_from_angles(self, method: str | None = None, cycles: float = np.inf) -> bool:
        """Return whether dt/dτ₁ over so many cycles comes from angles: never near a separatrix,
        always on uneven tori and where that is the method; by what is cheaper where none is given.
        """
        if self.near_separatrix:
            return False
        if not self.is_even:
            return True
        genus = self.curve.genus
        if method is not None or genus <= THETA_GENUS:
            return method == "angles"
        return genus > RATE_GENUS or cycles < RATE_CYCLES[genus] or self.quotients.cost > RATE_TERMS

    @cached_property
    def rate_constant(self) -> float:
        """Return dt/dτ₁ over that power of the stretch; its largest value, at a half period, is the
        scale of the rate.
        """
        return float(self.rate.scale) * self.quotients.peak_inverted(
            TIME_RATE_POWERS[self.problem.time]
        )

    @cached_property
    def _rate_of_position(self) -> Callable[[Array], Array]:
        return time_rate(self.spectrum, self.problem.time, DOUBLE)

    @cached_property
    def near_separatrix(self) -> bool:
        """Return whether a gap is so narrow that angles near its ends say little of the body, and
        theta functions serve.
        """
        narrow = NARROW_GAP if self.curve.genus <= THETA_GENUS else _NARROW_GAP_HIGH_GENUS
        return self.curve.narrowest_gap < narrow and self.curve.genus <= _SEPARATRIX_GENUS

    @cached_property
    def mean_rate(self) -> float:
        """Return F_0, the mean of dt/dτ₁ over the torus."""
        return float(self.rate.mean)

    @cached_property
    def start_sources(self) -> Array:
        """Return how far each source of rounding at the start moves the phases, shape (g, 2g).

        They are the angles, and the integrals of the forms before a⁻¹ makes them phases: near a
        separatrix a⁻¹ is large in one direction, in which the frame hardly turns.
        """
        slopes = self.inversion.jacobian(self.start.angles[None, :])[0]
        periods = self.periods
        integrals = sum(np.sum(np.abs(series), axis=1) for series in periods.cut_series)
        sources = [slopes * np.abs(self.start.angles), periods.inverse_cycles * integrals]
        return np.asarray(np.concatenate(sources, axis=1) * DOUBLE.epsilon)

    @cached_property
    def start_rounding(self) -> Array:
        """Return how far all of them together move each phase, shape (g,)."""
        return np.asarray(np.sum(np.abs(self.start_sources), axis=1))

    @cached_property
    def in_tau1(self) -> LinearFlow:
        """Return z(τ₁) = z⁰ + fτ₁ in double precision."""
        return LinearFlow.of(self._origin, self.periods.frequencies)

    @cached_property
    def in_time(self) -> LinearFlow:
        """Return the uniform part z⁰ + Ωt, Ω = f/F_0, in double precision."""
        return LinearFlow.of(self._origin, self.periods.frequencies / self.rate.mean)

    @cached_property
    def precise_flows(self) -> tuple[LinearFlow, LinearFlow, float]:
        """Return both flows and F_0 with guard digits, for times far out."""
        # loads python-flint
        from veselova.analytic.time_map.guard_digits import extended_precision_flows

        return extended_precision_flows(self.spectrum, self._origin, self.problem.time)

    def fourier_time_map(self, precise_flows: bool) -> FourierTimeMap:
        """Return the Fourier time map, with guard digits or without; raises Unsolved
        (``beyond-floats``).
        """
        self.require_narrow_rate()
        if precise_flows not in self._fourier_time_maps:
            flows = (
                self.precise_flows
                if precise_flows
                else (self.in_tau1, self.in_time, self.mean_rate)
            )
            odd = self.odd_part_of_rate
            self._fourier_time_maps[precise_flows] = FourierTimeMap(self.rate, *flows, odd)
        return self._fourier_time_maps[precise_flows]

    @property
    def odd_part_of_rate(self) -> TorusSeries | None:
        """Return the part of dt/dτ₁ that changes sign with a period of one phase, None where there
        is none.
        """
        return None

    @cached_property
    def rate_variation(self) -> float:
        """Return by how much dt/dτ₁ may vary at most."""
        return self.moving.rate_variation

    def require_narrow_rate(self) -> None:
        """Raise Unsolved (``beyond-floats``) where dt/dτ₁ varies too much for a Fourier map."""
        if (variation := self.rate_variation) > WIDEST_RATE:
            raise Unsolved(
                "beyond-floats",
                f"dt/dτ₁ may vary by {variation:.1e}, and a Fourier time map rounds it to 1e-16 "
                "of its mean",
            )

    @cached_property
    def _fourier_time_maps(self) -> dict[bool, FourierTimeMap]:
        return {}

    @cached_property
    def modes(self) -> float:
        """Return about how many modes a Fourier time map has."""
        sign, logarithm = np.linalg.slogdet(self.periods.riemann_matrix)
        return estimate_modes(self.curve.genus, float(logarithm) if sign > 0 else -np.inf)

    @cached_property
    def fastest(self) -> float:
        """Return the most cycles that a phase makes in a unit of time."""
        return float(np.max(np.abs(self.in_time.rates)))

    @cached_property
    def _sampling(self) -> SensitivitySampling:
        half_periods = self.default_method() == "theta"
        steep = not self.near_separatrix
        point = self.point if self.problem.time == "s" else None
        return SensitivitySampling(
            self.frame,
            self.inversion,
            self.start.angles,
            self.in_tau1.rates,
            self.start_sources,
            half_periods,
            steep,
            point,
        )

    def point(self, q: Array) -> Array:
        """Return the points Aq/√(q,Aq) of the ellipsoid with unit normals q (N, m), along the
        moving directions.
        """
        A = float(self.moving.unit) * to_float(self.moving.A)
        return np.asarray(A * q / np.sqrt((q * q) @ A)[:, None])

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """Return how fast the frame turns with the phases, and more for what lies between the
        sampled points.
        """
        if self._sampling.sensitivity is not None:
            return self._sampling.sensitivity
        return self.sensitivities_at(self._drawn)[0].largest()

    @cached_property
    def sensitivity_of_point(self) -> Sensitivity:
        """Return how fast the point of a geodesic moves with the phases, in the same way."""
        if self._sampling.sensitivity_of_point is not None:
            return self._sampling.sensitivity_of_point
        return self.sensitivities_at(self._drawn)[1].largest()

    @property
    def _drawn(self) -> Array:
        return np.concatenate([sample_phases(self.curve.genus), self._origin[None, :]])

    def sensitivities_at(self, z: Array) -> tuple[Sensitivity, Sensitivity]:
        """Return how fast the frame turns, and the point of a geodesic moves, at each of the phases
        z (N, g), and more between; doubled near a separatrix, where it varies most.
        """
        near = self.near_separatrix
        rates = self.in_tau1.rates
        points = z if near else self.inversion.invert(z)
        along = np.broadcast_to(np.eye(rates.size), (*z.shape, rates.size))
        ends = Differences(
            points, along if near else np.linalg.inv(self.inversion.jacobian(points))
        )
        attitude: Callable[[Array], Attitude] = self.quotients.at if near else self.frame.at
        at = attitude(ends.ends)
        between = 2.0 if near else BETWEEN
        slopes = (ends.slopes(at), ends.quotients(self.point(at.q)))
        of_frame, of_point = (
            Sensitivity.at_points(between * part, rates, self.start_sources) for part in slopes
        )
        return of_frame, of_point

    @cached_property
    def quotients(self) -> ThetaQuotients:
        """Return the theta route of this torus."""
        T = np.asarray(self.periods.riemann_matrix, dtype=np.float64)
        return replace(
            ThetaQuotients.of(T, self.frame), at_half_periods=self._sampling.at_half_periods
        )

    @cached_property
    def largest_period(self) -> float:
        """Return max |T_ij|; it grows like log(1/width) of a narrow cut."""
        return float(np.max(np.abs(self.periods.riemann_matrix)))

    @cached_property
    def is_even(self) -> bool:
        """Return whether neither narrow cuts nor wide A's give the phases very different weights;
        not asked beyond FEW.
        """
        if self.curve.genus > FEW:
            return True
        return bool(
            self.largest_period < _LARGE_PERIOD
            and np.max(self.periods.cancellation) < _LARGE_CANCELLATION
        )

    def choose_method(self, given: str | None) -> str:
        """Return the method given, or the default one."""
        return given or self.default_method()

    def default_method(self) -> str:
        """Return theta near a separatrix, angles for a narrow cut or wide A's, and otherwise the
        cheaper route.
        """
        if self.near_separatrix:
            return "theta"
        return "theta" if self.curve.genus <= THETA_GENUS and self.is_even else "angles"

    def attitude(self, z: Array, method: str) -> Attitude:
        """Return the attitude at phases z (N, g), along sorted axes, by theta quotients or by
        Abel–Jacobi inversion.
        """
        return (
            self.frame.at(self.inversion.invert(z)) if method == "angles" else self.quotients.at(z)
        )

    @cached_property
    def rotation(self) -> Array:
        """Return the constant ℜ of (orth, printed 7.6): moving part of e_2 … e_n = (n_2 … γ)(t) ℜ,
        shape (g, n−1).

        For the natural frame it is a matrix of signs, exactly, where rounding leaves no doubt of
        that.
        """
        normals = self._sampling.start.normals[0]
        along = normals.T @ self.moving.directions.T
        if self.problem.exact.natural and along.shape[0] == self.problem.n - 1:
            # The last bits of the frame are asked for only where those of a double leave a doubt.
            for name in ("near_frame", "frame"):
                raw = along @ getattr(self.problem, name)[:, 1:]
                signs = np.rint(raw)
                if np.max(np.abs(raw - signs)) <= _SIGN_ROUNDING * self.problem.n:
                    return np.asarray(signs)
        return np.asarray(along @ self.problem.frame[:, 1:])

    @cached_property
    def frozen_part(self) -> Array:
        """Return what stays of e_2 … e_n: their components along the directions that
        do not move.
        """
        directions = self.moving.directions
        normals = self.problem.frame[:, 1:]
        return np.asarray(normals - directions @ (directions.T @ normals))

    def states(self, attitude: Attitude) -> tuple[Array, Array, Array]:
        """Return dτ₁/dt, q̇ and the frame along the problem's principal axes."""
        rate = self._rate_of_position(attitude.q)
        moving = self.moving
        n = self.problem.n
        (count, along, genus), frame = attitude.normals.shape, np.empty((attitude.q.shape[0], n, n))
        # one product, not one for every time
        rotated = attitude.normals.reshape(-1, genus) @ self.rotation
        frame[:, :, 0] = attitude.q @ moving.directions.T
        frame[:, :, 1:] = moving.directions @ rotated.reshape(count, along, -1)
        if moving.frozen:
            frame[:, :, 1:] += self.frozen_part
        return rate, (attitude.q_prime @ moving.directions.T) * rate[:, None], frame

    def spheroconic(self, attitude: Attitude) -> Array:
        """Return the λ's of all directions, from an attitude that has those of the moving ones."""
        frozen = np.tile(1 / to_float(self.moving.frozen), (attitude.q.shape[0], 1))
        return np.sort(
            np.concatenate([attitude.spheroconic / float(self.moving.unit), frozen], axis=1), axis=1
        )
