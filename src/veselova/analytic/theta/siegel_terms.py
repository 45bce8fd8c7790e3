"""The terms of a theta sum after Siegel reduction: W_k and the powers of e^{2πi v}, or the terms
themselves where these leave the range of a double.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

__all__ = ["ExactTerms", "TermTable"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]

_EPSILON = float(np.finfo(float).eps)

#: Calibrated: rounding of the factors of a term, in that of one operation.
_FACTOR_ROUNDING = 4.0


@dataclass(frozen=True)
class TermTable:
    """The terms of a sum by the halves of the k's.

    - left, right: halves of the k's, (I, a) and (J, g−a), those of equal parities side by side
    - weights: W between them, sparse (J, I)
    - points: the k's, (K, g), in the order of the weights
    - rounding: the relative error of each term, (K,), at v in the cell
    """

    left: Array
    right: Array
    weights: csr_array
    points: Array
    rounding: Array

    @classmethod
    def of(cls, tau: Complex, points: Array) -> TermTable:
        """Return the table of the points k (K, g)."""
        split = (points.shape[1] + 1) // 2
        (left, i), (right, j) = _by_parity(points[:, :split]), _by_parity(points[:, split:])
        order = np.lexsort((i, j))
        k = points[order]
        values = np.exp(1j * np.pi * np.sum((k @ tau) * k, axis=1))
        size, sizes = np.abs(k), np.abs(tau)
        of_W = np.pi * np.sum((size @ sizes) * size, axis=1)
        of_powers = np.pi * size @ (1 + np.sum(sizes, axis=1))
        of_factors = _FACTOR_ROUNDING + np.sum(size, axis=1)
        rounding = _EPSILON * (of_factors + of_W + of_powers) / 2
        weights = csr_array((values, (j[order], i[order])), shape=(len(right), len(left)))
        return cls(left, right, weights, k, rounding)

    @property
    def width(self) -> int:
        """Return the numbers that a point needs."""
        return max(len(self.left), len(self.right))

    def _powers(self, v: Complex) -> tuple[Complex, Complex]:
        """Return the powers e^{2πi k·v} of both halves, (I, N) and (J, N)."""
        split = self.left.shape[1]
        right = _products_of_powers(self.right, v[:, split:])
        return _products_of_powers(self.left, v[:, :split]), right

    @cached_property
    def _classes(self) -> tuple[list[tuple[slice, csr_array]], Integers, Array]:
        """Return the rows of the left half of one parity each, with W of them; where those of the
        right half begin; and the parities p of both together, (classes, g).
        """
        lefts, rights = _firsts(self.left), _firsts(self.right)
        slices = [slice(*ends) for ends in itertools.pairwise([*lefts.tolist(), len(self.left)])]
        pairs = itertools.product(self.left[lefts] % 2, self.right[rights] % 2)
        parities = np.array([np.concatenate(pair) for pair in pairs])
        return [(rows, csr_array(self.weights[:, rows])) for rows in slices], rights, parities

    def _sums(self, P: Complex, R: Complex, half_turns: Integers) -> Complex:
        """Return Σ (−1)^{h·k} R W P, (M, N): the signs depend on the parities of k alone, so each
        class of these is summed once.
        """
        if not half_turns.any():
            one = np.sum(R * (self.weights @ P), axis=0)
            return np.broadcast_to(one, (len(half_turns), *one.shape))
        lefts, rights, parities = self._classes
        sums = [np.add.reduceat(R * (W @ P[rows]), rights, axis=0) for rows, W in lefts]
        return np.asarray((1.0 - 2.0 * np.mod(half_turns @ parities.T, 2)) @ np.concatenate(sums))

    def moments(self, v: Complex, order: int, half_turns: Integers) -> list[Complex]:
        """Return Σ ± W e^{2πi k·v}, and with k_i and k_ik_j in the sum, (M, N), (M, N, g), (M, N,
        g, g).

        half_turns: h (M, g), whole numbers; the signs are (−1)^{h·k}
        """
        split, genus = self.left.shape[1], v.shape[1]
        left, right = self._powers(v)

        def total(*chosen: int) -> Complex:
            P, R = left, right
            for c in chosen:
                if c < split:
                    P = P * self.left[:, c, None]
                else:
                    R = R * self.right[:, c - split, None]
            return self._sums(P, R, half_turns)

        found = [total()]
        if order >= 1:
            found.append(np.stack([total(i) for i in range(genus)], axis=2))
        if order == 2:
            second = np.empty((len(half_turns), len(v), genus, genus), dtype=complex)
            for i, j in itertools.combinations_with_replacement(range(genus), 2):
                second[:, :, i, j] = second[:, :, j, i] = total(i, j)
            found.append(second)
        return found

    def sizes(self, v: Complex, most: int) -> tuple[list[Array], list[Array]]:
        """Return Σ |term|·κ^p, p = 0 … most, κ the largest |k_i|, and the same with the relative
        errors of the terms, (N,) each.
        """
        left, right = map(np.abs, self._powers(v))
        kappa = np.max(np.abs(self.points), axis=1)

        def total(factors: Array) -> Array:
            entries = np.abs(self.weights.data) * factors, self.weights.indices, self.weights.indptr
            weights = csr_array(entries, self.weights.shape)
            return np.asarray(np.sum(right * (weights @ left), axis=0))

        powers = [kappa**p for p in range(most + 1)]
        return [total(x) for x in powers], [total(self.rounding * x) for x in powers]


@dataclass(frozen=True)
class ExactTerms:
    """The terms of a sum where Im τ is large: rounded, each from its exponent in balls, whose parts
    leave the range of a double one by one though few terms matter.

    - points: the k's, (K, g)
    """

    points: Array

    @property
    def width(self) -> int:
        """Return the numbers that a point needs."""
        return len(self.points)

    def at(self, tau: Any, v: Any) -> Complex:
        """Return the terms, (N, K), at points v (N, g), balls as τ."""
        k = flint.acb_mat(self.points.tolist())
        rows = zip((k * tau).tolist(), self.points.astype(int).tolist(), strict=True)
        own = [sum(x * m for x, m in zip(*row, strict=True)) for row in rows]
        twice = (2 * v * k.transpose()).tolist()
        return np.array(
            [[complex((x + e).exp_pi_i()) for x, e in zip(row, own, strict=True)] for row in twice]
        )

    def moments(self, terms: Complex, order: int, half_turns: Integers) -> list[Complex]:
        """Return what ``TermTable.moments`` does, from the terms (N, K)."""
        k = self.points
        signed = (1.0 - 2.0 * np.mod(half_turns @ k.T, 2))[:, None, :] * terms
        sums = ["mnk->mn", "mnk,ki->mni", "mnk,ki,kj->mnij"][: order + 1]
        return [np.einsum(text, signed, *[k] * p) for p, text in enumerate(sums)]

    def sizes(self, terms: Complex, most: int) -> tuple[list[Array], list[Array]]:
        """Return what ``TermTable.sizes`` does, from the terms (N, K)."""
        kappa = np.max(np.abs(self.points), axis=1)
        found = [np.abs(terms) @ kappa**p for p in range(most + 1)]
        return found, [_FACTOR_ROUNDING * _EPSILON * x for x in found]


def _products_of_powers(rows: Array, v: Complex) -> Complex:
    """Return e^{2πi k·v} for the whole numbers k (I, a) and points v (N, a), (I, N): products of
    powers of a few exponentials.
    """
    result = np.ones((len(rows), len(v)), dtype=complex)
    for k, own in zip(rows.T.astype(np.int64), v.T, strict=True):
        most = int(np.max(np.abs(k), initial=0))
        powers = np.ones((2 * most + 1, len(v)), dtype=complex)
        up = np.exp(2j * np.pi * own)
        for sign, one in ((1, up), (-1, 1 / up)):
            for j in range(1, most + 1):
                np.multiply(powers[most + sign * (j - 1)], one, out=powers[most + sign * j])
        result *= powers[most + k]
    return result


def _by_parity(points: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the distinct rows of whole numbers, those of equal parities side by side, and which of
    them each row is.
    """
    keyed = np.hstack([np.mod(points, 2), points])
    rows, which = np.unique(keyed, axis=0, return_inverse=True)
    return rows[:, points.shape[1] :], which.ravel()


def _firsts(rows: Array) -> Integers:
    """Return the first of the rows of each parity."""
    changes = np.any(np.diff(np.mod(rows, 2), axis=0), axis=1)
    return np.flatnonzero(np.concatenate([[True], changes])).astype(np.int64)
