"""One motion by compiled loops, where these were asked for and serve its kind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.compiled.compiler import ready
from veselova.analytic.motion.ensemble import States, states_of_starts
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova import Veselova
from veselova.tunings import COMPILED_TIMES

__all__ = ["compiled_motion"]

Array = NDArray[np.float64]


def compiled_motion(problem: TorusProblem, grid: TimeGrid) -> States | None:
    """Return the states of a Veselova problem whose data are doubles, along the body axes; None
    where compiled loops were not asked for or do not serve.
    """
    if not ready() or not isinstance(problem, Veselova) or problem.axes is not None:
        return None
    if problem.n > 3 or grid.doubles.size > COMPILED_TIMES:
        return None
    exact = problem.exact
    data = [*exact.A, *exact.q, *exact.q_dot]
    doubles = [float(x) for x in data]
    if any(
        x.as_integer_ratio() != y.as_integer_ratio() for x, y in zip(doubles, data, strict=True)
    ):
        return None
    A, q, q_dot = np.array(doubles).reshape(3, 1, -1)
    frames = None if exact.natural else problem.frame[None]
    return next(states_of_starts(A, q, q_dot, grid, frames), None)
