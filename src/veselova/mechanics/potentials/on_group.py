"""Potentials on a matrix group: sums of monomials in the entries of g, with their left-invariant
derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import Path, read_only
from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.exact_input import plain
from veselova.mechanics.core.flow import FLOATS, Operations
from veselova.mechanics.groups.matrix_group import MatrixGroup
from veselova.mechanics.potentials.laurent import FIELDS, read_list, read_terms, read_whole_numbers

__all__ = ["GroupPotential"]

Array = NDArray[np.float64]

#: Limits of one potential: beyond them it is no formula that someone wrote down.
_MOST_TERMS = 1000
_MOST_FACTORS = 64
_LARGEST_POWER = 64

_FORM = '{"coefficient": c, "powers": [[i, j, p], …]} for c Π g_ij^p'

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
        terms = read_terms(value, ("potential",), _MOST_TERMS, _FORM, partial(_factors, size))
        coefficients, powers = zip(*terms, strict=True)
        given = [{name: plain(monomial[name]) for name in FIELDS} for monomial in value]
        return cls(read_only(np.array(coefficients)), powers, given)

    def scale(self, factor: float) -> GroupPotential:
        """Return the potential times a factor."""
        return replace(self, coefficients=factor * self.coefficients)

    def _factors_at(self, g: Any) -> list[list[Any]]:
        return [[g[..., i, j] ** p for i, j, p in factors] for factors in self.powers]

    def value(self, g: Any) -> Any:
        """Return v at matrices (…, N, N)."""
        terms = zip(self.coefficients, self._factors_at(g), strict=True)
        return sum((prod(factors, start=c) for c, factors in terms), 0.0 * g[..., 0, 0])

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
                others = prod(factors[:l] + factors[l + 1 :], start=coefficients[k])
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


def _factors(size: int, value: Any, path: Path) -> tuple[tuple[int, int, int], ...]:
    triples = read_list(
        value, path, 0, _MOST_FACTORS, f"a list of at most {_MOST_FACTORS} triples [i, j, p]"
    )
    ranges = [(1, size), (1, size), (-_LARGEST_POWER, _LARGEST_POWER)]
    powers: dict[tuple[int, int], int] = {}
    for l, triple in enumerate(triples):
        i, j, p = read_whole_numbers(triple, (*path, l), ranges)
        powers[i - 1, j - 1] = powers.get((i - 1, j - 1), 0) + p
    if any(abs(p) > _LARGEST_POWER for p in powers.values()):
        required = f"powers of one entry that sum to at most {_LARGEST_POWER}"
        raise InvalidInput(path, required, "more")
    return tuple((i, j, p) for (i, j), p in powers.items() if p)
