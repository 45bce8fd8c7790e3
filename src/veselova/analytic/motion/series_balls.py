"""The series of a trajectory in ball arithmetic, under the names of each system, from the states of
what moves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["States", "series_of", "to_all_directions"]


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


def series_of(problem: TorusProblem, states: States, arithmetic: Any) -> Mapping[str, Values]:
    """Return the series of a problem by name, in the order of its outputs."""
    engine = {name: getattr(states, name) for name in ("tau1", "frame", "spheroconic")}
    if states.displacement is not None:
        engine["displacement"] = states.displacement
    stored = dict(problem.complete({"q_dot": states.velocity, **engine}))
    derived = {name: problem.derive(name, stored) for name in problem.derived if name != "X"}
    if "X" in problem.derived:
        derived["X"] = _position(problem.exact.A, states.frame[:, :, 0], arithmetic)
    return {name: {**stored, **derived}[name] for name in problem.outputs}


def _position(A: tuple[Fraction, ...], q: Values, arithmetic: Any) -> Values:
    """Return X = Aq/√(q,Aq), equation (Gauss, printed 7.5), (N, n)."""
    squares = arithmetic.array(A)
    return np.asarray(squares * q / arithmetic.sqrt(np.sum(squares * q * q, axis=1))[:, None])
