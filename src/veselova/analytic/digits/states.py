"""The series of a trajectory in ball arithmetic, under the names of each system, from the states of
what moves, or of a problem at rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.digits.frame import BodyFrame, frame_around
from veselova.analytic.spectrum.moving_part import moving_part
from veselova.analytic.spectrum.polynomials import zeros_of_position
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["States", "resting_series", "series_of", "to_all_directions"]


@dataclass(frozen=True)
class States:
    """States along the principal axes, in units of the problem.

    - tau1: (N,)
    - velocity: (N, n): dq/d(time) in the problem's own time
    - frame: (N, n, n)
    - spheroconic: (N, n−1)
    - displacement: (N, n−1) of a rolling ball, else None
    """

    tau1: Values
    velocity: Values
    frame: Values
    spheroconic: Values
    displacement: Values | None = None


def to_all_directions(points: Values, frozen: tuple[Fraction, ...], arithmetic: Any) -> Values:
    """Return the λ's of all directions, (N, n−1), increasing, from those of the directions that
    move, (N, m−1).
    """
    resting = np.tile(arithmetic.array([1 / a for a in frozen]), (len(points), 1))
    coordinates = np.concatenate([points, resting], axis=1)
    order = np.argsort(coordinates.astype(float), axis=1, kind="stable")
    return np.asarray(np.take_along_axis(coordinates, order, axis=1))


def series_of(problem: TorusProblem, states: States) -> Mapping[str, Values]:
    """Return the series of a problem by name, in the order of its outputs."""
    engine = {name: getattr(states, name) for name in ("tau1", "frame", "spheroconic")}
    if states.displacement is not None:
        engine["displacement"] = states.displacement
    series = dict(problem.complete({"q_dot": states.velocity, **engine}))
    for name in problem.derived:
        series[name] = problem.derive(name, series)
    return {name: series[name] for name in problem.outputs}


def resting_series(problem: TorusProblem, count: int, arithmetic: Any) -> Mapping[str, Values]:
    """Return the series of a problem at rest, by name, at ``count`` times; raises Unsolved where no
    frame can be known.

    Neumann's point rests where q is an eigenvector of A: so are the others, and the natural frame
    is one of axes. A body rests anywhere, and its natural frame is known in double precision only.
    """
    xp, exact, moving = arithmetic, problem.exact, moving_part(problem)
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
    points = xp.array(np.zeros((1, 0)))
    if moving.size > 1:
        found = np.array(zeros_of_position([1 / a for a in moving.A], moving.q_squared))
        points = found[None] / xp.number(moving.unit)
    points = np.repeat(to_all_directions(points, moving.frozen, xp), count, axis=0)
    zeros = xp.array(np.zeros((count, problem.n)))
    frames = np.repeat(frame[None], count, axis=0)
    return series_of(problem, States(zeros[:, 0], zeros, frames, points))
