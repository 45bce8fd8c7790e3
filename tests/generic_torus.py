"""The curve of a motion in doubles with its frame and time maps at any phases, by the kernel."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from veselova.analytic.closed.base import Attitude
from veselova.analytic.closed.motion import KernelMotion, kernel_motion
from veselova.analytic.closed.start import exact_start
from veselova.analytic.curve.moving_part import moving_part
from veselova.analytic.curve.periods import AbelInDoubles
from veselova.analytic.kernel import modes as kernel_modes
from veselova.analytic.kernel.coefficients import RATE
from veselova.analytic.kernel.frame import set_frame
from veselova.analytic.kernel.rate import even_rate
from veselova.analytic.time_map.modes import LinearFlow
from veselova.analytic.time_map.panels import ChebyshevTimeMap
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["FourierClock", "GenericTorus", "fastest"]


def fastest(problem: TorusProblem) -> float:
    """Return the most cycles that a phase makes in a unit of time."""
    return float(kernel_motion(problem, proven=False).fastest)


class GenericTorus:
    def __init__(self, problem: TorusProblem) -> None:
        motion = KernelMotion(problem, exact_start(moving_part(problem)))
        self.moving, self.torus, self.room = moving_part(problem), motion.torus, motion.room
        self.spectrum: Any = motion.moving.spectrum
        series = self.torus.angles.slopes.transpose(1, 0, 2)
        self.inversion = AbelInDoubles(series, float("nan"))
        self.in_tau1 = LinearFlow(np.array(self.torus.z), np.array(self.torus.frequencies))
        self.mean_rate = float(self.torus.mean[0])

    def rate_at(self, z: Any) -> Any:
        return np.array(list(map(partial(even_rate, self.torus), self.inversion.invert(z))))

    def attitude(self, z: Any) -> Attitude:
        m, psi = self.torus.of_I.size, self.inversion.invert(z)
        frames, components = np.empty((len(z), m, m)), np.empty((len(z), m - 1))
        points = np.empty((len(z), m - 1))
        for at, frame, along, point in zip(psi, frames, components, points, strict=True):
            set_frame(self.torus, at, self.room, frame, np.empty(m))
            along[:] = np.roll(self.room.v, -1)
            low = self.room.roots[np.arange(m - 1), np.arange(1, 2 * m - 1, 2)]
            point[:] = self.torus.points[1:-1:2] + low * low
        return Attitude(frames[:, :, 0], frames[:, :, 1:], components, points)

    def panels(self, times: Any) -> ChebyshevTimeMap:
        ends = np.min(times), np.max(times)
        return ChebyshevTimeMap(self.rate_at, self.mean_rate, self.in_tau1, *ends)


class FourierClock:
    """The Fourier time map of a motion by the kernel."""

    def __init__(self, problem: TorusProblem) -> None:
        motion = kernel_motion(problem, proven=False)
        self.torus, self.room, g = motion.torus, motion.room, motion.genus
        self.mean = float(self.torus.mean[0])
        flow = self.torus.frequencies / self.torus.mean, np.zeros(g)
        self.modes = kernel_modes.make_modes(
            self.torus, RATE, *flow, kernel_modes.SIDES[g], kernel_modes.MOST_MODES[g]
        )
        assert self.modes.reach[0] >= 0

    def tau1(self, times: Any) -> tuple[Any, Any]:
        """Return (τ₁, z modulo 2) at times."""
        g, odd = self.torus.z.size, kernel_modes.no_modes(self.torus.z.size)
        tau, (psi, z) = np.empty(times.size), np.empty((2, times.size, g))
        given = self.torus, self.modes, odd, times, tau, psi, z, self.room
        assert kernel_modes.jump(*given) == 0
        return tau, z

    def sums(self, z: Any) -> tuple[Any, Any]:
        """Return S(z) − S(z⁰) and its derivative by τ₁ at phases (N, g)."""
        found = [kernel_modes.sum_modes(self.modes, kernel_modes.ALL, x) for x in z]
        values, slopes = np.array(found).T
        return values - self.modes.at_start[kernel_modes.ALL], slopes
