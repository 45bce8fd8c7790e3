"""The terms of a theta sum after Siegel reduction: W_k and the powers of e^{2πi v}, or their
exponents where these leave the range of a double.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

__all__ = ["WIDE_RATIO", "Exponents", "TermTable", "rounding_of"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Wide = NDArray[np.clongdouble]
Integers = NDArray[np.int64]

_PI = np.longdouble("3.14159265358979323846264338327950288")

_EPSILON = float(np.finfo(float).eps)

#: Rounding of a long double over that of a double.
WIDE_RATIO = float(np.finfo(np.longdouble).eps / np.finfo(float).eps)

#: Calibrated: rounding of a term in ε: that of its factors, and that of their exponents for each
#: unit of these. Largest seen over random τ: a quarter of both together.
_FACTOR_ROUNDING = 4.0
_EXPONENT_ROUNDING = 1.0


@dataclass(frozen=True)
class TermTable:
    """The terms of a sum.

    - left, right: halves of the k's, (I, a) and (J, g−a), those of equal parities side by side
    - weights: W between them, sparse (J, I)
    - points: the k's, (K, g), in the order of the weights
    - rounding: the relative error of each W, (K,)
    """

    left: Array
    right: Array
    weights: csr_array
    points: Array
    rounding: Array

    @property
    def width(self) -> int:
        """Return the numbers that a point needs."""
        return max(len(self.left), len(self.right))

    @classmethod
    def of(cls, tau: Complex, points: Array, tau_error: Array) -> TermTable:
        """Return the table of the points k (K, g); τ is off by at most ``tau_error``."""
        split = (points.shape[1] + 1) // 2
        (left, i), (right, j) = _by_parity(points[:, :split]), _by_parity(points[:, split:])
        values = np.exp(1j * np.pi * np.sum((points @ tau) * points, axis=1))
        order = np.lexsort((i, j))
        weights = csr_array((values[order], (j[order], i[order])), shape=(len(right), len(left)))
        ordered = points[order]
        return cls(left, right, weights, ordered, rounding_of(ordered, tau, tau_error))

    def _powers(self, v: Wide) -> tuple[Complex, Complex]:
        """Return the powers e^{2πi k·v} of both halves, (I, N) and (J, N)."""
        split = self.left.shape[1]
        point = v.astype(complex)
        left = _products_of_powers(self.left, point[:, :split])
        return left, _products_of_powers(self.right, point[:, split:])

    @cached_property
    def _classes(self) -> tuple[list[tuple[slice, csr_array, int]], list[tuple[slice, int]]]:
        """Return the rows of the left half of one parity each, W of them and their code; and those
        of the right half.
        """
        lefts = [
            (rows, csr_array(self.weights[:, rows]), code)
            for rows, code in _runs(_parity_codes(self.left))
        ]
        return lefts, _runs(_parity_codes(self.right))

    def moments(self, v: Wide, order: int, half_turns: Integers) -> list[Complex]:
        """Return Σ ± W e^{2πi k·v}, and with k_i and k_ik_j in the sum, (M, N), (M, N, g), (M, N,
        g, g).

        half_turns: h (M, g), whole numbers; the signs are (−1)^{h·k}
        """
        split = self.left.shape[1]
        genus = v.shape[1]
        left, right = self._powers(v)
        factors = [(self.left, i) for i in range(split)] + [
            (self.right, i) for i in range(genus - split)
        ]

        def total(chosen: tuple[int, ...]) -> Complex:
            P = left
            R = right
            for c in chosen:
                table, column = factors[c]
                if table is self.left:
                    P = P * table[:, column, None]
                else:
                    R = R * table[:, column, None]
            if not half_turns.any():
                one = np.sum(R * (self.weights @ P), axis=0)
                return np.broadcast_to(one, (len(half_turns), *one.shape))
            return self._signed_sums(P, R, half_turns)

        found = [total(())]
        if order >= 1:
            found.append(np.stack([total((i,)) for i in range(genus)], axis=2))
        if order == 2:
            second = np.empty((len(half_turns), len(v), genus, genus), dtype=complex)
            for i, j in itertools.combinations_with_replacement(range(genus), 2):
                second[:, :, i, j] = second[:, :, j, i] = total((i, j))
            found.append(second)
        return found

    def _signed_sums(self, P: Complex, R: Complex, half_turns: Integers) -> Complex:
        """Return Σ ± R W P, (M, N): the signs depend on the parities of k alone, so each class of
        these is summed once.
        """
        split = self.left.shape[1]
        lefts, rights = self._classes
        of_right = _signs(half_turns[:, split:])
        of_left = _signs(half_turns[:, :split])
        result = np.zeros((len(half_turns), P.shape[1]), dtype=complex)
        for rows, weights, code in lefts:
            product = R * (weights @ P[rows])
            of_class = np.stack([np.sum(product[of], axis=0) for of, _ in rights])
            signs = of_left[:, code, None] * of_right[:, [right for _, right in rights]]
            result += signs @ of_class
        return result

    def bound_rounding(self, v: Wide, common: Array, growth: list[Array]) -> Array:
        """Return Σ |term|·(its relative error)·Σ_p growth_p κ^p, κ = max |k_i|, (N,).

        common: what is added to the relative error of every term, (N,) · growth: (N,) each.
        """
        left, right = map(np.abs, self._powers(v))
        shift = np.sum(np.abs(v), axis=1).astype(float)
        kappa = np.max(np.abs(self.points), axis=1)
        sizes = np.abs(self.weights.data)
        turning = _EXPONENT_ROUNDING * _EPSILON * 2 * np.pi * kappa

        def total(values: Array) -> Array:
            weights = csr_array(
                (sizes * values, self.weights.indices, self.weights.indptr), self.weights.shape
            )
            return np.asarray(np.sum(right * (weights @ left), axis=0))

        found = np.zeros(len(v))
        for p, factor in enumerate(growth):
            power = kappa**p
            of_terms = total(self.rounding * power) + shift * total(turning * power)
            found += factor * (of_terms + common * total(power))
        return found


@dataclass(frozen=True)
class Exponents:
    """The terms of a sum by their k's (K, g) and exponents πi kᵀτk (K,), in long doubles, and the
    relative error of each e^exponent, (K,).
    """

    points: Array
    exponents: Wide
    rounding: Array

    @property
    def width(self) -> int:
        """Return the numbers that a point needs."""
        return len(self.points)

    def _terms(self, v: Wide) -> Complex:
        """Return the terms, (K, N)."""
        turns = self.points @ v.T
        return np.asarray(np.exp(self.exponents[:, None] + 2j * _PI * turns).astype(complex))

    def moments(self, v: Wide, order: int, half_turns: Integers) -> list[Complex]:
        """Return what ``TermTable.moments`` does."""
        terms = self._terms(v)
        k = self.points
        signs = 1.0 - 2.0 * np.mod(half_turns @ k.T, 2)
        found = [signs @ terms]
        if order >= 1:
            found.append(np.einsum("mk,kn,ki->mni", signs, terms, k))
        if order == 2:
            found.append(np.einsum("mk,kn,ki,kj->mnij", signs, terms, k, k, optimize=True))
        return found

    def bound_rounding(self, v: Wide, common: Array, growth: list[Array]) -> Array:
        """Return what ``TermTable.bound_rounding`` does."""
        sizes = np.abs(self._terms(v))
        kappa = np.max(np.abs(self.points), axis=1)[:, None]
        shift = np.sum(np.abs(v), axis=1).astype(float)
        turning = 4 * WIDE_RATIO * _EPSILON * 2 * np.pi * kappa * shift
        relative = self.rounding[:, None] + turning + common
        factors = sum(factor * kappa**p for p, factor in enumerate(growth))
        return np.asarray(np.sum(sizes * relative * factors, axis=0))


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


def _parity_codes(points: Array) -> Integers:
    """Return the parities of the entries of each row, as bits of one number."""
    bits = np.mod(points, 2).astype(np.int64)
    return np.asarray(bits @ (1 << np.arange(points.shape[1])[::-1]), dtype=np.int64)


def _runs(codes: Integers) -> list[tuple[slice, int]]:
    """Return the slices of equal codes, which are sorted, and their codes."""
    values, firsts = np.unique(codes, return_index=True)
    ends = [*firsts[1:].tolist(), len(codes)]
    return [
        (slice(*ends_of), code)
        for *ends_of, code in zip(firsts.tolist(), ends, values.tolist(), strict=True)
    ]


def _signs(half_turns: Integers) -> Array:
    """Return (−1)^{h·p} for each row h and each code p of parities, (M, 2^width)."""
    width = half_turns.shape[1]
    bits = np.arange(1 << width)[:, None] >> np.arange(width)[::-1] & 1
    return np.asarray(1.0 - 2.0 * np.mod(half_turns @ bits.T, 2))


def rounding_of(points: Array, tau: Complex, tau_error: Array, ratio: float = 1.0) -> Array:
    """Return the relative error of e^{πi kᵀτk} for each k (K, g): of its exponent, rounded to
    ``ratio`` ε, of its factors, and of a τ that is off by at most ``tau_error``.
    """
    size = np.abs(points)
    exponents = np.pi * np.sum((size @ np.abs(tau)) * size, axis=1)
    of_tau = np.pi * np.sum((size @ tau_error) * size, axis=1)
    products = np.sum(size, axis=1)
    roundings = _FACTOR_ROUNDING + products + _EXPONENT_ROUNDING * ratio * exponents
    # (m+ε)ᵀdτ(m+ε) is at most twice what k and the rest of m+ε have
    return np.asarray(_EPSILON * roundings + 2 * of_tau)


def _by_parity(points: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the distinct rows of whole numbers, those of equal parities side by side, and which of
    them each row is.
    """
    rows, which = _distinct(points)
    order = np.argsort(_parity_codes(rows), kind="stable")
    return rows[order], np.argsort(order)[which]


def _distinct(points: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the distinct rows of whole numbers, and which of them each row is."""
    low = points.min(axis=0, initial=0)
    widths = (points.max(axis=0, initial=0) - low + 1).astype(np.int64)
    codes = np.zeros(len(points), dtype=np.int64)
    for column, width, least in zip(points.T, widths, low, strict=True):
        codes = codes * width + (column - least).astype(np.int64)
    _, first, which = np.unique(codes, return_index=True, return_inverse=True)
    return points[first], which.ravel()
