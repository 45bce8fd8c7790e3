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
from collections.abc import Iterator
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

_EPSILON = float(np.finfo(float).eps)

#: Rounding of a term in ε: that of its factors, and that of their exponents for each unit of
#: these. Largest seen over random τ: a quarter of both together.
_FACTOR_ROUNDING = 4.0
_EXPONENT_ROUNDING = 1.0

#: Largest exponent of W up to which W and powers are multiplied: 2^±1022 = e^±708.
_LARGEST_EXPONENT = 200.0

#: Im τ' from which exponents leave the range of a double.
_LARGEST_TAU = 1e200

#: Entries of one block of (points × half vectors), and the most terms of a sum, some 2 GB.
_BLOCK = 1_000_000
_MOST_TERMS = 100_000_000


@dataclass(frozen=True)
class _Table:
    """The terms of a sum.

    - left, right: halves of the k's, (I, a) and (J, g−a)
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
    def of(cls, tau: Complex, points: Array, tau_error: Array) -> _Table:
        """Return the table of the points k (K, g); τ is off by at most ``tau_error``."""
        split = (points.shape[1] + 1) // 2
        (left, i), (right, j) = _distinct(points[:, :split]), _distinct(points[:, split:])
        values = np.exp(1j * np.pi * np.sum((points @ tau) * points, axis=1))
        order = np.lexsort((i, j))
        weights = csr_array((values[order], (j[order], i[order])), shape=(len(right), len(left)))
        ordered = points[order]
        return cls(left, right, weights, ordered, _rounding_of(ordered, tau, tau_error))

    def _powers(self, v: Wide) -> tuple[Complex, Complex]:
        """Return the powers e^{2πi k·v} of both halves, (I, N) and (J, N)."""
        split = self.left.shape[1]
        v = v.astype(complex)
        left = np.exp(2j * np.pi * (self.left @ v[:, :split].T))
        right = np.exp(2j * np.pi * (self.right @ v[:, split:].T))
        return left, right

    def moments(self, v: Wide, order: int) -> list[Complex]:
        """Return Σ W e^{2πi k·v}, and with k_i and k_ik_j in the sum, (N,), (N, g), (N, g, g)."""
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
            return np.asarray(np.sum(R * (self.weights @ P), axis=0))

        found = [total(())]
        if order >= 1:
            found.append(np.stack([total((i,)) for i in range(genus)], axis=1))
        if order == 2:
            second = np.empty((len(v), genus, genus), dtype=complex)
            for i, j in itertools.combinations_with_replacement(range(genus), 2):
                second[:, i, j] = second[:, j, i] = total((i, j))
            found.append(second)
        return found

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
class _Exponents:
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

    def moments(self, v: Wide, order: int) -> list[Complex]:
        """Return what ``_Table.moments`` does."""
        terms = self._terms(v)
        k = self.points
        found = [np.sum(terms, axis=0)]
        if order >= 1:
            found.append(terms.T @ k)
        if order == 2:
            found.append(np.einsum("kn,ki,kj->nij", terms, k, k))
        return found

    def bound_rounding(self, v: Wide, common: Array, growth: list[Array]) -> Array:
        """Return what ``_Table.bound_rounding`` does."""
        sizes = np.abs(self._terms(v))
        kappa = np.max(np.abs(self.points), axis=1)[:, None]
        shift = np.sum(np.abs(v), axis=1).astype(float)
        turning = 4 * _WIDE_RATIO * _EPSILON * 2 * np.pi * kappa * shift
        relative = self.rounding[:, None] + turning + common
        factors = sum(factor * kappa**p for p, factor in enumerate(growth))
        return np.asarray(np.sum(sizes * relative * factors, axis=0))


def _rounding_of(points: Array, tau: Complex, tau_error: Array, ratio: float = 1.0) -> Array:
    """Return the relative error of e^{πi kᵀτk} for each k (K, g): of its exponent, rounded to
    ``ratio`` ε, of its factors, and of a τ that is off by at most ``tau_error``.
    """
    size = np.abs(points)
    exponents = np.pi * np.sum((size @ np.abs(tau)) * size, axis=1)
    of_tau = np.pi * np.sum((size @ tau_error) * size, axis=1)
    roundings = _FACTOR_ROUNDING + _EXPONENT_ROUNDING * ratio * exponents
    # (m+ε)ᵀdτ(m+ε) is at most twice what k and the rest of m+ε have
    return np.asarray(_EPSILON * roundings + 2 * of_tau)


@dataclass(frozen=True)
class _Sums:
    """Σ terms and their derivatives, over e^{2πi·turns}; where they are summed.

    - derivatives: the sums, (N,), (N, g), (N, g, g)
    - turns: (N,)
    - v: (N, g), the argument next to the largest term
    - own: m+ε of that term, (N, g)
    """

    derivatives: list[Complex]
    turns: Wide
    v: Wide
    own: Array


def _transform(found: _Sums, slope: Complex, L: Complex, Q: Complex) -> Complex:
    """Return the highest derivative of e^{πi zᵀQz + …}Θ(Lz)."""
    value, *higher = found.derivatives
    if not higher:
        return value
    gradient = higher[0] @ L
    if len(higher) == 1:
        return gradient + slope * value[:, None]
    mixed = slope[:, :, None] * gradient[:, None, :]
    own = slope[:, :, None] * slope[:, None, :] + 2j * np.pi * Q
    return L.T @ higher[1] @ L + mixed + np.swapaxes(mixed, 1, 2) + own * value[:, None, None]


def _growth(found: _Sums, slope: Complex, L: Complex, Q: Complex) -> list[Array]:
    """Return c_p, (N,) each: the derivative multiplies a term by at most Σ_p c_p κ^p, κ the
    largest |k_i|. A first derivative multiplies it by 2πi Lᵀ(m+ε) + slope.
    """
    order = len(found.derivatives) - 1
    rate = 2 * np.pi * float(np.max(np.sum(np.abs(L), axis=0)))
    at_largest = 2 * np.pi * np.abs(found.own) @ np.abs(L) + np.abs(slope)
    fixed = np.max(at_largest, axis=1)
    one = np.ones_like(fixed)
    if order == 0:
        return [one]
    if order == 1:
        return [fixed, rate * one]
    return [fixed**2 + 2 * np.pi * float(np.max(np.abs(Q))), 2 * rate * fixed, rate**2 * one]


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
        error = self.reduction.rounding
        if np.max(np.abs(exponents.real)) > _LARGEST_EXPONENT:
            rounding = _rounding_of(points, tau, error, 4 * _WIDE_RATIO)
            return _Exponents(points, exponents, rounding)
        return _Table.of(tau, points, error)

    def values(
        self, z: Complex, characteristics: Array, order: int, with_errors: bool = True
    ) -> tuple[Complex, Array, Array]:
        """Return the derivatives of one order (0, 1 or 2) at points z (N, g) for characteristics
        (C, 2, g).

        The result is (mantissas, exponents, errors): the derivative is mantissa·exp(exponent), of
        shapes (N, C, g, …) and (N, C). The errors bound those of the mantissas; NaN without
        ``with_errors``.
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
        errors = np.full(shape, np.nan)
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
            derivative = _transform(found, slope, L.astype(complex), Q.astype(complex))
            values[:, c] = derivative * factor.reshape((count, *(1,) * order))
            if with_errors:
                growth = _growth(found, slope, L.astype(complex), Q.astype(complex))
                errors[:, c] = self._bound_rounding(found, turns, growth)
        return values, exponents, errors

    def _bound_rounding(self, found: _Sums, turns: Wide, growth: list[Array]) -> Array:
        """Return what the sums may be off by, (N,): the errors of their terms, and of the common
        factor.
        """
        own = np.abs(found.own)
        of_tau = 2 * np.pi * np.sum((own @ self.reduction.rounding) * own, axis=1)
        common = 64 * _WIDE_RATIO * _EPSILON * (1 + np.abs(turns).astype(float)) + of_tau
        errors = np.empty(len(own))
        for rows in self._blocks(len(own)):
            parts = [part[rows] for part in growth]
            errors[rows] = self._table.bound_rounding(found.v[rows], common[rows], parts)
        return errors

    def _blocks(self, count: int) -> Iterator[slice]:
        """Yield slices of so many points, with a checkpoint before each."""
        block = max(1, _BLOCK // self._table.width)
        for first in range(0, count, block):
            checkpoint()
            yield slice(first, first + block)

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
        for rows in self._blocks(count):
            moments = self._table.moments(v[rows], order)
            sums[0][rows], shift = moments[0], own[rows]
            if order >= 1:
                sums[1][rows] = 2j * np.pi * (moments[1] + shift * moments[0][:, None])
            if order == 2:
                mixed = shift[:, :, None] * moments[1][:, None, :]
                square = shift[:, :, None] * shift[:, None, :] * moments[0][:, None, None]
                sums[2][rows] = (
                    -4 * np.pi**2 * (moments[2] + mixed + np.swapaxes(mixed, 1, 2) + square)
                )
        return _Sums(sums, turns, v, own)


def _distinct(points: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the distinct rows of whole numbers, and which of them each row is."""
    low = points.min(axis=0, initial=0)
    widths = (points.max(axis=0, initial=0) - low + 1).astype(np.int64)
    codes = np.zeros(len(points), dtype=np.int64)
    for column, width, least in zip(points.T, widths, low, strict=True):
        codes = codes * width + (column - least).astype(np.int64)
    _, first, which = np.unique(codes, return_index=True, return_inverse=True)
    return points[first], which.ravel()
