"""The attitude as theta quotients with one common denominator, from the torus of the kernel.

    q_i = κ_i θ[η(I_i)]/θ,   v_k = (q', n_k) = κ_k θ[η(c_k)]/θ,   (n_k)_i = κ_ik θ[η(I_i)+η(c_k)]/θ,
        γ the case c_1 = 0,   d(time)/dτ₁ = constant · |θ[η(c_1)]/θ|^power

The constants κ come from half periods z = ½ν, where every λ_s is a branch point and the frame is
exact: for each function the half period at which it is largest against its denominator. Phases
come from the kernel's time maps, and beside a separatrix, where ψ says little of the body and
phases say all, from panels of dt/dτ₁ by theta quotients.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.base import MOST_LOCAL, sensitivity
from veselova.analytic.closed.states import TIMES_AT_ONCE, StateFiller, States, blocks
from veselova.analytic.curve.hyperelliptic import functions_of_attitude
from veselova.analytic.kernel import document
from veselova.analytic.kernel import frame as kernel_frame
from veselova.analytic.kernel.abel import abel
from veselova.analytic.kernel.coefficients import set_peaks
from veselova.analytic.kernel.document import set_phases
from veselova.analytic.kernel.rate import ARC, NEUMANN, PHYSICAL, tilted
from veselova.analytic.theta.siegel_theta import SiegelTheta
from veselova.analytic.time_map.modes import LinearFlow
from veselova.analytic.time_map.panels import ChebyshevTimeMap, integrate_together
from veselova.mechanics.core.errors import Unsolved

__all__ = ["ByTheta", "Quotients", "riemann_matrix"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: The exponent of |(q',γ)| in d(time)/dτ₁.
POWERS = {PHYSICAL: 1, ARC: -2, NEUMANN: 0}

#: Budget: terms of all functions together: 4 GB of tables; and a genus at which no sum is as short.
_MOST_TERMS = 2.5e8
_LARGEST_GENUS = 18

#: Calibrated: rounding of one evaluation of the quotients, in ε, twice the largest seen over the
#: problem tables, for each unit of the largest entry of T, whose rounding stands in an exponent;
#: and how many functions T has a part in, numerator and denominator, and those of κ.
_EVALUATION, _FUNCTIONS = 40.0, 4.0

#: Budget: phases drawn for the steepest places.
_DRAWN = 48

#: Derived: step of a difference quotient in a phase.
_STEP = 2.0**-24

#: Calibrated: rounding in ε of a phase, and of f, F_0 and the time map, relatively; by how much the
#: frame may be steeper than at the places that are looked at; what all of it may miss, and where
#: sensitivities are those of each time alone.
_PHASE, _RATE, _BETWEEN, _SAFETY, _FEW = 2.0, 2.0, 2.0, 4.0, 10.0


def riemann_matrix(torus: Any) -> tuple[Array, float, float]:
    """Return T (g, g), and of it what ``kernel.document.set_riemann_matrix`` returns."""
    T = np.zeros((torus.z.size, torus.z.size))
    return T, *document.set_riemann_matrix(torus, T)


def require_theta(T: Array) -> SiegelTheta:
    """Return the theta functions of T (g, g). Raises Unsolved where their tables would fill the
    memory (``too-many-terms``), or where T leaves the range of floats.
    """
    if not (np.all(np.isfinite(T)) and np.linalg.eigvalsh(T)[0] > 0):
        raise Unsolved(
            "beyond-floats", "periods leave the range of a float: the A's are too far apart"
        )
    theta = SiegelTheta(np.asarray(1j * T))
    functions = len(T) * (len(T) + 3) + 1
    cost = theta.terms if len(T) <= _LARGEST_GENUS else math.inf
    if not cost * functions <= _MOST_TERMS:
        wanted = (
            f"n = {len(T) + 1} takes {functions} theta functions of {min(cost, 1e11):.1e} "
            "terms or more"
        )
        raise Unsolved(
            "too-many-terms",
            f"{wanted}, {_MOST_TERMS:.1e} in all can be kept; angles serve at any n",
        )
    return theta


class AlongOrbit(NamedTuple):
    """At N phases: [q n_2 … γ] (N, m, m), dq/d(time) (N, m), (q',n_2) … (q',γ) (N, m−1),
    d(time)/dτ₁ (N,), and the tilt of it (N,), of ``kernel.rate``.
    """

    frames: Array
    velocities: Array
    slopes: Array
    rates: Array
    tilts: Array


@dataclass(frozen=True)
class Quotients:
    """The theta functions of a torus, and what makes its attitude of them.

    - functions: (C, 2, g) the characteristics of all functions, that of the denominator first
    - places: (K,) where among them the numerators stand: those of q_1 … q_n, of v_k, and of (n_k)_i
      with i before k; k runs over c_2 … c_g, c_1
    - constants: (K,) κ
    - rate, power: the constant and the exponent of d(time)/dτ₁, its even part; torus: of the kernel
    - rounding: what one evaluation is off by, relative to the size of what is evaluated
    """

    torus: Any
    theta: SiegelTheta
    functions: Array
    places: NDArray[np.intp]
    constants: Array
    rate: float
    power: int
    rounding: float

    @classmethod
    def of(cls, torus: Any, room: Any) -> Quotients:
        """Return those of a torus. Raises Unsolved as ``require_theta``."""
        g = torus.z.size
        T, _, of_B = riemann_matrix(torus)
        theta = require_theta(T)
        functions, places = functions_of_attitude(torus.of_I.tolist(), torus.of_c.tolist())
        halves, rates = np.empty((2**g, g)), np.empty(2**g)
        entries = np.empty((2**g, len(places)))
        document.set_half_periods(torus, room, halves, entries, rates)
        raw = _over_first(theta, halves / 2, functions)[:, places]
        best, columns = np.argmax(np.abs(raw), axis=0), np.arange(len(places))
        # (q', γ) by least squares over all of them, since an orbit takes its rounding along
        exact, quotient = np.abs(entries[:, 2 * g]), np.abs(raw[:, 2 * g])
        power = POWERS[int(torus.time[0])]
        largest = np.argmax(exact)
        rate = rates[largest] * (exact @ quotient / (quotient @ quotient) / exact[largest]) ** power
        return cls(
            torus,
            theta,
            functions,
            places,
            entries[best, columns] / raw[best, columns],
            float(rate),
            power,
            _rounding(T, float(np.max(torus.cancellation)), of_B),
        )

    def at(self, z: Array) -> AlongOrbit:
        """Return what is known at phases modulo 2 (N, g), along what moves."""
        g = z.shape[1]
        raw = _over_first(self.theta, z, self.functions)[:, self.places]
        q, slopes, normals = np.split(raw * self.constants, [g + 1, 2 * g + 1], axis=1)
        frames = np.concatenate([q[:, :, None], normals.reshape(-1, g + 1, g)], axis=2)
        tilts = np.zeros(len(z))
        if self.torus.tilt[0]:
            tilts = np.array([tilted(self.torus, frame) for frame in frames.copy()])
        rates = self.rate * np.abs(raw[:, 2 * g]) ** self.power * (1 - tilts)
        velocities = (frames[:, :, 1:] @ slopes[:, :, None])[:, :, 0] / rates[:, None]
        return AlongOrbit(frames, velocities, slopes, rates, tilts)


def _over_first(theta: SiegelTheta, z: Array, functions: Array) -> Array:
    """Return the functions at points z (N, g) over the first one, (N, C)."""
    mantissas, exponents, _ = theta.values(z.astype(complex), functions, 0, False)
    found = mantissas * np.exp(exponents - exponents[:, :1])
    return np.asarray((found / found[:, :1]).real)


def _rounding(T: Array, of_a: float, of_B: float) -> float:
    """Return the rounding of an evaluation, and what that of T makes of the quotients.

    T is a⁻¹B: a rounding of a moves it by ε of itself for each unit by which its periods cancel,
    and one of B by ε of what cancels there, where that is more.
    On a Gaussian e^{−πd²/μ}, μ the least eigenvalue, that is at most 1/e = max x e^{−x} of its part
    in μ, which is small near a separatrix.
    """
    size = float(np.max(np.abs(T)))
    off = of_a * size + 2 * max(0.0, of_B - of_a * size)
    of_T = off / (math.e * float(np.linalg.eigvalsh(T)[0]))
    return _EPSILON * (_EVALUATION * max(1.0, size) + _FUNCTIONS * of_T)


class ByTheta:
    """The states of a motion by theta functions: made of those by angles, or on panels of their
    own. Raises Unsolved as ``Quotients``.
    """

    def __init__(self, filler: StateFiller) -> None:
        self._filler, self._torus = filler, filler.torus
        self._quotients = Quotients.of(filler.torus, filler.room)
        self._flow = LinearFlow(filler.torus.z, filler.torus.frequencies)

    @property
    def terms(self) -> int:
        """Return the terms of a theta sum."""
        return round(self._quotients.theta.terms)

    def __call__(self, found: States) -> States:
        """Return the states by theta functions; τ₁ and what the time map is off by stay."""
        filler = self._filler
        frames, velocities = np.empty(found.frames.shape), np.empty(found.velocities.shape)
        for few in blocks(found.tau1.size, TIMES_AT_ONCE):
            z = np.empty(found.psi[few].shape)
            set_phases(self._torus, found.psi[few], filler.room, z)
            at = self._quotients.at(z)
            frames[few], velocities[few] = filler.to_principal_axes(at.frames, at.velocities)
        errors = found.errors + self._quotients.rounding
        return found._replace(frames=frames, velocities=velocities, errors=errors)

    def on_panels(self, times: Array, late: Array) -> States:
        """Return the states at increasing times; ``late``: what these are off by. Raises Unsolved
        (``narrow-gap``) where panels do not resolve the orbit.
        """
        torus, filler, mean = self._torus, self._filler, float(self._torus.mean[0])
        time_map = ChebyshevTimeMap(
            lambda z: self._at(z).rates, mean, self._flow, times[0], times[-1]
        )
        tau1, z = time_map.tau1(times)
        found = self._at(z)
        frames, velocities = filler.to_principal_axes(found.frames, found.velocities)
        of_start = 2 * _PHASE * _EPSILON + np.linalg.norm(self._sources, axis=1)
        of_map, drift = time_map.error(tau1, of_start, _RATE * _EPSILON * np.abs(torus.frequencies))
        off = mean * of_map + (_RATE * _EPSILON + drift) * np.abs(times) + late
        errors, of_phases = self._errors(z, tau1, off / found.rates)
        paths, peaks = np.zeros((filler.paths, times.size)), np.empty(filler.paths)
        set_peaks(torus, peaks)
        if filler.paths:
            ends = min(tau1[0], 0.0), max(tau1[-1], 0.0)
            parts = partial(self._integrands, peaks)
            panels = integrate_together(parts, self._flow, *ends, floor=1.0)
            paths = peaks[:, None] * np.array([x.at(tau1) for x in panels])
            of_phases = of_phases * np.abs(tau1) + np.max([x.error(tau1) for x in panels], axis=0)
        of_paths = peaks[:, None] * (off / found.rates + of_phases)
        size = time_map.size
        return States(tau1, frames, velocities, errors, size, np.empty((0, 0)), paths, of_paths)

    def _at(self, z: Array) -> AlongOrbit:
        """Return the same as the quotients, by blocks with checkpoints between them."""
        parts = (self._quotients.at(z[few]) for few in blocks(len(z), TIMES_AT_ONCE))
        return AlongOrbit(*(np.concatenate(x) for x in zip(*parts, strict=True)))

    def _integrands(self, peaks: Array, z: Array) -> Array:
        """Return what paths integrate, over their peaks (K,), (N, K): (q',n_k), and the odd part
        of the rate.
        """
        at, g = self._at(z), z.shape[1]
        odd = -at.rates * at.tilts / (1 - at.tilts)
        parts = np.column_stack([at.slopes[:, : g - 1], odd])[:, : peaks.size]
        return np.asarray(parts / np.maximum(peaks, np.finfo(float).tiny))

    @property
    def _sources(self) -> Array:
        """Return how far each source of rounding at the start moves phases, (g, 2g): angles, and
        integrals before a⁻¹ makes phases of them, in a direction in which the frame hardly turns.
        """
        torus, g = self._torus, self._torus.z.size
        slopes = np.empty((g, g))
        abel(torus.angles, torus.psi, np.empty(g), slopes)
        whole = np.max(np.abs(np.linalg.solve(torus.inverse, slopes)), axis=1)
        sources = [slopes * np.abs(torus.psi), torus.inverse * (2 * np.pi * whole)]
        return np.asarray(np.concatenate(sources, axis=1) * _EPSILON)

    def _errors(self, z: Array, tau1: Array, lag: Array) -> tuple[Array, Array]:
        """Return the errors of the frame and of X, (2, T), where τ₁ is off by ``lag`` (T,), and
        those of phases in functions, (T,).
        """
        few = z.shape[0] <= MOST_LOCAL
        rows = np.linspace(0, len(z) - 1, min(len(z), MOST_LOCAL)).astype(int)
        drawn = np.random.default_rng(3).uniform(0.0, 2.0, (0 if few else _DRAWN, z.shape[1]))
        slopes = self._slopes(np.concatenate([z[rows], drawn]))
        errors, frequencies = np.empty((2, len(z))), self._torus.frequencies
        cancelling = float(np.max(self._torus.cancellation))
        for part, of_part in enumerate(slopes):
            at = sensitivity(_BETWEEN * of_part, frequencies, self._sources)
            along_flow, together, by_rates, by_start = at if few else np.max(at, axis=1)
            phases = _PHASE * _EPSILON * together + by_start
            phases = phases + cancelling * _RATE * _EPSILON * np.abs(tau1) * by_rates
            own = self._quotients.rounding + kernel_frame.EVALUATION * _EPSILON
            errors[part] = own + (_FEW if few else _SAFETY) * phases + _SAFETY * lag * along_flow
            if part == 0:
                of_phases = np.broadcast_to(phases, lag.shape)
        return errors, of_phases

    def _slopes(self, z: Array) -> list[Array]:
        """Return the derivatives of the frame's entries, and of X of a geodesic, by every phase,
        (N, K, g) each.
        """
        torus, ends = self._torus, [z, *(z + step for step in _STEP * np.eye(z.shape[1]))]
        frames = self._at(np.concatenate(ends)).frames.reshape(len(ends), *z.shape[:1], -1)
        values, m = [frames], torus.of_I.size
        if torus.time[0] == ARC:
            I = torus.points[torus.of_I]
            q = frames.reshape(*frames.shape[:2], m, m)[:, :, :, 0]
            total = np.sum(q * q / I, axis=2, keepdims=True)
            values.append(q / I * np.sqrt(I[0] / total))
        else:
            values.append(np.zeros((*frames.shape[:2], 1)))
        return [np.moveaxis((x[1:] - x[0]) / _STEP, 0, 2) for x in values]
