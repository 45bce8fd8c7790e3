"""The matrix A of a body: given along its principal axes, or as a symmetric matrix that is
diagonalised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import Path, has_entries, is_matrix
from veselova.mechanics.core.decimals import enclose, precision, rational
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.exact_input import (
    exact_matrix,
    exact_vector,
    require_moderate,
    scale_number,
    to_float,
)
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.geometry.symmetric_axes import BITS, eigenvectors

__all__ = [
    "AXES_KNOWN",
    "WideAxes",
    "positive_numbers",
    "principal_inertia",
    "symmetric_matrix",
    "three_moments",
    "wide_axes",
]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)


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


def positive_numbers(A: Any, name: str = "A") -> tuple[Fraction, ...]:
    """Return the entries of A, two or more numbers from 1e-30 to 1e30, exactly; ``name`` is that of
    the argument.
    """
    diagonal = exact_vector(A, (name,), entry=scale_number)
    if len(diagonal) < 2:
        raise InvalidInput((name,), "at least 2 numbers (n ≥ 2)", f"{len(diagonal)}")
    return diagonal


def principal_inertia(A: Any, name: str = "A") -> tuple[tuple[Fraction, ...], WideAxes | None]:
    """Return the diagonal of A as exact numbers, and the principal axes when A was given as a
    matrix that is not diagonal.

    Both are of the symmetric part, to 2^−256 of its largest entry: what is seen along them has no
    rounding of theirs. The axes are a rotation, determinant +1, so that vector products and
    determinants of frames are the same along them.
    ``name``: of the argument, for its refusals.
    """
    if not is_matrix(A):
        return positive_numbers(A, name), None
    if len(A) < 2:
        raise InvalidInput((name,), "at least 2 rows (n ≥ 2)", f"{len(A)}")
    matrix = symmetric_matrix(A, (name,), len(A))
    if not any(map(any, matrix)):
        raise InvalidInput((name,), "a positive definite matrix", "zero")
    diagonal = tuple(matrix[i][i] for i in range(len(matrix)))
    off = (x for i, row in enumerate(matrix) for j, x in enumerate(row) if i != j)
    if not any(off) and min(diagonal) > 0:  # the axes are the body's, and all digits are known
        return positive_numbers(diagonal, name), None
    axes = wide_axes(matrix)
    if axes.values[0] <= len(A) * Fraction(_EPSILON) * axes.values[-1]:
        raise InvalidInput(
            (name,),
            "a positive definite matrix",
            f"one with eigenvalue {float(axes.values[0]):.3g}",
        )
    for value in (axes.values[0], axes.values[-1]):
        require_moderate([value], (name,))
    return axes.values, axes


def three_moments(given: Any) -> tuple[tuple[Fraction, ...], WideAxes | None]:
    """Return ``principal_inertia`` of a body in space, which has three moments or three rows."""
    form = "3 positive principal moments, or a symmetric positive definite 3 × 3 matrix"
    if not has_entries(given):
        raise InvalidInput(("inertia",), form, show(given))
    if len(given) != 3:
        what = "rows" if is_matrix(given) else "numbers"
        raise InvalidInput(("inertia",), form, f"{len(given)} {what}")
    return principal_inertia(given, "inertia")


def symmetric_matrix(A: Any, path: Path, size: int) -> tuple[tuple[Fraction, ...], ...]:
    """Return the symmetric part of a matrix exactly; raises InvalidInput unless it is all of it to
    1e-9 of the largest entry.
    """
    given = exact_matrix(A, path, size)
    matrix = to_float(given)
    asymmetry = np.abs(matrix / 2 - matrix.T / 2)  # a sum may leave the range of a float
    if np.max(asymmetry) > INPUT_TOLERANCE / 2 * np.max(np.abs(matrix)):
        i, j = divmod(int(np.argmax(asymmetry)), len(given))
        raise InvalidInput(
            (*path, i, j),
            "a symmetric matrix",
            f"{matrix[i, j]} against {matrix[j, i]} across the diagonal",
        )
    return tuple(
        tuple((x + y) / 2 for x, y in zip(*lines, strict=True))
        for lines in zip(given, zip(*given, strict=True), strict=True)
    )


def wide_axes(matrix: Sequence[Sequence[Fraction]]) -> WideAxes:
    """Return the principal axes of a symmetric matrix, not zero."""
    largest = max(abs(x) for row in matrix for x in row)
    with precision(BITS):
        found, V = eigenvectors(enclose(np.array(matrix, dtype=object) / largest))
        columns = np.frompyfunc(rational, 1, 1)(V)
    values = [round(x / _KEPT) * _KEPT for x in found]
    for i in range(1, len(values)):
        if values[i] - values[i - 1] <= 2 * _KEPT:
            values[i] = values[i - 1]
    rounded = columns.astype(np.float64)
    if np.linalg.slogdet(rounded)[0] < 0:  # eigenvectors come with any sign
        columns[:, -1], rounded[:, -1] = -columns[:, -1], -rounded[:, -1]
    return WideAxes(tuple(x * largest for x in values), columns, rounded)
