"""The terms of a theta sum after Siegel reduction, their points of the lattice, and the sums in
balls: theta functions of τ = iT at real points to any number of digits.

The term of k is W_k Π_i s_i^{|k_i|} with the steps s_i = e^{2πi(±v_i + τ_ii/2)}, the sign that of
k_i, and W_k = exp πi(kᵀτk − Σ τ_ii|k_i|): next to the largest term no factor is large however large
Im τ_ii is.
"""

from __future__ import annotations

import itertools
import math
import operator
from dataclasses import dataclass
from typing import Any

import flint
import numpy as np
import scipy  # its parts are loaded when they are asked for
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import Values
from veselova.analytic.theta.siegel_reduction import Member, SiegelReduction, arguments, reduce_form
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.decimals import precision
from veselova.mechanics.core.errors import Unsolved

__all__ = [
    "RADIUS",
    "TermTable",
    "ThetaInBalls",
    "largest_corner",
    "points_near_cell",
    "points_within",
    "short_sum",
    "steps_of",
]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]

_EPSILON = float(np.finfo(float).eps)

#: Radius, in the norm of T or T⁻¹, of the terms above e^(−39) = 1e-17 of the largest; the others
#: are left out.
RADIUS = math.sqrt(39.0 / math.pi)

#: Derived: least eigenvalue of S for waves: there θ(z)/θ(0) stays above
#: ((1−2e^(−π/2))/(1+2e^(−π/2)))^|F| = 0.42^|F|.
_WAVE_FLOOR = 0.5

#: Derived: bits in which a basis of doubles is reduced.
_BASIS_BITS = 128

#: Calibrated: rounding of the factors of a term, in that of one operation.
_FACTOR_ROUNDING = 4.0

#: Derived: cycles of Im(±v + τ_ii/2) from which a step is below any rounding of the largest term.
_LONGEST_STEP = 6.0

#: Derived: largest exponent of a factor, so that products of factors are doubles.
_LARGEST_EXPONENT = 300.0

#: Derived: terms in balls below e^(−nats−4) of the largest are left out: as many as there are near
#: the edge add less than the precision.
_BEYOND_PRECISION = 4.0

#: Budget: most terms of one sum in balls: a second for each point; entries of one block of (points
#: × half vectors).
_MOST_TERMS = 300_000
_BLOCK = 10_000

_phase_factors = np.frompyfunc(lambda x: (2 * x).exp_pi_i(), 1, 1)
_real = np.frompyfunc(operator.attrgetter("real"), 1, 1)


def steps_of(v: NDArray[Any], tau: NDArray[Any]) -> NDArray[Any]:
    """Return the logarithms of the steps up and down at v (N, g), in cycles, (N, 2, g)."""
    return np.asarray(np.stack([v, -v], axis=1) + np.diagonal(tau) / 2)


@dataclass(frozen=True)
class TermTable:
    """The terms of a sum by the halves of the k's, in doubles or in balls.

    - left, right: halves of the k's, (I, a) and (J, g−a)
    - weights: W between them, (J, I): sparse in doubles, FLINT's matrix in balls
    - points: the k's, (K, g), in the order of the weights
    - longest: cycles of a logarithm of a step beyond which its terms are below any rounding
    """

    left: Array
    right: Array
    weights: Any
    points: Array
    longest: float = _LONGEST_STEP

    @classmethod
    def of(cls, points: Array, tau: NDArray[Any]) -> TermTable:
        """Return the table of the points k (K, g) and τ (g, g), complex doubles or balls; raises
        Unsolved (``beyond-floats``) where a factor leaves the range of doubles.
        """
        in_balls = tau.dtype == object
        k = points.astype(np.int64).astype(object) if in_balls else points
        exponents = _exponents(k, tau)
        split = (points.shape[1] + 1) // 2
        (left, i), (right, j) = (
            np.unique(half, axis=0, return_inverse=True)
            for half in (points[:, :split], points[:, split:])
        )
        i, j = i.ravel(), j.ravel()
        order = np.lexsort((i, j))
        places, shape = (j[order], i[order]), (len(right), len(left))
        if in_balls:
            weights = np.zeros(shape, dtype=object)
            weights[places] = _phase_factors(exponents[order] / 2)
            return cls(left, right, flint.acb_mat(weights.tolist()), points[order])
        coupling = np.sum(np.abs(tau.imag), axis=1) - np.diagonal(tau.imag)
        largest = max(0.0, *(-np.pi * exponents.imag))
        if max(largest, np.pi * np.max(coupling)) > _LARGEST_EXPONENT:
            raise Unsolved("beyond-floats", "terms of the reduced τ leave the range of a float")
        entries = (np.exp(1j * np.pi * exponents[order]), places)
        weights = scipy.sparse.csr_array(entries, shape=shape)
        longest = _LONGEST_STEP + largest / (2 * np.pi)
        return cls(left, right, weights, points[order], longest)

    @property
    def width(self) -> int:
        """Return the numbers that a point needs."""
        return max(len(self.left), len(self.right))

    def _powers(self, u: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the products of steps u (g, 2, N) of both halves, (I, N) and (J, N)."""
        split = self.left.shape[1]
        return _products_of_steps(self.left, u[:split]), _products_of_steps(self.right, u[split:])

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
        """Return the sums of ± the terms at steps u (g, 2, N), and with k_i and k_ik_j in them, (M,
        N), (M, N, g), (M, N, g, g).

        half_turns: h (M, g), whole numbers; the signs are (−1)^{h·k}
        """
        split, genus = self.left.shape[1], len(u)
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
        of_W = np.pi * _exponents(size, sizes)
        heights = np.abs(tau.imag)
        longest = np.sum(heights, axis=1) + np.diagonal(heights)  # of 2|±v + τ_ii/2|
        of_powers = 2 * np.pi * size @ (1 + np.minimum(longest, 2 * self.longest))
        rounding = _FACTOR_ROUNDING + np.sum(size, axis=1) + of_W + of_powers

        def total(factors: Array) -> Array:
            entries = np.abs(self.weights.data) * factors, self.weights.indices, self.weights.indptr
            weights = scipy.sparse.csr_array(entries, self.weights.shape)
            return np.asarray(np.sum(right * (weights @ left), axis=0))

        powers = [kappa**p for p in range(most + 1)]
        return [total(x) for x in powers], [_EPSILON / 2 * total(rounding * x) for x in powers]


class ThetaInBalls:
    """The theta functions of T, shape (g, g), balls of ``arithmetic``. What is left out of the sums
    is estimated, not bounded.
    """

    def __init__(self, T: Values, arithmetic: Any) -> None:
        self.genus, self._xp = len(T), arithmetic
        reduction = SiegelReduction.of(T * flint.acb(0, 1))
        if reduction is None:
            raise ZeroDivisionError("a Riemann matrix of too few digits")
        self._reduction, self._matrices = reduction, reduction.matrices()
        tau = self._matrices[0]
        form = tau.astype(complex).imag
        radius = math.sqrt((arithmetic.nats + _BEYOND_PRECISION) / math.pi)
        count = points_within(form, radius + math.sqrt(largest_corner(form)))
        if not count <= _MOST_TERMS:
            reason = f"theta sums of {arithmetic.digits} digits would have {count:.1e} terms"
            raise Unsolved("narrow-gap", f"{reason} at this gap")
        self._table = TermTable.of(points_near_cell(form, radius), tau)

    def values(self, z: Values, characteristics: Array) -> Values:
        """Return θ[ε;δ](z) at points (N, g) for characteristics (C, 2, g), half-integer, (N, C).

        The first characteristic must be zero: what the sums leave out is measured against its
        values, which have no zeros.
        """
        xp = self._xp
        size = max(1, _BLOCK // self._table.width)
        result = np.empty((len(z), len(characteristics)), dtype=object)
        # by even numbers characteristics are not turned
        near = z - 2 * xp.floor(z / 2 + xp.number(1) / 2)
        for members in self._reduction.alike(characteristics):
            for first in range(0, len(z), size):
                checkpoint()
                rows = slice(first, first + size)
                self._fill(result[rows], near[rows], members)
        return np.asarray(xp.add_error(result, np.abs(result[:, :1]) * xp.epsilon))

    def _fill(self, result: Values, points: Values, members: list[Member]) -> None:
        """Write the values of characteristics that are alike to their places."""
        first = members[0]
        at = arguments(self._matrices, points, first)
        half_turns = np.array([2 * (c.delta - first.delta) for c in members]).round().astype(int)
        steps = _phase_factors(steps_of(at.v, self._matrices[0])).T
        sums = self._table.moments(steps, 0, half_turns)[0] * _phase_factors(at.turns)
        epsilon = first.reduced[: self.genus]
        signs = 1 - 2 * (half_turns @ at.nearest.astype(int).T % 2)
        for member, h, values, sign in zip(members, half_turns, sums, signs, strict=True):
            factor = flint.acb(epsilon @ h + 2 * member.turns).exp_pi_i()
            result[:, member.place] = _real(values * factor) * sign


def _exponents(k: NDArray[Any], tau: NDArray[Any]) -> NDArray[Any]:
    """Return kᵀτk − Σ τ_ii|k_i| for whole numbers k (K, g), (K,)."""
    coupling = tau * (1 - np.eye(len(tau), dtype=int))
    return np.asarray(np.sum((k @ coupling) * k, axis=1) + (k * k - abs(k)) @ np.diagonal(tau))


def _product(weights: Any, powers: NDArray[Any]) -> NDArray[Any]:
    """Return the product of weights and powers, (J, N)."""
    if powers.dtype != object:
        return np.asarray(weights @ powers)
    found = weights * flint.acb_mat(powers.tolist())
    entries = np.fromiter(found.entries(), dtype=object, count=found.nrows() * found.ncols())
    return entries.reshape(found.nrows(), -1)


def _products_of_steps(rows: Array, u: NDArray[Any]) -> NDArray[Any]:
    """Return Π_i s_i^{|k_i|} for whole numbers k (I, a) and steps u (a, 2, N), (I, N)."""
    result = np.ones((len(rows), u.shape[2]), dtype=u.dtype)
    for k, both in zip(rows.T.astype(np.int64), u, strict=True):
        most = int(np.max(np.abs(k), initial=0))
        powers = np.ones((2 * most + 1, u.shape[2]), dtype=u.dtype)
        for sign, one in zip((1, -1), both, strict=True):
            for j in range(1, most + 1):
                np.multiply(powers[most + sign * (j - 1)], one, out=powers[most + sign * j])
        result *= powers[most + k]
    return result


def _signs(half_turns: Array) -> Array:
    """Return (−1)^h of whole numbers."""
    return 1.0 - 2.0 * np.mod(half_turns, 2)


def short_sum(T: Array) -> tuple[NDArray[np.int64], list[int]]:
    """Return a basis U ∈ GL(g, Z), as rows, and the coordinates F in which the sum of the real T
    has waves and not Gaussians: those in which it is short and does not cancel.

    With m = Uᵀm', θ[ε;δ](z; T) = θ[U⁻ᵀε; Uδ](Uz; UTUᵀ). Poisson summation over the other
    coordinates, G, turns their waves into Gaussians,

        θ[ε;δ](z) = det T_GG^{−1/2} Σ_{x∈Z^F+ε_F} Σ_{k∈Z^G} e^{−π xᵀSx − π dᵀT_GG⁻¹d}
            cos 2π[x·(z_F+δ_F + Cd) + k·ε_G],   d = k−z_G−δ_G,  C = T_FG T_GG⁻¹,  S = T_FF − C T_GF,

    which does not cancel where S is not small. Near a separatrix T has a nearly null vector; in a
    reduced basis it is a coordinate of its own, which one Gaussian serves.
    """
    g = len(T)
    with precision(_BASIS_BITS):
        basis = reduce_form(np.array(list(map(flint.arb, T.flat))).reshape(T.shape))
    if basis is None:
        raise Unsolved("beyond-floats", "the Riemann matrix is not positive definite in doubles")
    U = np.array(basis.tolist(), dtype=np.int64)
    U = U[np.argsort(np.diagonal(U @ T @ U.T), kind="stable")]
    lower = np.linalg.cholesky(U @ T @ U.T)
    lengths = np.diagonal(lower)

    def cost(gaussians: int) -> float:
        rest = lower[gaussians:, gaussians:]
        if len(rest) and np.linalg.eigvalsh(rest @ rest.T)[0] < _WAVE_FLOOR:
            return math.inf
        axes = RADIUS * np.concatenate([lengths[:gaussians], 1 / lengths[gaussians:]])
        return float(np.prod(1 + 2 * axes))

    return U, list(range(min(range(g + 1), key=cost), g))


def points_within(form: Array, radius: float) -> float:
    """Return about how many points of Z^d lie in a ball of this radius in the norm of the form: its
    volume, in cells, or one.
    """
    axes = radius / np.diag(np.linalg.cholesky(form))
    half = len(axes) / 2
    unit_ball = math.exp(half * math.log(math.pi) - math.lgamma(half + 1))
    return max(1.0, unit_ball * float(np.prod(axes)))


def largest_corner(form: Array) -> float:
    """Return max rᵀ form r over the cell |r_i| ≤ ½, a convex function: the maximum over its
    corners.
    """
    size = len(form)
    corners = (np.arange(2**size)[:, None] >> np.arange(size) & 1) - 0.5
    return float(((corners @ form) * corners).sum(axis=1).max())


def points_near_cell(form: Array, radius: float) -> Array:
    """Return the k ∈ Z^d that matter to some r of the cell |r_i| ≤ ½: |k−r|² ≤ radius² + min_k
    |k−r|² in the norm of the form.

    Zero is no nearer than the nearest, so |k|² − 2k·r ≤ radius², whose least value over the cell is
    |k|² − Σ|(form k)_i|.
    """
    corner = largest_corner(form)
    k = lattice_points(form, math.sqrt(radius * radius + corner) + math.sqrt(corner))
    projected = k @ form
    return np.asarray(k[(projected * k - np.abs(projected)).sum(axis=1) <= radius * radius])


def lattice_points(form: Array, radius: float) -> Array:
    """Return the points k ∈ Z^d with kᵀ form k ≤ radius², shape (K, d), by descent through the
    Cholesky factor.
    """
    upper = np.linalg.cholesky(form).T
    points = np.zeros((1, 0))
    left = np.array([radius * radius])
    for i in range(len(form) - 1, -1, -1):
        length = float(upper[i, i])
        centre = points @ (upper[i, i + 1 :] / -length)
        reach = np.sqrt(left) / length
        first = np.ceil(centre - reach)
        counts = (np.floor(centre + reach) - first).astype(np.int64) + 1
        parent = np.repeat(np.arange(len(points)), counts)
        ends = np.cumsum(counts)
        whole = (first - (ends - counts))[parent] + np.arange(len(parent))
        left = np.maximum(left[parent] - (length * (whole - centre[parent])) ** 2, 0.0)
        points = np.concatenate([whole[:, None], points[parent]], axis=1)
    return points
