"""The invariant torus of a motion, from its solution."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.curve.periods import Periods
from veselova.analytic.motion.area_solution import solution_of
from veselova.analytic.motion.orbit_period import close_orbit
from veselova.analytic.motion.torus_solution import Solution
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.drift import Drift
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.systems.torus_problem import TorusProblem, on_torus

__all__ = ["actions", "torus"]

Array = NDArray[np.float64]


def torus(given: Problem, solution: Solution | None = None) -> Torus:
    """Return the invariant torus on which a motion runs, and where it starts there; ``solution``:
    that of the problem on the torus.

    Directions that do not move belong to no torus: the curve is that of the moving part. Raises
    Unsolved at rest.
    Digits: periods and T to about 1e-15 relative, tested for n = 2…8.
    """
    problem = on_torus(given)
    solution = solution or solution_of(problem)
    curve = solution.curve
    moving = solution.moving
    root = solution.tau1_unit
    unit = float(moving.unit)
    g = curve.genus
    # With λ in units of the largest I, λ^{k−1}dλ/√R scales like I^{k−g−½}.
    with np.errstate(over="ignore", under="ignore"):
        periods = (
            _monomial_cycles(solution.periods)
            * np.exp(math.log(unit) * (g + 0.5 - np.arange(1, g + 1)))[:, None]
        )
    # The curve itself depends on ratios of A alone, and so does all that follows.
    in_range = bool(
        np.all(np.isfinite(periods))
        and np.all(np.any(np.abs(periods) >= np.finfo(float).tiny, axis=1))
    )
    known = 0 if problem.time == "tau1" else 1  # c_1 = 0 goes without saying
    constants = [float(c) / unit for c in solution.spectrum.constants[known:]] + [
        1 / float(a) for a in moving.frozen
    ]
    return Torus(
        n=problem.n,
        **{"energy": None, given.energy_name: problem.energy if problem.has_units else None},
        constants=np.sort(constants),
        branch_points=np.array(curve.branch_points) / unit,
        origins=tuple(
            f"{o.kind}{moving.axes[o.index] + 1 if o.kind == 'I' else o.index + 1}"
            for o in curve.origins
        ),
        periods=periods if in_range else None,
        actions=actions(solution.periods) / root,
        rotation_numbers=np.array(solution.in_time.rates / solution.in_time.rates[0]),
        signs=_signs(problem),
        riemann_matrix=np.array(solution.periods.riemann_matrix),
        riemann_matrix_residual=float(solution.periods.riemann_matrix_residual),
        frequencies_tau1=np.array(solution.in_tau1.rates) / root,
        frequencies_t=np.array(solution.in_time.rates),
        phases=np.mod(np.mod(solution.in_tau1.start, 1.0), 1.0),  # the first mod of −1e-20 is 1.0
        mean_rate=solution.mean_rate / root,
        regime=solution.regime,
        close_orbit=partial(close_orbit, problem),
        drift=_drift(given, solution),
    )


def _drift(given: Problem, solution: Solution) -> Drift | None:
    """Return how a ball drifts, where that takes about as long as the torus."""
    if "position" not in given.outputs or solution.separatrices:
        return None
    # Bodies need none of this, and a first torus is faster without it.
    from veselova.analytic.motion.mean_drift import MOST_PHASES, drift

    ball: Any = given
    return drift(ball, solution) if solution.curve.genus <= MOST_PHASES else None


def _signs(problem: TorusProblem) -> NDArray[np.int64]:
    """Return the sign of each q_i at the start, of q̇_i where q_i = 0, and 0 where the coordinate
    rests in its plane.
    """
    pairs = zip(problem.exact.q, problem.exact.tangent, strict=True)
    return np.array([(x > 0) - (x < 0) or (v > 0) - (v < 0) for x, v in pairs], dtype=np.int64)


def actions(periods: Periods) -> Array:
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
