"""The reduced Veselova system on T S² as a Chaplygin system and, in time τ, as geodesics (or a
potential motion) on S².

𝓘 is the tensor as a (3, 3) matrix, ``inverse`` its inverse; vectors have shape (..., 3). τ is that
of (3.3), dτ = dt/√(q,𝓘⁻¹q); the τ of the n-dimensional theorem (L^*) is √det A = 1/√det 𝓘 times it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.potentials.laurent import LaurentPolynomial

__all__ = [
    "chaplygin_multiplier",
    "euler_metric",
    "geodesic_field",
    "geodesic_hamiltonian",
    "geodesic_integral",
    "geodesic_metric",
    "geodesic_momentum",
    "gyroscopic_form",
    "reduced_lagrangian",
    "rescaled_lagrangian",
]

Array = NDArray[np.float64]


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.sum(a * b, axis=-1))


def reduced_lagrangian(inertia: Array, q: Array, q_dot: Array) -> Array:
    """Return L = ½(𝓘(q̇×q), q̇×q), shape (...); a potential V(q) is subtracted."""
    Omega = np.cross(q_dot, q)
    return _dot(Omega @ inertia, Omega) / 2


def gyroscopic_form(inertia: Array, q: Array, q_dot: Array, xi: Array) -> Array:
    """Return Ψ(q,q̇,ξ) = (𝓘(q̇×q), q̇×ξ) of the reduced Lagrange–d'Alembert equation, (red2,
    printed 4.7): ∂L/∂q − d/dt ∂L/∂q̇ = ∂Ψ/∂ξ.
    """
    return _dot(np.cross(q_dot, q) @ inertia, np.cross(q_dot, xi))


def chaplygin_multiplier(inverse: Array, q: Array) -> Array:
    """Return 𝒩 = 1/√(q,𝓘⁻¹q), shape (...): dτ = 𝒩 dt, and the density of the reduced invariant
    measure.
    """
    return np.asarray(1 / np.sqrt(_dot(q @ inverse, q)))


def rescaled_lagrangian(inertia: Array, inverse: Array, q: Array, q_prime: Array) -> Array:
    """Return L* = (𝓘(q'×q), q'×q)/(2(q,𝓘⁻¹q)), equation (3.3, printed 4.8), q' = dq/dτ, shape
    (...); a potential V(q) is subtracted.
    """
    return np.asarray(reduced_lagrangian(inertia, q, q_prime) / _dot(q @ inverse, q))


def geodesic_metric(inertia: Array, inverse: Array, q: Array) -> Array:
    """Return G with (G dq, dq) = det𝓘 [(dq,𝓘⁻¹dq)(𝓘⁻¹q,q) − (𝓘⁻¹q,dq)²]/(q,𝓘⁻¹q), (..., 3, 3): the
    metric of 2L* on S².
    """
    across = q @ inverse
    outer = across[..., :, None] * across[..., None, :] / _dot(across, q)[..., None, None]
    return np.asarray(np.linalg.det(inertia) * (inverse - outer))


def geodesic_integral(inertia: Array, inverse: Array, q: Array, q_prime: Array) -> Array:
    """Return F_2* = [(𝓘Ω,𝓘Ω) − (𝓘Ω,q)²]/(2(q,𝓘⁻¹q)), Ω = q'×q, shape (...); the paper prints (𝓘Ω,Ω)
    for (𝓘Ω,𝓘Ω).
    """
    M = np.cross(q_prime, q) @ inertia
    return np.asarray((_dot(M, M) - _dot(M, q) ** 2) / (2 * _dot(q @ inverse, q)))


def geodesic_momentum(inertia: Array, inverse: Array, q: Array, q_prime: Array) -> Array:
    """Return m = 𝒩²[𝓘Ω − (𝓘Ω,q)q], Ω = q'×q: the momentum of L* as a vector with (m,q) = 0, shape
    (..., 3).
    """
    M = np.cross(q_prime, q) @ inertia
    return np.asarray((M - _dot(M, q)[..., None] * q) / _dot(q @ inverse, q)[..., None])


def geodesic_hamiltonian(inverse: Array, q: Array, m: Array) -> Array:
    """Return H* = ½[(q,𝓘⁻¹q)(m,𝓘⁻¹m) − (m,𝓘⁻¹q)²] = ½ det𝓘⁻¹ (𝓘(m×q), m×q), shape (...); a
    potential V(q) is added.
    """
    across = q @ inverse
    return np.asarray((_dot(across, q) * _dot(m @ inverse, m) - _dot(across, m) ** 2) / 2)


def geodesic_field(
    inverse: Array, q: Array, m: Array, potential: LaurentPolynomial | None = None
) -> tuple[Array, Array]:
    """Return (dq/dτ, dm/dτ) = (q×H*_m, m×H*_m + q×H*_q): Hamilton's equations of H* + V on T*S² =
    {(q,q) = 1, (m,q) = 0} ⊂ e(3)*.

    For V = 0 q(τ) is a geodesic of ``geodesic_metric``. Shapes (..., 3).
    """
    across = q @ inverse
    along = m @ inverse
    mixed = _dot(across, m)[..., None]
    by_m = _dot(across, q)[..., None] * along - mixed * across
    by_q = _dot(along, m)[..., None] * across - mixed * along
    if potential is not None:
        by_q = by_q + potential.gradient(q)
    return np.asarray(np.cross(q, by_m)), np.asarray(np.cross(m, by_m) + np.cross(q, by_q))


def euler_metric(inertia: Array, inverse: Array, q: Array) -> Array:
    """Return G with (G dq, dq) = det𝒥 (dq,𝒥⁻¹dq)/(q,𝒥q), (..., 3, 3): ds²_{J,P}, the metric of the
    Euler case on (𝒥Ω,γ) = 0.
    """
    return np.asarray(np.linalg.det(inertia) * inverse / _dot(q @ inertia, q)[..., None, None])
