"""The motion of a ball in ℝⁿ, n ≥ 4, from that of the rank-one problem on whose torus it rolls."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from veselova.analytic.motion.area_motion import largest_component, roll
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.rolling_ball_n import RollingBallN

__all__ = ["ball_fields", "motion_of_ball_n"]


def motion_of_ball_n(problem: RollingBallN, point: Trajectory) -> Trajectory:
    """Return the motion of the ball whose torus problem moves along a trajectory, with the same
    frame.
    """
    frame = point.series("frame")
    rolled = roll(problem, problem.on_torus(), point.series("displacement"))
    position = problem.start["position"] + rolled
    series = {"Omega": problem.angular_velocity(frame), "frame": frame, "position": position}
    lost = float(np.finfo(float).eps) * largest_component(position)
    error = problem.ball.size * point.error + lost
    dense = None if point.dense is None else partial(_motion_at, problem, point.dense)
    return Trajectory(problem, point.times, error, series, point.provenance, dense)


def _motion_at(problem: RollingBallN, dense: Callable[[Any], Trajectory], times: Any) -> Trajectory:
    return motion_of_ball_n(problem, dense(times))


def ball_fields(ball: RollingBallN) -> dict[str, Any]:
    """Return the field ``ball`` of a document, from which ω follows: x with J_ij = x_ix_j, the
    momentum Eᵀp in space, and ma² for a ball that twists freely, else None.
    """
    return {
        "roots": ball.ball.roots.tolist(),
        "momentum": ball.momentum_in_space.tolist(),
        "added": float(ball.ball.added) if ball.twists else None,
    }
