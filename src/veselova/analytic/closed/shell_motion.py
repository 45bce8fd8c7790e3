"""The shell around a sphere of half its radius, ε = −1, in closed form.

With B = A⁻¹, x = A^{1/2}γ/|A^{1/2}γ| is Neumann's point in time s, x'' = Bx + νx, |x'|² = (x,Bx),
and dt/ds = C(x,Bx)^{−1/2}. So γ is B^{1/2}x over its length, and the frame of space turns by ė_k =
(γ∧γ̇)e_k.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.attitude_on_torus import AttitudeOnTorus, Floquet
from veselova.analytic.closed.base import BETWEEN, Motion
from veselova.analytic.closed.document import Flow, document_of, growth_of_slow_modes, largest_modes
from veselova.analytic.closed.motion import KernelMotion, kernel_motion
from veselova.analytic.closed.series import Series as FourierSeries
from veselova.analytic.closed.torus import torus
from veselova.analytic.kernel import modes
from veselova.analytic.kernel.frame import set_frames
from veselova.analytic.time_map.modes import LinearFlow, SampledTimeMap
from veselova.mechanics.core.decimals import enclose, rational, working_digits
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.geometry.so_n import wedge
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.systems.ball_on_sphere import RubberBallOnSphere
from veselova.mechanics.systems.neumann import NeumannSystem

__all__ = ["ShellMotion", "neumann_of"]

Array = NDArray[np.float64]

#: Derived: digits of Neumann's start, beyond those that doubles need.
_DIGITS = 80

_EPSILON = float(np.finfo(float).eps)

#: Budget: points of the torus at which slopes are sampled. Derived: step of their quotients.
_SAMPLES, _STEP = 48, 1e-6

#: Calibrated: rounding in ε of an evaluation, of phases at the start, and of frequencies.
_EVALUATION, _PHASE, _FLOW = 8.0, 8.0, 4.0

#: Calibrated: rounding in ε of a round of the fastest phase in the angles of the attitude; by how
#: much a document is off more than the engine.
_ROUND, _OF_DOCUMENT = 8.0, 2.0


def neumann_of(ball: RubberBallOnSphere) -> tuple[NeumannSystem, float]:
    """Return Neumann's system of a moving shell, B in units of its largest entry, and C."""
    largest = max(ball.inverse)
    inverse = [b / largest for b in ball.inverse]
    with working_digits(_DIGITS):
        B, gamma, v = (
            enclose(np.array(x, dtype=object))
            for x in (inverse, ball.exact_gamma, ball.exact_velocity)
        )
        root = np.array([b.sqrt() for b in B])
        y, rate = gamma / root, -v / root
        size = (y @ y).sqrt()
        x = y / size
        rate = (rate - x * (x @ rate)) / size
        square, speed = x @ (B * x), (rate @ rate).sqrt()
        start = rate * (square.sqrt() / speed)
        q, velocity = ([rational(entry) for entry in vector] for vector in (x, start))
        constant = float(rational(square / speed))
    A = [1 / (2 - b) for b in inverse]
    # zeros stay zeros: directions that do not move
    return NeumannSystem(A, q, velocity, normalize=True), constant


class ShellMotion(Motion[RubberBallOnSphere]):
    """The motion as a function of time."""

    @cached_property
    def _reduced(self) -> tuple[NeumannSystem, float]:
        return neumann_of(self.problem)

    @cached_property
    def kernel(self) -> KernelMotion:
        """Return Neumann's motion."""
        if reason := self.problem.without_closed_form:
            raise Unsolved("no-closed-form", reason)
        if not self.problem.moves:
            raise Unsolved("at-rest", "nothing moves, so there is neither a curve nor a torus")
        found = kernel_motion(self._reduced[0])
        if found.on_separatrix:
            raise Unsolved("no-closed-form", "on a separatrix phases do not serve")
        return found

    @cached_property
    def _roots(self) -> Array:
        """Return B^{1/2} along what moves, (m,), in units of the largest entry."""
        largest = max(self.problem.inverse)
        roots = np.sqrt(to_float([b / largest for b in self.problem.inverse]))
        return np.asarray(np.linalg.norm(roots[:, None] * self.kernel.moving.directions, axis=0))

    def _points(self, z: Array, direction: Array, steps: Array) -> tuple[Array, Array]:
        """Return y = B^{1/2}x and dy/ds along what moves, (N, K, m), at phases z + steps·direction,
        z (N, g), steps (N, K). Raises Unsolved (``narrow-gap``).
        """
        kernel = self.kernel
        torus, g = kernel.torus, kernel.genus
        line = modes.no_modes(g)._replace(high=direction, low=np.zeros(g))
        count, number = steps.shape
        psi, order = np.empty((count, number, g)), np.arange(g + 1)
        for start, own, at in zip(z, np.array(steps, order="C"), psi, strict=True):
            given = torus._replace(z=start), line, line, own, np.empty(number)
            if modes.jump(*given, at, np.empty((0, 0)), kernel.room):
                raise Unsolved("narrow-gap", "angles in doubles do not resolve the torus")
        frames = np.empty((count * number, g + 1, g + 1))
        velocities = np.empty((count * number, g + 1))
        at_all = psi.reshape(-1, g)
        set_frames(torus, at_all, order, np.eye(g), frames, velocities, kernel.room)
        y, rate = frames[:, :, 0] * self._roots, velocities * self._roots
        return y.reshape(count, number, -1), rate.reshape(count, number, -1)

    @cached_property
    def flow(self) -> LinearFlow:
        """Return z⁰ and f in the time s."""
        torus = self.kernel.torus
        return LinearFlow(np.array(torus.z), torus.frequencies / torus.mean)

    @cached_property
    def time_map(self) -> SampledTimeMap:
        """Return t(s)."""

        def rate(shape: tuple[int, ...]) -> Array:
            *others, last = (np.arange(n) / n for n in shape)
            starts = np.stack([x.ravel() for x in np.meshgrid(*others, [0.0], indexing="ij")], 1)
            steps = np.broadcast_to(last, (len(starts), last.size)).copy()
            y, _ = self._points(starts, np.eye(len(shape))[-1], steps)
            return np.asarray(self._reduced[1] / np.linalg.norm(y, axis=2).reshape(shape))

        return SampledTimeMap.of(rate, self.flow)

    @cached_property
    def attitude(self) -> AttitudeOnTorus:
        """Return what turns the frame of space along what moves."""
        torus, g = self.kernel.torus, self.kernel.genus

        def rate(z: Array, steps: Array) -> Array:
            y, y_prime = self._points(z, self.flow.rates, np.ascontiguousarray(steps))
            return np.asarray(wedge(y, y_prime) / np.sum(y * y, axis=2)[:, :, None, None])

        # x_i changes sign where the phase of the cut that I_i ends goes round
        ends = (torus.of_I[None, :] - 1) // 2 == np.arange(g)[:, None]
        return AttitudeOnTorus(rate, self.flow, np.where(ends, -1.0, 1.0))

    @cached_property
    def _slopes(self) -> tuple[float, float]:
        """Return the largest √Σ_k|∂γ/∂z_k|² and Σ_k|f_k ∂γ/∂z_k| over samples."""
        g = self.kernel.genus
        z = np.random.default_rng(7).uniform(0.0, 2.0, (_SAMPLES, g))
        steps = np.broadcast_to([0.0, _STEP], (_SAMPLES, 2)).copy()
        slopes = []
        for direction in np.eye(g):
            y, _ = self._points(z, direction, steps)
            gamma = y / np.linalg.norm(y, axis=2)[:, :, None]
            slopes.append(np.max(np.abs(gamma[:, 1] - gamma[:, 0]), axis=1) / _STEP)
        sizes = np.array(slopes)
        together = np.linalg.norm(sizes, axis=0), np.abs(self.flow.rates) @ sizes
        return BETWEEN * float(np.max(together[0])), BETWEEN * float(np.max(together[1]))

    def _error(self, tau1: Array, off: Array) -> Array:
        """Return the error of γ and of the frame at s (N,), itself off by ``off``."""
        at_once, by_flow = self._slopes
        cancelled = float(np.max(self.kernel.torus.cancellation))
        phases = cancelled * (_PHASE * at_once + _FLOW * by_flow * np.abs(tau1))
        return _EPSILON * (_EVALUATION * self.problem.n + phases) + by_flow * off

    @property
    def torus(self) -> Torus:
        """Return Neumann's torus, with the energy of the ball and its frequencies in t."""
        ball, known = self.problem, torus(self.kernel.problem)
        energy = float(ball.integrals(ball.start)["energy"][0])
        rates, mean = self.time_map.in_time.rates, self.time_map.mean
        given: dict[str, Any] = {"frequencies_t": rates, "mean_rate": mean, "close_orbit": None}
        return replace(known, energy=energy, **given)

    @property
    def _fastest(self) -> float:
        """Return the largest ds/dt."""
        return float(np.max(self._roots)) / self._reduced[1]

    def document_fields(self, accuracy: float) -> dict[str, Any]:
        """Return the fields of a document but for its head, Neumann's besides ``shell``.
        ``accuracy``: what modes left out may make in γ and the frame. Raises Unsolved (also
        ``too-many-modes``).
        """
        fields, _, _ = document_of(self.kernel, accuracy)
        ball, clock, (_, by_flow) = self.problem, self.time_map, self._slopes
        turning = by_flow * self._fastest
        flow = Flow(self.flow.rates, clock.mean, 1.0, turning)
        series = FourierSeries(2 * clock.modes, clock.coefficients, 0.0, 0.0)
        orders, coefficients = largest_modes(series, flow, turning, accuracy / 2)
        attitude = self.attitude.floquet()
        roots, directions = self._roots, self.kernel.moving.directions
        start = ball.axes.T @ ball.frame
        moved = directions.T @ start
        from_start = attitude.start @ moved
        once, later = self._error(np.arange(2.0), clock.off(np.full(2, math.inf))).tolist()
        later += 2 * math.pi * _ROUND * _EPSILON * flow.fastest * flow.mean - once
        # y = B^{1/2}x over its length is less exact than x
        once += fields["error"]["at_start"] * float(np.max(roots) / np.min(roots)) + attitude.skew
        growth = later / flow.mean + turning * growth_of_slow_modes(flow, orders, coefficients)
        bounds = ball.bound({}, _OF_DOCUMENT * np.array([once, growth]) + [accuracy, 0.0])
        at_start, growth = bounds.tolist()
        return {
            **fields,
            "axes": ball.axes.tolist(),
            "frequencies": self.flow.rates.tolist(),
            "mean_rate": clock.mean,
            "modes": (orders // 2).tolist(),
            "coefficients": coefficients,
            "units": {**fields["units"], "time": "t"},
            "error": {
                "at_start": at_start,
                "per_unit_time": growth,
                "per_cycle": growth / flow.fastest,
            },
            "shell": {
                "sphere": float(ball.sphere),
                "constant": self._reduced[1],
                "roots": roots.tolist(),
                "rates": attitude.rates.tolist(),
                "start": [from_start.real.tolist(), from_start.imag.tolist()],
                "still": (start - directions @ moved).tolist(),
                **_terms(attitude, accuracy / 4),
            },
        }

    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        problem, times = self.problem, grid.doubles
        directions = self.kernel.moving.directions
        tau1 = self.time_map.tau1(times)
        off = self._error(tau1, self.time_map.off(tau1) + grid.late * self._fastest)
        problem.require_digit(times, off, "doubles do not hold the motion there")
        y, y_prime = (
            x[0] for x in self._points(self.flow.start[None], self.flow.rates, tau1[None])
        )
        gamma = y / np.linalg.norm(y, axis=1)[:, None]
        across = y_prime - np.sum(gamma * y_prime, axis=1)[:, None] * gamma
        start = problem.axes.T @ problem.frame
        moved = directions.T @ start
        frame = start - directions @ moved + directions @ (self.attitude.at(tau1) @ moved)
        series = problem.complete(
            {
                "gamma": gamma @ directions.T,
                "velocity": -across @ directions.T / self._reduced[1],
                "frame": frame,
            }
        )
        error = problem.bound(series, off)
        problem.require_digit(times, error, "doubles do not hold the motion there")
        return series, error, "angles", {"time_map": "fourier"}


def _terms(attitude: Floquet, accuracy: float) -> dict[str, Any]:
    """Return the largest terms of the attitude; those left out add up to the accuracy, and their
    rounding to decimal places to a fourth of it.
    """
    left_out = np.cumsum(np.abs(attitude.coefficients[::-1]))[::-1]
    kept = int(np.count_nonzero(left_out > accuracy))
    places = math.ceil(-math.log10(accuracy / (4 * max(1, kept))))
    coefficients = attitude.coefficients[:kept]
    return {
        "modes": attitude.orders[:kept].tolist(),
        "columns": attitude.columns[:kept].tolist(),
        "real": np.round(coefficients.real, places).tolist(),
        "imaginary": np.round(coefficients.imag, places).tolist(),
    }
