"""Riemann theta functions of any τ, at any complex z, with any real characteristics, and their
derivatives.

After Siegel reduction, with n the lattice point next to the largest term and p = n + ε',

    θ[ε;δ](z|τ) = e^{…} Σ_k exp πi(kᵀτ'k + 2k·v),   v = Lz + δ' + τ'p.

The terms are products of weights, which do not depend on point or characteristic, and of steps
(analytic.theta.siegel_terms). The k's of an ellipsoid are pairs of halves, so that the weights are
a sparse matrix between the products of the two halves. v and the exponent are formed in doubles;
points at which their rounding would be seen have them from balls.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import flint
import numpy as np
from numpy.typing import NDArray

from veselova.analytic.theta.siegel_reduction import (
    Arguments,
    Member,
    SiegelReduction,
    arguments,
    exact,
    imaginary,
    with_enough_bits,
)
from veselova.analytic.theta.siegel_terms import (
    RADIUS,
    TermTable,
    largest_corner,
    points_near_cell,
    points_within,
    steps_of,
)
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["SiegelTheta"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_EPSILON = float(np.finfo(float).eps)

#: Derived: rounding to nearest, relative.
_ROUNDING = _EPSILON / 2

#: Derived: im τ' from which exponents leave the range of a double.
_LARGEST_TAU = 1e200

#: Budget: rounding of phases, in cycles, from which they are formed in balls; the radius that is
#: left there.
_ROUGH = 3.5e-15
_LARGEST_RADIUS = 2.0**-60

#: Derived: bits of numbers that are rounded to doubles.
_KNOWN_BITS = 60

#: Calibrated: rounding of the common factor in ε. Largest seen over random τ: a third.
_COMMON_ROUNDING = 8.0

#: Budget: entries of one block of (points × half vectors).
_BLOCK = 50_000

#: Balls less the whole numbers next to their real parts.
_mod_one = np.frompyfunc(lambda x: x - (x.real.mid() + 0.5).mid().floor(), 1, 1)


class _Rounded(NamedTuple):
    """What N points are to the sums of one characteristic, in doubles.

    - logarithms: (N, 2, g), of the steps, in cycles, but for whole numbers
    - nearest: n, (N, g)
    - phases, exponents: of the common factor e^{2πi·phase + exponent}, (N,); what is left of the
      exponent beyond a double is in the phase, which is complex
    - slopes: (N, g), the gradient of the largest term over itself
    - off_steps, off_phase: the rounding of v, summed over its entries, and of the phase, (N,) each,
      in cycles
    """

    logarithms: Complex
    nearest: Array
    phases: Complex
    exponents: Array
    slopes: Complex
    off_steps: Array
    off_phase: Array


@dataclass(frozen=True)
class SiegelTheta:
    """The theta functions of one matrix τ, complex, symmetric, Im τ positive definite, shape (g,
    g).
    """

    tau: Complex

    @cached_property
    def reduction(self) -> SiegelReduction:
        """Return the reduced matrix and the way there."""
        return with_enough_bits(lambda: SiegelReduction.of(exact(self.tau)))

    @cached_property
    def _doubles(self) -> tuple[Complex, Complex, Complex, complex]:
        """Return τ', L, Q and the turns of c."""

        def rounded() -> tuple[Complex, Complex, Complex, complex] | None:
            *matrices, turns = self.reduction.matrices()
            entries = (x for matrix in matrices for x in matrix.flat if x != 0)
            if any(x.rel_accuracy_bits() < _KNOWN_BITS for x in entries):
                return None
            tau, L, Q = (matrix.astype(complex) for matrix in matrices)
            return tau, L, Q, complex(turns)

        return with_enough_bits(rounded)

    @property
    def reduced(self) -> Complex:
        """Return τ'."""
        return self._doubles[0]

    @cached_property
    def terms(self) -> float:
        """Return about the number of terms of a sum, without forming them; infinity where their
        exponents leave the range of a double, or rounding has left Im τ' without its sign.
        """
        form = self.reduced.imag
        if not np.max(np.abs(form)) < _LARGEST_TAU:
            return math.inf
        try:
            return points_within(form, RADIUS + math.sqrt(largest_corner(form)))
        except np.linalg.LinAlgError:
            return math.inf

    @cached_property
    def _table(self) -> TermTable:
        return TermTable.of(points_near_cell(self.reduced.imag, RADIUS), self.reduced)

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
        shape = (len(characteristics), count)
        values = np.empty((*shape, *(genus,) * order), dtype=complex)
        exponents, errors = np.empty((2, *shape))
        size = max(1, _BLOCK // self._table.width)
        for members in self.reduction.alike(characteristics):
            places = [member.place for member in members]
            for first in range(0, count, size):
                checkpoint()
                rows = slice(first, first + size)
                found = self._block(z[rows], members, order, with_errors)
                values[places, rows], exponents[places, rows], errors[places, rows] = found
        return np.swapaxes(values, 0, 1), exponents.T, errors.T

    def _block(
        self, z: Complex, members: list[Member], order: int, with_errors: bool
    ) -> tuple[Complex, Array, Any]:
        """Return the derivatives of M characteristics that are alike, (M, N, …), and their common
        exponents and errors, (N,), NaN without ``with_errors``.
        """
        first, whole = members[0], np.rint(z.real)
        inside = z - whole
        at = self._in_doubles(inside, first)
        rough = np.flatnonzero(~(at.off_steps + at.off_phase <= _ROUGH))
        if rough.size:
            fine = with_enough_bits(lambda: self._by_balls(inside[rough], first))
            for part, better in zip(at, fine, strict=True):
                part[rough] = better
        epsilon = first.reduced[: z.shape[1]].astype(float)
        half_turns = np.array([np.rint(2 * (c.delta - first.delta)) for c in members], dtype=int)
        own = at.nearest + epsilon
        steps = np.exp(2j * np.pi * np.ascontiguousarray(at.logarithms.T))
        sums = self._table.moments(steps, order, half_turns)
        phases = at.phases + half_turns / 2 @ (np.fmod(at.nearest, 2) + epsilon).T
        for row, member in zip(phases, members, strict=True):
            row += float(member.turns) + _turns_of(whole, member.given)
        factors = np.exp(2j * np.pi * (phases - np.rint(phases.real)))
        derivatives = self._transform(sums, at.slopes) * factors[(..., *[None] * order)]
        bound: Any = np.nan
        if with_errors:
            scale = np.exp(-2 * np.pi * at.phases.imag)
            bound = self._bound_rounding(steps, at, own, order) * scale
        return derivatives, at.exponents, bound

    def _in_doubles(self, z: Complex, member: Member) -> _Rounded:
        """Return what points (N, g) in the strip |Re z_i| ≤ ½ are to the sums, by doubles."""
        tau, L, Q, _ = self._doubles
        at = arguments(self._doubles, z, member)
        sizes, far = np.abs(z), np.abs(at.own)
        of_inner, of_moved = sizes @ np.abs(L).T, far @ np.abs(tau)
        of_turns = _dot(sizes @ np.abs(Q), sizes) / 2 + _dot(far, of_inner + of_moved / 2 + 1)
        off = np.sum(of_inner + of_moved + 1, axis=1), of_turns + 1
        return _Rounded(
            steps_of(at.v - np.rint(at.v.real), tau),
            at.nearest,
            at.turns.real.astype(complex),
            -2 * np.pi * at.turns.imag,
            2j * np.pi * at.slopes,
            _ROUNDING * off[0],
            _EPSILON * off[1],
        )

    def _by_balls(self, z: Complex, member: Member) -> _Rounded | None:
        """Return the same from balls, None where the precision in force is not enough."""
        matrices = self.reduction.matrices()
        at: Arguments = arguments(matrices, exact(z), member)
        if not np.all(np.isfinite(at.nearest)):
            raise Unsolved("beyond-floats", "an exponent leaves the range of a float")
        if not all(float(x.rad()) <= _LARGEST_RADIUS for x in (*at.turns, *at.v.flat)):
            return None
        exponents = (-2 * flint.arb.pi() * imaginary(at.turns)).astype(float)
        # as exponents are rounded, their rest is left to the phases
        heights = np.array([flint.arb(x) for x in exponents.tolist()]) / (2 * flint.arb.pi())
        phases = (_mod_one(at.turns) + heights * flint.acb(0, 1)).astype(complex)
        if not np.all(np.abs(phases.imag) < 1):
            raise Unsolved("beyond-floats", "an exponent leaves the range of a float")
        logarithms = steps_of(_mod_one(at.v), matrices[0]).astype(complex)
        # a longer one makes no term that is seen
        lengths = np.minimum(np.abs(logarithms), self._table.longest)
        return _Rounded(
            logarithms,
            at.nearest,
            phases,
            exponents,
            2j * np.pi * at.slopes.astype(complex),
            _EPSILON * np.sum(np.max(lengths, axis=1), axis=1),
            np.full(len(z), _EPSILON),
        )

    def _transform(self, moments: list[Complex], slopes: Complex) -> Complex:
        """Return the highest derivative of e^{πi zᵀQz + …}Θ(Lz), from the moments of Θ in k: a
        derivative multiplies the term of k by 2πi Lᵀk + slope.
        """
        _, L, Q, _ = self._doubles
        value, *higher = moments
        if not higher:
            return value
        gradient = 2j * np.pi * higher[0] @ L
        if len(higher) == 1:
            return gradient + slopes * value[..., None]
        mixed = slopes[:, :, None] * gradient[..., None, :]
        own = slopes[:, :, None] * slopes[:, None, :] + 2j * np.pi * Q
        second = -4 * np.pi**2 * (L.T @ higher[1] @ L) + own * value[..., None, None]
        return np.asarray(second + mixed + np.swapaxes(mixed, -1, -2))

    def _bound_rounding(self, steps: Complex, at: _Rounded, own: Array, order: int) -> Array:
        """Return what the sums may be off by, (N,): the errors of their terms, of their arguments
        and of the common factor.
        """
        tau, L, Q, _ = self._doubles
        # a derivative multiplies a term by at most Σ_p growth_p κ^p, κ the largest |k_i|: a first
        # one multiplies it by 2πi Lᵀ(m+ε) + slope
        rate = 2 * np.pi * np.max(np.sum(np.abs(L), axis=0))
        fixed = np.max(np.abs(at.slopes), axis=1)
        growths = [[1.0], [fixed, rate], [fixed**2 + 2 * np.pi * np.max(np.abs(Q))]]
        growths[2] += [2 * rate * fixed, rate**2]
        sizes, errors = self._table.sizes(steps, tau, order + 1)
        common = 2 * np.pi * at.off_phase + _COMMON_ROUNDING * _EPSILON
        found = np.zeros(len(own))
        for p, factor in enumerate(growths[order]):
            found += factor * (
                errors[p] + 2 * np.pi * at.off_steps * sizes[p + 1] + common * sizes[p]
            )
        # the two parts of a slope may cancel
        of_own = 2j * np.pi * own.astype(complex) @ L
        parts = 2 * np.pi * np.abs(own) @ np.abs(L) + np.abs(at.slopes - of_own)
        parts = np.max(parts, axis=1)
        for p, factor in enumerate(growths[order - 1] if order else []):
            found += order * _COMMON_ROUNDING * _EPSILON * parts * factor * sizes[p]
        return found


def _turns_of(whole: Array, epsilon: NDArray[Any]) -> Any:
    """Return n·ε modulo 1, (N,), for whole numbers n of any size, (N, g)."""
    if not whole.any():
        return 0.0
    if all((2 * x).q == 1 for x in epsilon):
        return np.fmod(whole, 2) @ np.array([float(x - 2 * (x / 2).floor()) for x in epsilon])
    rows = [map(int, row) for row in whole.tolist()]
    sums = [sum(n * x for n, x in zip(row, epsilon, strict=True)) for row in rows]
    return np.array([float(x - x.floor()) for x in sums])


def _dot(left: NDArray[Any], right: NDArray[Any]) -> NDArray[Any]:
    """Return the products of rows with rows, (N,)."""
    return np.asarray(np.sum(left * right, axis=1))
