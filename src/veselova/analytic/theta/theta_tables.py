"""The tables of theta sums (analytic.theta.riemann_theta): what Gaussians and waves are multiplied
with, for many characteristics at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.trigonometric_sums import waves_at

__all__ = ["SIGNS", "Blocks", "Family", "Group", "in_blocks"]

Array = NDArray[np.float64]

#: (−1)^m by m modulo two.
SIGNS = np.array([1.0, -1.0])


@dataclass(frozen=True)
class Family:
    """M characteristics with the same Gaussians and waves.

    orders (X, |F|): 2x of the waves
    tables (M·W, K): w_x (−1)^{2k·ε_G} (cos, −sin) 2πx·(Ck + δ_F) for each of M, W = 2X; without
    waves the signs, W = 1
    """

    orders: NDArray[np.int64]
    tables: Array

    @property
    def size(self) -> int:
        """Return M."""
        return len(self.tables) // (2 * len(self.orders) if self.orders.shape[1] else 1)

    def of(self, members: list[int]) -> Family:
        """Return the family of some members."""
        lattice = self.tables.shape[1]
        return Family(
            self.orders, self.tables.reshape(self.size, -1, lattice)[members].reshape(-1, lattice)
        )

    def sums(self, gaussian_factors: Array, along: Array) -> Array:
        """Return the sums without their signs, shape (M, N); ``along`` (W, N): cosines of each x,
        then sines.
        """
        weighted = (self.tables @ gaussian_factors.T).reshape(-1, *along.shape)
        return np.asarray(np.multiply(weighted, along, out=weighted).sum(axis=1))


@dataclass(frozen=True)
class Group:
    """The families with one δ_G, and of all their characteristics:

    places  among those asked for · parities (|G|, M): 2ε_G · signs (M,): of their reduction modulo
        one, and det T_GG^{−1/2}
    """

    delta_G: Array
    families: list[Family]
    places: list[int]
    parities: Array
    signs: Array

    def of(self, places: Mapping[int, int]) -> Group | None:
        """Return the group of the members at some places, the keys, with their new places; None
        where it has none of them.
        """
        selected = [i for i, place in enumerate(self.places) if place in places]
        if not selected:
            return None
        families = []
        first = 0
        for family in self.families:
            last = first + family.size
            members = [i - first for i in selected if first <= i < last]
            families += [family.of(members)] if members else []
            first = last
        new = [places[self.places[i]] for i in selected]
        return Group(self.delta_G, families, new, self.parities[:, selected], self.signs[selected])

    @cached_property
    def _orders(self) -> NDArray[np.int64]:
        return np.concatenate([family.orders for family in self.families])

    @cached_property
    def _highest(self) -> int:
        return int(np.max(np.abs(self._orders), initial=0))

    def sums(self, gaussian_factors: Array, angles: Array) -> Array:
        """Return the sums of all families without their signs, shape (M, N), for the ``angles`` (N,
        |F|) of their waves.
        """
        if not angles.shape[1]:
            return np.concatenate([family.tables @ gaussian_factors.T for family in self.families])
        along = waves_at(angles, self._orders, self._highest)
        result = []
        first = 0
        for family in self.families:
            last = first + len(family.orders)
            result.append(
                family.sums(gaussian_factors, along[:, first:last].reshape(-1, len(angles)))
            )
            first = last
        return np.concatenate(result)


@dataclass(frozen=True)
class Blocks:
    """M characteristics with P different δ_G, all at once for few points, by matrices of P blocks
    of which a row has one.

    shifts (P, |G|): the δ_G
    orders (X, P·|F|): 2x of the waves of each
    tables (2X, P·K): w_x (−1)^{2k·ε_G} cos 2πx·(Ck + δ_F), then −sin
    firsts (M,): the first wave of each
    parities (M, P·|G|), signs (M, 1): as those of a group
    """

    shifts: Array
    orders: Array
    tables: Array
    firsts: NDArray[np.intp]
    parities: Array
    signs: Array

    def of(self, members: list[int]) -> Blocks:
        """Return the tables of some members."""
        ends = np.append(self.firsts, len(self.orders))
        counts = np.diff(ends)[members]
        harmonics = np.concatenate([np.arange(ends[i], ends[i + 1]) for i in members])
        tables = np.concatenate([part[harmonics] for part in np.split(self.tables, 2)])
        return Blocks(
            self.shifts,
            self.orders[harmonics],
            tables,
            np.cumsum(counts) - counts,
            self.parities[members],
            self.signs[members],
        )

    def values(self, gaussian_factors: Array, angles: Array, nearest: Array) -> Array:
        """Return the theta functions, (N, M), from (P, N, K), (P, N, |F|) and (P, N, |G|): see
        ``Theta``.
        """
        phases = self.orders @ _stack_blocks(angles)
        terms = self.tables @ _stack_blocks(gaussian_factors)
        sums = terms[: len(phases)] * np.cos(phases)
        sums += terms[len(phases) :] * np.sin(phases)
        half_turns = (self.parities @ _stack_blocks(nearest)).astype(np.int64)
        result: Array = np.add.reduceat(sums, self.firsts, axis=0)
        result *= self.signs * SIGNS[half_turns & 1]
        return result.T


def in_blocks(rows: NDArray[Any], blocks: NDArray[np.intp], count: int) -> Array:
    """Return rows (R, d), each in its place among ``count`` blocks, shape (R, count·d)."""
    result = np.zeros((len(rows), count, rows.shape[1]))
    result[np.arange(len(rows)), blocks] = rows
    return result.reshape(len(rows), -1)


def _stack_blocks(given: Array) -> Array:
    """Return the blocks (P, N, d) of N points below each other, one column each, shape (P·d, N)."""
    return given.swapaxes(1, 2).reshape(-1, given.shape[1])
