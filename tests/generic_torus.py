"""The curve of a motion in doubles with its periods, Abel map, frame and time maps, by the texts
that balls, potentials and the toolkit share.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.closed.base import Attitude
from veselova.analytic.closed.motion import kernel_motion
from veselova.analytic.curve.branch_points import resolve_spectrum
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.moving_part import moving_part
from veselova.analytic.curve.periods import AbelJacobi, Periods
from veselova.analytic.digits.frame import Frame
from veselova.analytic.kernel import modes as kernel_modes
from veselova.analytic.kernel import rule
from veselova.analytic.kernel.coefficients import RATE
from veselova.analytic.time_map.modes import LinearFlow
from veselova.analytic.time_map.panels import ChebyshevTimeMap
from veselova.analytic.time_map.rate import TimeRate
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["FourierClock", "GenericTorus", "fastest"]


def fastest(problem: TorusProblem) -> float:
    """Return the most cycles that a phase makes in a unit of time."""
    return float(kernel_motion(problem, proven=False).fastest)


class GenericTorus:
    def __init__(self, problem: TorusProblem) -> None:
        found = resolve_spectrum(moving_part(problem), DOUBLE.digits)
        self.problem, self.moving, self.spectrum = problem, found.moving, found.spectrum
        self.curve = Curve.of(self.spectrum, DOUBLE)
        self.periods = Periods(self.curve)
        self.inversion = AbelJacobi(self.periods)
        self.frame = Frame(self.periods, np.array(self.spectrum.signs))
        self.origin = self.inversion.map(self.periods.start_angles(self.spectrum)[None, :])[0]
        self.in_tau1 = LinearFlow(self.origin, self.periods.frequencies)

    @cached_property
    def rate(self) -> TimeRate:
        return TimeRate.of(self.spectrum, self.inversion, self.problem.time)

    @property
    def mean_rate(self) -> float:
        return float(self.rate.mean)

    def rate_at(self, z: Any) -> Any:
        return self.rate.at(self.inversion.invert(z))

    def attitude(self, z: Any) -> Attitude:
        return self.frame.at(self.inversion.invert(z))

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
            self.torus, RATE, *flow, rule.SIDES[g], rule.MOST_MODES[g]
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
        spans, used = self.modes.spans[kernel_modes.ALL], self.modes.used[kernel_modes.ALL]
        room = kernel_modes.mode_room(self.modes, self.modes)
        found = [kernel_modes.sum_modes(self.modes, spans, used, x, *room) for x in z]
        values, slopes = np.array(found).T
        return values - self.modes.at_start[0], slopes
