"""The invariant torus of a motion: by the kernel, or from its solution where that serves not."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.torus import TorusParts, parts_of, torus_motion, torus_of
from veselova.analytic.curve.periods import Periods
from veselova.analytic.motion.area_solution import solution_of
from veselova.analytic.motion.orbit_period import close_orbit
from veselova.analytic.motion.torus_solution import Solution
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.drift import Drift
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.systems.torus_problem import on_torus

__all__ = ["torus"]

Array = NDArray[np.float64]


def torus(given: Problem) -> Torus:
    """Return the invariant torus on which a motion runs, and where it starts there. Raises Unsolved
    at rest.
    """
    problem = on_torus(given)
    motion, opened = torus_motion(problem)
    if motion is not None:
        drift = None if opened else _drift(given, None, motion.genus)
        return torus_of(given, problem, parts_of(motion, opened), drift)
    solution = solution_of(problem)
    drift = None if solution.separatrices else _drift(given, solution, solution.curve.genus)
    return torus_of(given, problem, _parts_of_solution(solution), drift)


def _parts_of_solution(solution: Solution) -> TorusParts:
    curve, periods = solution.curve, solution.periods
    return TorusParts(
        solution.moving,
        solution.regime,
        np.array(curve.branch_points),
        tuple((o.kind, o.index) for o in curve.origins),
        np.array([float(c) for c in solution.spectrum.constants]),
        _monomial_cycles(periods),
        _actions(periods),
        np.array(periods.riemann_matrix),
        float(periods.riemann_matrix_residual),
        solution.in_tau1.rates,
        solution.in_tau1.start,
        solution.mean_rate,
        partial(close_orbit, solution.problem),
    )


def _drift(given: Problem, solution: Solution | None, genus: int) -> Drift | None:
    """Return how a ball drifts, where that takes about as long as the torus."""
    if "position" not in given.outputs:
        return None
    # Bodies need none of this, and a first torus is faster without it.
    from veselova.analytic.motion.mean_drift import MOST_PHASES, drift

    ball: Any = given
    return drift(ball, solution) if genus <= MOST_PHASES else None


def _actions(periods: Periods) -> Array:
    """Return J_s = (1/2π)∮ p_s dλ_s over cut s, p_s = ½√|λ Π(λ−c_k)/Π(λ−I_i)|, the momentum to λ_s
    of the metric |dq|².

    With p_s dλ = |Π(λ−c_k)| dλ/(2√|R|), c_1 = 0 included, it is a mean over the angle of the cut.
    """
    curve = periods.curve
    found = []
    places = curve.layout("c").places
    for cuts in periods.blocks_of_cuts:
        psi = periods.arithmetic.nodes(periods.node_count(cuts))
        below, above = cuts.distances(psi)
        to_constants = cuts.to_branch_points(below, above)[..., places, :]
        common, of_gaps = cuts.measure(below, above)
        densities = (
            common * to_constants[..., 0, :] * np.prod(to_constants[..., 1:, :] / of_gaps, axis=-2)
        )
        found.append(np.mean(densities, axis=-1).reshape(*curve.branch_points.shape[:-1], -1))
    return np.concatenate(found, axis=-1)


def _monomial_cycles(periods: Periods) -> Array:
    """Return a in the basis λ^{k−1}dλ/(2√|R|)."""
    g = periods.genus
    rows = list[Array]()
    lower_ends = periods.curve.branch_points[1::2, None]
    for cuts in periods.blocks_of_cuts:
        below, above = cuts.distances(periods.arithmetic.nodes(periods.node_count(cuts)))
        point = lower_ends[len(rows) : len(rows) + len(below)] + below
        common, of_gaps = cuts.measure(below, above)
        density = common / np.prod(of_gaps, axis=-2)
        rows += list(
            2 * np.pi * np.mean(point[:, None] ** np.arange(g)[:, None] * density[:, None], axis=-1)
        )
    return np.stack([(-1) ** (g - s - 1) * row for s, row in enumerate(rows)], axis=1)
