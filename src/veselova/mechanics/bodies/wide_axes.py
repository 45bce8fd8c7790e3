"""Principal axes of a symmetric matrix far beyond double precision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.enclosures import enclose, precision, rational
from veselova.mechanics.geometry.symmetric_axes import BITS, eigenvectors, product

__all__ = ["AXES_KNOWN", "WideAxes", "wide_axes"]

Array = NDArray[np.float64]

#: Parts of the largest number below which what differs along these axes is rounding.
AXES_KNOWN = Fraction(1, 1 << 240)

#: Parts of the largest number that are kept of what is found: two values that are equal, or a
#: component that is zero, then come out so.
_KEPT = Fraction(1, 1 << 256)


@dataclass(frozen=True)
class WideAxes:
    """The principal axes of a symmetric matrix to 2^−256, determinant +1.

    - values: (n,) the eigenvalues, increasing; multiple ones are equal numbers
    - columns: (n, n) the axes as columns of rationals
    - rounded: the same as floats, each correctly rounded
    """

    values: tuple[Fraction, ...]
    columns: Any
    rounded: Array

    def to_axes(self, vector: Sequence[Fraction]) -> tuple[Fraction, ...]:
        """Return the components of a vector along the axes, to 2^−256 of the largest."""
        components = np.array(vector, dtype=object) @ self.columns
        unit = _KEPT * (max(map(abs, components)) or 1)
        return tuple(round(x / unit) * unit for x in components)

    def turn_operator(self, operator: Sequence[Sequence[Fraction]]) -> Any:
        """Return an operator on so(n) along the axes, a (D, D) array of rationals.

        It is a symmetric matrix, not zero, on E_i∧E_j, i < j, in lexicographic order, D =
        n(n−1)/2, and comes to 2^−256 of its largest entry.
        """
        i, j = np.triu_indices(len(self.values), 1)
        M, largest = _over_largest(operator)
        with precision(BITS):
            V = enclose(self.columns)
            planes = V[np.ix_(i, i)] * V[np.ix_(j, j)] - V[np.ix_(i, j)] * V[np.ix_(j, i)]
            return _to_rationals(product(planes.T, enclose(M), planes)) * largest


def wide_axes(matrix: Sequence[Sequence[Fraction]]) -> WideAxes:
    """Return the principal axes of a symmetric matrix, not zero."""
    M, largest = _over_largest(matrix)
    near = np.linalg.eigh(M.astype(np.float64))[1]
    with precision(BITS):
        balls = enclose(M)
        V = eigenvectors(balls, enclose(near.astype(object)))
        found = _to_rationals(np.diag(product(V.T, balls, V)))
        columns = np.frompyfunc(rational, 1, 1)(V)
    order = np.argsort(found, kind="stable")
    values, columns = found[order].tolist(), columns[:, order]
    for i in range(1, len(values)):
        if values[i] - values[i - 1] <= 2 * _KEPT:
            values[i] = values[i - 1]
    rounded = columns.astype(np.float64)
    if np.linalg.slogdet(rounded)[0] < 0:  # eigenvectors come with any sign
        columns[:, -1], rounded[:, -1] = -columns[:, -1], -rounded[:, -1]
    return WideAxes(tuple(x * largest for x in values), columns, rounded)


def _over_largest(matrix: Sequence[Sequence[Fraction]]) -> tuple[Any, Fraction]:
    """Return a matrix over its largest entry, and that entry."""
    largest = max(abs(x) for row in matrix for x in row)
    return np.array(matrix, dtype=object) / largest, largest


def _to_rationals(balls: Any) -> Any:
    """Return numbers of size one as multiples of 2^−256."""
    return np.frompyfunc(lambda x: round(rational(x) / _KEPT) * _KEPT, 1, 1)(balls)
