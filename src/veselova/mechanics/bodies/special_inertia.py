"""The inertia of a ball in ℝⁿ, n ≥ 4, as it is given: along the axes of the special operator (4.5,
printed 5.11), or as a matrix that is turned into them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np

from veselova.mechanics.bodies.principal_inertia import principal_inertia, symmetric_matrix
from veselova.mechanics.bodies.wide_axes import WideAxes, wide_axes
from veselova.mechanics.core.errors import InvalidInput, InvalidRequest, show, unknown_fields
from veselova.mechanics.core.exact_input import (
    exact_vector,
    has_entries,
    is_matrix,
    positive_number,
)
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE

__all__ = ["GivenInertia", "pair_of"]

#: Budget: dimension up to which an operator on so(n) is turned; n = 16 has 120 × 120 entries and
#: takes 0.5 s.
_LARGEST_TURNED = 16

_EPSILON = Fraction(float(np.finfo(float).eps))

Matrix = tuple[tuple[Fraction, ...], ...]


@dataclass(frozen=True)
class GivenInertia:
    """What is given of the inertia.

    - numbers: A_1 … A_n, or the n(n−1)/2 moments I_ij, i < j, in lexicographic order
    - special: whether they are A
    - axes: the principal axes E_i that they belong to, None where they are the body's
    """

    numbers: tuple[Fraction, ...]
    special: bool
    axes: WideAxes | None = None

    @classmethod
    def of(cls, inertia: Any, n: int) -> GivenInertia:
        """Return what {"special": A} states, A n numbers or an n × n matrix; or n(n−1)/2 moments;
        or an operator on so(n) as a matrix of that size, bare or as {"matrix": …}.

        Raises InvalidInput.
        """
        count = n * (n - 1) // 2
        forms = (
            f'{{"special": A}} with A_1 … A_{n} or a matrix of {n} rows, or {count} positive '
            f"moments I_ij, i < j, or a matrix of {count} rows"
        )
        if isinstance(inertia, Mapping):
            if unknown := unknown_fields(("inertia",), inertia, ("special", "matrix")):
                raise InvalidRequest(unknown)
            if len(inertia) != 1:
                raise InvalidInput(("inertia",), forms, show(inertia))
            ((form, data),) = inertia.items()
            try:
                return cls._special(data, n) if form == "special" else cls._operator(data, n, form)
            except InvalidInput as error:
                raise error.below("inertia") from None
        if is_matrix(inertia):
            return cls._operator(inertia, n, "inertia")
        if not has_entries(inertia):
            raise InvalidInput(("inertia",), forms, show(inertia))
        if len(inertia) != count:
            raise InvalidInput(("inertia",), forms, f"{len(inertia)} numbers")
        return cls(exact_vector(inertia, ("inertia",), count, positive_number), False)

    @classmethod
    def _special(cls, data: Any, n: int) -> GivenInertia:
        if not is_matrix(data):
            return cls(exact_vector(data, ("special",), n, positive_number), True)
        if len(data) != n:
            required = f"{n} positive numbers, or a symmetric positive definite {n} × {n} matrix"
            raise InvalidInput(("special",), required, f"{len(data)} rows")
        A, axes = principal_inertia(data, "special")
        return cls(A, True, axes)

    @classmethod
    def _operator(cls, data: Any, n: int, name: str) -> GivenInertia:
        count = n * (n - 1) // 2
        if not is_matrix(data) or len(data) != count:
            given = f"{len(data)} rows" if is_matrix(data) else show(data)
            required = f"a symmetric positive definite {count} × {count} matrix"
            raise InvalidInput((name,), required, given)
        matrix = symmetric_matrix(data, name)
        diagonal = tuple(row[i] for i, row in enumerate(matrix))
        if min(diagonal) <= 0:
            given = f"one with {float(min(diagonal)):.3g} on its diagonal"
            raise InvalidInput((name,), "a positive definite matrix", given)
        if not any(x for i, row in enumerate(matrix) for j, x in enumerate(row) if i != j):
            return cls(exact_vector(diagonal, (name,), count, positive_number), False)
        if n > _LARGEST_TURNED:
            required = (
                f"a diagonal matrix, or n ≤ {_LARGEST_TURNED}, or the n × n matrix A of "
                '{"special": A}'
            )
            raise InvalidInput((name,), required, f"n = {n} with entries off the diagonal")
        axes = wide_axes(_contract(matrix, n))
        return cls(_moments_along(axes, matrix, name), False, axes)


def pair_of(place: int, n: int) -> tuple[int, int]:
    """Return i and j, from one, of a place in lexicographic order."""
    return list(combinations(range(1, n + 1), 2))[place]


def _contract(matrix: Matrix, n: int) -> Matrix:
    """Return Σ_j I(E_i∧E_j, E_k∧E_j), (n, n): its eigenvectors are the principal axes of a special
    operator.

    Its eigenvalues Σ_j I_ij increase or decrease with A_i, so that equal ones belong to equal A's.
    """
    pairs = list(combinations(range(n), 2))
    place = {pair: (k, 1) for k, pair in enumerate(pairs)}
    place |= {(j, i): (k, -1) for k, (i, j) in enumerate(pairs)}
    found = [[Fraction(0)] * n for _ in range(n)]
    for i in range(n):
        for k in range(i, n):
            for j in set(range(n)) - {i, k}:
                (row, sign), (column, other) = place[i, j], place[k, j]
                found[i][k] += sign * other * matrix[row][column]
            found[k][i] = found[i][k]
    return tuple(map(tuple, found))


def _moments_along(axes: WideAxes, matrix: Matrix, name: str) -> tuple[Fraction, ...]:
    """Return I(e_i∧e_j, e_i∧e_j) along axes e_i. Raises InvalidInput unless they are positive, and
    all other entries are below 1e-9 of them.
    """
    n = len(axes.values)
    along = axes.turn_operator(matrix)
    moments = tuple(np.diag(along))
    if min(moments) <= len(moments) * _EPSILON * max(moments):
        i, j = pair_of(moments.index(min(moments)), n)
        given = f"a moment I_{i}{j} of {float(min(moments)):.3g} along its principal axes"
        raise InvalidInput((name,), "a positive definite matrix", given)
    scaled = np.array(along / np.max(np.diag(along)), dtype=np.float64)
    sizes = np.sqrt(np.diag(scaled))
    off = np.abs(scaled / sizes / sizes[:, None])
    np.fill_diagonal(off, 0)
    if np.max(off) > INPUT_TOLERANCE:
        row, column = divmod(int(np.argmax(off)), len(off))
        i, j = pair_of(row, n)
        k, m = pair_of(column, n)
        required = "a special operator: E_i∧E_j of some axes E_i are its eigenvectors to 1e-9"
        given = (
            f"one that has E_{i}∧E_{j} against E_{k}∧E_{m} off by {np.max(off):.3g} of the moments "
            "along the best axes"
        )
        raise InvalidInput((name,), required, given)
    return moments
