"""The tables of theta sums (analytic.theta.riemann_theta): what Gaussians and waves are multiplied
with, for many characteristics at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.trigonometric_sums import waves_at

__all__ = ["SIGNS", "Family", "Group"]

Array = NDArray[np.float64]

#: (−1)^m by m modulo two.
SIGNS = np.array([1.0, -1.0])


@dataclass(frozen=True)
class Family:
    """M characteristics with the same Gaussians and waves.

    - orders: (X, |F|): 2x of the waves
    - tables: (M·W, K): w_x (−1)^{2k·ε_G} (cos, −sin) 2πx·(Ck + δ_F) for each of M, W = 2X;
      without waves the signs, W = 1
    """

    orders: NDArray[np.int64]
    tables: Array

    def sums(self, gaussian_factors: Array, along: Array) -> Array:
        """Return the sums without their signs, shape (M, N); ``along`` (W, N): cosines of each x,
        then sines.
        """
        weighted = (self.tables @ gaussian_factors.T).reshape(-1, *along.shape)
        return np.asarray(np.multiply(weighted, along, out=weighted).sum(axis=1))


@dataclass(frozen=True)
class Group:
    """The families with one δ_G, and of all their characteristics:

    - places: among those asked for
    - parities: (|G|, M): 2ε_G
    - signs: (M,): of their reduction modulo one, and det T_GG^{−1/2}
    """

    delta_G: Array
    families: list[Family]
    places: list[int]
    parities: Array
    signs: Array

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
