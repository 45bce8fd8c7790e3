"""Potentials on a matrix group: sums of monomials in the entries of g, with their left-invariant
derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    missing_fields,
    show,
    unknown_fields,
)
from veselova.mechanics.core.exact_input import exact_number, plain, read_only, require_each
from veselova.mechanics.core.flow import FLOATS, Operations
from veselova.mechanics.groups.matrix_group import MatrixGroup

__all__ = ["GroupPotential"]

Array = NDArray[np.float64]

#: Limits of one potential: beyond them it is no formula that someone wrote down.
_MOST_MONOMIALS = 1000
_MOST_FACTORS = 64
_LARGEST_POWER = 64

#: The fields of a monomial.
_FIELDS = ("coefficient", "powers")

_MONOMIAL = 'an object {"coefficient": c, "powers": [[i, j, p], …]} for c Π g_ij^p'

#: Group elements at which invariance of a potential is looked for; a polynomial that vanishes at so
#: many vanishes.
_SAMPLES = 12
_VANISHES = 1e-9


@dataclass(frozen=True, eq=False)
class GroupPotential:
    """v(g) = Σ_k c_k Π g_ij^p.

    - coefficients: (K,)
    - powers: for every monomial its factors (i, j, p), i and j from 0, p ≠ 0, no entry twice
    """

    coefficients: Array
    powers: tuple[tuple[tuple[int, int, int], ...], ...]
    given: Any = None

    @classmethod
    def of(cls, value: Any, size: int) -> GroupPotential:
        """Return the potential that a list of monomials states, i and j from 1 to ``size``; raises
        InvalidInput.
        """
        path = ("potential",)
        if (
            isinstance(value, (str, bytes))
            or not isinstance(value, Sequence)
            or not 0 < len(value) <= _MOST_MONOMIALS
        ):
            raise InvalidInput(
                path, f"null or a list of 1 to {_MOST_MONOMIALS} monomials", show(value)
            )
        terms = require_each(partial(_monomial, size), value, path)
        coefficients, powers = zip(*terms, strict=True)
        given = [{name: plain(monomial[name]) for name in _FIELDS} for monomial in value]
        return cls(read_only(np.array(coefficients)), powers, given)

    def scale(self, factor: float) -> GroupPotential:
        """Return the potential times a factor."""
        return replace(self, coefficients=factor * self.coefficients)

    def _factors_at(self, g: Any) -> list[list[Any]]:
        return [[g[..., i, j] ** p for i, j, p in factors] for factors in self.powers]

    def value(self, g: Any) -> Any:
        """Return v at matrices (…, N, N)."""
        total = 0.0 * g[..., 0, 0]
        for c, factors in zip(self.coefficients, self._factors_at(g), strict=True):
            total = total + _product(c, factors)
        return total

    def magnitude(self, g: Array) -> Array:
        """Return Σ |c_k| Π |g_ij|^p at matrices (…, N, N), of which ε is the rounding
        of a value.
        """
        return np.asarray(
            replace(self, coefficients=np.abs(self.coefficients)).value(np.abs(g)), dtype=np.float64
        )

    def slope(self, g: Any, coefficients: Any) -> Any:
        """Return the matrix ∂v/∂g_ij, (…, N, N), for given coefficients, in numbers or symbols."""
        slope = 0.0 * g
        for k, factors in enumerate(self._factors_at(g)):
            for l, (i, j, p) in enumerate(self.powers[k]):
                others = _product(coefficients[k], factors[:l] + factors[l + 1 :])
                slope[..., i, j] = slope[..., i, j] + others * (
                    float(p) * (g[..., i, j] ** (p - 1) if p != 1 else 1.0)
                )
        return slope

    def gradient(
        self, group: MatrixGroup, g: Any, coefficients: Any = None, ops: Operations = FLOATS
    ) -> Any:
        """Return the Lie derivatives y_a(v) along the left-invariant fields gY_a, in coordinates
        (…, D).
        """
        pulled = ops.dot(
            np.swapaxes(g, -1, -2),
            self.slope(g, self.coefficients if coefficients is None else coefficients),
        )
        return group.covector(pulled, ops)

    @property
    def singular_entries(self) -> tuple[tuple[int, int], ...]:
        """Return the entries (i, j) that occur with a negative power, so that v is infinite where
        g_ij = 0.
        """
        return tuple(sorted({(i, j) for factors in self.powers for i, j, p in factors if p < 0}))

    def singular_part(self, entry: tuple[int, int]) -> GroupPotential:
        """Return the monomials with a negative power of an entry."""
        kept = [
            k
            for k, factors in enumerate(self.powers)
            if any((i, j) == entry and p < 0 for i, j, p in factors)
        ]
        return GroupPotential(self.coefficients[kept], tuple(self.powers[k] for k in kept))

    def strength(self, g: Array) -> float:
        """Return a bound on the slope of v: Σ |c_k| Σ|p| Π|g_ij|^p, with |g_ij| = 1 under positive
        powers.
        """
        total = 0.0
        for c, factors in zip(self.coefficients, self.powers, strict=True):
            total += (
                abs(c)
                * sum(abs(p) for *_, p in factors)
                * np.prod([abs(g[i, j]) ** p for i, j, p in factors if p < 0])
            )
        return float(total)

    def invariant_directions(self, group: MatrixGroup, space: Array) -> Array:
        """Return orthonormal rows (k, d): combinations of d elements ``space`` along whose
        right-invariant fields v is constant.

        Ad_g y(v) has no component along them at any g; they are found at random group elements.
        """
        rng = np.random.default_rng(group.dimension)
        g = np.array(
            [
                group.exponential(2 * rng.normal(size=group.dimension))
                for _ in range(max(_SAMPLES, 2 * len(space)))
            ]
        )
        torque = group.adjoint(g, self.gradient(group, g))
        size = np.max(np.abs(torque), axis=1, keepdims=True)
        torque = np.divide(torque, size, out=np.zeros_like(torque), where=size > 0)
        _, values, vectors = np.linalg.svd(torque @ space.T, full_matrices=True)
        return np.asarray(vectors[int(np.sum(values > _VANISHES)) :], dtype=np.float64)


def _product(first: Any, factors: list[Any]) -> Any:
    for factor in factors:
        first = first * factor
    return first


def _monomial(
    size: int, item: Any, path: tuple[str | int, ...]
) -> tuple[float, tuple[tuple[int, int, int], ...]]:
    if not isinstance(item, Mapping):
        raise InvalidInput(path, _MONOMIAL, show(item))
    faults = Faults()
    faults.found += unknown_fields(path, item, _FIELDS) + missing_fields(path, item, _FIELDS)
    coefficient = faults.attempt(exact_number, item.get("coefficient", 0), (*path, "coefficient"))
    powers = faults.attempt(_factors, item.get("powers", ()), size, (*path, "powers"))
    faults.require_none()
    return float(coefficient), powers


def _factors(
    value: Any, size: int, path: tuple[str | int, ...]
) -> tuple[tuple[int, int, int], ...]:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if (
        isinstance(value, (str, bytes))
        or not isinstance(value, Sequence)
        or len(value) > _MOST_FACTORS
    ):
        raise InvalidInput(
            path, f"a list of at most {_MOST_FACTORS} triples [i, j, p]", show(value)
        )
    powers: dict[tuple[int, int], int] = {}
    for l, item in enumerate(value):
        item = item.tolist() if isinstance(item, np.ndarray) else item
        whole = isinstance(item, Sequence) and not isinstance(item, (str, bytes)) and len(item) == 3
        if not whole or not all(isinstance(x, int) and not isinstance(x, bool) for x in item):
            raise InvalidInput((*path, l), "three whole numbers [i, j, p]", show(item))
        i, j, p = item
        if not (1 <= i <= size and 1 <= j <= size):
            raise InvalidInput(
                (*path, l), f"an entry g_ij with i and j from 1 to {size}", f"i = {i}, j = {j}"[:60]
            )
        if abs(p) > _LARGEST_POWER:
            raise InvalidInput(
                (*path, l, 2), f"a power from −{_LARGEST_POWER} to {_LARGEST_POWER}", show(p)
            )
        powers[i - 1, j - 1] = powers.get((i - 1, j - 1), 0) + p
    if any(abs(p) > _LARGEST_POWER for p in powers.values()):
        raise InvalidInput(
            path, f"powers of one entry that sum to at most {_LARGEST_POWER}", "more"
        )
    return tuple((i, j, p) for (i, j), p in powers.items() if p)
