"""The motion of a body with an area constant, from that on the torus of its rank-one problem."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["AreaBody", "largest_component", "motion_with_area", "plane_of_path", "roll"]

Array = NDArray[np.float64]

AreaBody = VeselovaSO3 | ChaplyginBall

_EPSILON = float(np.finfo(float).eps)

#: Derived: roundings of the constant rotation between both frames, of its product with one, and of
#: the principal axes.
_ROUNDINGS = 8.0


def motion_with_area(problem: AreaBody, point: Trajectory) -> Trajectory:
    """Return the motion of the body whose ``AreaVeselova`` moves along a trajectory.

    Its frame {v, ±u, ±n} turns as that of the body does: both differ by a constant rotation.
    """
    torus = point.problem
    assert isinstance(torus, AreaVeselova)
    axes = np.eye(3) if problem.axes is None else problem.axes
    at_start = axes.T @ problem.frame
    # one product, not one for every time
    rows = point.series("frame").reshape(-1, 3) @ (torus.frame.T @ at_start)
    frame = rows.reshape(-1, 3, 3)
    if problem.axes is not None:
        frame = axes @ frame
    # a row of errors times a column of unit length
    error = np.sqrt(3) * point.error + _ROUNDINGS * _EPSILON
    series = {"Omega": problem.angular_velocity(frame), "frame": frame}
    if isinstance(problem, RollingBall):
        rolled = roll(problem, torus, point.series("displacement"))
        series["position"] = problem.start["position"] + rolled
        lost = _ROUNDINGS * _EPSILON * largest_component(rolled)
        lost += _EPSILON * largest_component(series["position"])
        error = problem.ball.size * error + lost
    dense = None if point.dense is None else partial(_motion_at, problem, point.dense)
    return Trajectory(problem, point.times, error, series, point.provenance, dense)


def roll(ball: RollingBall | RollingBallN, torus: TorusProblem, displacement: Array) -> Array:
    """Return x(t) − x(0) along e_2 … e_n, (N, n−1), from the series of the problem on the torus."""
    radius = float(ball.ball.radius)
    if not isinstance(torus, AreaVeselova):
        return -radius * displacement
    assert isinstance(ball, RollingBall)
    return np.asarray(radius * displacement @ plane_of_path(ball, torus))


def largest_component(vectors: Array) -> Array:
    """Return the largest |component| of each vector of the plane, (N, K) to (N,)."""
    return reduce(np.maximum, np.abs(vectors).T)


def plane_of_path(ball: RollingBall, torus: AreaVeselova) -> Array:
    """Return n and e_⊥ along e_2 and e_3, as rows, (2, 2)."""
    axes = np.eye(3) if ball.axes is None else ball.axes
    rows = np.stack([torus.normal, torus.horizontal])
    return np.asarray(rows @ (axes.T @ ball.frame[:, 1:]))


def _motion_at(problem: AreaBody, dense: Callable[[Any], Trajectory], times: Any) -> Trajectory:
    return motion_with_area(problem, dense(times))
