"""The motion of a body or a ball, from that of the rank-one problem on whose torus it moves: with
A = 𝓘⁻¹ where (Ω,γ) = 0, of ``AreaVeselova`` with an area constant, of a ball in ℝⁿ.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import Decimals, Later
from veselova.mechanics.core.enclosures import (
    SHOWN_DIGITS,
    BallSeries,
    Pair,
    decimal_pair,
    exact_as,
    working_digits,
)
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = [
    "AreaBody",
    "decimals_of_body",
    "exact_position",
    "motion_of_body",
    "plane_of_path",
    "roll",
]

Array = NDArray[np.float64]

AreaBody = VeselovaSO3 | ChaplyginBall

_EPSILON = float(np.finfo(float).eps)

#: Derived: roundings of the constant rotation between both frames, of its product with one, and of
#: the principal axes.
_ROUNDINGS = 8.0


def motion_of_body(problem: AreaBody | RollingBallN, point: Trajectory) -> Trajectory:
    """Return the motion of the body whose rank-one problem moves along a trajectory.

    Both frames are the same, and Ω = γ̇×γ. With an area constant they turn in the same way, and
    differ by a constant rotation.
    """
    torus, frame, error = point.problem, point.series("frame"), point.error
    roundings = 1.0
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
        assert isinstance(torus, TorusProblem)
        rolled = roll(problem, torus, point.series("displacement"))
        series["position"] = problem.start["position"] + rolled
        # the product with the radius, and the sum
        lost = roundings * _largest_component(rolled) + _largest_component(series["position"])
        error = problem.ball.size * error + _EPSILON * lost
    dense = None if point.dense is None else partial(_motion_at, problem, point.dense)
    decimals = None
    if point.decimals is not None:
        assert isinstance(problem, VeselovaSO3)
        decimals = _decimals(problem, point.decimals)
    return Trajectory(problem, point.times, error, series, point.provenance, dense, decimals)


def _motion_at(
    problem: AreaBody | RollingBallN, dense: Callable[[Any], Trajectory], times: Any
) -> Trajectory:
    return motion_of_body(problem, dense(times))


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


def _decimals(problem: VeselovaSO3, point: Decimals) -> Decimals:
    """Return the decimals of a body with (Ω,γ) = 0; Ω and what follows from it are made when they
    are asked for.
    """
    pairs: dict[str, Pair | Callable[[], Pair]] = {
        "Omega": partial(_angular_velocity, point),
        "frame": lambda: (point.midpoints["frame"], point.radii["frame"]),
    }
    if isinstance(problem, RubberBall):
        pairs["position"] = partial(exact_position, problem, point, point.digits)
    return decimals_of_body(problem, pairs, point.digits, point.certified)


def decimals_of_body(
    problem: AreaBody,
    pairs: dict[str, Pair | Callable[[], Pair]],
    digits: int,
    certified: bool,
) -> Decimals:
    """Return the decimals of a body from those of its motion, by name; what follows from these is
    made when it is asked for.
    """
    middles = Later(pairs, 0)
    radii = Later(pairs, 1)
    for name in problem.derived:
        pairs[name] = partial(problem.derive_decimals, name, middles, radii, digits)
    ordered = {name: pairs[name] for name in problem.outputs}
    return Decimals(digits, certified, Later(ordered, 0), Later(ordered, 1), problem.bounded)


def exact_position(
    ball: RollingBall, point: Decimals, digits: int, plane: np.ndarray[Any, Any] | None = None
) -> Pair:
    """Return the contact point x(0) − a·displacement, its components along the rows of ``plane``,
    rationals, where there is one.
    """
    with working_digits(digits):
        moved = BallSeries(point.midpoints, point.radii)["displacement"]
        if plane is not None:
            moved = moved @ exact_as(moved, plane)
        start, radius = (exact_as(moved, x) for x in (ball.ball.contact, ball.ball.radius))
        return decimal_pair(start - radius * moved, digits + SHOWN_DIGITS)


def _angular_velocity(point: Decimals) -> Pair:
    with working_digits(point.digits):
        series = BallSeries(point.midpoints, point.radii)
        Omega = np.cross(series["q_dot"], series["frame"][:, :, 0])
        return decimal_pair(Omega, point.digits + SHOWN_DIGITS)
