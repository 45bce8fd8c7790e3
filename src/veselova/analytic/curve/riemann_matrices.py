"""The Riemann matrices of many hyperelliptic curves with real branch points."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.curve_values import CurveValues
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.mechanics.core.arguments import takes_arrays
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.curve_arguments import curve_rows
from veselova.mechanics.core.errors import Faults
from veselova.mechanics.results.curve import RiemannMatrices

__all__ = ["riemann_matrices"]


@takes_arrays
def riemann_matrices(branch_points: ArrayLike, sign: int = -1) -> RiemannMatrices:
    """Return the Riemann matrices ``tau`` (N, g, g) of many curves w² = sign·Π(λ−b_j), and bounds
    ``error`` (N,) of the errors of their entries: what ``RealHyperelliptic`` gives for each row.

    branch_points: (N, 2g+1) or (N, 2g+2) doubles, exact as they stand, in any order in each row,
    g = 1 … 16. Raises InvalidInput, with all faults, for rows that are no such curves.
    """
    rows, sign = curve_rows(branch_points, sign)
    genus = (rows.shape[1] - 1) // 2
    tau, errors = np.empty((len(rows), genus, genus), dtype=complex), np.empty(len(rows))
    faults = Faults()
    for i, row in enumerate(iterate(rows.tolist())):
        curve = faults.attempt(RealCurve, tuple(map(Fraction, row)), sign, ("branch_points", i))
        if curve is not None:
            periods = CurveValues(curve, DOUBLE).periods
            tau[i], errors[i] = 1j * periods.riemann_matrix, periods.riemann_matrix_error
    faults.require_none()
    return RiemannMatrices(tau, errors)
