"""The motion of a body or a ball, from that of the rank-one problem on whose torus it moves: with
A = 𝓘⁻¹ where (Ω,γ) = 0, of ``AreaVeselova`` with an area constant, of a ball in ℝⁿ.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.area_veselova import AreaVeselova
from veselova.analytic.closed.base import Motion
from veselova.analytic.closed.motion import TorusMotion
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["AreaBody", "MotionOfBody", "plane_of_path", "roll"]

Array = NDArray[np.float64]

AreaBody = VeselovaSO3 | ChaplyginBall

_EPSILON = float(np.finfo(float).eps)

#: Derived: roundings of the constant rotation between both frames, of its product with one, and of
#: the principal axes.
_ROUNDINGS = 8.0


@dataclass(frozen=True)
class MotionOfBody(Motion[AreaBody | RollingBallN]):
    """The motion of a body by that of the rank-one problem on its torus; ``method``, ``time_map``:
    of that.

    Both frames are the same, and Ω = γ̇×γ. With an area constant they turn in the same way, and
    differ by a constant rotation.
    """

    method: str | None = None
    time_map: str | None = None

    @cached_property
    def _point(self) -> TorusMotion:
        return TorusMotion(self.problem.on_torus(), self.method, self.time_map)

    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        point, problem, torus = self._point(grid.increasing), self.problem, self._point.problem
        frame, error, roundings = point.series("frame"), point.error, 1.0
        if isinstance(torus, AreaVeselova):
            assert not isinstance(problem, RollingBallN)
            frame, roundings = _own_frame(problem, torus, frame), _ROUNDINGS
            # a row of errors times a column of unit length
            error = np.sqrt(3) * error + roundings * _EPSILON
        if isinstance(problem, VeselovaSO3) and not isinstance(torus, AreaVeselova):
            Omega = np.cross(point.series("q_dot"), frame[:, :, 0])
        else:
            Omega = problem.angular_velocity(frame)
        series = {"Omega": Omega, "frame": frame}
        if isinstance(problem, (RollingBall, RollingBallN)):
            rolled = roll(problem, torus, point.series("displacement"))
            series["position"] = problem.start["position"] + rolled
            # the product with the radius, and the sum
            lost = roundings * _largest_component(rolled) + _largest_component(series["position"])
            error = problem.ball.size * error + _EPSILON * lost
        return series, error, point.provenance.method, point.provenance.details


def _own_frame(problem: AreaBody, torus: AreaVeselova, frame: Array) -> Array:
    """Return the frame of the body (N, 3, 3) from {v, ±u, ±n}."""
    axes = np.eye(3) if problem.axes is None else problem.axes
    # one product, not one for every time
    rows = frame.reshape(-1, 3) @ (torus.frame.T @ (axes.T @ problem.frame))
    found = rows.reshape(-1, 3, 3)
    return found if problem.axes is None else np.asarray(axes @ found)


def roll(ball: RollingBall | RollingBallN, torus: TorusProblem, displacement: Array) -> Array:
    """Return x(t) − x(0) along e_2 … e_n, (N, n−1), from the series of the problem on the torus."""
    radius = float(ball.ball.radius)
    if not isinstance(torus, AreaVeselova):
        return -radius * displacement
    assert isinstance(ball, RollingBall)
    return np.asarray(radius * displacement @ plane_of_path(ball, torus))


def plane_of_path(ball: RollingBall, torus: AreaVeselova) -> Array:
    """Return n and e_⊥ along e_2 and e_3, as rows, (2, 2)."""
    axes = np.eye(3) if ball.axes is None else ball.axes
    return np.asarray(to_float(torus.plane) @ (axes.T @ ball.frame[:, 1:]))


def _largest_component(vectors: Array) -> Array:
    """Return the largest |component| of each vector of the plane, (N, K) to (N,)."""
    return reduce(np.maximum, np.abs(vectors).T)
