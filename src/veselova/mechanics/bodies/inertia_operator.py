"""Inertia operators 𝓘: 𝔤 → 𝔤 on coordinates in an orthonormal basis; on so(n) also the special one
of (4.5, printed 5.11).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.principal_inertia import symmetric_matrix
from veselova.mechanics.core.arguments import Path, read_only
from veselova.mechanics.core.errors import InvalidInput, InvalidRequest, field_faults, show
from veselova.mechanics.core.exact_input import (
    exact_vector,
    require_moderate,
    scale_number,
    to_float,
)
from veselova.mechanics.core.flow import FLOATS, Operations

__all__ = ["Inertia", "apply_operator", "stated_form"]

Array = NDArray[np.float64]

#: Ratio of moments of inertia beyond which an operator is singular to the digits of a double.
_WIDEST = 1e14

_FORMS = {"special": '{"special": [A_1, …, A_n]}', "matrix": '{"matrix": …}'}


def stated_form(inertia: Any, forms: Mapping[str, str]) -> tuple[str, Any]:
    """Return the form of an inertia that is a mapping with one field, and its data.

    ``forms``: the fields, and what is written for them. Raises InvalidInput.
    """
    required = " or ".join(forms.values())
    if not isinstance(inertia, Mapping):
        raise InvalidInput(("inertia",), required, show(inertia))
    if unknown := field_faults(("inertia",), inertia, list(forms)):
        raise InvalidRequest(unknown)
    if len(inertia) != 1:
        raise InvalidInput(("inertia",), required, show(inertia))
    return next(iter(inertia.items()))


def apply_operator(operator: Any, rows: Any, ops: Operations = FLOATS) -> Any:
    """Return a symmetric operator applied to coordinate rows (…, D); it is a matrix, or its
    diagonal as a vector.
    """
    return rows * operator if operator.ndim == 1 else ops.dot(rows, operator)


@dataclass(frozen=True, eq=False)
class Inertia:
    """A symmetric positive definite operator and its inverse: matrices (D, D), or their diagonals
    (D,) where they have no more.

    A   the numbers of (4.5, printed 5.11) where the operator is the special one, else None
    """

    operator: Array
    inverse: Array
    A: Array | None = None

    @classmethod
    def of(cls, value: Any, n: int) -> Inertia:
        """Return the operator on so(n) that a mapping states, in the basis E_i∧E_j, i < j, in
        lexicographic order.

        ``{"special": [A_1, …, A_n]}`` is (4.5), 𝓘(E_i∧E_j) = (A_iA_j/det A) E_i∧E_j; ``{"matrix":
        …}`` any symmetric positive definite matrix of size n(n−1)/2. Raises InvalidInput.
        """
        form, data = stated_form(value, _FORMS)
        if form == "special":
            return cls.special(data, n)
        return cls.of_matrix(data, n * (n - 1) // 2, ("inertia", "matrix"))

    @classmethod
    def special(cls, A: Any, n: int) -> Inertia:
        """Return the operator (4.5, printed 5.11) of n positive numbers A, each entry rounded once
        from the exact data.
        """
        path = ("inertia", "special")
        exact = exact_vector(A, path, n, scale_number)
        determinant = math.prod(exact)
        entries = [exact[i] * exact[j] / determinant for i in range(n) for j in range(i + 1, n)]
        for entry in (min(entries), max(entries)):
            require_moderate([entry], path)
        if max(entries) > min(entries) * Fraction(_WIDEST):
            given = f"{float(min(entries)):.3g} and {float(max(entries)):.3g}"
            raise InvalidInput(
                path, f"moments of inertia A_iA_j/det A with ratios up to {_WIDEST:.0e}", given
            )
        inverse = to_float([1 / entry for entry in entries])
        return cls(to_float(entries), inverse, to_float(exact))

    @classmethod
    def of_matrix(cls, matrix: Any, size: int, path: Path = ("inertia",)) -> Inertia:
        """Return the operator of a symmetric positive definite matrix of a size; raises
        InvalidInput otherwise.
        """
        exact = to_float(symmetric_matrix(matrix, path, size))
        largest = float(np.max(np.abs(exact)))
        require_moderate([largest], path)
        unit = exact / (largest or 1.0)
        values, axes = np.linalg.eigh(unit)
        if values[0] * _WIDEST <= values[-1]:
            given = f"one with eigenvalue {values[0] * largest:.3g}"
            raise InvalidInput(path, "a positive definite matrix", given)
        inverse: Array = np.asarray(axes / values @ axes.T, dtype=np.float64) / largest
        operator: Array = unit * largest
        if np.count_nonzero(unit) == size:
            operator, inverse = np.diag(operator).copy(), np.asarray(1 / np.diag(operator))
        else:
            inverse = inverse / 2 + inverse.T / 2
        return cls(read_only(operator), read_only(inverse))

    @property
    def matrix(self) -> Array:
        """Return the operator as a matrix (D, D)."""
        return np.diag(self.operator) if self.operator.ndim == 1 else self.operator

    @cached_property
    def moments(self) -> Array:
        """Return the principal moments of inertia (D,), increasing."""
        found = (
            np.sort(self.operator) if self.operator.ndim == 1 else np.linalg.eigvalsh(self.operator)
        )
        return read_only(np.asarray(found, dtype=np.float64))

    @property
    def exponent(self) -> int:
        """Return k with the moments near 2^k: their geometric mean, rounded."""
        return int(np.rint(np.mean(np.log2(np.maximum(self.moments, np.finfo(float).tiny)))))

    def rescale(self) -> Inertia:
        """Return 𝓘/2^k with moments near one, exactly."""
        k = self.exponent
        return Inertia(np.ldexp(self.operator, -k), np.ldexp(self.inverse, k), self.A)

    def __call__(self, rows: Any) -> Any:
        """Return 𝓘 applied to coordinate rows (…, D)."""
        return apply_operator(self.operator, rows)
