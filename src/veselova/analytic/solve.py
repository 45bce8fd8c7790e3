"""The analytic engine's answer."""

from __future__ import annotations

import time
from typing import Any

from veselova.analytic.error import estimated_error
from veselova.analytic.solution import METHODS, Solution
from veselova.mechanics.errors import InvalidInput, shown
from veselova.mechanics.times import validated_times
from veselova.mechanics.trajectory import Provenance, Trajectory
from veselova.mechanics.veselova import Veselova
from veselova.version import __version__

__all__ = ["METHODS", "solve"]


def solve(problem: Veselova, times: Any, *, method: str | None = None, clock: str | None = None) -> Trajectory:
    """Return the motion at the given times in closed form.

    ``method``: ``theta`` (every entry of the attitude a theta quotient) or ``angles`` (Abel–Jacobi inversion, then the
    algebraic frame); None takes the cheaper. ``clock``: ``fourier`` or ``panels``; None takes the cheaper. Any time costs the
    same with the Fourier clock. Raises InvalidInput for bad times or names, Unsolved outside the generic regime.
    Accuracy: see the trajectory's ``error``; about 1e-14 at t of order 10². Tested for n = 2…8, ratios of A up to 100.
    """
    grid = validated_times(times)
    for field, value, names in (("method", method, METHODS), ("clock", clock, ("fourier", "panels"))):
        if value is not None and value not in names:
            raise InvalidInput((field,), f"one of {', '.join(names)}", shown(value))
    began = time.perf_counter()
    return _evaluate(Solution(problem), grid, method, clock, began)


def _evaluate(solution: Solution, grid: Any, method: str | None, clock_name: str | None, began: float) -> Trajectory:
    route = method or solution.default_method()
    clock = solution.clock(grid, clock_name)
    tau1, z = clock.tau1(grid)
    states = solution.states(solution.attitude(z, route))
    error = estimated_error(solution, grid, tau1, clock, route)
    details = {
        "clock": clock.name,
        "clock_size": clock.size,
        "guard_digits": solution.is_guarded(grid),
        "quadrature_nodes": sum(solution.periods.node_count(cut) for cut in solution.periods.cuts),
        "theta_terms": solution.quotients.theta.size if route == "theta" else 0,
        "riemann_matrix_residual": solution.periods.riemann_matrix_residual,
    }
    provenance = Provenance("analytic", route, 15, __version__, time.perf_counter() - began, details)

    def again(times: Any) -> Trajectory:
        return _evaluate(solution, validated_times(times), method, clock_name, time.perf_counter())

    return Trajectory.of_principal(solution.problem, grid, (tau1, *states), error, provenance, dense=again)
