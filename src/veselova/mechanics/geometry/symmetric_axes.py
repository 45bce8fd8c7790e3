"""Eigenvectors of symmetric matrices far beyond double precision, in Arb's numbers."""

from __future__ import annotations

import operator
from functools import reduce
from itertools import combinations
from typing import Any

import numpy as np

__all__ = ["BITS", "eigenvectors", "midpoints", "product"]

#: Bits of numbers of size one.
BITS = 320

#: Entries below this many units in the last place are zero: what the roundings of all rotations
#: leave.
_NOTHING = 2.0 ** (24 - BITS)

#: Corrections, each of which squares what is wrong with eigenvectors in doubles.
_CORRECTIONS = 4

#: Newton–Schulz steps: a correction of a thousandth leaves a defect of 1e-6, they one of 1e-96.
_STEPS = 4

#: Distance of eigenvalues that are told apart, over what the matrix is off a diagonal one: a
#: correction is below a thousandth, and its square is small.
_TOLD_APART = 1 << 10

#: Sweeps of rotations, which converge in the square from the third or fourth on.
_MOST_SWEEPS = 30

#: The midpoints of balls, exactly.
midpoints = np.frompyfunc(lambda x: x.mid(), 1, 1)


def eigenvectors(M: Any, V: Any) -> Any:
    """Return V (m, n), columns that are orthonormal to doubles, turned so that VᵀMV is diagonal.

    With H = VᵀMV a step V ← V(1+X), X_ij = H_ij/(H_jj−H_ii), squares the error where eigenvalues
    are told apart. Jacobi's rotations of two columns, which need no distance of eigenvalues, do the
    rest. Numbers are Arb's, in the precision in force, that of M being BITS after the point.
    """
    for _ in range(_CORRECTIONS):
        V = _nearer_orthonormal(V)
        H = product(V.T, M, V)
        values = np.diag(H)
        gaps = values[None, :] - values[:, None]
        off = max(np.sum(np.abs(H), axis=1) - np.abs(values), key=float)
        told = (np.abs(gaps) > _TOLD_APART * off).astype(bool)
        if off <= _NOTHING or not told.any():
            break
        V = V + product(V, midpoints(np.where(told, H / np.where(told, gaps, 1), 0 * H)))
    for _ in range(_STEPS):  # rotations leave orthonormal columns so, and no others
        V = _nearer_orthonormal(V)
    return _rotate(product(V.T, M, V), V)


def product(*matrices: Any) -> Any:
    """Return the midpoints of the product of matrices."""
    from flint import arb_mat

    found = reduce(operator.mul, (arb_mat(m.tolist()) for m in matrices))
    entries = np.array(found.entries(), dtype=object)
    return midpoints(entries.reshape(found.nrows(), found.ncols()))


def _nearer_orthonormal(V: Any) -> Any:
    """Return nearly orthonormal columns after a Newton–Schulz step, which squares their defect."""
    return midpoints((3 * V - product(V, V.T, V)) / 2)


def _rotate(H: Any, V: Any) -> Any:
    """Return V after Jacobi's rotations that make H diagonal."""
    for _ in range(_MOST_SWEEPS):
        rotated = False
        for p, q in combinations(range(len(H)), 2):
            if abs(H[p, q]) <= _NOTHING:
                continue
            rotated = True
            cosine, sine = _rotation(H[q, q] - H[p, p], 2 * H[p, q])
            for X in (H.T, H, V):  # the columns p and q of Hᵀ are the rows of H
                first, second = X[:, p].copy(), X[:, q].copy()
                X[:, p] = midpoints(cosine * first - sine * second)
                X[:, q] = midpoints(sine * first + cosine * second)
        if not rotated:
            break
    return V


def _rotation(difference: Any, across: Any) -> tuple[Any, Any]:
    """Return cosine and sine of the smaller angle of which tan 2φ = across/difference."""
    ratio = difference / across
    tangent = 1 / (abs(ratio) + (1 + ratio * ratio).sqrt())
    cosine = 1 / (1 + tangent * tangent).sqrt()
    return cosine, (-tangent if ratio < 0 else tangent) * cosine
