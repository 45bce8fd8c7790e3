"""The Riemann matrices of many hyperelliptic curves with real branch points: what
``RealCurve`` has for one, in doubles and without its exact differences.

Differences of doubles round once. Those of ν = ±1/(e−λ) are quotients of such differences, so near
branch points keep their digits. Curves with one number of nodes are computed side by side; no
number depends on which other curves there are.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.hyperelliptic import BranchPoint, Curve
from veselova.analytic.curve.periods import Periods
from veselova.analytic.curve.real_hyperelliptic import SMALLEST_GAP, RealCurve
from veselova.mechanics.core.arguments import takes_arrays
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.curve_arguments import curve_rows
from veselova.mechanics.core.errors import Faults
from veselova.mechanics.results.curve import RiemannMatrices

__all__ = ["riemann_matrices"]

Array = NDArray[np.float64]

#: Method: numbers of nodes are rounded up to a multiple of this, so that few groups have many
#: curves.
_NODE_STEP = 8

#: Budget: entries of the forms of one interval that are formed at once: they stay in the cache.
_BLOCK = 100_000


@takes_arrays
def riemann_matrices(branch_points: ArrayLike, sign: int = -1) -> RiemannMatrices:
    """Return the Riemann matrices ``tau`` (N, g, g) of many curves w² = sign·Π(λ−b_j), and bounds
    ``error`` (N,) of the errors of their entries: what ``RealHyperelliptic`` gives for each row.

    branch_points: (N, 2g+1) or (N, 2g+2) doubles, exact as they stand, in any order in each row,
    g = 1 … 16. Raises InvalidInput, with all faults, for rows that are no such curves. Tested for
    g = 1 … 8 and gaps to 1e-45, each against the single curve, and to 1e-15 against 30 digits. No
    number depends on the other rows.
    """
    T, errors = _matrices(*curve_rows(branch_points, sign))
    return RiemannMatrices(np.asarray(1j * T), errors)


def _matrices(points: Array, sign: int) -> tuple[Array, Array]:
    """Return T of the Riemann matrices iT, and the bounds."""
    genus = (points.shape[1] - 1) // 2
    T = np.empty((len(points), genus, genus))
    errors = np.empty(len(points))
    with np.errstate(all="ignore"):  # rows beyond doubles are left to exact differences
        differences, ordinary = _differences(points, sign)
    faults = Faults()
    for row in np.flatnonzero(~ordinary).tolist():
        found = faults.attempt(_alone, points[row].tolist(), sign, row)
        if found is not None:
            T[row], errors[row] = found.riemann_matrix, found.riemann_matrix_error
    faults.require_none()
    rows = np.flatnonzero(ordinary)
    nodes = _node_counts(differences[rows])
    for count in np.unique(nodes).tolist():
        group = rows[nodes == count]
        size = max(1, _BLOCK // (count * (2 * genus + 1)))
        for first in range(0, group.size, size):
            checkpoint()
            members = group[first : first + size]
            periods = Periods(_curves(differences[members]), count)
            T[members] = periods.riemann_matrix
            errors[members] = periods.riemann_matrix_error
    return T, errors


def _alone(points: list[float], sign: int, row: int) -> Periods:
    """Return the periods of one curve by exact differences."""
    return RealCurve(tuple(map(Fraction, points)), sign, ("branch_points", row)).periods


def _differences(points: Array, sign: int) -> tuple[Array, NDArray[np.bool_]]:
    """Return all β_j − β_i, (N, 2g+1, 2g+1), in units in which the largest is 1 to 2, and whether
    all of them are doubles: (N,).
    """
    even = points.shape[1] % 2 == 0
    upwards = _between(points)
    surely = _is_wide(upwards)
    if even:
        to_last = upwards[:, :-1, -1]
        upwards = _in_unit(upwards[:, :-1, :-1] / to_last[:, :, None] / to_last[:, None, :])
        surely &= _is_wide(upwards)
    if (sign > 0) != even:
        upwards = np.swapaxes(upwards, 1, 2)[:, ::-1, ::-1]
    return upwards, surely


def _between(points: Array) -> Array:
    """Return b_j − b_i, each rounded once, in such a unit."""
    _, exponents = np.frexp(np.max(np.abs(points), axis=1))
    scaled = np.ldexp(points, -exponents[:, None])
    return _in_unit(np.asarray(scaled[:, None, :] - scaled[:, :, None]))


def _in_unit(differences: Array) -> Array:
    """Return differences in the power of 2 in which the largest of each curve is 1 to 2."""
    _, exponents = np.frexp(differences[:, 0, -1])
    return np.asarray(np.ldexp(differences, 1 - exponents[:, None, None]))


def _is_wide(differences: Array) -> NDArray[np.bool_]:
    """Return whether neighbours are far enough apart for doubles, (N,)."""
    widths = np.diagonal(differences, 1, axis1=1, axis2=2)
    return np.asarray(np.min(widths, axis=1) > 2 * float(SMALLEST_GAP))


def _curves(differences: Array) -> Curve:
    count = differences.shape[1]
    origins = tuple(BranchPoint("c" if j % 2 == 0 else "I", j) for j in range(count))
    return Curve(DOUBLE, differences[:, 0], differences, origins)


def _node_counts(differences: Array) -> NDArray[np.intp]:
    """Return numbers of nodes that serve every interval of each curve, (N,)."""
    periods = Periods(_curves(differences))
    counts = [periods.count_nodes(interval)[:, 0] for interval in (*periods.cuts, *periods.gaps)]
    largest = np.max(counts, axis=0)
    return np.asarray(_NODE_STEP * np.ceil(largest / _NODE_STEP), dtype=np.intp)
