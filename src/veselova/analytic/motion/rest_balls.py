"""A problem at rest in balls: the state that it keeps, to any number of digits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.body_frame_balls import BodyFrame
from veselova.analytic.attitude.frame_balls import frame_around
from veselova.analytic.motion.series_balls import States, series_of, to_all_directions
from veselova.analytic.spectrum.moving_part import moving_part
from veselova.analytic.spectrum.polynomials import zeros_of_position
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["resting_series"]


def resting_series(problem: TorusProblem, count: int, arithmetic: Any) -> Mapping[str, Values]:
    """Return the series of a problem at rest, by name, at ``count`` times; raises Unsolved where no
    frame can be known.

    Neumann's point rests where q is an eigenvector of A: so are the others, and the natural frame
    is one of axes. A body rests anywhere, and its natural frame is known in double precision only.
    """
    xp = arithmetic
    exact = problem.exact
    moving = moving_part(problem)
    q = xp.array(exact.q)
    q = q / xp.sqrt(np.sum(q * q))
    if exact.frame is not None:
        frame = frame_around(q, exact.frame, xp)
    elif problem.time == "tau1":
        body = BodyFrame(problem, moving, xp.array([1]), xp.array(np.zeros((1, 0))), xp)
        frame = np.column_stack([q, body.start])
    else:
        raise Unsolved(
            "at-rest",
            "nothing moves, and a resting body's natural frame is known in double precision only; "
            "give a frame, or ask for 15 digits, not certified",
        )
    points = (
        np.array(zeros_of_position([1 / a for a in moving.A], moving.q_squared))
        / xp.number(moving.unit)
        if moving.size > 1
        else xp.array(np.zeros(0))
    )
    frames, coordinates = (
        np.stack([x] * count)
        for x in (frame, to_all_directions(points[None], moving.frozen, xp)[0])
    )
    zeros = xp.array(np.zeros((count, problem.n)))
    return series_of(problem, States(zeros[:, 0], zeros, frames, coordinates), xp)
