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
from veselova.mechanics.geometry.jacobi_rotations import BITS, diagonalize
from veselova.mechanics.geometry.sphere import over_largest

__all__ = ["moser_frame", "natural_frame", "orthonormalize", "refine"]

Array = NDArray[np.float64]

#: Steps of refinement; one is the last where what it leaves of each turn is below 2^−_ENOUGH.
_STEPS = 6
_ENOUGH = 70

#: Sweeps of Jacobi's rotations, which converge in the square from the third or fourth on.
_SWEEPS = 8

#: The largest turn from which it converges; beyond, it begins from eigenvectors of more digits.
_LARGEST_TURN = 0.05

#: Two normals wait for the next step while the difference of their constants is less than so many
#: times what turns of the others add to it. A pair alone adds 2·0.05² of its own difference at
#: most.
_UNDECIDED = 16

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

    Rounding turns normals into each other by ε/(distance of their constants). In integers of BITS
    bits, H = NᵀMN with M = A⁻¹ − q'q'ᵀ is made diagonal by N ← N(1+X), X_ij = H_ij/(H_jj−H_ii),
    which squares the turns. Normals whose constants coincide are not turned into each other. A
    frame at rest, of high dimension, or of a velocity beyond 1e40 is returned as it is.
    ``rate_squared`` is (dτ₁/d(time))² for the time of ``tangent``, that of a Veselova problem where
    it is left out.
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
    normals = _diagonalizing(N, M, unit)
    if normals is not None:
        return np.column_stack([frame[:, 0], _to_double(normals)])
    normals = _diagonalizing(_eigenvectors(N, M, unit), M, unit)
    if normals is None:
        return frame
    along = _to_fixed_point([over_largest(tuple(tangent))])
    components = _to_double(_product(along, normals))[0]
    return _with_signs(np.column_stack([frame[:, 0], _to_double(normals)]), components)


def _diagonalizing(N: Any, M: Any, unit: Any) -> Any:
    """Return N, turned so that NᵀMN is diagonal, in integers; None where it is too far from that,
    or its constants are not in order: those of n_2, … increase, and γ's is the least.
    """
    for _ in range(_STEPS):
        N = _orthonormal(N, unit)
        H = _product(N.T, _product(M, N))
        distance = np.diag(H)[None, :] - np.diag(H)[:, None]
        close = np.abs(distance) < 1 << (BITS - _NEAREST)
        turn = np.where(close, 0, (H << BITS) // np.where(close, 1, distance))
        sure = np.abs(turn) <= int(_LARGEST_TURN * 2**BITS)
        # What turns change in the second order: H_ij and H_ii − H_jj by these sums at most.
        second = np.sum(np.where(sure, np.abs(turn * H) >> BITS, 0), axis=1)
        second = second[:, None] + second[None, :]
        undecided = ~close & (np.abs(distance) < _UNDECIDED * second)
        if not np.all(sure | undecided):
            return None
        N = N + _product(N, np.where(undecided, 0, turn))
        if np.all(close | (second << _ENOUGH < np.abs(distance))):
            in_order = np.diff(np.roll(np.diag(H), 1)) > -(1 << (BITS - _NEAREST))
            return N if np.all(in_order) else None
    return None


def _eigenvectors(N: Any, M: Any, unit: Any) -> Any:
    """Return n_2, …, n_{n−1}, γ without signs, from vectors near an orthonormal basis of q⊥, by
    Jacobi's rotations.
    """
    N = _orthonormal(N, unit)
    H = _product(N.T, _product(M, N))
    N = diagonalize(H, N, _SWEEPS)
    # c_1 = 0, the least, belongs to γ, the last
    order = sorted(range(len(H)), key=lambda k: int(H[k, k]))
    return N[:, order[1:] + order[:1]]


def _orthonormal(N: Any, unit: Any) -> Any:
    """Return N, near orthonormal columns, made orthogonal to q and orthonormal."""
    one = np.eye(N.shape[1], dtype=int).astype(object) << BITS
    N = N - _product(unit, _product(unit.T, N))
    for _ in range(_STEPS):
        gram = _product(N.T, N)
        N = _product(N, 3 * one - gram) >> 1
        # A Newton–Schulz step squares the defect, which counts over the distance of constants.
        if np.max(np.abs(gram - one)) < 1 << (BITS - (_NEAREST + _ENOUGH) // 2):
            break
    return N


def _to_double(N: Any) -> Array:
    return np.asarray((N / (1 << BITS)).astype(np.float64))


def _weighted_product(
    A: Sequence[Fraction], x: Sequence[Fraction], y: Sequence[Fraction]
) -> Fraction:
    (a, over_a), (b, over_b), (c, over_c) = map(over_common_denominator, (A, x, y))
    return Fraction(sum(map(math.prod, zip(a, b, c, strict=True))), over_a * over_b * over_c)


def _to_fixed_point(rows: Any) -> Any:
    """Return floats or ratios as integers of BITS bits after the point."""
    return np.array([[_shift(*x.as_integer_ratio()) for x in row] for row in rows], dtype=object)


def _shift(numerator: int, denominator: int) -> int:
    return (numerator << BITS) // denominator


def _outer_square(vector: Sequence[Fraction], scale: Fraction) -> Any:
    """Return scale·vvᵀ as integers of BITS bits after the point."""
    whole, common = over_common_denominator(vector)
    times = scale.numerator
    over = scale.denominator * common**2
    return np.array([[_shift(x * y * times, over) for y in whole] for x in whole], dtype=object)


def _product(a: Any, b: Any) -> Any:
    return (a @ b) >> BITS


def _unit_vector(q: Sequence[Fraction]) -> Any:
    """Return q/|q| as a column of integers."""
    largest = max(abs(x) for x in q)
    column = _to_fixed_point([[x / largest] for x in q])
    return (column << BITS) // math.isqrt(int(np.sum(column * column)))
