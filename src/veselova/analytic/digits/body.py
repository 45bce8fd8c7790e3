"""Bodies and balls in space to more digits than a double has, from the motion of the problem on
whose torus they move.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from veselova.analytic.closed.bodies import AreaBody
from veselova.mechanics.core.decimals import Decimals, Later
from veselova.mechanics.core.enclosures import (
    SHOWN_DIGITS,
    BallSeries,
    Objects,
    Pair,
    decimal_pair,
    exact_as,
    working_digits,
)
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.area_start import exact_start
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.rolling_ball import RollingBall

__all__ = ["FURTHER", "body_with_digits"]

#: Calibrated: digits beyond those asked for that the frame of a torus with an area constant has:
#: the constant rotation to the frame of the body adds three errors.
FURTHER = 1


def body_with_digits(problem: AreaBody, point: Trajectory) -> Trajectory:
    """Return the motion of the body whose problem on the torus moves along a trajectory with
    decimals; Ω and what follows from it are made when they are asked for.

    Both frames are the same where (Ω,γ) = 0. Else E(t) = [v u −n](t) [v u −n](0)ᵀ E(0), and Ω =
    B(K + σγ) with K fixed in space.
    """
    torus, known = point.problem, point.decimals
    assert known is not None
    digits, plane = known.digits, None
    pairs: dict[str, Pair | Callable[[], Pair]] = {
        "Omega": partial(_crossed, known),
        "frame": lambda: (known.midpoints["frame"], known.radii["frame"]),
    }
    if isinstance(torus, AreaVeselova):
        digits -= FURTHER
        start = exact_start(problem, digits)
        at_start = np.array(start.frame, dtype=object)
        with working_digits(digits):
            frame = BallSeries(known.midpoints, known.radii)["frame"]
            frame = frame @ exact_as(frame, np.array(torus.columns, dtype=object) @ at_start)
        plane = -(np.array(torus.plane, dtype=object) @ at_start[:, 1:])
        pairs["Omega"] = partial(_angular_velocity, problem, start.momentum, frame, digits)
        pairs["frame"] = partial(decimal_pair, frame, digits + SHOWN_DIGITS)
    if isinstance(problem, RollingBall):
        pairs["position"] = partial(_position, problem, known, digits, plane)
    middles, radii = Later(pairs, 0), Later(pairs, 1)
    for name in problem.derived:
        pairs[name] = partial(problem.derive_decimals, name, middles, radii, digits)
    ordered = {name: pairs[name] for name in problem.outputs}
    sides = Later(ordered, 0), Later(ordered, 1)
    decimals = Decimals(digits, known.certified, *sides, problem.bounded)
    arrays = {name: decimals.midpoints[name].astype(np.float64) for name in problem.stored}
    error = np.nextafter(decimals.error.astype(np.float64), np.inf) + problem.rounding(arrays)
    provenance = replace(point.provenance, digits=digits)
    dense = None if point.dense is None else partial(_at, problem, point.dense)
    return Trajectory(problem, point.times, error, arrays, provenance, dense, decimals)


def _at(problem: AreaBody, dense: Callable[[Any], Trajectory], times: Any) -> Trajectory:
    return body_with_digits(problem, dense(times))


def _crossed(point: Decimals) -> Pair:
    """Return Ω = γ̇×γ."""
    with working_digits(point.digits):
        series = BallSeries(point.midpoints, point.radii)
        Omega = np.cross(series["q_dot"], series["frame"][:, :, 0])
        return decimal_pair(Omega, point.digits + SHOWN_DIGITS)


def _angular_velocity(
    problem: AreaBody, momentum: tuple[Fraction, ...], frame: Any, digits: int
) -> Pair:
    """Return Ω = B(K + σγ), σ = (c − (BK,γ))/(Bγ,γ), or D(BK,γ)/(1 − D(Bγ,γ))."""
    along, *across_gamma = momentum
    added, gamma = problem.added, frame[:, :, 0]
    # (Ω,γ), which exceeds the others in small bodies, has no part in BK
    momentum = (Fraction(0) if added is None else along, *across_gamma)
    with working_digits(digits):
        free = problem.velocity_of(frame @ exact_as(frame, momentum))
        across = problem.velocity_of(gamma)
        if added is None:
            share = exact_as(frame, along) - np.sum(free * gamma, axis=1)
            share = share / np.sum(across * gamma, axis=1)
        else:
            # 1 − D(Bγ,γ) = (Bγ,Iγ), without cancellation
            inertia = [moment - added for moment in problem.moments]
            share = exact_as(frame, added) * np.sum(free * gamma, axis=1)
            share = share / np.sum(across * (exact_as(gamma, inertia) * gamma), axis=1)
        return decimal_pair(free + share[:, None] * across, digits + SHOWN_DIGITS)


def _position(ball: RollingBall, point: Decimals, digits: int, plane: Objects | None) -> Pair:
    """Return the contact point x(0) − a·displacement, its components along the rows of ``plane``,
    rationals, where there is one.
    """
    with working_digits(digits):
        moved = BallSeries(point.midpoints, point.radii)["displacement"]
        if plane is not None:
            moved = moved @ exact_as(moved, plane)
        start, radius = (exact_as(moved, x) for x in (ball.ball.contact, ball.ball.radius))
        return decimal_pair(start - radius * moved, digits + SHOWN_DIGITS)
