"""The invariant torus of a motion, from its solution."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.periods import Periods
from veselova.analytic.solution import Solution
from veselova.mechanics.errors import Unsolved
from veselova.mechanics.torus import Torus
from veselova.mechanics.veselova import Veselova

__all__ = ["torus"]

Array = NDArray[np.float64]


def torus(problem: Veselova) -> Torus:
    """Return the invariant torus on which a motion runs, and where it starts there.

    Directions that do not move belong to no torus: the curve is that of the moving part. Raises Unsolved at rest, and where
    periods leave the range of a float. Digits: periods and T to about 1e-15 relative, tested for n = 2…8.
    """
    solution = Solution(problem)
    curve, moving, root = solution.curve, solution.moving, solution.tau1_unit
    unit = float(moving.unit)
    g = curve.genus
    # With λ in units of the largest I, λ^{k−1}dλ/√R scales like I^{k−g−½}.
    with np.errstate(over="ignore", under="ignore"):
        periods = _monomial_cycles(solution.periods) * np.exp(math.log(unit) * (g + 0.5 - np.arange(1, g + 1)))[:, None]
    if not (np.all(np.isfinite(periods)) and np.all(np.any(periods != 0, axis=1))):
        raise Unsolved(
            "beyond-floats", "periods of λ^k dλ/√R leave the range of a float at this scale of A; only ratios of A matter"
        )
    constants = [float(c) / unit for c in solution.spectrum.constants[1:]] + [1 / float(a) for a in moving.frozen]
    return Torus(
        n=problem.n,
        energy=problem.energy,
        constants=np.sort(constants),
        branch_points=np.array(curve.branch_points) / unit,
        origins=tuple(f"{o.kind}{moving.axes[o.index] + 1 if o.kind == 'I' else o.index + 1}" for o in curve.origins),
        periods=periods,
        riemann_matrix=np.array(solution.periods.riemann_matrix),
        riemann_matrix_residual=solution.periods.riemann_matrix_residual,
        frequencies_tau1=np.array(solution.in_tau1.rates) / root,
        frequencies_t=np.array(solution.in_time.rates),
        phases=np.mod(np.mod(solution.in_tau1.start, 1.0), 1.0),  # the first mod of −1e-20 is 1.0
        mean_rate=solution.mean_rate / root,
        regime=solution.regime,
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
