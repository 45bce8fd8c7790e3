"""The invariant torus of a motion, with the drift of a ball."""

from __future__ import annotations

from typing import Any

from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.torus import torus_motion, torus_of
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.drift import Drift
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.systems.torus_problem import on_torus

__all__ = ["torus"]


def torus(given: Problem) -> Torus:
    """Return the invariant torus on which a motion runs, and where it starts there. Raises Unsolved
    at rest.
    """
    problem = on_torus(given)
    motion = torus_motion(problem)
    return torus_of(given, motion, None if motion.on_separatrix else _drift(given, motion))


def _drift(given: Problem, motion: KernelMotion) -> Drift | None:
    """Return how a ball drifts, where that takes about as long as the torus."""
    if "position" not in given.outputs:
        return None
    # Bodies need none of this, and a first torus is faster without it.
    from veselova.analytic.closed.mean_drift import MOST_PHASES, drift

    ball: Any = given
    return drift(ball, motion) if motion.genus <= MOST_PHASES else None
