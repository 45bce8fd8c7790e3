"""Principal axes of a symmetric matrix far beyond double precision.

Eigenvectors in doubles are refined in integers by the iteration of Ogita and Aishima, and by
Jacobi's rotations where eigenvalues lie too near together for it.

T. Ogita, K. Aishima, Iterative refinement for symmetric eigenvalue decomposition, Japan J. Indust.
Appl. Math. 35 (2018), Algorithm 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.exact_input import over_common_denominator
from veselova.mechanics.geometry.jacobi_rotations import BITS, NOTHING, diagonalize

__all__ = ["AXES_KNOWN", "WideAxes", "wide_axes"]

Array = NDArray[np.float64]

#: Parts of the largest number below which what differs along these axes is rounding.
AXES_KNOWN = Fraction(1, 1 << 240)

#: Bits that are kept of what is found: two values that are equal, or a component that is zero, then
#: come out so.
_KEPT = 256

#: Refinements: each squares the error, over the distance of the eigenvalues. From doubles four are
#: needed, for distances of 1e-12 eight.
_REFINEMENTS = 16

#: Distance of eigenvalues that are told apart, over what the matrix is off a diagonal one: a
#: correction is below a thousandth, and its square is small.
_TOLD_APART = 1 << 10

#: Dimension from which products of matrices of integers are faster by python-flint.
_BY_FLINT = 20

_ONE = 1 << BITS


@dataclass(frozen=True)
class WideAxes:
    """The principal axes of a symmetric matrix to 2^−256, determinant +1.

    - values: (n,) the eigenvalues, increasing; multiple ones are equal numbers
    - columns: (n, n) the axes as columns of integers, 2^320 for one
    - rounded: the same as floats, each correctly rounded
    """

    values: tuple[Fraction, ...]
    columns: Any
    rounded: Array

    def to_axes(self, vector: Sequence[Fraction]) -> tuple[Fraction, ...]:
        """Return the components of a vector along the axes, to 2^−256 of the largest."""
        whole, common = over_common_denominator(vector)
        components = np.array(whole, dtype=object) @ self.columns
        spare = max(0, max(int(abs(x)).bit_length() for x in components) - _KEPT)
        return tuple(Fraction(_nearest(x, spare) << spare, common << BITS) for x in components)

    def turn_operator(self, operator: Sequence[Sequence[Fraction]]) -> tuple[Any, Fraction]:
        """Return an operator on so(n) along the axes, a (D, D) array of integers and their unit.

        It is a symmetric matrix, not zero, on E_i∧E_j, i < j, in lexicographic order, D =
        n(n−1)/2. The unit is 2^−256 of its largest entry.
        """
        i, j = np.triu_indices(len(self.values), 1)
        V = self.columns
        planes = (V[np.ix_(i, i)] * V[np.ix_(j, j)] - V[np.ix_(i, j)] * V[np.ix_(j, i)]) >> BITS
        M, largest = _over_largest(operator)
        along = _product(planes.T, _product(M, planes))
        return _nearest(along, BITS - _KEPT), largest / (1 << _KEPT)


def wide_axes(matrix: Sequence[Sequence[Fraction]]) -> WideAxes:
    """Return the principal axes of a symmetric matrix, not zero.

    Doubles find the axes first, and refinements the digits. Rotations of two axes at a time, which
    need no distance between eigenvalues, do the rest.
    """
    M, largest = _over_largest(matrix)
    scaled = [[float(x / largest) for x in row] for row in matrix]
    V = _as_integers(np.linalg.eigh(np.array(scaled))[1])
    for _ in range(_REFINEMENTS):
        correction = _correction(M, V)
        V = V + _product(V, correction)
        if np.max(np.abs(correction)) <= NOTHING:
            break
    else:
        for _ in range(_REFINEMENTS):  # rotations leave orthonormal columns so, and no others
            V = V + (_product(V, _defect(V)) >> 1)
    V = diagonalize(_product(V.T, _product(M, V)), V)
    values = [_nearest(int(x), BITS - _KEPT) for x in np.sum(V * _product(M, V), axis=0) >> BITS]
    order = sorted(range(len(values)), key=values.__getitem__)
    values = [values[i] for i in order]
    V = V[:, order]
    for i in range(1, len(values)):
        if values[i] - values[i - 1] <= 2:
            values[i] = values[i - 1]
    rounded = _as_floats(V)
    if np.linalg.slogdet(rounded)[0] < 0:  # eigenvectors come with any sign
        V[:, -1], rounded[:, -1] = -V[:, -1], -rounded[:, -1]
    return WideAxes(tuple(Fraction(x, 1 << _KEPT) * largest for x in values), V, rounded)


def _over_largest(matrix: Sequence[Sequence[Fraction]]) -> tuple[Any, Fraction]:
    """Return a matrix as integers, 2^320 for its largest entry, and that entry."""
    largest = max(abs(x) for row in matrix for x in row)
    rows = ((x / largest for x in row) for row in matrix)
    M = [[(x.numerator << BITS) // x.denominator for x in row] for row in rows]
    return np.array(M, dtype=object), largest


def _as_integers(V: Array) -> Any:
    return np.array(
        [[int(math.ldexp(x, 1000)) >> (1000 - BITS) for x in row] for row in V.tolist()],
        dtype=object,
    )


def _defect(V: Any) -> Any:
    """Return 1 − VᵀV."""
    return np.diag([_ONE] * len(V)) - _product(V.T, V)


def _correction(M: Any, V: Any) -> Any:
    """Return E such that V + VE are the eigenvectors of M to the square of the error of V.

    With R = 1 − VᵀV and S = VᵀMV, E_ij = (S_ij + λ_j R_ij)/(λ_j − λ_i). Where λ_i and λ_j are not
    told apart, E_ij = R_ij/2, which leaves the two columns orthogonal.
    """
    n = V.shape[0]
    R = _defect(V)
    S = _product(V.T, _product(M, V))
    values = [(S[i, i] << BITS) // (_ONE - R[i, i]) for i in range(n)]
    off = max(sum(abs(x) for j, x in enumerate(row) if j != i) for i, row in enumerate(S))
    # Row sums bound the norms of S − Λ and of R; that of M is at most n
    untold = _TOLD_APART * (off + n * max(sum(map(abs, row)) for row in R))
    result = R >> 1
    for j in range(n):
        across = S[:, j] + (values[j] * R[:, j] >> BITS)
        for i in range(n):
            if abs(values[j] - values[i]) > untold:
                result[i, j] = (across[i] << BITS) // (values[j] - values[i])
    return result


def _product(a: Any, b: Any) -> Any:
    """Return the product of two square matrices."""
    if len(a) < _BY_FLINT:
        return (a @ b) >> BITS
    from flint import fmpz_mat

    product = fmpz_mat(a.tolist()) * fmpz_mat(b.tolist())
    whole = [[int(x) for x in row] for row in product.tolist()]
    return np.array(whole, dtype=object) >> BITS


def _nearest(x: Any, bits: int) -> Any:
    """Return x/2^bits to the nearest integer, of an integer or an array of them."""
    return (x + (1 << bits >> 1)) >> bits


def _as_floats(V: Any) -> Array:
    return np.array([[float(Fraction(x, _ONE)) for x in row] for row in V.tolist()])
