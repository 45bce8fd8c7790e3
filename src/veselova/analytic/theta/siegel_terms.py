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


#: Derived: whole numbers up to here are 64 bits.
_LARGEST_KEY = 2.0**62


@dataclass(frozen=True)
class TermTable:
    """The terms of a sum by the halves of the k's, in doubles or in balls.

    - left, right: halves of the k's, (I, a) and (J, g−a), those of equal parities side by side
    - weights: W between them, (J, I); sparse in doubles
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
        (left, i), (right, j) = _by_parity(points[:, :split]), _by_parity(points[:, split:])
        order = np.lexsort((i, j))
        places, shape = (j[order], i[order]), (len(right), len(left))
        if values.dtype == object:
            weights = np.zeros(shape, dtype=object)
            weights[places] = values[order]
            return cls(left, right, weights, points[order])
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

    @cached_property
    def _classes(self) -> tuple[list[tuple[slice, Any]], Integers, Integers]:
        """Return the rows of the left half of one parity each, with W of them; where those of the
        right half begin; and the parities p of both together, (classes, g).
        """
        lefts, rights = _firsts(self.left), _firsts(self.right)
        slices = [slice(*ends) for ends in itertools.pairwise([*lefts.tolist(), len(self.left)])]
        pairs = itertools.product(self.left[lefts] % 2, self.right[rights] % 2)
        parities = np.array([np.concatenate(pair) for pair in pairs], dtype=np.int64)
        return [(rows, _factor(self.weights[:, rows])) for rows in slices], rights, parities

    def _sums(self, P: NDArray[Any], R: NDArray[Any], half_turns: Integers) -> NDArray[Any]:
        """Return Σ (−1)^{h·k} R W P, (M, N): the signs depend on the parities of k alone, so each
        class of these is summed once.
        """
        if not half_turns.any():
            one = np.sum(R * _product(_factor(self.weights), P), axis=0)
            return np.broadcast_to(one, (len(half_turns), *one.shape))
        lefts, rights, parities = self._classes
        sums = [np.add.reduceat(R * _product(W, P[rows]), rights, axis=0) for rows, W in lefts]
        # of one type: products of two types are fifty times as slow
        signs = (1 - 2 * np.mod(half_turns @ parities.T, 2)).astype(P.dtype)
        return np.asarray(signs @ np.concatenate(sums))

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
        signed = (1.0 - 2.0 * np.mod(half_turns @ k.T, 2))[:, None, :] * terms
        sums = ["mnk->mn", "mnk,ki->mni", "mnk,ki,kj->mnij"][: order + 1]
        return [np.einsum(text, signed, *[k] * p) for p, text in enumerate(sums)]

    def sizes(self, terms: Complex, _: Complex, most: int) -> tuple[list[Array], list[Array]]:
        """Return what ``TermTable.sizes`` does, from the terms (N, K)."""
        kappa = np.max(np.abs(self.points), axis=1)
        found = [np.abs(terms) @ kappa**p for p in range(most + 1)]
        return found, [_FACTOR_ROUNDING * _EPSILON * x for x in found]


def _factor(weights: Any) -> Any:
    """Return weights as what multiplies fast."""
    return flint.acb_mat(weights.tolist()) if weights.dtype == object else weights


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


def _by_parity(points: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the distinct rows of whole numbers, those of equal parities side by side, and which of
    them each row is.
    """
    keyed = np.hstack([np.mod(points, 2), points]).astype(np.int64)
    keyed -= keyed.min(axis=0)
    spans = keyed.max(axis=0) + 1
    # one number a row is ten times as fast
    if keyed.size and np.prod(spans, dtype=np.float64) < _LARGEST_KEY:
        keyed = keyed @ np.append(np.cumprod(spans[:0:-1])[::-1], 1)
    axis = None if keyed.ndim == 1 else 0
    _, first, which = np.unique(keyed, axis=axis, return_index=True, return_inverse=True)
    return points[first], which.ravel()


def _firsts(rows: Array) -> Integers:
    """Return the first of the rows of each parity."""
    changes = np.any(np.diff(np.mod(rows, 2), axis=0), axis=1)
    return np.flatnonzero(np.concatenate([[True], changes])).astype(np.int64)
