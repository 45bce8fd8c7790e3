"""What an answer of the closed form is compared with: 20 digits, binary128, or integration."""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import Any

import numpy as np
from truth import true_motion

import veselova as vs
from generic_torus import fastest
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["against_truth", "time_unit"]

DIGITS = 20

#: Steps of an integration in binary128: half a minute at n = 8.
STEPS = 3000

#: Classes at which balls need longer than integration, and those of starts at which some integrator
#: would take hours.
FIRST_INTEGRATED = (
    "near a separatrix",
    "separatrix",
    "wide A's",
    "flat",
    "needle",
    "near a saddle",
    "near an unstable equilibrium",
)


def time_unit(problem: Problem) -> float:
    """Return the time of a radian of turning, or of two cycles of the fastest phase where that is
    shorter.
    """
    turning = min(1 / problem.turning, 1e200) if problem.turning > 0 else 1.0
    if not isinstance(problem, vs.Veselova):
        return turning
    return min(1 / float(np.max(np.abs(problem.q_dot))), 2 / fastest(problem))


def against_truth(name: str, found: vs.Trajectory, patience: int) -> tuple[Any, Any]:
    """Return the true error at each time, (N,), and what it may be; raises TimeoutError or Unsolved
    where none can be had.
    """
    problem, times = found.problem, found.times
    if isinstance(problem, TorusProblem) and problem.moves:
        frame = true_frame(name, problem, times, patience)
        off = np.max(np.abs(found.frame - frame), axis=(1, 2))
        if "X" in problem.bounded:
            q = frame[:, :, 0]
            X = problem.A * q / np.sqrt(np.sum(problem.A * q * q, axis=1))[:, None]
            off = np.maximum(off, np.max(np.abs(found.series("X") - X), axis=1))
        return off, found.error
    other = _within(2 * patience, lambda: vs.solve(problem, times, "numeric", "taylor"))
    gaps = [
        np.abs(found.series(series) - other.series(series)).reshape(times.size, -1).max(axis=1)
        for series in problem.bounded
    ]
    return np.max(gaps, axis=0), found.error + other.error


def true_frame(name: str, problem: TorusProblem, times: Any, patience: int) -> Any:
    """Return the frames in balls or in binary128, whichever can be had; raises Unsolved or
    TimeoutError where neither can.
    """
    ways: list[Callable[[], Any]] = [lambda: true_motion(problem, times, most_steps=STEPS)[0]]
    if isinstance(problem, vs.Veselova):
        ways.append(
            lambda: _within(patience, lambda: vs.solve(problem, times, digits=DIGITS).frame)
        )
        if name not in FIRST_INTEGRATED:
            ways.reverse()
    for way in ways[:-1]:
        try:
            return way()
        except (TimeoutError, vs.Unsolved):
            continue
    return ways[-1]()


def _within(seconds: int, call: Callable[[], Any]) -> Any:
    signal.signal(signal.SIGPROF, _give_up)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return call()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def _give_up(*_: object) -> None:
    raise TimeoutError
