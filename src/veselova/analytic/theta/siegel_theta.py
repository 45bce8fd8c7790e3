"""Riemann theta functions of any τ, at any complex z, with any real characteristics, and their
derivatives.

After Siegel reduction, with m = n + k and n the lattice point next to the largest term,

    θ[ε;δ](z|τ) = e^{…} Σ_k W_k Π_j u_j^{k_j},   W_k = exp(πi kᵀτk),   u = exp 2πi(z + δ + τ(n+ε)).

W does not depend on point or characteristic. The k's of an ellipsoid are pairs of halves, so that W
is a sparse matrix between the products of powers of the two halves. Where Im τ is large, both leave
the range of a double, though few terms matter: there the exponents are added first.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from veselova.analytic.theta.lattice import RADIUS, largest_corner, points_near_cell, points_within
from veselova.analytic.theta.siegel_reduction import SiegelReduction
from veselova.mechanics.core.budget import checkpoint

__all__ = ["SiegelTheta"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Wide = NDArray[np.clongdouble]
WideReal = NDArray[np.longdouble]

_PI = np.longdouble("3.14159265358979323846264338327950288")

#: Rounding of a long double over that of a double.
_WIDE_RATIO = float(np.finfo(np.longdouble).eps / np.finfo(float).eps)

#: Rounding of a term in ε, by its exponent and by products of powers; largest seen over random τ:
#: 6.
_TERM_ROUNDING = 4 * float(np.finfo(float).eps)

#: Largest exponent of W up to which W and powers are multiplied: 2^±1022 = e^±708.
_LARGEST_EXPONENT = 200.0

#: Im τ' from which exponents leave the range of a double.
_LARGEST_TAU = 1e200

#: Entries of one block of (points × half vectors), and the most terms of a sum, some 2 GB.
_BLOCK = 1_000_000
_MOST_TERMS = 100_000_000


@dataclass(frozen=True)
class _Table:
    """The terms of a sum: halves of the k's, (I, a) and (J, g−a), and W between them, sparse (J,
    I), and |W|.
    """

    left: Array
    right: Array
    weights: csr_array
    sizes: csr_array

    @property
    def width(self) -> int:
        """Return the numbers that a point needs."""
        return max(len(self.left), len(self.right))

    @classmethod
    def of(cls, tau: Complex, points: Array) -> _Table:
        """Return the table of the points k (K, g)."""
        split = (points.shape[1] + 1) // 2
        (left, i), (right, j) = _distinct(points[:, :split]), _distinct(points[:, split:])
        values = np.exp(1j * np.pi * np.sum((points @ tau) * points, axis=1))
        weights = csr_array((values, (j, i)), shape=(len(right), len(left)))
        return cls(left, right, weights, abs(weights))

    def moments(self, v: Wide, order: int) -> tuple[list[Complex], Array, Array]:
        """Return Σ W e^{2πi k·v}, and with k_i and k_ik_j in the sum, (N,), (N, g), (N, g, g);
        Σ|W e^{2πi k·v}|; and this sum times 1 and 2π|k·v|, which its rounding is proportional to.
        """
        split = self.left.shape[1]
        genus = v.shape[1]
        v = v.astype(complex)
        left = np.exp(2j * np.pi * (self.left @ v[:, :split].T))
        right = np.exp(2j * np.pi * (self.right @ v[:, split:].T))
        sizes = np.sum(np.abs(right) * (self.sizes @ np.abs(left)), axis=0)
        turns = sum(
            np.max(np.abs(k), axis=0, initial=0.0) @ np.abs(u).T
            for k, u in ((self.left, v[:, :split]), (self.right, v[:, split:]))
        )
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
            return np.asarray(np.sum(R * (self.weights @ P), axis=0))

        found = [total(())]
        if order >= 1:
            found.append(np.stack([total((i,)) for i in range(genus)], axis=1))
        if order == 2:
            second = np.empty((len(v), genus, genus), dtype=complex)
            for i, j in itertools.combinations_with_replacement(range(genus), 2):
                second[:, i, j] = second[:, j, i] = total((i, j))
            found.append(second)
        return found, sizes, sizes * (1 + 2 * np.pi * turns)


@dataclass(frozen=True)
class _Exponents:
    """The terms of a sum by their k's (K, g) and exponents πi kᵀτk (K,), in long doubles."""

    points: Array
    exponents: Wide

    @property
    def width(self) -> int:
        """Return the numbers that a point needs."""
        return len(self.points)

    def moments(self, v: Wide, order: int) -> tuple[list[Complex], Array, Array]:
        """Return what ``_Table.moments`` does."""
        turns = self.points @ v.T
        terms = np.exp(self.exponents[:, None] + 2j * _PI * turns).astype(complex)
        k = self.points
        found = [np.sum(terms, axis=0)]
        if order >= 1:
            found.append(terms.T @ k)
        if order == 2:
            found.append(np.einsum("kn,ki,kj->nij", terms, k, k))
        sizes = np.abs(terms)
        exponents = np.abs(self.exponents)[:, None] + 2 * np.pi * np.abs(turns)
        roundings = np.sum(sizes * (1 + 4 * _WIDE_RATIO * exponents.astype(float)), axis=0)
        return found, np.sum(sizes, axis=0), roundings


@dataclass(frozen=True)
class _Sums:
    """Σ terms and their derivatives, over e^{2πi·turns}; Σ|terms|; the largest 2π|m+ε|; the
    rounding of the sum in ε.
    """

    derivatives: list[Complex]
    turns: Wide
    sizes: Array
    largest: Array
    rounding: Array


def _transform(
    found: _Sums, slope: Complex, L: Complex, Q: Complex
) -> tuple[Complex, Array | float]:
    """Return the highest derivative of e^{πi zᵀQz + …}Θ(Lz), and what a rounding of a term is
    multiplied with.
    """
    value, *higher = found.derivatives
    if not higher:
        return value, 1.0
    gradient = higher[0] @ L
    growth = np.max(np.abs(L)) * found.largest + np.max(np.abs(slope), axis=1)
    if len(higher) == 1:
        return gradient + slope * value[:, None], growth
    mixed = slope[:, :, None] * gradient[:, None, :]
    own = slope[:, :, None] * slope[:, None, :] + 2j * np.pi * Q
    second = L.T @ higher[1] @ L + mixed + np.swapaxes(mixed, 1, 2) + own * value[:, None, None]
    return second, growth**2 + 2 * np.pi * np.max(np.abs(Q))


def _forms(rows: NDArray[Any], matrix: Wide) -> Wide:
    """Return xᵀ matrix x for each row x."""
    return np.asarray(np.sum((rows @ matrix) * rows, axis=1))


@dataclass(frozen=True)
class SiegelTheta:
    """The theta functions of one matrix τ, complex, symmetric, Im τ positive definite, shape (g,
    g).
    """

    tau: Complex

    @cached_property
    def reduction(self) -> SiegelReduction:
        """Return the reduced matrix and the way there."""
        return SiegelReduction(np.array(self.tau, dtype=np.clongdouble))

    @cached_property
    def terms(self) -> float:
        """Return about the number of terms of a sum, without forming them; infinity where their
        exponents leave the range of a double.
        """
        form = self.reduction.tau.imag.astype(float)
        if not np.max(np.abs(form)) < _LARGEST_TAU:
            return math.inf
        return points_within(form, RADIUS + math.sqrt(largest_corner(form)))

    @property
    def is_small(self) -> bool:
        """Return whether the table of a sum fits into memory."""
        return self.terms <= _MOST_TERMS

    @cached_property
    def _table(self) -> _Table | _Exponents:
        wide = self.reduction.tau
        tau = wide.astype(complex)
        points = points_near_cell(tau.imag, RADIUS)
        exponents = 1j * _PI * _forms(points, wide)
        if np.max(np.abs(exponents.real)) > _LARGEST_EXPONENT:
            return _Exponents(points, exponents)
        return _Table.of(tau, points)

    def values(
        self, z: Complex, characteristics: Array, order: int
    ) -> tuple[Complex, Array, Array]:
        """Return the derivatives of one order (0, 1 or 2) at points z (N, g) for characteristics
        (C, 2, g).

        The result is (mantissas, exponents, errors): the derivative is mantissa·exp(exponent), of
        shapes (N, C, g, …) and (N, C). The errors bound those of the mantissas.
        """
        count, genus = z.shape
        point = z.astype(np.clongdouble)
        tau = self.tau.astype(np.clongdouble)
        # z = z' + n + τm with z' in the cell around zero: quadratic exponents would lose the digits
        # of a large z.
        m = np.rint(np.linalg.solve(self.tau.imag, z.imag.T).T)
        rest = point - m @ tau
        n = np.rint(rest.real)
        rest = rest - n
        L = self.reduction.linear
        Q = self.reduction.quadratic
        inner = rest @ L.T
        outer = (_forms(rest, Q) - _forms(m, tau)) / 2
        slope = (2j * np.pi * (rest @ Q - m)).astype(complex)  # the gradient of the exponent
        shape = (count, len(characteristics))
        values = np.empty((*shape, *(genus,) * order), dtype=complex)
        exponents = np.empty(shape)
        errors = np.empty(shape)
        for c, (epsilon, delta) in enumerate(characteristics):
            within_epsilon, within_delta, turns, root = self.reduction.characteristic(
                epsilon, delta
            )
            found = self._sums(inner, within_epsilon, within_delta, order)
            turns = (
                found.turns
                + outer
                + turns
                + n @ epsilon.astype(np.longdouble)
                - np.sum(m * (rest + delta), axis=1)
            )
            exponent = -2 * _PI * turns.imag + root.real
            exponents[:, c] = exponent
            phase = (2 * _PI * (turns.real - np.rint(turns.real)) + root.imag).astype(float)
            factor = np.exp((exponent - exponents[:, c]).astype(float) + 1j * phase)
            derivative, scale = _transform(found, slope, L.astype(complex), Q.astype(complex))
            values[:, c] = derivative * factor.reshape((count, *(1,) * order))
            wide = 64 * float(np.finfo(np.longdouble).eps) * (1 + np.abs(turns).astype(float))
            # a rounding of τ' turns a term by ½(m+ε)ᵀdτ'(m+ε)
            wide += self.reduction.rounding * found.largest**2
            errors[:, c] = scale * (_TERM_ROUNDING * found.rounding + wide * found.sizes)
        return values, exponents, errors

    def _sums(self, z: Wide, epsilon: WideReal, delta: WideReal, order: int) -> _Sums:
        """Return the sums of the reduced matrix, over the largest term."""
        tau = self.reduction.tau
        count = z.shape[0]
        genus = z.shape[1]
        height = np.linalg.solve(tau.imag.astype(float), z.imag.astype(float).T).T
        m = np.rint(-(epsilon.astype(float) + height)) + epsilon
        v = z + delta + m @ tau
        turns = _forms(m, tau) / 2 + np.sum(m * (z + delta), axis=1)
        v = v - np.rint(v.real)  # k is an integer
        own = m.astype(float)
        sums = [np.empty((count, *(genus,) * k), dtype=complex) for k in range(order + 1)]
        sizes = np.empty(count)
        roundings = np.empty(count)
        block = max(1, _BLOCK // self._table.width)
        for first in range(0, count, block):
            checkpoint()
            rows = slice(first, first + block)
            moments, sizes[rows], roundings[rows] = self._table.moments(v[rows], order)
            sums[0][rows], shift = moments[0], own[rows]
            if order >= 1:
                sums[1][rows] = 2j * np.pi * (moments[1] + shift * moments[0][:, None])
            if order == 2:
                mixed = shift[:, :, None] * moments[1][:, None, :]
                square = shift[:, :, None] * shift[:, None, :] * moments[0][:, None, None]
                sums[2][rows] = (
                    -4 * np.pi**2 * (moments[2] + mixed + np.swapaxes(mixed, 1, 2) + square)
                )
        largest = 2 * np.pi * (np.max(np.abs(own), axis=1) + self._reach)
        return _Sums(sums, turns, sizes, largest, roundings)

    @cached_property
    def _reach(self) -> float:
        table = self._table
        parts = (table.points,) if isinstance(table, _Exponents) else (table.left, table.right)
        return float(max(np.max(np.abs(part), initial=0) for part in parts))


def _distinct(points: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the distinct rows of whole numbers, and which of them each row is."""
    low = points.min(axis=0, initial=0)
    widths = (points.max(axis=0, initial=0) - low + 1).astype(np.int64)
    codes = np.zeros(len(points), dtype=np.int64)
    for column, width, least in zip(points.T, widths, low, strict=True):
        codes = codes * width + (column - least).astype(np.int64)
    _, first, which = np.unique(codes, return_index=True, return_inverse=True)
    return points[first], which.ravel()
