"""Laurent polynomials Σ c γ_1^a γ_2^b γ_3^c in three variables, with values and gradients in
numbers or symbols; and terms {"coefficient": c, "powers": …} that users give, read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import Path, list_items, require_each, whole_number
from veselova.mechanics.core.errors import Faults, InvalidInput, field_faults, show
from veselova.mechanics.core.exact_input import exact_number

__all__ = [
    "FIELDS",
    "LaurentPolynomial",
    "monomials",
    "read_list",
    "read_terms",
    "read_whole_numbers",
]

Array = NDArray[np.float64]

Powers = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class LaurentPolynomial:
    """Σ_k c_k Π_j γ_j^{p_kj} with integer powers of either sign; no two terms share their powers,
    no coefficient is zero.

    - powers: of each term, three integers
    - coefficients: (k,)
    """

    powers: tuple[Powers, ...]
    coefficients: Array

    @classmethod
    def of(cls, terms: Iterable[tuple[float, Powers]]) -> LaurentPolynomial:
        """Return the sum of terms (coefficient, powers)."""
        collected: dict[Powers, float] = {}
        for coefficient, powers in terms:
            collected[powers] = collected.get(powers, 0.0) + coefficient
        kept = {powers: c for powers, c in collected.items() if c != 0}
        return cls(tuple(kept), np.array(list(kept.values()), dtype=np.float64))

    @classmethod
    def quadratic(cls, form: Array) -> LaurentPolynomial:
        """Return (Sγ,γ) for a symmetric matrix S, (3, 3)."""
        units: list[Powers] = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
        return cls.of(
            (float(form[i, j]), _add(units[i], units[j])) for i in range(3) for j in range(3)
        )

    def __bool__(self) -> bool:
        return bool(self.powers)

    def __add__(self, other: LaurentPolynomial) -> LaurentPolynomial:
        return LaurentPolynomial.of([*self._terms, *other._terms])

    def __mul__(self, other: LaurentPolynomial) -> LaurentPolynomial:
        return LaurentPolynomial.of(
            (c * d, _add(p, r)) for c, p in self._terms for d, r in other._terms
        )

    def times(self, factor: float) -> LaurentPolynomial:
        """Return the polynomial multiplied by a number."""
        return LaurentPolynomial.of((factor * c, powers) for c, powers in self._terms)

    @property
    def _terms(self) -> list[tuple[float, Powers]]:
        return list(zip(self.coefficients.tolist(), self.powers, strict=True))

    @cached_property
    def exponents(self) -> Array:
        """Return the powers as an array, (k, 3)."""
        return np.array(self.powers, dtype=np.float64).reshape(-1, 3)

    @cached_property
    def slopes(self) -> tuple[Array, Array, Array]:
        """Return the terms of the gradient: exponents (l, 3), coefficients (l,), and which
        component each belongs to, (3, l).
        """
        terms = [
            (j, c * p[j], (p[0] - (j == 0), p[1] - (j == 1), p[2] - (j == 2)))
            for j in range(3)
            for c, p in self._terms
            if p[j] != 0
        ]
        exponents = np.array([powers for _, _, powers in terms], dtype=np.float64).reshape(-1, 3)
        components = np.array([[float(j == i) for j, _, _ in terms] for i in range(3)])
        return exponents, np.array([c for _, c, _ in terms]), components

    @property
    def singular_axes(self) -> tuple[int, ...]:
        """Return the axes that occur with a negative power, so that the plane γ_j = 0
        is singular.
        """
        return tuple(j for j in range(3) if any(p[j] < 0 for p in self.powers))

    def singular_part(self, axis: int) -> LaurentPolynomial:
        """Return the terms with a negative power of γ_axis."""
        return LaurentPolynomial.of((c, p) for c, p in self._terms if p[axis] < 0)

    def value(self, gamma: Array) -> Array:
        """Return the values at points (..., 3), shape (...)."""
        return np.asarray(monomials(self.exponents, gamma) @ self.coefficients, dtype=np.float64)

    def magnitude(self, gamma: Array) -> Array:
        """Return Σ|c_k| Π_j |γ_j|^{p_kj} at points (..., 3), shape (...), of which ε is the
        rounding of a value.
        """
        return np.asarray(
            monomials(self.exponents, np.abs(gamma)) @ np.abs(self.coefficients), dtype=np.float64
        )

    def gradient(self, gamma: Array) -> Array:
        """Return the gradients in R³ at points (..., 3), shape (..., 3)."""
        exponents, coefficients, components = self.slopes
        return np.asarray(
            (monomials(exponents, gamma) * coefficients) @ components.T, dtype=np.float64
        )

    def size(self, gamma: Array) -> float:
        """Return Σ|c_k| Π_j |γ_j|^{min(p_kj, 0)}: how large terms become on the sphere, this near
        to singular planes.
        """
        return float(
            monomials(np.minimum(self.exponents, 0), np.abs(gamma)) @ np.abs(self.coefficients)
        )


def monomials(exponents: Array, gamma: Any) -> Any:
    """Return Π_j γ_j^{p_kj} for exponents (k, 3), shape (..., k); of symbols, (3,), by repeated
    multiplication.
    """
    if gamma.dtype != object:
        return np.prod(gamma[..., None, :] ** exponents, axis=-1)
    products = np.empty(len(exponents), dtype=object)
    for k, powers in enumerate(exponents):
        factors = [
            x if p > 0 else 1.0 / x
            for x, p in zip(gamma, powers, strict=True)
            for _ in range(abs(int(p)))
        ]
        products[k] = prod(factors, start=1.0)
    return products


def _add(p: Powers, r: Powers) -> Powers:
    return p[0] + r[0], p[1] + r[1], p[2] + r[2]


#: The fields of a term.
FIELDS = ("coefficient", "powers")

Exponents = TypeVar("Exponents")


def read_list(given: Any, path: Path, least: int, most: int, required: str) -> list[Any]:
    """Return a list of so many entries; raises InvalidInput."""
    listed = list_items(given, path, required)
    if not least <= len(listed) <= most:
        raise InvalidInput(path, required, f"{len(listed)} of them")
    return listed


def read_terms(
    given: Any, path: Path, most: int, form: str, read_powers: Callable[[Any, Path], Exponents]
) -> tuple[tuple[float, Exponents], ...]:
    """Return coefficients and powers of 1 to ``most`` terms; raises InvalidInput.

    form: what a term is, in words
    """

    def read(item: Any, place: Path) -> tuple[float, Exponents]:
        if not isinstance(item, Mapping):
            raise InvalidInput(place, f"a term {form}", show(item))
        faults = Faults()
        faults.found += field_faults(place, item, FIELDS, FIELDS)
        values: dict[str, Any] = {
            name: faults.attempt(call, item[name], (*place, name))
            for name, call in zip(FIELDS, (exact_number, read_powers), strict=True)
            if name in item
        }
        faults.require_none()
        return float(values["coefficient"]), values["powers"]

    terms = read_list(given, path, 1, most, f"a list of 1 to {most} terms {form}")
    return require_each(read, terms, path)


def read_whole_numbers(
    given: Any, path: Path, ranges: Sequence[tuple[int, int]]
) -> tuple[int, ...]:
    """Return as many whole numbers as there are ranges, each in its own; raises InvalidInput."""
    count = len(ranges)
    listed = read_list(given, path, count, count, f"a list of {count} whole numbers")

    def read(entry: Any, place: Path) -> int:
        return whole_number(entry, place, *ranges[int(place[-1])])

    return require_each(read, listed, path)
