"""The natural frame {q, n_2, …, n_{n−1}, γ} of Theorem recon0: normals of confocal quadrics and the geodesic's tangent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.integrals import neumann_velocity, tangent_basis

__all__ = ["natural_frame", "orthonormalized"]

Array = NDArray[np.float64]


def natural_frame(A: Array, q: Array, q_dot: Array) -> Array:
    """Return the natural frame at a state, columns q, n_2 … n_{n−1}, γ, shape (n, n), determinant +1.

    n_k ∝ (A⁻¹ − c_k)⁻¹(q' + S_k q) are the eigenvectors of A⁻¹ − q'q'ᵀ restricted to q⊥ with eigenvalues c_k, and γ is the
    one of c_1 = 0, which stays true where the formula divides zero by zero (coinciding A's, turning points).
    Signs: (q', n_k) ≥ 0 for k ≥ 3 and (q', γ) ≥ 0; the sign of n_2 (of γ when n = 2) makes the determinant +1.
    A body at rest gets the eigenvectors of A⁻¹ restricted to q⊥ in the same places.
    """
    basis = tangent_basis(q)
    v = neumann_velocity(A, q, q_dot)
    restricted = basis.T @ (np.diag(1 / A) - np.outer(v, v)) @ basis
    vectors = basis @ np.linalg.eigh(restricted)[1]  # columns γ, n_2, …, n_{n−1}: c_1 = 0 is the smallest
    vectors = vectors * np.where(v @ vectors < 0, -1.0, 1.0)
    frame = np.column_stack([q, vectors[:, 1:], vectors[:, :1]])
    if np.linalg.det(frame) < 0:
        frame[:, 1] = -frame[:, 1]
    return orthonormalized(frame)


def orthonormalized(frame: Array) -> Array:
    """Return the nearest orthogonal matrices to nearly orthogonal ones, shape (..., n, n).

    One Newton–Schulz step E(3 − EᵀE)/2 squares the defect: 1e-9 becomes 1e-18.
    """
    gram = np.swapaxes(frame, -1, -2) @ frame
    return np.asarray(0.5 * (3.0 * frame - frame @ gram), dtype=np.float64)
