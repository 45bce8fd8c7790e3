"""Lines tangent to confocal quadrics: Chasles' theorem and Moser's Lax pair (Proposition Moser1).

Q(α): Σ x_i²/(A_i−α) = 1, Q(0) the ellipsoid. All functions take A (n,), points and directions of
shape (..., n).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Contacts", "contacts", "lax_matrix", "lax_partner"]

Array = NDArray[np.float64]


def lax_matrix(A: Array, x: Array, V: Array) -> Array:
    """Return 𝓛 = Π(A − x⊗x)Π with Π = 1 − V⊗V/(V,V), equation (calB), shape (..., n, n).

    It is the same for every point x of the line along V. Along a geodesic of Q(0) its eigenvalues
    are constant: zero twice (the normal of Q(0) and V), and the α_2 … α_{n−1} of the quadrics that
    the tangent touches.
    """
    n = A.size
    projection = (
        np.eye(n) - V[..., :, None] * V[..., None, :] / np.sum(V * V, axis=-1)[..., None, None]
    )
    return np.asarray(
        projection @ (np.diag(A) - x[..., :, None] * x[..., None, :]) @ projection, dtype=np.float64
    )


def lax_partner(A: Array, x: Array, V: Array) -> Array:
    """Return 𝓑 = A⁻¹x⊗A⁻¹V − A⁻¹V⊗A⁻¹x, equation (calB, printed 7.4), shape (..., n, n).

    d𝓛/ds₁ = [𝓛,𝓑] with ds = (X,A⁻²X) ds₁; the print has a minus sign there.
    """
    wedge = (x / A)[..., :, None] * (V / A)[..., None, :]
    return np.asarray(wedge - np.swapaxes(wedge, -1, -2), dtype=np.float64)


@dataclass(frozen=True)
class Contacts:
    """The quadrics that tangents of a geodesic touch besides Q(0), k = 2…n−1.

    - quadrics: (..., n−2) α_k, decreasing
    - points: (..., n−2, n) where each is touched
    - normals: (..., n−2, n) unit normals there
    """

    quadrics: Array
    points: Array
    normals: Array


def contacts(A: Array, X: Array, V: Array) -> Contacts:
    """Return the quadrics touched by the tangents X + σV of a geodesic on Q(0), with points and
    normals (Chasles' theorem).

    Normals are eigenvectors of 𝓛, orthogonal to each other, to V and to the normal of Q(0); their
    signs are left to chance.
    """
    values, vectors = np.linalg.eigh(lax_matrix(A, X, V))
    normal = X / A
    basis = np.stack(
        [
            V / np.linalg.norm(V, axis=-1)[..., None],
            normal / np.linalg.norm(normal, axis=-1)[..., None],
        ],
        axis=-1,
    )
    # The two null vectors are known; those of the quadrics are what is orthogonal to both, whatever
    # α may coincide with zero.
    known = np.sum((np.swapaxes(basis, -1, -2) @ vectors) ** 2, axis=-2)
    order = np.argsort(known, axis=-1)[..., : A.size - 2]
    alphas = np.take_along_axis(values, order, axis=-1)
    sorting = np.argsort(-alphas, axis=-1)
    order = np.take_along_axis(order, sorting, axis=-1)
    alphas = np.take_along_axis(alphas, sorting, axis=-1)
    normals = np.swapaxes(np.take_along_axis(vectors, order[..., None, :], axis=-1), -1, -2)
    # The point x with normal n is (A−α)n/(x,n), and (x,n) is the same along the whole line.
    height = np.sum(X[..., None, :] * normals, axis=-1)
    points = (A - alphas[..., None]) * normals / height[..., None]
    return Contacts(alphas, np.asarray(points), np.asarray(normals))
