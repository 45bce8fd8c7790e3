"""The natural frame {q, n_2, …, n_{n−1}, γ} of Theorem recon0: normals of confocal quadrics and the
geodesic's tangent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.exact_input import over_common_denominator
from veselova.mechanics.geometry.integrals_of_motion import neumann_velocity, tangent_basis

__all__ = ["moser_frame", "natural_frame", "orthonormalize", "refine"]

Array = NDArray[np.float64]

#: Bits after the point in refinement.
_BITS = 320

#: Steps of refinement; one is the last where the square of its turn, over the least distance of
#: constants, is below 2^−_ENOUGH: that is what it leaves.
_STEPS = 6
_ENOUGH = 70

#: The largest turn from which it converges: where constants are nearer than 1e-14 of the largest,
#: the frame stays as it is.
_LARGEST_TURN = 0.05

#: Constants within 2^−_NEAREST of each other count as equal: their difference may be rounding.
_NEAREST = 100

#: Dimension beyond which refinement, n³ products of integers, would take longer than a second.
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
    frame[:, 1:] *= np.where(q_prime @ frame[:, 1:] < 0, -1.0, 1.0)
    if np.linalg.det(frame) < 0:
        frame[:, 1] = -frame[:, 1]
    return orthonormalize(frame)


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

    Rounding turns normals into each other by ε/(distance of their constants). In integers of _BITS
    bits, H = NᵀMN with M = A⁻¹ − q'q'ᵀ is made diagonal by N ← N(1+X), X_ij = H_ij/(H_jj−H_ii),
    which squares the turn, over the distance of the constants. Normals whose constants nearly
    coincide are not turned into each other. A frame at rest or of high dimension is returned as it
    is. ``rate_squared`` is (dτ₁/d(time))² for the time of ``tangent``, that of a Veselova problem
    where it is left out.
    """
    if frame.shape[0] > _LARGEST_REFINED or not (any(tangent) or rate_squared):
        return frame
    largest = 1 / min(A)
    if rate_squared is None:
        qAq, vAv, qAv = (
            _weighted_product(A, x, y) for x, y in ((q, q), (tangent, tangent), (q, tangent))
        )
        rate_squared = (vAv * qAq - qAv * qAv) / qAq
    velocity = _outer_square(tangent, 1 / (rate_squared * largest))
    M = _to_fixed_point(np.diag([1 / (a * largest) for a in A]).tolist()) - velocity
    unit = _unit_vector(q)
    N = _to_fixed_point(frame[:, 1:].tolist())
    one = np.eye(frame.shape[0] - 1, dtype=int).astype(object) << _BITS
    for _ in range(_STEPS):
        N = N - _product(unit, _product(unit.T, N))
        N = _product(N, 3 * one - _product(N.T, N)) >> 1
        H = _product(N.T, _product(M, N))
        distance = np.diag(H)[None, :] - np.diag(H)[:, None] + one
        close = np.abs(distance) < 1 << (_BITS - _NEAREST)
        turn = np.where(
            (one != 0) | close, 0, (H << _BITS) // np.where(close, 1 << _BITS, distance)
        )
        largest_turn = np.max(np.abs(turn))
        if largest_turn > int(_LARGEST_TURN * 2**_BITS):
            return frame
        N = N + _product(N, turn)
        nearest = np.min(np.where((one != 0) | close, 1 << _BITS, np.abs(distance)))
        if largest_turn * largest_turn < nearest << (_BITS - _ENOUGH):
            break
    else:
        return frame
    return np.column_stack([frame[:, 0], (N / (1 << _BITS)).astype(np.float64)])


def _weighted_product(
    A: Sequence[Fraction], x: Sequence[Fraction], y: Sequence[Fraction]
) -> Fraction:
    (a, over_a), (b, over_b), (c, over_c) = map(over_common_denominator, (A, x, y))
    return Fraction(sum(map(math.prod, zip(a, b, c, strict=True))), over_a * over_b * over_c)


def _to_fixed_point(rows: Any) -> Any:
    """Return floats or ratios as integers of _BITS bits after the point."""
    return np.array([[_shift(*x.as_integer_ratio()) for x in row] for row in rows], dtype=object)


def _shift(numerator: int, denominator: int) -> int:
    return (numerator << _BITS) // denominator


def _outer_square(vector: Sequence[Fraction], scale: Fraction) -> Any:
    """Return scale·vvᵀ as integers of _BITS bits after the point."""
    whole, common = over_common_denominator(vector)
    times = scale.numerator
    over = scale.denominator * common**2
    return np.array([[_shift(x * y * times, over) for y in whole] for x in whole], dtype=object)


def _product(a: Any, b: Any) -> Any:
    return (a @ b) >> _BITS


def _unit_vector(q: Sequence[Fraction]) -> Any:
    """Return q/|q| as a column of integers."""
    largest = max(abs(x) for x in q)
    column = _to_fixed_point([[x / largest] for x in q])
    return (column << _BITS) // math.isqrt(int(np.sum(column * column)))
