"""One motion by compiled loops, where these were asked for and serve its kind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.compiled.compiler import ready
from veselova.analytic.motion.ensemble import LIMITS, MOST_COMPILED, REACH
from veselova.analytic.motion.ensemble_compiled import motion_compiled
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova import Veselova
from veselova.tunings import COMPILED_TIMES

__all__ = ["compiled_motion"]

Array = NDArray[np.float64]


def compiled_motion(problem: TorusProblem, grid: TimeGrid) -> tuple[Series, Array] | None:
    """Return the series of a Veselova problem whose data are doubles, along the body axes, and
    their error; None where compiled loops were not asked for or do not serve.
    """
    if not ready() or not isinstance(problem, Veselova) or problem.axes is not None:
        return None
    if problem.n > MOST_COMPILED or grid.doubles.size > COMPILED_TIMES:
        return None
    start = _in_doubles(problem)
    if start is None:
        return None
    frame = None if problem.exact.natural else problem.frame
    found = motion_compiled(start, frame, grid, REACH, LIMITS)
    if found is None:
        return None
    series = {"tau1": found.tau1[0], "q_dot": found.q_dot[0], "frame": found.frame[0]}
    return series, found.error[0]


def _in_doubles(problem: Veselova) -> Array | None:
    """Return A, q and q̇, (3, n), None where they are no doubles."""
    exact = problem.exact
    doubles = []
    for number in (*exact.A, *exact.q, *exact.q_dot):
        ratio = number.as_integer_ratio()
        double = ratio[0] / ratio[1]
        if double.as_integer_ratio() != ratio:
            return None
        doubles.append(double)
    return np.array(doubles).reshape(3, -1)
