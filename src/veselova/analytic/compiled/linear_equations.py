"""Linear equations of one to three unknowns, inverses, determinants and sizes, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.compiled.compiler import compiled

__all__ = ["determinant", "largest", "set_inverse", "solve"]

Array = NDArray[np.float64]


@compiled()
def largest(values: Array) -> float:
    """Return the largest |x|."""
    result = 0.0
    for x in values:
        result = max(result, abs(x))
    return result


@compiled()
def _minor(matrix: Array, i: int, j: int, k: int, l: int) -> float:
    """Return the determinant of rows i, j and columns k, l."""
    return float(matrix[i, k] * matrix[j, l] - matrix[i, l] * matrix[j, k])


@compiled()
def _cofactor(matrix: Array, i: int, j: int) -> float:
    """Return the cofactor of an entry of three rows."""
    return _minor(matrix, (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3)


@compiled()
def determinant(matrix: Array) -> float:
    """Return the determinant of one to four rows."""
    size = matrix.shape[0]
    if size == 1:
        return float(matrix[0, 0])
    if size == 2:
        return _minor(matrix, 0, 1, 0, 1)
    total = 0.0
    if size == 3:
        for j in range(3):
            total += matrix[0, j] * _cofactor(matrix, 0, j)
        return total
    for j in range(1, 4):
        k, l = 1 + j % 3, 1 + (j + 1) % 3
        total += _minor(matrix, 0, 1, 0, j) * _minor(matrix, 2, 3, k, l)
        total += _minor(matrix, 0, 1, k, l) * _minor(matrix, 2, 3, 0, j)
    return total


@compiled()
def set_inverse(matrix: Array, inverse: Array) -> None:
    """Fill the inverse of one to three rows."""
    size = determinant(matrix)
    if matrix.shape[0] == 1:
        inverse[0, 0] = 1 / size
    elif matrix.shape[0] == 2:
        inverse[0, 0], inverse[0, 1] = matrix[1, 1] / size, -matrix[0, 1] / size
        inverse[1, 0], inverse[1, 1] = -matrix[1, 0] / size, matrix[0, 0] / size
    else:
        for i in range(3):
            for j in range(3):
                inverse[j, i] = _cofactor(matrix, i, j) / size


@compiled()
def solve(slopes: Array, right: Array, result: Array) -> None:
    """Fill the solution of one to three linear equations: angle_maps._solve."""
    if right.size == 1:
        result[0] = right[0] / slopes[0, 0]
        return
    inverse = 1 / determinant(slopes)
    if right.size == 2:
        result[0] = (slopes[1, 1] * right[0] - slopes[0, 1] * right[1]) * inverse
        result[1] = (slopes[0, 0] * right[1] - slopes[1, 0] * right[0]) * inverse
        return
    for j in range(3):
        total = 0.0
        for i in range(3):
            total += _cofactor(slopes, i, j) * right[i]
        result[j] = total * inverse
