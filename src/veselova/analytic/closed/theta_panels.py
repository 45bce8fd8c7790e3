"""States on panels of dt/dτ₁ by theta quotients: beside a separatrix, where ψ says little of the
body and phases say all.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.base import MOST_LOCAL, Sensitivity
from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.quotients import AlongOrbit, Quotients
from veselova.analytic.closed.states import TIMES_AT_ONCE, States, blocks
from veselova.analytic.kernel import error as kernel_error
from veselova.analytic.kernel.abel import abel
from veselova.analytic.kernel.rate import ARC
from veselova.analytic.kernel.weights import set_peaks
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.panels import ChebyshevTimeMap, integrate_together

__all__ = ["ThetaPanels"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Budget: phases drawn for the steepest places.
_DRAWN = 48

#: Derived: step of a difference quotient in a phase.
_STEP = 2.0**-24

#: Calibrated: rounding in ε of a phase, and of f, F_0 and the time map, relatively; by how much the
#: frame may be steeper than at the places that are looked at; what all of it may miss, and where
#: sensitivities are those of each time alone.
_PHASE, _RATE, _BETWEEN, _SAFETY, _FEW = 2.0, 2.0, 2.0, 4.0, 10.0


class ThetaPanels:
    """The states of a motion. Raises Unsolved as ``Quotients``."""

    def __init__(self, motion: KernelMotion) -> None:
        self._motion, self._torus = motion, motion.torus
        self._quotients = Quotients.of(motion)
        self._flow = LinearFlow(motion.torus.z, motion.torus.frequencies)

    def __call__(self, times: Array, late: Array) -> States:
        """Return the states at increasing times; ``late``: what these are off by. Raises Unsolved
        (``narrow-gap``) where panels do not resolve the orbit.
        """
        mean, filler = float(self._torus.mean[0]), self._motion.filler
        time_map = ChebyshevTimeMap(
            lambda z: self._at(z).rates, mean, self._flow, times[0], times[-1]
        )
        tau1, z = time_map.tau1(times)
        found = self._at(z)
        frames, velocities = filler.to_principal_axes(found.frames, found.velocities)
        of_map, drift = time_map.error(tau1, self._of_start, _RATE * _EPSILON * self._frequencies)
        off = mean * of_map + (_RATE * _EPSILON + drift) * np.abs(times) + late
        errors, of_phases = self._errors(z, tau1, off / found.rates)
        paths, peaks = np.zeros((filler.paths, times.size)), np.empty(filler.paths)
        set_peaks(self._torus, peaks)
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
        at, g = self._at(z), self._motion.genus
        odd = -at.rates * at.tilts / (1 - at.tilts)
        parts = np.column_stack([at.slopes[:, : g - 1], odd])[:, : peaks.size]
        return np.asarray(parts / np.maximum(peaks, np.finfo(float).tiny))

    @property
    def _frequencies(self) -> Array:
        return np.asarray(np.abs(self._torus.frequencies))

    @property
    def _sources(self) -> Array:
        """Return how far each source of rounding at the start moves phases, (g, 2g): angles, and
        integrals before a⁻¹ makes phases of them, in a direction in which the frame hardly turns.
        """
        torus, g = self._torus, self._motion.genus
        slopes = np.empty((g, g))
        abel(torus.angles, torus.psi, np.empty(g), slopes)
        whole = np.max(np.abs(np.linalg.solve(torus.inverse, slopes)), axis=1)
        sources = [slopes * np.abs(torus.psi), torus.inverse * (2 * np.pi * whole)]
        return np.asarray(np.concatenate(sources, axis=1) * _EPSILON)

    @property
    def _of_start(self) -> Array:
        return np.asarray(2 * _PHASE * _EPSILON + np.sum(np.abs(self._sources), axis=1))

    def _errors(self, z: Array, tau1: Array, lag: Array) -> tuple[Array, Array]:
        """Return the errors of the frame and of X, (2, T), where τ₁ is off by ``lag`` (T,), and
        those of phases in functions, (T,).
        """
        few = z.shape[0] <= MOST_LOCAL
        rows = np.linspace(0, len(z) - 1, min(len(z), MOST_LOCAL)).astype(int)
        drawn = np.random.default_rng(3).uniform(0.0, 2.0, (0 if few else _DRAWN, z.shape[1]))
        slopes = self._slopes(np.concatenate([z[rows], drawn]))
        errors, frequencies = np.empty((2, len(z))), self._torus.frequencies
        cancelling = float(self._torus.cancellation[0])
        for part, of_part in enumerate(slopes):
            at = Sensitivity.at_points(_BETWEEN * of_part, frequencies, self._sources)
            at = at if few else at.largest()
            phases = _PHASE * _EPSILON * at.together + at.by_start
            phases = phases + cancelling * _RATE * _EPSILON * np.abs(tau1) * at.by_rates
            own = self._quotients.rounding + kernel_error.EVALUATION * _EPSILON
            errors[part] = own + (_FEW if few else _SAFETY) * (phases + lag * at.along_flow)
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
