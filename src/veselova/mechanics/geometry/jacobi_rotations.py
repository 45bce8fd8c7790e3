"""Jacobi's rotations of two columns at a time, in integers of BITS bits after the point."""

from __future__ import annotations

import math
from typing import Any

__all__ = ["BITS", "NOTHING", "diagonalize"]

#: Bits after the point.
BITS = 320

#: Entries below this many units in the last place are zero: what the roundings of all rotations
#: leave.
NOTHING = 1 << 24

#: Sweeps, where eigenvalues lie near together.
MOST_SWEEPS = 30


def diagonalize(H: Any, V: Any, sweeps: int = MOST_SWEEPS) -> Any:
    """Return V (m, n) after the rotations that make H = VᵀMV (n, n) diagonal; both are changed."""
    n = H.shape[0]
    for _ in range(sweeps):
        rotated = False
        for p in range(n - 1):
            for q in range(p + 1, n):
                if abs(H[p, q]) <= NOTHING:
                    continue
                rotated = True
                cosine, sine = _rotation(H[p, p], H[q, q], H[p, q])
                for X in (H.T, H, V):  # the columns p and q of Hᵀ are the rows of H
                    first = X[:, p].copy()
                    second = X[:, q].copy()
                    X[:, p] = (cosine * first - sine * second) >> BITS
                    X[:, q] = (sine * first + cosine * second) >> BITS
        if not rotated:
            break
    return V


def _rotation(first: int, second: int, across: int) -> tuple[int, int]:
    """Return cosine and sine of the smaller angle that makes ``across`` vanish."""
    ratio = ((second - first) << (BITS - 1)) // across
    tangent = (1 << 2 * BITS) // (abs(ratio) + math.isqrt(ratio * ratio + (1 << 2 * BITS)))
    cosine = (1 << 2 * BITS) // math.isqrt((1 << 2 * BITS) + tangent * tangent)
    return cosine, (-1 if ratio < 0 else 1) * tangent * cosine >> BITS
