"""Riemann theta functions of any τ, at any complex z, with any real characteristics, and their
derivatives.

After Siegel reduction, with m = n + k and n the lattice point next to the largest term,

    θ[ε;δ](z|τ) = e^{…} Σ_k W_k Π_j u_j^{k_j},   W_k = exp(πi kᵀτk),   u = exp 2πi(z + δ + τ(n+ε)).

W does not depend on point or characteristic. The k's of an ellipsoid are pairs of halves, so that W
is a sparse matrix between the products of powers of the two halves. Where Im τ is large, both leave
the range of a double, though few terms matter: there the exponents are added first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.theta.lattice import RADIUS, largest_corner, points_near_cell, points_within
from veselova.analytic.theta.siegel_reduction import SiegelReduction, turns_of
from veselova.analytic.theta.siegel_terms import WIDE_RATIO, Exponents, TermTable, rounding_of
from veselova.mechanics.core.budget import checkpoint

__all__ = ["SiegelTheta"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Wide = NDArray[np.clongdouble]
WideReal = NDArray[np.longdouble]

_PI = np.longdouble("3.14159265358979323846264338327950288")

_EPSILON = float(np.finfo(float).eps)

#: Derived: largest exponent of W up to which W and powers are multiplied: 2^±1022 = e^±708.
_LARGEST_EXPONENT = 200.0

#: Derived: im τ' from which exponents leave the range of a double.
_LARGEST_TAU = 1e200

#: Calibrated: rounding of the common factor, in that of a long double for each turn that its phase
#: is summed of. Largest seen over random τ: a third, at phases of few turns.
_PHASE_ROUNDING = 16.0

#: Budget: entries of one block of (points × half vectors), and the most terms of a sum, some 2 GB.
_BLOCK = 50_000
_MOST_TERMS = 100_000_000


@dataclass(frozen=True)
class _Member:
    """A characteristic by its place among those given: ε and δ as given, but for whole numbers, and
    after the reduction, and its factor e^{2πi·turns + logarithm}.
    """

    place: int
    given_epsilon: WideReal
    given_delta: WideReal
    epsilon: WideReal
    delta: WideReal
    turns: Any
    logarithm: Any


@dataclass(frozen=True)
class _Sums:
    """Σ terms and their derivatives for M characteristics that are alike, over e^{2πi·turns}; where
    they are summed.

    - derivatives: the sums, (M, N), (M, N, g), (M, N, g, g)
    - turns: (N,), of the first; those of others differ by (m+ε)·(δ − δ of the first)
    - v: (N, g), the argument of the first next to the largest term; of others it differs by halves
    - own: m+ε of that term, (N, g)
    """

    derivatives: list[Complex]
    turns: Wide
    v: Wide
    own: WideReal


@dataclass(frozen=True)
class _Points:
    """Points z = z' + n + τm, (N, g).

    - rest: z', in the cell around zero
    - n: whole numbers, as the sum of up to two parts
    - m: whole numbers
    - inner: Lz', where the reduced functions are asked
    - outer: what z' and m turn the value by, (N,)
    - slope: the gradient of the exponent, (N, g)
    """

    rest: Wide
    n: tuple[Array | WideReal, ...]
    m: Array
    inner: Wide
    outer: Wide
    slope: Complex


def _phases(
    points: _Points, found: _Sums, members: list[_Member]
) -> tuple[list[WideReal], WideReal]:
    """Return the phases of the common factors in turns, (N,) for each of the members, and their
    logarithm of the size, which all have.
    """
    first = members[0]
    moved = _dot(points.m, points.rest + first.given_delta)
    own = found.turns.real + points.outer.real - moved.real
    own += sum(turns_of(part, first.given_epsilon) for part in points.n)
    own += first.turns.real + first.logarithm.imag / (2 * _PI)
    height = found.turns.imag + points.outer.imag - moved.imag + first.turns.imag
    phases = [own]
    for member in members[1:]:
        phase = own + found.own @ (member.delta - first.delta) + (member.turns - first.turns).real
        apart = member.given_epsilon - first.given_epsilon
        phase += sum(turns_of(part, apart) for part in points.n)
        phases.append(phase - points.m @ (member.given_delta - first.given_delta))
    return phases, first.logarithm.real - 2 * _PI * height


def _transform(sums: list[Complex], slope: Complex, L: Complex, Q: Complex) -> Complex:
    """Return the highest derivative of e^{πi zᵀQz + …}Θ(Lz), from the derivatives of Θ."""
    value, *higher = sums
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
    at_largest = 2 * np.pi * np.abs(found.own.astype(float)) @ np.abs(L) + np.abs(slope)
    fixed = np.max(at_largest, axis=1)
    one = np.ones_like(fixed)
    if order == 0:
        return [one]
    if order == 1:
        return [fixed, rate * one]
    return [fixed**2 + 2 * np.pi * float(np.max(np.abs(Q))), 2 * rate * fixed, rate**2 * one]


def _times(rows: NDArray[Any], matrix: Wide) -> Wide:
    """Return real rows times a complex matrix: each part is a product of real numbers."""
    found = np.empty((len(rows), matrix.shape[1]), dtype=np.clongdouble)
    found.real, found.imag = rows @ matrix.real, rows @ matrix.imag
    return found


def _forms(rows: NDArray[Any], matrix: Wide) -> Wide:
    """Return xᵀ matrix x for each row x."""
    return np.asarray(_dot(rows @ matrix, rows))


def _dot(left: NDArray[Any], right: NDArray[Any]) -> Any:
    """Return the products of rows with rows, (N,), each summed in order."""
    found = left[:, 0] * right[:, 0]
    for k in range(1, left.shape[1]):
        found += left[:, k] * right[:, k]
    return found


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
    def _table(self) -> TermTable | Exponents:
        wide = self.reduction.tau
        tau = wide.astype(complex)
        points = points_near_cell(tau.imag, RADIUS)
        exponents = 1j * _PI * _forms(points, wide)
        error = self.reduction.rounding
        if np.max(np.abs(exponents.real)) > _LARGEST_EXPONENT:
            rounding = rounding_of(points, tau, error, 4 * WIDE_RATIO)
            return Exponents(points, exponents, rounding)
        return TermTable.of(tau, points, error)

    def values(
        self, z: Complex, characteristics: Array, order: int, with_errors: bool = True
    ) -> tuple[Complex, Array, Array]:
        """Return the derivatives of one order (0, 1 or 2) at points z (N, g) for characteristics
        (C, 2, g).

        The result is (mantissas, exponents, errors): the derivative is mantissa·exp(exponent), of
        shapes (N, C, g, …) and (N, C). The errors bound those of the mantissas; NaN without
        ``with_errors``.
        """
        points = self._reduce_points(z)
        L = self.reduction.linear.astype(complex)
        Q = self.reduction.quadratic.astype(complex)
        count, genus = z.shape
        shape = (len(characteristics), count)
        sizes = self._sizes(points) if with_errors else None
        values = np.empty((*shape, *(genus,) * order), dtype=complex)
        exponents = np.empty(shape)
        errors = np.full(shape, np.nan)
        for members in self._alike(characteristics):
            found = self._sums(points.inner, members, order)
            phases, exponent = _phases(points, found, members)
            rounded = exponent.astype(float)
            growth = _growth(found, points.slope, L, Q) if with_errors else []
            size = np.exp((exponent - rounded).astype(float))
            for place, member in enumerate(members):
                angle = 2 * np.pi * (phases[place] - np.rint(phases[place])).astype(float)
                factor = size * np.exp(1j * angle)
                derivative = _transform(
                    [part[place] for part in found.derivatives], points.slope, L, Q
                )
                exponents[member.place] = rounded
                values[member.place] = derivative * factor.reshape((count, *(1,) * order))
                if sizes is not None:
                    turns = np.hypot(phases[place], exponent / (2 * _PI)).astype(float)
                    errors[member.place] = self._bound_rounding(found, sizes, turns, growth)
        return np.swapaxes(values, 0, 1), exponents.T, errors.T

    def _reduce_points(self, z: Complex) -> _Points:
        """Return points as z' + n + τm with z' in the cell around zero: quadratic exponents would
        lose the digits of a large z.
        """
        tau = self.tau.astype(np.clongdouble)
        L = self.reduction.linear
        Q = self.reduction.quadratic
        m = np.rint(np.linalg.solve(self.tau.imag, z.imag.T).T)
        moved = _times(m, tau)
        far = np.rint(z.real)
        rest = z - far - moved
        near = np.rint(rest.real)
        rest.real -= near
        pulled = rest @ Q
        slope = 2j * np.pi * (pulled.astype(complex) - m)
        outer = _dot(rest, pulled) / 2 - _dot(m, moved) / 2
        n = tuple(part for part in (far, near) if part.any())
        return _Points(rest, n, m, rest @ L.T, outer, slope)

    def _alike(self, characteristics: Array) -> list[list[_Member]]:
        """Return the characteristics after the reduction, those together that share their terms up
        to signs: equal ε, and δ's that differ by halves.
        """
        groups: dict[tuple[Any, ...], list[_Member]] = {}
        for place, (epsilon, delta) in enumerate(characteristics):
            # whole numbers in δ are in the factor, and next to n and m they turn nothing
            part, shift = ((x - np.rint(x)).astype(np.longdouble) for x in (epsilon, delta))
            reduced = self.reduction.characteristic(epsilon, delta)
            member = _Member(place, part, shift, *reduced)
            key = (*member.epsilon, *np.mod(2 * member.delta, 1))
            groups.setdefault(key, []).append(member)
        return list(groups.values())

    def _sizes(self, points: _Points) -> tuple[Array, Array]:
        """Return what ``outer``, (N,), and Lz', (N, g), are summed of, by absolute value."""
        rest, m = np.abs(points.rest).astype(float), np.abs(points.m)
        L, Q = (np.abs(x).astype(float) for x in (self.reduction.linear, self.reduction.quadratic))
        of_m = m @ np.abs(self.tau)
        outer = _dot(rest @ Q, rest / 2 + of_m) + _dot(m, of_m + rest)
        return outer, (rest + of_m) @ L.T

    def _bound_rounding(
        self, found: _Sums, sizes: tuple[Array, Array], turns: Array, growth: list[Array]
    ) -> Array:
        """Return what the sums of one member may be off by, (N,): the errors of their terms, and of
        the common factor, of so many turns, whose parts may cancel.
        """
        outer, inner = sizes
        own = np.abs(found.own.astype(float))
        moved = own @ np.abs(self.reduction.tau).astype(float)
        turns = turns + outer + _dot(own + 1, inner + moved)
        of_tau = 2 * np.pi * np.sum((own @ self.reduction.rounding) * own, axis=1)
        common = _PHASE_ROUNDING * WIDE_RATIO * _EPSILON * (1 + turns) + of_tau
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

    def _sums(self, z: Wide, members: list[_Member], order: int) -> _Sums:
        """Return the sums of the reduced matrix for characteristics that are alike, over the
        largest term.
        """
        tau = self.reduction.tau
        count, genus = z.shape
        epsilon, first = members[0].epsilon, members[0].delta
        half_turns = np.array([np.rint(2 * (c.delta - first)) for c in members], dtype=np.int64)
        height = np.linalg.solve(tau.imag.astype(float), z.imag.astype(float).T).T
        m = np.rint(-(epsilon.astype(float) + height)) + epsilon
        moved = _times(m, tau)
        v = z + first
        turns = _dot(m, v + moved / 2)
        v += moved
        v.real -= np.rint(v.real)  # k is an integer
        own = m.astype(float)
        shape = (len(members), count)
        sums = [np.empty((*shape, *(genus,) * k), dtype=complex) for k in range(order + 1)]
        for rows in self._blocks(count):
            moments = self._table.moments(v[rows], order, half_turns)
            sums[0][:, rows], shift = moments[0], own[rows]
            if order >= 1:
                gradient = moments[1] + shift * moments[0][..., None]
                sums[1][:, rows] = 2j * np.pi * gradient
            if order == 2:
                mixed = shift[:, :, None] * moments[1][:, :, None, :]
                square = shift[:, :, None] * shift[:, None, :] * moments[0][..., None, None]
                whole = moments[2] + mixed + np.swapaxes(mixed, 2, 3) + square
                sums[2][:, rows] = -4 * np.pi**2 * whole
        return _Sums(sums, turns, v, m)
