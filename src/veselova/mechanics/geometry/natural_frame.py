"""The natural frame {q, n_2, …, n_{n−1}, γ} of Theorem recon0: normals of confocal quadrics and the
geodesic's tangent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.enclosures import enclose, precision
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.geometry.integrals_of_motion import neumann_velocity, tangent_basis
from veselova.mechanics.geometry.sphere import over_largest
from veselova.mechanics.geometry.symmetric_axes import BITS, eigenvectors, midpoints

__all__ = ["moser_frame", "natural_frame", "orthonormalize", "refine"]

Array = NDArray[np.float64]

#: By what normals of one constant are told apart, in units of the largest: far below the distance
#: of different constants, and above the roundings.
_TOLD_APART = Fraction(1, 1 << 170)

#: Cosine above which a refined normal is the one in doubles.
_SAME = 0.9

#: Dimension beyond which refinement, n³ products of 320 bits, would take longer than a second.
_LARGEST_REFINED = 48


def natural_frame(A: Array, q: Array, q_dot: Array) -> Array:
    """Return the natural frame at a state, columns q, n_2 … n_{n−1}, γ, shape (n, n), determinant
    +1.

    n_k ∝ (A⁻¹ − c_k)⁻¹(q' + S_k q) are the eigenvectors of A⁻¹ − q'q'ᵀ restricted to q⊥ with
    eigenvalues c_k, and γ is the one of c_1 = 0, which stays true where the formula divides zero by
    zero (coinciding A's, turning points).
    Signs: (q', n_k) ≥ 0 for k ≥ 3 and (q', γ) ≥ 0; the sign of n_2 (of γ when n = 2) makes the
    determinant +1. A body at rest gets the eigenvectors of A⁻¹ restricted to q⊥ in the same places.
    """
    return moser_frame(A, q, neumann_velocity(A, q, q_dot))


def moser_frame(A: Array, q: Array, q_prime: Array) -> Array:
    """Return the same for a Neumann motion with velocity q' of any size, γ being the eigenvector of
    the least constant c_1.
    """
    basis = tangent_basis(q)
    along = q_prime @ basis
    restricted = (basis.T / A) @ basis - along[:, None] * along
    # columns γ, n_2, …, n_{n−1}: c_1 = 0 is the smallest
    vectors = basis @ np.linalg.eigh(restricted)[1]
    frame = np.empty_like(vectors, shape=(q.size, q.size))
    frame[:, 0], frame[:, 1:-1], frame[:, -1] = q, vectors[:, 1:], vectors[:, 0]
    return orthonormalize(_with_signs(frame, q_prime @ frame[:, 1:]))


def _with_signs(frame: Array, components: Array) -> Array:
    """Return the frame with the signs of the natural one, from components of q' of any scale."""
    frame[:, 1:] *= np.where(components < 0, -1.0, 1.0)
    if np.linalg.det(frame) < 0:
        frame[:, 1] = -frame[:, 1]
    return frame


def orthonormalize(frame: Array) -> Array:
    """Return the nearest orthogonal matrices to nearly orthogonal ones, shape (..., n, n).

    One Newton–Schulz step E(3 − EᵀE)/2 squares the defect: 1e-9 becomes 1e-18.
    """
    gram = frame.swapaxes(-1, -2) @ frame
    return np.asarray(0.5 * (3.0 * frame - frame @ gram), dtype=np.float64)


def refine(
    frame: Array,
    A: Sequence[Fraction],
    q: Sequence[Fraction],
    tangent: Sequence[Fraction],
    rate_squared: Fraction | None = None,
) -> Array:
    """Return a natural frame to the last bit, from one in double precision and the exact data.

    Rounding turns normals into each other by ε/(distance of their constants); here they are
    eigenvectors of A⁻¹ − q'q'ᵀ to 2^−300. Normals whose constants coincide are not turned into each
    other. A frame at rest or of high dimension is returned as it is. ``rate_squared`` is
    (dτ₁/d(time))² for the time of ``tangent``, that of a Veselova problem where it is left out.
    """
    if frame.shape[0] > _LARGEST_REFINED or not (any(tangent) or rate_squared):
        return frame
    largest = 1 / min(A)
    if rate_squared is None:
        qAq, vAv, qAv = (
            sum((a * b * c for a, b, c in zip(A, x, y, strict=True)), Fraction())
            for x, y in ((q, q), (tangent, tangent), (q, tangent))
        )
        rate_squared = (vAv * qAq - qAv * qAv) / qAq
    velocity = np.array(tangent, dtype=object)
    square = np.outer(velocity, velocity) / (rate_squared * largest)
    size = math.ceil(np.max(np.abs(np.diag(square))))
    with precision(BITS + size.bit_length()):
        M = enclose(np.diag([1 / (a * largest) for a in A])) - enclose(square)
        unit = enclose(np.array(over_largest(tuple(q)), dtype=object))
        unit = unit / (unit @ unit).sqrt()
        across = enclose(np.eye(len(unit))) - np.outer(unit, unit)
        # γ, n_2 … n_{n−1} in doubles by these weights, and q beyond all constants
        near = enclose(np.roll(frame[:, 1:], 1, axis=1))
        weights = enclose([k * _TOLD_APART for k in range(near.shape[1])])
        M = across @ M @ across + (near * weights) @ near.T + 2 * np.outer(unit, unit)
        vectors = eigenvectors(midpoints((M + M.T) / 2))[1].astype(np.float64)
        normals = np.roll(vectors[:, :-1], -1, axis=1)
    cosines = np.sum(normals * frame[:, 1:], axis=0)
    if np.all(np.abs(cosines) > _SAME):
        return np.column_stack([frame[:, 0], normals * np.sign(cosines)])
    components = to_float(over_largest(tuple(tangent))) @ normals
    return _with_signs(np.column_stack([frame[:, 0], normals]), components)
