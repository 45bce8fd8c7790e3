"""The matrix A of a body: given along its principal axes, or as a symmetric matrix that is
diagonalised.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from veselova.mechanics.bodies.wide_axes import WideAxes, wide_axes
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.exact_input import (
    exact_matrix,
    exact_vector,
    is_matrix,
    positive_number,
    round_to_text,
    to_float,
)
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE

__all__ = ["positive_numbers", "principal_inertia", "require_moderate", "symmetric_matrix"]

_EPSILON = float(np.finfo(float).eps)

#: The inverse of a smaller number is no float; the square of one up to the second is.
_LEAST = Fraction(1, 10**308)
_MODERATE = Fraction(10**120)


def positive_numbers(A: Any, name: str = "A") -> tuple[Fraction, ...]:
    """Return the entries of A, two or more numbers above zero, exactly; ``name`` is that of the
    argument.
    """
    diagonal = exact_vector(A, (name,), entry=_invertible_number)
    if len(diagonal) < 2:
        raise InvalidInput((name,), "at least 2 numbers (n ≥ 2)", f"{len(diagonal)}")
    return diagonal


def _invertible_number(value: Any, path: tuple[str | int, ...]) -> Fraction:
    number = positive_number(value, path)
    if number < _LEAST:
        raise InvalidInput(
            path, "a number whose inverse is within the range of a float", show(value)
        )
    return number


def require_moderate(values: tuple[Fraction, ...], name: str, limit: Fraction = _MODERATE) -> None:
    """Raise InvalidInput unless the numbers and their inverses are below ``limit``: some products
    of them must stay floats.
    """
    least = min(values)
    most = max(values)
    if most > limit or least < 1 / limit:
        given = f"numbers from {round_to_text(least)} to {round_to_text(most)}"
        raise InvalidInput(
            (name,), f"numbers between {float(1 / limit):.0e} and {float(limit):.0e}", given
        )


def principal_inertia(A: Any, name: str = "A") -> tuple[tuple[Fraction, ...], WideAxes | None]:
    """Return the diagonal of A as exact numbers, and the principal axes when A was given as a
    matrix that is not diagonal.

    Both are of the symmetric part, to 2^−256 of its largest entry: what is seen along them has no
    rounding of theirs. The axes are a rotation, determinant +1, so that vector products and
    determinants of frames are the same along them.
    ``name``: of the argument, for its refusals.
    """
    if not is_matrix(A):
        return positive_numbers(A, name), None
    if len(A) < 2:
        raise InvalidInput((name,), "at least 2 rows (n ≥ 2)", f"{len(A)}")
    matrix = symmetric_matrix(A, name)
    if not any(map(any, matrix)):
        raise InvalidInput((name,), "a positive definite matrix", "zero")
    diagonal = tuple(matrix[i][i] for i in range(len(matrix)))
    off = (x for i, row in enumerate(matrix) for j, x in enumerate(row) if i != j)
    if not any(off) and min(diagonal) > 0:  # the axes are the body's, and all digits are known
        return positive_numbers(diagonal, name), None
    axes = wide_axes(matrix)
    if axes.values[0] <= len(A) * Fraction(_EPSILON) * axes.values[-1]:
        raise InvalidInput(
            (name,),
            "a positive definite matrix",
            f"one with eigenvalue {float(axes.values[0]):.3g}",
        )
    return axes.values, axes


def symmetric_matrix(A: Any, name: str = "A") -> tuple[tuple[Fraction, ...], ...]:
    """Return the symmetric part of a matrix exactly; raises InvalidInput unless it is all of it to
    1e-9 of the largest entry.
    """
    given = exact_matrix(A, (name,), len(A))
    matrix = to_float(given)
    asymmetry = np.abs(matrix / 2 - matrix.T / 2)  # a sum may leave the range of a float
    if np.max(asymmetry) > INPUT_TOLERANCE / 2 * np.max(np.abs(matrix)):
        i, j = divmod(int(np.argmax(asymmetry)), len(given))
        raise InvalidInput(
            (name, i, j),
            "a symmetric matrix",
            f"{matrix[i, j]} against {matrix[j, i]} across the diagonal",
        )
    return tuple(
        tuple((x + y) / 2 for x, y in zip(*lines, strict=True))
        for lines in zip(given, zip(*given, strict=True), strict=True)
    )
