"""The Stiefel variety V(r,n) = SO(n−r)\\SO(n): orthonormal columns X = (e_1 … e_r), its momentum
maps, and 𝓓_r ⊂ so(n).

Every function takes X of shape (..., n, r) and works along the leading axes. Γ = XXᵀ, ⟨X,Y⟩ = −½ tr
XY.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "ad_invariants",
    "admissible_part",
    "angular_velocity",
    "cotangent",
    "momentum_map",
    "nearest_orthonormal",
    "product",
    "tangent_part",
    "trace_integrals",
]

Array = NDArray[np.float64]


def _transpose(matrix: Array) -> Array:
    return np.swapaxes(matrix, -1, -2)


def product(first: Array, second: Array) -> Array:
    """Return ⟨X,Y⟩ = −½ tr XY of skew matrices (..., n, n), shape (...)."""
    return np.asarray(0.5 * np.sum(first * second, axis=(-1, -2)), dtype=np.float64)


def nearest_orthonormal(X: Array) -> Array:
    """Return the orthonormal columns nearest to those of X: its polar factor."""
    left, _, right = np.linalg.svd(X, full_matrices=False)
    return np.asarray(left @ right, dtype=np.float64)


def tangent_part(X: Array, Z: Array) -> Array:
    """Return Z − X sym(XᵀZ), which meets (cond_X) as a velocity and (condX) as a momentum."""
    along = _transpose(X) @ Z
    return np.asarray(Z - X @ (along + _transpose(along)) / 2, dtype=np.float64)


def angular_velocity(X: Array, X_dot: Array) -> Array:
    """Return ω = Φ(X,Ẋ) = XẊᵀ − ẊXᵀ + ½X[XᵀẊ − ẊᵀX]Xᵀ, equation (4.3, printed 5.17), shape (..., n,
    n); then Ẋ = −ωX, (Poisson, printed 5.18).
    """
    outer = X @ _transpose(X_dot)
    inner = _transpose(X) @ X_dot
    return np.asarray(
        outer - _transpose(outer) + X @ (inner - _transpose(inner)) @ _transpose(X) / 2,
        dtype=np.float64,
    )


def momentum_map(X: Array, P: Array) -> Array:
    """Return Φ*(X,P) = pr_𝓓 𝓘ω = XPᵀ − PXᵀ for the momentum P = ∂L/∂Ẋ of (dotX->P, printed 5.19),
    with XᵀP skew, shape (..., n, n).

    The third term that (mom^*, printed 5.21) prints belongs to another P, that of the normal
    metric, for which Σ dP∧dX is not the symplectic form when r > 1; ``cotangent`` is the way back.
    """
    outer = X @ _transpose(P)
    return np.asarray(outer - _transpose(outer), dtype=np.float64)


def cotangent(X: Array, momentum: Array) -> Array:
    """Return P = ∂L/∂Ẋ = −𝓜X + ½XXᵀ𝓜X, shape (..., n, r), for 𝓜 = 𝓘ω or its part in 𝓓_r; XᵀP is
    skew.
    """
    image = momentum @ X
    return np.asarray(X @ (_transpose(X) @ image) / 2 - image, dtype=np.float64)


def admissible_part(X: Array, Z: Array) -> Array:
    """Return pr_𝓓 Z = ΓZ + ZΓ − ΓZΓ of skew matrices Z, the projection before (4.1c, printed 5.6),
    as Z − (1−Γ)Z(1−Γ).
    """
    rest = np.eye(X.shape[-2]) - X @ _transpose(X)
    return np.asarray(Z - rest @ Z @ rest, dtype=np.float64)


def trace_integrals(X: Array, momentum: Array) -> Array:
    """Return the coefficients of λ^{k−j} in tr(𝓜+λΓ)^k, j = 2, 4 … k, k = 2 … n, the integrals
    after (4.2a, printed 5.8), shape (..., K).

    Those with odd j vanish, since (𝓜+λΓ)ᵀ = −𝓜+λΓ; j = 0 gives r; and traces beyond the n-th power
    follow from the others.
    """
    n = X.shape[-2]
    gamma = X @ _transpose(X)
    # the part of (𝓜+λΓ)^k of degree j in 𝓜, by j
    powers = [np.broadcast_to(np.eye(n), momentum.shape)]
    values = []
    for k in range(1, n + 1):
        least = gamma @ powers[0]
        most = momentum @ powers[-1]
        between = [momentum @ lower + gamma @ same for lower, same in pairwise(powers)]
        powers = [least, *between, most]
        values += [np.trace(powers[j], axis1=-2, axis2=-1) for j in range(2, k + 1, 2)]
    return np.stack(values, axis=-1)


def ad_invariants(momentum: Array) -> Array:
    """Return the singular values of 𝓜 that come in pairs, one each, (..., n//2): they generate the
    Ad-invariants of so(n).

    (tr 𝓜^2k = 2(−1)^k Σ σ^2k; the sign of the Pfaffian, which cannot change along a motion, is left
    out.)
    """
    values = np.linalg.svd(momentum, compute_uv=False)
    return np.asarray(values[..., : 2 * (momentum.shape[-1] // 2) : 2], dtype=np.float64)
