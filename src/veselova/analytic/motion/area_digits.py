"""The motion of ``VeselovaSO3`` with (Ω,γ) ≠ 0 to more digits than a double has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np

from veselova.analytic.motion.bodies import decimals_of_body, exact_position
from veselova.analytic.motion.motion_balls import MotionInBalls
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.enclosures import (
    SHOWN_DIGITS,
    BallSeries,
    Pair,
    decimal_pair,
    exact_as,
    working_digits,
)
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.area_start import AreaStart, exact_start
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["AreaMotionInBalls"]

#: Calibrated: digits beyond those asked for that the frame of the torus has: the constant rotation
#: to the frame of the body adds three errors.
_FURTHER = 1


@dataclass(frozen=True)
class AreaMotionInBalls:
    """A motion with an area constant that can be asked for times, with ``digits`` correct digits
    after the point in the frame.

    E(t) = [v u −n](t) [v u −n](0)ᵀ E(0), and Ω = B(K + σγ) with K fixed in space.
    """

    problem: VeselovaSO3 | ChaplyginBall
    digits: int
    method: str | None

    def __call__(self, times: Any) -> Trajectory:
        """Return the trajectory at times; raises Unsolved as ``MotionInBalls`` does."""
        point = MotionInBalls(self._torus, self.digits + _FURTHER, False, self.method)(times)
        assert point.decimals is not None
        decimals = self._decimals(point.decimals)
        arrays = {name: decimals.midpoints[name].astype(np.float64) for name in self.problem.stored}
        spread = np.nextafter(decimals.error.astype(np.float64), np.inf)
        error = spread + self.problem.rounding(arrays)
        return Trajectory(
            self.problem,
            point.times,
            error,
            arrays,
            replace(point.provenance, digits=self.digits),
            self,
            decimals,
        )

    @cached_property
    def _torus(self) -> AreaVeselova:
        return self.problem.area_class(self.problem, self.digits)

    @cached_property
    def _start(self) -> AreaStart:
        return exact_start(self.problem, self.digits)

    def _decimals(self, point: Decimals) -> Decimals:
        """Return the decimals of the body; Ω and what follows from it are made when they are asked
        for.
        """
        problem = self.problem
        columns = np.array(self._torus.columns, dtype=object)
        rotation = columns @ np.array(self._start.frame, dtype=object)
        with working_digits(self.digits):
            frame = BallSeries(point.midpoints, point.radii)["frame"]
            frame = frame @ exact_as(frame, rotation)
        pairs: dict[str, Pair | Callable[[], Pair]] = {
            "Omega": partial(self._angular_velocity, frame),
            "frame": partial(decimal_pair, frame, self.digits + SHOWN_DIGITS),
        }
        if isinstance(problem, RollingBall):
            plane = np.array(self._torus.plane, dtype=object)
            horizontal = np.array(self._start.frame, dtype=object)[:, 1:]
            rotated = -(plane @ horizontal)
            pairs["position"] = partial(exact_position, problem, point, self.digits, rotated)
        return decimals_of_body(problem, pairs, self.digits, False)

    def _angular_velocity(self, frame: Any) -> Pair:
        """Return Ω = B(K + σγ), σ = (c − (BK,γ))/(Bγ,γ), or D(BK,γ)/(1 − D(Bγ,γ))."""
        along, *across_gamma = self._start.momentum
        # (Ω,γ), which exceeds the others in small bodies, has no part in BK
        momentum = [Fraction(0) if self.problem.added is None else along, *across_gamma]
        gamma = frame[:, :, 0]
        with working_digits(self.digits):
            free = self.problem.velocity_of(frame @ exact_as(frame, momentum))
            across = self.problem.velocity_of(gamma)
            if self.problem.added is None:
                share = exact_as(frame, along) - np.sum(free * gamma, axis=1)
                share = share / np.sum(across * gamma, axis=1)
            else:
                # 1 − D(Bγ,γ) = (Bγ,Iγ), without cancellation
                inertia = [moment - self.problem.added for moment in self.problem.moments]
                share = exact_as(frame, self.problem.added) * np.sum(free * gamma, axis=1)
                share = share / np.sum(across * (exact_as(gamma, inertia) * gamma), axis=1)
            return decimal_pair(free + share[:, None] * across, self.digits + SHOWN_DIGITS)
