"""The analytic engine's answer."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.motion.area_motion import AreaBody, motion_with_area
from veselova.analytic.motion.ball_n_motion import motion_of_ball_n
from veselova.analytic.motion.precision_limits import (
    needs_doubles,
    require_digits,
    require_exact_axes,
)
from veselova.analytic.motion.rank_one_so3 import motion_of_body
from veselova.analytic.motion.torus_motion import TorusMotion
from veselova.analytic.separable.body_motion import BodyMotion
from veselova.analytic.separable.point_motion import PointMotion
from veselova.mechanics.core.decimals import FEWEST_DIGITS, beyond_double
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.names import require_name
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.separable_veselova import SeparableVeselova
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["METHODS", "solve"]

Array = NDArray[np.float64]

#: The routes from phases to the attitude.
METHODS = ("theta", "angles")


def solve(
    problem: TorusProblem | AreaBody | RollingBallN | SeparableVeselova,
    times: Any,
    *,
    method: str | None = None,
    time_map: str | None = None,
    digits: int = FEWEST_DIGITS,
    certified: bool = False,
    clock: str | None = None,
) -> Trajectory:
    """Return the motion at the given times in closed form.

    ``method``: ``theta`` (every entry of the attitude a theta quotient) or ``angles`` (Abel–Jacobi
    inversion, then the algebraic frame); None takes the cheaper.
    ``time_map``: ``fourier`` or ``panels``; None takes the cheaper. Any time costs the same by
    ``fourier``. ``clock`` is its name in version 0.1.
    Every start is served: equal A's, frozen directions, coinciding constants, rest. On a separatrix
    the start is moved by 1e-60, and the error grows like e^(rate·t) from there.
    ``digits`` > 15, or ``certified``: in ball arithmetic, data taken exactly; see
    Trajectory.decimals.
    Raises InvalidInput for bad times or names, Unsolved where a time is too far or the data leave
    no digit of the answer.
    ``error`` bounds the true error of every component of the bounded series at each time:
    true ≤ error. The true error is about 1e-14 at t of order 10².
    """
    began = time.perf_counter()
    grid = TimeGrid.of(times, beyond_double(digits, certified))
    time_map = time_map or clock
    for field, value, names in (
        ("method", method, METHODS),
        ("time_map", time_map, ("fourier", "panels")),
    ):
        if value is not None:
            require_name(value, (field,), names)
    if isinstance(problem, RollingBallN):
        return _motion_of_ball_n(problem, grid, method, time_map, digits, certified)
    if isinstance(problem, ChaplyginBall) or (
        isinstance(problem, VeselovaSO3) and problem.has_area_constant
    ):
        if beyond_double(digits, certified):
            require_digits(problem, digits, certified)
            _require_options(method, time_map, digits, certified)
            from veselova.analytic.motion.area_digits import AreaMotionInBalls

            return AreaMotionInBalls(problem, digits, method)(grid)
        if problem.moves:
            on_torus = TorusMotion(problem.on_torus(), method, time_map)
            return motion_with_area(problem, on_torus.evaluate(grid))
        provenance = Provenance.since(began, "analytic", "rest", {"regime": "rest"})
        return Trajectory.at_rest(problem, grid, provenance, partial(solve, problem))
    if isinstance(problem, VeselovaSO3) and problem.has_torus:
        require_exact_axes(problem, digits, certified)
        options: Any = {
            "method": method,
            "time_map": time_map,
            "digits": digits,
            "certified": certified,
        }
        point = problem.rank_one() if beyond_double(digits, certified) else problem.on_torus()
        return motion_of_body(problem, solve(point, grid, **options))
    if isinstance(problem, (VeselovaSO3, SeparableVeselova)):
        if beyond_double(digits, certified):
            raise needs_doubles(digits, f"system {problem.system} with a potential")
        return _separable_motion(problem, grid, method, time_map)
    if not beyond_double(digits, certified):
        return TorusMotion(problem, method, time_map).evaluate(grid)
    _require_options(method, time_map, digits, certified)
    from veselova.analytic.motion.motion_balls import MotionInBalls

    return MotionInBalls(problem, digits, certified, method)(grid)


def _motion_of_ball_n(
    problem: RollingBallN,
    grid: TimeGrid,
    method: str | None,
    time_map: str | None,
    digits: int,
    certified: bool,
) -> Trajectory:
    """Return the motion of a ball in ℝⁿ."""
    if beyond_double(digits, certified):
        further = "" if problem.twists else ": the attitude alone has more, system veselova"
        raise needs_doubles(digits, f"the contact point{further}")
    if not problem.moves:
        provenance = Provenance.since(time.perf_counter(), "analytic", "rest", {"regime": "rest"})
        return Trajectory.at_rest(problem, grid, provenance, partial(solve, problem))
    on_torus = TorusMotion(problem.on_torus(), method, time_map)
    return motion_of_ball_n(problem, on_torus.evaluate(grid))


def _require_options(
    method: str | None, time_map: str | None, digits: int, certified: bool
) -> None:
    """Raise InvalidInput for a method or time map that answers in balls do not have."""
    served = ("angles",) if certified else ("theta", "angles")
    if method is not None and method not in served:
        precision = "errors are certified" if certified else f"digits > {FEWEST_DIGITS}"
        raise InvalidInput(("method",), f"{' or '.join(served)}, where {precision}", show(method))
    if time_map is not None:
        raise InvalidInput(
            ("time_map",),
            f"none, where digits > {FEWEST_DIGITS} or errors are certified",
            show(time_map),
        )


def _separable_motion(
    problem: VeselovaSO3 | SeparableVeselova,
    grid: TimeGrid,
    method: str | None,
    time_map: str | None,
) -> Trajectory:
    """Return the motion in a separable potential; it has one method and no choice of time maps."""
    for field, given, allowed in (
        ("method", method, (None, "angles")),
        ("time_map", time_map, (None,)),
    ):
        if given not in allowed:
            required = {"method": "angles", "time_map": "none"}[field]
            raise InvalidInput((field,), f"{required} for system {problem.system}", show(given))
    return (
        BodyMotion(problem) if isinstance(problem, VeselovaSO3) else PointMotion(problem)
    ).evaluate(grid)
