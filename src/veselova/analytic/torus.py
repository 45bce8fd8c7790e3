"""The invariant torus of a motion, from its solution."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.periods import Periods
from veselova.analytic.solution import Solution
from veselova.mechanics.torus import Torus
from veselova.mechanics.veselova import Veselova

__all__ = ["torus"]

Array = NDArray[np.float64]


def torus(problem: Veselova) -> Torus:
    """Return the invariant torus on which a motion runs, and where it starts there.

    Raises Unsolved outside the generic regime. Digits: periods and T to about 1e-15 relative, tested for n = 2…8.
    """
    solution = Solution(problem)
    curve = solution.curve
    names = [
        f"I{solution.spectrum.order[origin.index] + 1}" if origin.kind == "I" else f"c{origin.index + 1}"
        for origin in curve.origins
    ]
    return Torus(
        n=problem.n,
        energy=problem.energy,
        constants=np.array([float(c) for c in solution.spectrum.constants[1:]]),
        branch_points=np.array(curve.branch_points),
        origins=tuple(names),
        periods=_monomial_cycles(solution.periods),
        riemann_matrix=np.array(solution.periods.riemann_matrix),
        riemann_matrix_residual=solution.periods.riemann_matrix_residual,
        frequencies_tau1=np.array(solution.in_tau1.rates),
        frequencies_t=np.array(solution.in_time.rates),
        phases=np.mod(solution.in_tau1.start, 1.0),
        mean_rate=solution.mean_rate,
        regime="generic",
    )


def _monomial_cycles(periods: Periods) -> Array:
    """Return a in the basis λ^{k−1}dλ/(2√|R|): the nodal form p_g divided by its polynomial, which has no zero on a cut."""
    g, columns = periods.genus, []
    zeros = periods.curve.midpoints[0]
    for s, cut in enumerate(periods.cuts):
        psi = cut.nodes(periods.node_count(cut))
        _, _, below, above = cut.distances(psi)
        point = periods.curve.branch_points[2 * s + 1] + below
        density = cut.forms(below, above)[g - 1] / np.prod(point[:, None] - zeros, axis=1)
        columns.append((-1) ** (g - s - 1) * 2 * np.pi * np.mean(point ** np.arange(g)[:, None] * density, axis=1))
    return np.stack(columns, axis=1)
