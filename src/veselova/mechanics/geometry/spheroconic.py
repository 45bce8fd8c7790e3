"""Spheroconic coordinates λ_1 ≤ … ≤ λ_{n−1} on the unit sphere, equation (S_n)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.geometry.integrals_of_motion import moser_eigenvalues

__all__ = ["to_spheroconic"]

Array = NDArray[np.float64]

#: Points taken at once.
_BLOCK = 65536


def to_spheroconic(A: Array, q: Array) -> Array:
    """Return λ_1 ≤ … ≤ λ_{n−1}, the zeros of Σ q_i² Π_{k≠i}(λ−I_k), shape (..., n−1).

    They are the eigenvalues of A⁻¹ restricted to q⊥; absolute error of a few ε·max I_i.
    """
    if q.ndim == 2 and q.shape[0] > _BLOCK:
        return np.concatenate(
            [to_spheroconic(A, q[first : first + _BLOCK]) for first in range(0, q.shape[0], _BLOCK)]
        )
    return moser_eigenvalues(A, q, np.zeros_like(q))
