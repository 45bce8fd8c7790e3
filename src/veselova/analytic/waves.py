"""Trigonometric sums in double precision from powers of each e^{iφ}: a product costs a tenth of a sine and a cosine."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["cosine_series", "cosine_sums", "midpoints", "powers", "sine_sums", "turns", "waves"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]

#: Matrices of cosine series to this size are kept, so many of them: 32 MB at most.
_LARGEST_KEPT, _MOST_KEPT = 256, 64


def powers(angles: Array, count: int) -> Complex:
    """Return e^{imφ}, m = 0 … count, for angles of any shape, m first.

    By doubling: the error is about mε, that of one rounding of the angle.
    """
    result = np.empty((count + 1, *angles.shape), dtype=np.complex128)
    result[0] = 1
    np.cos(angles, out=result.real[1])
    np.sin(angles, out=result.imag[1])
    known = 1
    while known < count:
        more = min(known, count - known)
        np.multiply(result[1 : more + 1], result[known], out=result[known + 1 : known + more + 1])
        known += more
    return result


def turns(angles: Array, largest: int) -> Complex:
    """Return e^{ikφ_j}, k = 0 … largest, −largest … −1, for angles (N, d), shape (2 largest + 1, d, N): k is the index."""
    forward = powers(angles.T, max(largest, 1))[: largest + 1]
    return np.concatenate([forward, np.conj(forward[:0:-1])])


def waves(turns: Complex, orders: Integers) -> Complex:
    """Return e^{i k·φ} for orders (K, d) from the ``turns`` of the angles, shape (K, N)."""
    result: Complex = turns[orders[:, 0], 0]
    for j in range(1, orders.shape[1]):
        result *= turns[orders[:, j], j]
    return result


def sine_sums(coefficients: Array) -> Callable[[Array], Array]:
    """Return the function ψ (N, g) ↦ Σ_s Σ_m c_smk sin(mψ_s), m = 1…M, shape (N, K), for coefficients (g, M, K)."""
    count, flat = coefficients.shape[1], np.swapaxes(coefficients, 0, 1).reshape(-1, coefficients.shape[2])
    return lambda psi: np.asarray(powers(psi.T, count)[1:].imag.reshape(-1, psi.shape[0]).T @ flat)


def cosine_sums(coefficients: Array) -> Callable[[Array], Array]:
    """Return the function ψ (N, g) ↦ Σ_m c_smk cos(mψ_s), m = 0…M−1, shape (N, K, g), for coefficients (g, M, K)."""
    highest = coefficients.shape[1] - 1

    def sums(psi: Array) -> Array:
        cosines = powers(psi.T, max(highest, 1))[: highest + 1].real
        return np.stack([cosines[:, s].T @ coefficients[s] for s in range(psi.shape[1])], axis=2)

    return sums


@lru_cache(_MOST_KEPT)
def midpoints(count: int) -> Array:
    """Return the midpoints π(2i+1)/2N of (0, π), read-only."""
    result = np.pi * (2 * np.arange(count) + 1) / (2 * count)
    result.flags.writeable = False
    return np.asarray(result)


def cosine_series(values: Array) -> Array:
    """Return the c_km with Σ_m c_km cos mψ = value at the N midpoints ψ, shape (..., K, N) as values."""
    count = values.shape[-1]
    return np.asarray(values @ (_kept_matrix(count) if count <= _LARGEST_KEPT else _to_coefficients(count)))


def _to_coefficients(count: int) -> Array:
    """Return the matrix (N, N) from values at the midpoints to coefficients: 2 cos(mψ_i)/N, half of that for m = 0."""
    table = np.cos(np.arange(4 * count) * (np.pi / (2 * count)))
    result = table[np.outer(2 * np.arange(count) + 1, np.arange(count)) % (4 * count)] * (2 / count)
    result[:, 0] /= 2
    return np.asarray(result)


_kept_matrix = lru_cache(_MOST_KEPT)(_to_coefficients)
