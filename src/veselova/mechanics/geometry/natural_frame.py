"""The natural frame {q, n_2, …, n_{n−1}, γ} of Theorem recon0: normals of confocal quadrics and the
geodesic's tangent; and a frame as given: admitted to rounding, or made orthonormal where that was
asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import enclose, precision, rational
from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.exact_input import exact_matrix, to_float
from veselova.mechanics.geometry.integrals_of_motion import neumann_velocity, tangent_basis
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE, over_largest, unit
from veselova.mechanics.geometry.symmetric_axes import BITS, eigenvectors, midpoints, orthonormal

__all__ = [
    "ExactFrame",
    "admissible_frame",
    "moser_frame",
    "natural_frame",
    "orthonormalize",
    "read_frame",
    "refine",
]

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


ExactFrame = tuple[tuple[Fraction, ...], ...]

#: Bits of a mended frame: beyond all digits that can be asked for, and, in
#: dimensions without digits, beyond doubles.
_ALL_BITS = 4096
_DOUBLE_BITS = 320

#: The largest dimension with digits.
_WITH_DIGITS = 8

#: A least singular value of columns of size one that are dependent.
_DEPENDENT = 1e-12


def read_frame(
    frame: Any, point: tuple[Fraction, ...] | None, n: int, normalize: bool, name: str = "q"
) -> ExactFrame | None:
    """Return the columns of a frame exactly, row by row; None for None. ``point`` is q, of any
    length, None where it is unreadable; ``name`` is its name.

    As given, where it is orthogonal with e_1 = q/|q| to 1e-9. With ``normalize`` any other is
    mended: e_1 becomes q/|q|, and e_2 … e_n are made orthonormal in turn, each against those before
    it. The sign of the determinant is kept, by reversing e_n where the new e_1 would change it.
    Raises InvalidInput unless the columns are independent, with q in place of e_1 as well.
    """
    if frame is None:
        return None
    exact = exact_matrix(frame, ("frame",), n)
    if point is None:
        return exact
    try:
        _require_admissible(to_float(exact), unit(to_float(over_largest(point))), name)
    except InvalidInput:
        if not normalize:
            raise
        return _mend(exact, point, name)
    return exact


def admissible_frame(frame: Array, q: Array) -> Array:
    """Return a nearly orthogonal frame, first column nearly q, made so to rounding."""
    rest = frame[:, 1:] - np.outer(q, q @ frame[:, 1:])
    return orthonormalize(np.column_stack([q, rest]))


def _require_admissible(frame: Array, q: Array, name: str) -> None:
    """Raise InvalidInput unless the frame is orthogonal with first column q, both to
    the tolerance.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        defect = float(np.max(np.abs(frame.T @ frame - np.eye(q.size))))
    if not defect <= INPUT_TOLERANCE:
        required = "an orthogonal matrix to 1e-9 (or normalize=True)"
        raise InvalidInput(("frame",), required, f"one with |EᵀE − 1| up to {defect:.3g}")
    offset = float(np.max(np.abs(frame[:, 0] - q)))
    if offset > INPUT_TOLERANCE:
        required = f"first column e_1 equal to {name} to 1e-9 (or normalize=True)"
        raise InvalidInput(("frame",), required, f"a difference of {offset:.3g}")


def _mend(frame: ExactFrame, q: tuple[Fraction, ...], name: str) -> ExactFrame:
    """Return q/|q| and the other columns after Gram–Schmidt."""
    columns = list(zip(*frame, strict=True))
    # columns over their largest entries, so that the determinants are floats
    before, mended = (
        np.column_stack([to_float(over_largest(x)) if any(x) else np.zeros(len(x)) for x in given])
        for given in (columns, [q, *columns[1:]])
    )
    for matrix, what in ((before, "each other"), (mended, name)):
        if np.linalg.svd(matrix, compute_uv=False)[-1] <= _DEPENDENT:
            required = f"columns independent of {what}"
            raise InvalidInput(("frame",), required, "a column in the span of others")
    with precision(_ALL_BITS if len(q) <= _WITH_DIGITS else _DOUBLE_BITS):
        vectors = enclose(np.array([q, *columns[1:]], dtype=object))
        exact = [tuple(map(rational, column)) for column in orthonormal(vectors)]
    if np.linalg.det(before) * np.linalg.det(mended) < 0:
        exact[-1] = tuple(-x for x in exact[-1])
    return tuple(zip(*exact, strict=True))
