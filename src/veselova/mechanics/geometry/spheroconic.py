"""Spheroconic coordinates λ_1 ≤ … ≤ λ_{n−1} on the unit sphere, equation (S_n), both ways."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.geometry.integrals_of_motion import tangent_basis

__all__ = ["from_spheroconic", "to_spheroconic"]

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
    basis = tangent_basis(q)
    restricted = np.swapaxes(basis, -1, -2) @ ((1 / A)[:, None] * basis)
    return np.asarray(np.linalg.eigvalsh(restricted), dtype=np.float64)


def from_spheroconic(A: Array, spheroconic: Array, signs: Array) -> Array:
    """Return q with q_i² = Π_s(I_i−λ_s)/Π_{j≠i}(I_i−I_j), equation (S_n, printed 6.10), and the
    given signs, shape (..., n).

    The A_i must be distinct, and the sorted λ_s interlace the sorted I_i; raises InvalidInput
    otherwise.
    """
    inverse = 1 / A
    n = A.size
    ordered = np.sort(inverse)
    if np.any(ordered[1:] == ordered[:-1]):
        raise InvalidInput(
            ("A",),
            "distinct entries (spheroconic coordinates do not determine q otherwise)",
            "equal entries",
        )
    coordinates = np.sort(spheroconic, axis=-1)
    if (
        coordinates.shape[-1] != n - 1
        or np.any(coordinates < ordered[:-1])
        or np.any(coordinates > ordered[1:])
    ):
        raise InvalidInput(
            ("spheroconic",),
            f"{n - 1} coordinates that interlace the inverses of A",
            "coordinates outside",
        )
    numerator = np.prod(inverse[:, None] - coordinates[..., None, :], axis=-1)
    difference = inverse[:, None] - inverse[None, :]
    np.fill_diagonal(difference, 1.0)
    return np.asarray(
        np.sign(signs) * np.sqrt(np.abs(numerator / np.prod(difference, axis=1))), dtype=np.float64
    )
