"""The matrix A of a body: given along its principal axes, or as a symmetric matrix that is diagonalised."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.errors import InvalidInput, shown
from veselova.mechanics.exact import exact_matrix, exact_vector, is_matrix, to_float
from veselova.mechanics.sphere import INPUT_TOLERANCE

__all__ = ["positive_numbers", "principal_inertia", "require_moderate"]

Array = NDArray[np.float64]

#: The inverse of a smaller number is no float; the square of one up to the second is.
_LEAST, _MODERATE = Fraction(1, 10**308), Fraction(10**120)


def positive_numbers(A: Any, name: str = "A") -> tuple[Fraction, ...]:
    """Return the entries of A, two or more numbers above zero, exactly; ``name`` is that of the argument."""
    diagonal = exact_vector(A, (name,))
    if len(diagonal) < 2:
        raise InvalidInput((name,), "at least 2 numbers (n ≥ 2)", f"{len(diagonal)}")
    for i, value in enumerate(diagonal):
        if value <= 0 or float(value) == 0:
            raise InvalidInput((name, i), "a finite number greater than 0", shown(A[i]))
        if value < _LEAST:
            raise InvalidInput((name, i), "a number whose inverse is within the range of a float", shown(A[i]))
    return diagonal


def require_moderate(values: tuple[Fraction, ...], name: str, limit: Fraction = _MODERATE) -> None:
    """Raise InvalidInput unless the numbers and their inverses are below ``limit``: some products of them must stay floats."""
    least, most = min(values), max(values)
    if most > limit or least < 1 / limit:
        given = f"numbers from {float(least):.3g} to {float(most):.3g}"
        raise InvalidInput((name,), f"numbers between {float(1 / limit):.0e} and {float(limit):.0e}", given)


def principal_inertia(A: Any, name: str = "A") -> tuple[tuple[Fraction, ...], Array | None]:
    """Return the diagonal of A as exact numbers, and the principal axes as columns when A was given as a matrix.

    The axes are a rotation, determinant +1, so that vector products and determinants of frames are the same along them.
    ``name``: of the argument, for its refusals.
    """
    if not is_matrix(A):
        return positive_numbers(A, name), None
    n = len(A)
    if n < 2:
        raise InvalidInput((name,), "at least 2 rows (n ≥ 2)", f"{n}")
    matrix = to_float(exact_matrix(A, (name,), n))
    asymmetry = np.abs(matrix - matrix.T)
    if np.max(asymmetry) > INPUT_TOLERANCE * np.max(np.abs(matrix)):
        i, j = divmod(int(np.argmax(asymmetry)), n)
        raise InvalidInput((name, i, j), "a symmetric matrix", f"{matrix[i, j]} against {matrix[j, i]} across the diagonal")
    values, axes = np.linalg.eigh(matrix / 2 + matrix.T / 2)  # the sum itself may leave the range of a float
    if values[0] <= n * np.finfo(float).eps * values[-1]:
        raise InvalidInput((name,), "a positive definite matrix", f"one with eigenvalue {values[0]:.3g}")
    return tuple(map(Fraction, values.tolist())), _right_handed(axes)


def _right_handed(axes: Array) -> Array:
    """Return the axes, the last one reversed where the determinant is −1: eigenvectors come with any sign."""
    axes[:, -1] *= np.linalg.slogdet(axes)[0]
    return axes
