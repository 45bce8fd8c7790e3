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
from veselova.analytic.time_map.fourier import FourierTimeMap
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.panels import ChebyshevTimeMap
from veselova.analytic.time_map.rate import TimeRate
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["GenericTorus", "fastest"]


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

    def time_map(self, times: Any, name: str) -> FourierTimeMap | ChebyshevTimeMap:
        if name == "panels":
            ends = np.min(times), np.max(times)
            return ChebyshevTimeMap(self.rate_at, self.mean_rate, self.in_tau1, *ends)
        in_time = LinearFlow(self.origin, self.periods.frequencies / self.rate.mean)
        return FourierTimeMap(self.rate, self.in_tau1, in_time)
