"""Skew matrices and their coefficients in the basis E_i∧E_j of so(n), i < j, in lexicographic
order.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["coefficients", "skew", "wedge"]

Array = NDArray[np.float64]


def skew(vector: Any, n: int) -> Array:
    """Return Σ c_ij E_i∧E_j of coefficients (..., n(n−1)/2), shape (..., n, n)."""
    matrix = np.zeros((*vector.shape[:-1], n, n))
    rows, columns = np.triu_indices(n, 1)
    matrix[..., rows, columns] = vector
    return matrix - np.swapaxes(matrix, -1, -2)


def wedge(x: Any, y: Any) -> Any:
    """Return x∧y = xyᵀ − yxᵀ of vectors (..., n), shape (..., n, n)."""
    product = x[..., :, None] * y[..., None, :]
    return product - np.swapaxes(product, -1, -2)


def coefficients(matrix: Array) -> Array:
    """Return the coefficients of skew matrices (..., n, n) in the basis E_i∧E_j, shape (...,
    n(n−1)/2).
    """
    return np.asarray(matrix[(..., *np.triu_indices(matrix.shape[-1], 1))], dtype=np.float64)
