"""Trigonometric sums in double precision from powers of each e^{iφ}: a product costs a tenth of a
sine and a cosine.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["exponentials", "powers", "turns", "waves_at"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]


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
    """Return e^{ikφ_j}, k = 0 … largest, −largest … −1, for angles (N, d), shape (2 largest + 1, d,
    N): k is the index.
    """
    forward = powers(angles.T, max(largest, 1))[: largest + 1]
    return np.concatenate([forward, np.conj(forward[:0:-1])])


def exponentials(turns: Complex, orders: Integers) -> Complex:
    """Return e^{i k·φ} for orders (K, d) from the ``turns`` of the angles, shape (K, N)."""
    result: Complex = turns[orders[:, 0], 0]
    for j in range(1, orders.shape[1]):
        result *= turns[orders[:, j], j]
    return result


def waves_at(angles: Array, orders: Integers, largest: int, out: Array | None = None) -> Array:
    """Return cos k·φ and sin k·φ for angles (N, d) and orders (K, d) of entries to ``largest``,
    shape (2, K, N).
    """
    result = np.empty((2, orders.shape[0], angles.shape[0])) if out is None else out
    found = exponentials(turns(angles, largest), orders)
    result[0], result[1] = found.real, found.imag
    return result
