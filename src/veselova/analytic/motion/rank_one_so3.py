"""The Veselova system on T SO(3) without potential, (Ω,γ) = 0, in closed form: the rank-one problem
with A = 𝓘⁻¹.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from veselova.analytic.motion.area_motion import largest_component, roll
from veselova.mechanics.core.decimals import Decimals, Later
from veselova.mechanics.core.enclosures import (
    SHOWN_DIGITS,
    BallSeries,
    Pair,
    decimal_pair,
    exact_as,
    working_digits,
)
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["exact_position", "motion_of_body"]


def motion_of_body(problem: VeselovaSO3, point: Trajectory) -> Trajectory:
    """Return the motion of the body whose rank-one problem moves along a trajectory: the same
    frame, and Ω = γ̇×γ.
    """
    frame = point.series("frame")
    series = {"Omega": np.cross(point.series("q_dot"), frame[:, :, 0]), "frame": frame}
    error = point.error
    if isinstance(problem, RubberBall):
        rolled = roll(problem, problem.on_torus(), point.series("displacement"))
        series["position"] = problem.start["position"] + rolled
        # the product with the radius, and the sum
        lost = np.finfo(float).eps * largest_component(rolled)
        lost += np.finfo(float).eps * largest_component(series["position"])
        error = problem.ball.size * error + lost
    dense = None if point.dense is None else partial(_motion_at, problem, point.dense)
    decimals = None if point.decimals is None else _decimals(problem, point.decimals)
    return Trajectory(
        problem,
        point.times,
        error,
        series,
        point.provenance,
        dense,
        decimals,
    )


def _motion_at(problem: VeselovaSO3, dense: Callable[[Any], Trajectory], times: Any) -> Trajectory:
    return motion_of_body(problem, dense(times))


def _decimals(problem: VeselovaSO3, point: Decimals) -> Decimals:
    """Return the decimals of the body; Ω and what follows from it are made when they
    are asked for.
    """
    pairs: dict[str, Pair | Callable[[], Pair]] = {
        "Omega": partial(_angular_velocity, point),
        "frame": lambda: (point.midpoints["frame"], point.radii["frame"]),
    }
    if isinstance(problem, RubberBall):
        pairs["position"] = partial(exact_position, problem, point, point.digits)
    middles = Later(pairs, 0)
    radii = Later(pairs, 1)
    for name in problem.derived:
        pairs[name] = partial(problem.derive_decimals, name, middles, radii, point.digits)
    ordered = {name: pairs[name] for name in problem.outputs}
    return Decimals(
        point.digits, point.certified, Later(ordered, 0), Later(ordered, 1), problem.bounded
    )


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
