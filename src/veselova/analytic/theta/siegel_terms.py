"""The terms of a theta sum after Siegel reduction: W_k and the powers of e^{2πi v}, or the terms
themselves where these leave the range of a double.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
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
    """The terms of a sum by the halves of the k's, in doubles or in balls.

    - left, right: halves of the k's, (I, a) and (J, g−a)
    - weights: W between them, (J, I): sparse in doubles, FLINT's matrix in balls
    - points: the k's, (K, g), in the order of the weights
    """

    left: Array
    right: Array
    weights: Any
    points: Array

    @classmethod
    def of(cls, points: Array, values: NDArray[Any]) -> TermTable:
        """Return the table of the points k (K, g) and the values of W there, (K,)."""
        split = (points.shape[1] + 1) // 2
        (left, i), (right, j) = (
            np.unique(half, axis=0, return_inverse=True)
            for half in (points[:, :split], points[:, split:])
        )
        i, j = i.ravel(), j.ravel()
        order = np.lexsort((i, j))
        places, shape = (j[order], i[order]), (len(right), len(left))
        if values.dtype == object:
            weights = np.zeros(shape, dtype=object)
            weights[places] = values[order]
            return cls(left, right, flint.acb_mat(weights.tolist()), points[order])
        return cls(left, right, csr_array((values[order], places), shape=shape), points[order])

    @property
    def width(self) -> int:
        """Return the numbers that a point needs."""
        return max(len(self.left), len(self.right))

    def _powers(self, u: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the products of powers of u (N, g) of both halves, (I, N) and (J, N)."""
        split = self.left.shape[1]
        return _products_of_powers(self.left, u[:, :split]), _products_of_powers(
            self.right, u[:, split:]
        )

    def _sums(self, P: NDArray[Any], R: NDArray[Any], half_turns: Integers) -> NDArray[Any]:
        """Return Σ (−1)^{h·k} R W P, (M, N): a sign is one of the left half times one of the
        right.
        """
        split = self.left.shape[1]
        found = np.empty((len(half_turns), P.shape[1]), dtype=P.dtype)
        patterns, which = np.unique(half_turns[:, :split] % 2, axis=0, return_inverse=True)
        for number, pattern in enumerate(patterns):
            rows = np.flatnonzero(which.ravel() == number)
            products = R * _product(self.weights, P * _signs(self.left @ pattern)[:, None])
            # of one type: products of two types are fifty times as slow
            signs = _signs(half_turns[rows, split:] @ self.right.T)
            found[rows] = signs.astype(P.dtype) @ products
        return found

    def moments(self, u: NDArray[Any], order: int, half_turns: Integers) -> list[NDArray[Any]]:
        """Return Σ ± W u^k, and with k_i and k_ik_j in the sum, (M, N), (M, N, g), (M, N,
        g, g).

        half_turns: h (M, g), whole numbers; the signs are (−1)^{h·k}
        """
        split, genus = self.left.shape[1], u.shape[1]
        left, right = self._powers(u)

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
            second = np.empty((*found[0].shape, genus, genus), dtype=complex)
            for i, j in itertools.combinations_with_replacement(range(genus), 2):
                second[:, :, i, j] = second[:, :, j, i] = total(i, j)
            found.append(second)
        return found

    def sizes(self, u: Complex, tau: Complex, most: int) -> tuple[list[Array], list[Array]]:
        """Return Σ |term|·κ^p, p = 0 … most, κ the largest |k_i|, and the same with the relative
        errors of the terms, (N,) each.
        """
        left, right = map(np.abs, self._powers(u))
        size, sizes = np.abs(self.points), np.abs(tau)
        kappa = np.max(size, axis=1)
        of_W = np.pi * np.sum((size @ sizes) * size, axis=1)
        of_powers = np.pi * size @ (1 + np.sum(np.abs(tau.imag), axis=1))
        rounding = _FACTOR_ROUNDING + np.sum(size, axis=1) + of_W + of_powers

        def total(factors: Array) -> Array:
            entries = np.abs(self.weights.data) * factors, self.weights.indices, self.weights.indptr
            weights = csr_array(entries, self.weights.shape)
            return np.asarray(np.sum(right * (weights @ left), axis=0))

        powers = [kappa**p for p in range(most + 1)]
        return [total(x) for x in powers], [_EPSILON / 2 * total(rounding * x) for x in powers]


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
        signed = _signs(half_turns @ k.T)[:, None, :] * terms
        sums = ["mnk->mn", "mnk,ki->mni", "mnk,ki,kj->mnij"][: order + 1]
        return [np.einsum(text, signed, *[k] * p) for p, text in enumerate(sums)]

    def sizes(self, terms: Complex, _: Complex, most: int) -> tuple[list[Array], list[Array]]:
        """Return what ``TermTable.sizes`` does, from the terms (N, K)."""
        kappa = np.max(np.abs(self.points), axis=1)
        found = [np.abs(terms) @ kappa**p for p in range(most + 1)]
        return found, [_FACTOR_ROUNDING * _EPSILON * x for x in found]


def _product(weights: Any, powers: NDArray[Any]) -> NDArray[Any]:
    """Return the product of weights and powers, (J, N)."""
    if powers.dtype != object:
        return np.asarray(weights @ powers)
    found = weights * flint.acb_mat(powers.tolist())
    entries = np.fromiter(found.entries(), dtype=object, count=found.nrows() * found.ncols())
    return entries.reshape(found.nrows(), -1)


def _products_of_powers(rows: Array, u: NDArray[Any]) -> NDArray[Any]:
    """Return Π_i u_i^{k_i} for the whole numbers k (I, a) and points u (N, a), (I, N)."""
    result = np.ones((len(rows), len(u)), dtype=u.dtype)
    for k, up in zip(rows.T.astype(np.int64), u.T, strict=True):
        most = int(np.max(np.abs(k), initial=0))
        powers = np.ones((2 * most + 1, len(u)), dtype=u.dtype)
        for sign, one in ((1, up), (-1, 1 / up)):
            for j in range(1, most + 1):
                np.multiply(powers[most + sign * (j - 1)], one, out=powers[most + sign * j])
        result *= powers[most + k]
    return result


def _signs(half_turns: Array) -> Array:
    """Return (−1)^h of whole numbers."""
    return 1.0 - 2.0 * np.mod(half_turns, 2)
