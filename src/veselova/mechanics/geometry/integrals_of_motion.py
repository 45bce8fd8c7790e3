"""Energy, momentum and the integrals of motion of the rank-one Veselova system with inertia (4.5,
printed 5.11), and of Neumann's; and spheroconic coordinates, which those integrals' quadrics have.

Every function takes the diagonal of A, shape (n,), and states q, q̇ of shape (..., n), and works
along the leading axes. I_i = 1/A_i throughout.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "constants_of_motion",
    "energy",
    "linear_integrals",
    "momentum",
    "moser_eigenvalues",
    "neumann_velocity",
    "sliding_velocity",
    "tangent_basis",
    "time_rate",
    "to_spheroconic",
    "uhlenbeck_integrals",
    "unit_scale",
]

Array = NDArray[np.float64]

#: I_i and I_j closer than this (relative) share one Neumann integral: their quotient
#: P_ij²/(I_i−I_j) carries no digits.
_COINCIDENT = 1e-12


def unit_scale(A: Array) -> tuple[Array, int]:
    """Return A/2^k with determinant near one, and k: det A itself leaves the float range for large
    n.
    """
    k = round(sum(map(math.log2, A.tolist())) / A.size)
    return np.ldexp(A, -k), k


def sliding_velocity(A: Array, q: Array, q_dot: Array) -> Array:
    """Return q̇ − (Aq,q̇)/(Aq,q) q, the part of q̇ that is A-orthogonal to q.

    With it, (Aq̇,q̇)(Aq,q) − (Aq,q̇)² is a product of two sums of positive terms: nothing cancels.
    """
    Aq = A * q
    ratio = (Aq * q_dot).sum(axis=-1) / (Aq * q).sum(axis=-1)
    sliding: Array = q_dot - ratio[..., None] * q
    return sliding


def energy(A: Array, q: Array, q_dot: Array) -> Array:
    """Return the kinetic energy h = [(Aq̇,q̇)(Aq,q) − (Aq,q̇)²]/(2 det A), equation (redL, printed
    6.2), shape (...).
    """
    rate = time_rate(A, q, q_dot)
    return np.asarray(rate * rate * ((A * q * q).sum(axis=-1) / (2 * A.prod())))


def momentum(A: Array, q: Array, q_dot: Array) -> Array:
    """Return p = [(q,Aq) A q̇ − (q̇,Aq) A q]/det A, equation (big_p), shape (..., n); (q,p) = 0."""
    qAq = (A * q * q).sum(axis=-1)
    return np.asarray(A * sliding_velocity(A, q, q_dot) * qAq[..., None] / A.prod())


def time_rate(A: Array, q: Array, q_dot: Array) -> Array:
    """Return dτ₁/dt = √(2h det A/(q,Aq)), equation (4.6, printed 6.15), shape (...).

    Since 2h det A = (Aq̇,q̇)(Aq,q) − (Aq,q̇)², this is √(A w, w) with w the part of q̇ that is
    A-orthogonal to q.
    """
    vectors = np.sqrt(A) * sliding_velocity(A, q, q_dot)
    # over the largest entry: with the rounding of a plain norm some normals would have another sign
    largest = np.abs(vectors).max(axis=-1, keepdims=True)
    unit = np.divide(vectors, largest, out=np.zeros_like(vectors), where=largest > 0)
    return np.asarray(largest[..., 0] * np.sqrt((unit * unit).sum(axis=-1)))


def neumann_velocity(A: Array, q: Array, q_dot: Array) -> Array:
    """Return q' = dq/dτ₁ = q̇/(dτ₁/dt), shape (..., n); zero for a body at rest."""
    sizes = time_rate(A, q, q_dot)[..., None]
    return np.divide(q_dot, sizes, out=np.zeros_like(q_dot), where=sizes > 0)


def linear_integrals(p: Array, frame: Array) -> Array:
    """Return l_k = (1/det A)⟨AωA, e_1∧e_k⟩ = (p, e_k), k = 2…n, from p and the frame, shape (...,
    n−1).
    """
    return np.asarray(np.einsum("...i,...ik->...k", p, frame[..., :, 1:]))


def uhlenbeck_integrals(A: Array, q: Array, q_prime: Array) -> Array:
    """Return F_i = q_i² + Σ_{j≠i} P_ij²/(I_i−I_j), the residues of (family1, printed 6.25), P =
    q∧q', shape (..., n).

    Where several A's coincide only the sum of their F_i exists; each of them is then given the mean
    of that sum.
    """
    inverse = 1 / A
    # I_i − I_j without cancellation
    gap = (A[None, :] - A[:, None]) * (inverse[:, None] * inverse[None, :])
    same = np.abs(gap) <= _COINCIDENT * np.maximum(inverse[:, None], inverse[None, :])
    q = _along(q)
    q_prime = _along(q_prime)
    product = q[:, None] * q_prime
    P = product - product.swapaxes(0, 1)
    P *= P
    P[same] = 0.0
    P /= np.where(same, 1.0, gap).reshape(gap.shape + (1,) * (P.ndim - 2))
    F = (q * q + P.sum(axis=1)).T
    if np.count_nonzero(same) == A.size:
        return np.asarray(F, dtype=np.float64)
    share = same / same.sum(axis=1, keepdims=True)
    return np.asarray(F @ share.T, dtype=np.float64)


def tangent_basis(q: Array) -> Array:
    """Return an orthonormal basis of q⊥ as columns, shape (..., n, n−1): n−1 columns of the
    reflection that swaps q and ∓E_n.
    """
    u = np.array(q, dtype=np.float64)
    u[..., -1] += np.where(u[..., -1] >= 0, 1.0, -1.0)  # the sign that adds: no cancellation
    norm = (u * u).sum(axis=-1)[..., None, None]
    return np.asarray(
        np.eye(q.shape[-1])[:, :-1] - 2 * u[..., :, None] * u[..., None, :-1] / norm,
        dtype=np.float64,
    )


def _along(vectors: Array) -> Array:
    """Return vectors (..., n) as (n, ...), leading axes in reverse, in memory: sums over n are then
    sums of long rows.
    """
    return np.ascontiguousarray(vectors.T)


def constants_of_motion(A: Array, q: Array, q_dot: Array) -> Array:
    """Return c_2 ≤ … ≤ c_{n−1}, the nonzero roots of N(λ), shape (..., n−2); c_1 = 0 is left out.

    Accuracy: see ``moser_eigenvalues``.
    """
    return moser_eigenvalues(A, q, neumann_velocity(A, q, q_dot))[..., 1:]


def moser_eigenvalues(A: Array, q: Array, q_prime: Array) -> Array:
    """Return c_1 ≤ … ≤ c_{n−1}, the roots of Φ𝓕 of (family1, printed 6.25), shape (..., n−1).

    They are the eigenvalues of A⁻¹ − q'q'ᵀ restricted to q⊥ (Moser's matrix for the inverse
    constants), so they come from a symmetric eigenproblem with absolute error of a few ε·max(I_i,
    |q'|²), whatever coincides.
    """
    basis = tangent_basis(q)
    along = np.einsum("...i,...ij->...j", q_prime, basis)
    form = np.swapaxes(basis, -1, -2) @ ((1 / A)[:, None] * basis)
    form -= along[..., :, None] * along[..., None, :]
    if form.shape[-1] == 2:  # as accurate, and ten times as fast for many states
        middle = (form[..., 0, 0] + form[..., 1, 1]) / 2
        radius = np.hypot((form[..., 0, 0] - form[..., 1, 1]) / 2, form[..., 0, 1])
        return np.stack([middle - radius, middle + radius], axis=-1)
    return np.asarray(np.linalg.eigvalsh(form), dtype=np.float64)


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
