"""The analytic engine's answer."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.by_theta import ByTheta
from veselova.analytic.closed.motion import KernelMotion, kernel_motion
from veselova.analytic.motion.area_motion import AreaBody, largest_component, motion_with_area
from veselova.analytic.motion.area_solution import solution_of
from veselova.analytic.motion.ball_n_motion import motion_of_ball_n
from veselova.analytic.motion.base import Motion
from veselova.analytic.motion.evaluator import METHODS, Evaluator
from veselova.analytic.motion.precision_limits import (
    needs_doubles,
    require_digits,
    require_exact_axes,
)
from veselova.analytic.motion.rank_one_so3 import motion_of_body
from veselova.analytic.motion.separatrix import DepartureBound
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.separable.body_motion import BodyMotion
from veselova.analytic.separable.point_motion import PointMotion
from veselova.mechanics.core.decimals import FEWEST_DIGITS, beyond_double
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.names import require_name
from veselova.mechanics.core.problem import NO_DIGIT, Series
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

#: How far the neighbours of a start on a separatrix are from it, relative to one coordinate: a few
#: roundings of the data.
_DATA_ROUNDING = Fraction(1, 2**50)

#: The series that states are, along the principal axes; the last may be left to the problem. A
#: displacement follows them.
_SERIES = ("tau1", "q_dot", "frame", "spheroconic")


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
    the error is that of starts a rounding away, and grows like e^(rate·t).
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
            on_torus = _TorusMotion(problem.on_torus(), method, time_map)
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
        return _TorusMotion(problem, method, time_map).evaluate(grid)
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
    on_torus = _TorusMotion(problem.on_torus(), method, time_map)
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


@dataclass(frozen=True)
class _TorusMotion(Motion[TorusProblem]):
    method: str | None
    time_map: str | None

    def evaluate(self, grid: TimeGrid) -> Trajectory:
        """Return the trajectory at validated times: by the kernel, where it serves."""
        began = time.perf_counter()
        kernel = self._kernel
        found = None if kernel is None else kernel.at(grid, self.time_map, self._by_theta)
        if found is None:
            return super().evaluate(grid)
        series, error, details = found
        series = self.problem.complete(series)
        if self._by_theta is not None:
            details["theta_terms"] = self._by_theta.terms
        provenance = Provenance.since(began, "analytic", self.method or "angles", details)
        return Trajectory.on_grid(self.problem, grid, error, series, provenance, self)

    @cached_property
    def _kernel(self) -> KernelMotion | None:
        """Return the motion by the kernel, None where it does not serve."""
        return kernel_motion(self.problem)

    @cached_property
    def _by_theta(self) -> ByTheta | None:
        """Return what makes states by theta functions of those by angles, None where angles are
        the method.
        """
        return ByTheta(self._kernel) if self.method == "theta" and self._kernel else None

    @cached_property
    def _solution(self) -> Solution:
        return solution_of(self.problem)

    def _require_motion(self) -> None:
        _ = self._solution

    @cached_property
    def _evaluator(self) -> Evaluator:
        return Evaluator(self._solution, self.method)

    @cached_property
    def _departure(self) -> DepartureBound | None:
        """Return how far starts a rounding away part from the motion, where it is on
        a separatrix.
        """
        if not self._solution.separatrices:
            return None
        neighbours = (
            Evaluator(solution_of(self.problem, sign * _DATA_ROUNDING), self._evaluator.method)
            for sign in (1, -1)
        )
        evaluators = (self._evaluator, *neighbours)
        return DepartureBound(
            partial(_with_neighbours, evaluators, self.time_map),
            2 * float(_DATA_ROUNDING),  # an axis is lifted by twice as much on one side
            self.problem.turning,
            NO_DIGIT,
        )

    @property
    def _cause(self) -> str:
        """Return why no digit is left, and what answers."""
        if self._departure is None:
            return "the data determine no digit there"
        further = (
            "; ask for more digits, which come from the exact data"
            if self.problem.axes is None and not (self._evaluator.rolls and self.problem.n > 3)
            else ""
        )
        return f"on a separatrix the data determine the motion, and doubles do not{further}"

    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        evaluator = self._evaluator
        plan = evaluator.plan(grid, self.time_map)
        along, error = evaluator.evaluate(plan, plan.make_time_map(evaluator.solution))
        if self._departure is not None:
            apart, on_the_way = self._departure.at(grid.doubles)
            apart = self.problem.bound({"frame": along.series[1]}, apart)
            error = np.maximum(error, on_the_way) + apart
        sizes = _lengths(along.series[-1]) if evaluator.rolls else 1.0
        self.problem.require_digit(grid.doubles, error / sizes, self._cause)
        solution = evaluator.solution
        details = {
            "regime": solution.regime,
            "time_map": plan.time_map,
            "time_map_size": along.time_map.size,
            "time_map_estimates": dict(plan.estimates),
            "guard_digits": plan.is_guarded,
            "quadrature_nodes": solution.periods.quadrature_nodes,
            "theta_terms": evaluator.terms,
        }
        states = (np.multiply(along.tau1, solution.tau1_unit, out=along.tau1), *along.series)
        last = ("displacement",) if evaluator.rolls else ()
        names = (*_SERIES[: len(states) - len(last)], *last)
        return (
            self.problem.complete(dict(zip(names, states, strict=True))),
            error,
            evaluator.method,
            details,
        )


def _with_neighbours(
    evaluators: Sequence[Evaluator], time_map: str | None, instants: Array
) -> tuple[list[Array], Array]:
    """Return the frames of a motion and its neighbours at increasing times, below them the
    displacements of a ball, and the error of the first, by its sensitivities at these times.
    """
    grid = TimeGrid.of(instants)
    local = [instants.size, *(0 for _ in evaluators[1:])]
    found = []
    for evaluator, most_local in zip(evaluators, local, strict=True):
        plan = evaluator.plan(grid, time_map)
        made = plan.make_time_map(evaluator.solution)
        found.append(evaluator.evaluate(plan, made, most_local))
    frames = [samples.series[1] for samples, _ in found]
    if evaluators[0].rolls:
        for k, (samples, _) in enumerate(found):
            row = np.zeros((instants.size, 1, frames[k].shape[2]))
            row[:, 0, 1:] = samples.series[-1]
            frames[k] = np.concatenate([frames[k], row], axis=1)
    return frames, found[0][1]


def _lengths(displacement: Array) -> Array:
    """Return the largest component at each time, at least one."""
    return np.asarray(np.maximum(1.0, largest_component(displacement)))
