"""The lattice of a theta sum: its points in an ellipsoid, and the coordinates in which the sum is
short.

With m = Uᵀm', U ∈ GL(g, Z), the sum over Z^g is one over m', and

    θ[ε;δ](z; T) = θ[U⁻ᵀε; Uδ](Uz; UTUᵀ).

Near a separatrix T has a nearly null vector, a difference of coordinates; in a reduced basis it is
a coordinate of its own, which one Gaussian serves. Reduction is in pairs: b_i is shortened by
multiples of b_j as long as one is, in T or in its dual T⁻¹.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.theta.characteristic import Characteristic
from veselova.tunings import GAUSSIAN_TERMS, WAVE_TERMS

__all__ = [
    "RADIUS",
    "Coordinates",
    "Halves",
    "Member",
    "half_of",
    "largest_corner",
    "lattice_points",
    "points_near_cell",
    "points_within",
    "schur",
    "small_norm",
]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Some entries of a characteristic, in halves.
Halves: TypeAlias = tuple[int, ...]

#: The place of a characteristic among those given, itself in these coordinates, and the sign of its
#: reduction modulo one.
Member: TypeAlias = tuple[int, Characteristic, int]
Families: TypeAlias = Mapping[Halves, Mapping[Halves, list[Member]]]

#: Radius, in the norm of T or T⁻¹, of the terms above e^(−39) = 1e-17 of the largest; the others
#: are left out.
RADIUS = math.sqrt(39.0 / math.pi)

#: Derived: least eigenvalue of S for waves: there θ(z)/θ(0) stays above
#: ((1−2e^(−π/2))/(1+2e^(−π/2)))^|F| = 0.42^|F|.
_WAVE_FLOOR = 0.5

#: Derived: a vector is shortened where the multiple of another that does it differs from ½ by more
#: than rounding.
_HALF = 0.5 + 1e-9


@dataclass(frozen=True)
class Coordinates:
    """The rows of ``U`` are the basis, shape (g, g); ``waves`` is the set F of
    analytic.theta.riemann_theta, the others have Gaussians.
    """

    U: Integers
    harmonics: tuple[int, ...]

    @classmethod
    def cheapest(cls, T: Array) -> tuple[Coordinates, float]:
        """Return those with the shortest sum, by volume, in which the waves do not cancel: S stays
        above a floor; and its cost.

        Gaussians are the shortest vectors of a basis reduced in T, or what the shortest of one
        reduced in T⁻¹ leave.
        """
        genus = len(T)
        primal = _reduce(T)
        dual = np.rint(np.linalg.inv(_reduce(np.asarray(np.linalg.inv(T)))).T).astype(np.int64)[
            ::-1
        ]
        choices = []
        for U, counts in ((primal, range(genus + 1)), (dual, range(1, genus))):
            if U is dual and (primal == U).all():
                break
            factors = _Factors.of(U @ T @ U.T)
            choices += [(cls(U, tuple(range(m, genus))), factors.cost(m)) for m in counts]
        return min(choices, key=lambda choice: choice[1])

    @classmethod
    def unreduced(cls, T: Array, harmonics: tuple[int, ...]) -> tuple[Coordinates, float]:
        """Return those of Z^g itself, and the cost of their sum; infinite where the
        waves cancel.
        """
        order = [*(i for i in range(len(T)) if i not in harmonics), *harmonics]
        return cls(np.eye(len(T), dtype=np.int64), harmonics), _Factors.of(
            T[np.ix_(order, order)]
        ).cost(len(T) - len(harmonics))

    @cached_property
    def gaussians(self) -> list[int]:
        """Return G, the coordinates that are not waves."""
        return [i for i in range(len(self.U)) if i not in self.harmonics]

    def form(self, T: Any) -> Any:
        """Return UTUᵀ."""
        return self.U @ T @ self.U.T

    def points(self, z: Any) -> Any:
        """Return Uz for z of shape (N, g)."""
        return z @ self.U.T

    def characteristics(self, given: Sequence[Characteristic]) -> list[tuple[Characteristic, int]]:
        """Return characteristics in these coordinates, each with the sign of its reduction modulo
        one.
        """
        halves = np.array([c.delta for c in given], dtype=np.int64) @ self.U.T
        epsilon = np.mod(np.array([c.epsilon for c in given], dtype=np.int64) @ self._dual.T, 2)
        delta = np.mod(halves, 2)
        signs = 1 - 2 * np.mod(np.sum(epsilon * ((halves - delta) // 2), axis=1), 2)
        rows = zip(epsilon.tolist(), delta.tolist(), signs.tolist(), strict=True)
        return [(Characteristic(tuple(e), tuple(d)), sign) for e, d, sign in rows]

    def families(self, characteristics: Sequence[Characteristic]) -> Families:
        """Return the members by δ_G and then by ε_F: those together that have the same Gaussians,
        and the same waves.
        """
        families: dict[Halves, dict[Halves, list[Member]]] = defaultdict(lambda: defaultdict(list))
        for place, (local, sign) in enumerate(self.characteristics(characteristics)):
            delta_G = tuple(local.delta[i] for i in self.gaussians)
            epsilon_F = tuple(local.epsilon[i] for i in self.harmonics)
            families[delta_G][epsilon_F].append((place, local, sign))
        return families

    @cached_property
    def _dual(self) -> Integers:
        return np.rint(np.linalg.inv(self.U).T).astype(np.int64)


def _reduce(form: Array) -> Integers:
    """Return a basis, as rows, in which no vector is shortened by a multiple of another; short
    vectors first.
    """
    U = np.eye(len(form), dtype=np.int64)
    gram = form.tolist()
    size = len(form)
    improved = True
    while improved:
        improved = False
        for i, j in ((i, j) for i in range(size) for j in range(size) if i != j):
            if abs(gram[i][j]) > _HALF * gram[j][j]:
                U[i] -= round(gram[i][j] / gram[j][j]) * U[j]
                gram = (U @ form @ U.T).tolist()
                improved = True
    return U[sorted(range(size), key=lambda i: gram[i][i])]


@dataclass(frozen=True)
class _Factors:
    """A form as LLᵀ, and L⁻¹, for Gaussians in its first m coordinates and waves in the others,
    with any m.

    The leading blocks of both are those of the first; the last block of L is a factor of S, the
    Schur complement.
    """

    lower: Array
    inverse: Array

    @classmethod
    def of(cls, form: Array) -> _Factors:
        """Return the factors of a form."""
        lower = np.asarray(np.linalg.cholesky(form))
        return cls(lower, np.asarray(np.linalg.inv(lower)))

    @cached_property
    def _lengths(self) -> list[float]:
        return [self.lower.item(i, i) for i in range(len(self.lower))]

    @cached_property
    def _spreads(self) -> list[float]:
        """Return how far centred points reach along each Gram–Schmidt vector, along which r of the
        cell reaches ``half``.
        """
        half = np.abs(self.inverse).sum(axis=1) / 2
        return [x + math.sqrt(x * x + RADIUS**2) for x in half.tolist()]

    def cost(self, m: int) -> float:
        """Return the terms of a value with Gaussians in the first m coordinates; infinite where the
        waves cancel.
        """
        rest = self.lower[m:, m:]
        of_waves = self._lengths[m:]
        least = (
            of_waves[0] ** 2
            if len(of_waves) == 1
            else float(np.linalg.eigvalsh(rest @ rest.T)[0])
            if of_waves
            else math.inf
        )
        if least < _WAVE_FLOOR:
            return math.inf
        gaussian_factors = _points(
            spread * x for spread, x in zip(self._spreads[:m], self._lengths[:m], strict=True)
        )
        harmonics = _points(RADIUS / x for x in of_waves)
        return (
            gaussian_factors * harmonics
            + GAUSSIAN_TERMS * gaussian_factors
            + (WAVE_TERMS * harmonics if of_waves else 0.0)
        )


def points_within(form: Array, radius: float) -> float:
    """Return about how many points of Z^d lie in a ball of this radius in the norm of the form."""
    return _points(radius / x for x in np.diag(np.linalg.cholesky(form)).tolist())


def _points(half_axes: Iterable[float]) -> float:
    """Return about how many points of Z^d an ellipsoid with these half axes, in cells, has: its
    volume, or one.
    """
    axes = list(half_axes)
    return max(1.0, _unit_ball(len(axes)) * math.prod(axes))


@lru_cache
def _unit_ball(dimension: int) -> float:
    return math.exp(dimension / 2 * math.log(math.pi) - math.lgamma(dimension / 2 + 1))


def schur(T: Array, F: list[int], G: list[int]) -> tuple[Array, Array, Array]:
    """Return (S, C, T_GG⁻¹): C = T_FG T_GG⁻¹, S = T_FF − C T_GF."""
    of_F = T[F]
    of_G = T[G]
    inverse = np.linalg.inv(of_G[:, G]) if G else np.empty((0, 0))
    C = of_F[:, G] @ inverse
    S = of_F[:, F] - C @ of_G[:, F]
    return (S + S.T) / 2, C, (inverse + inverse.T) / 2


def largest_corner(form: Array) -> float:
    """Return max rᵀ form r over the cell |r_i| ≤ ½, a convex function: the maximum over its
    corners.
    """
    corners = _corners(len(form))
    return float(((corners @ form) * corners).sum(axis=1).max())


@lru_cache
def _corners(size: int) -> Array:
    corners = np.asarray(
        (np.arange(2**size)[:, None] >> np.arange(size) & 1) - 0.5, dtype=np.float64
    )
    corners.flags.writeable = False
    return corners


def points_near_cell(form: Array, radius: float) -> Array:
    """Return the k ∈ Z^d that matter to some r of the cell |r_i| ≤ ½: |k−r|² ≤ radius² + min_k
    |k−r|² in the norm of the form.

    Zero is no nearer than the nearest, so |k|² − 2k·r ≤ radius², whose least value over the cell is
    |k|² − Σ|(form k)_i|.
    """
    corner = largest_corner(form)
    k = lattice_points(
        form, math.sqrt(radius * radius + corner) + math.sqrt(corner), np.zeros(form.shape[0])
    )
    projected = k @ form
    return np.asarray(k[(projected * k - np.abs(projected)).sum(axis=1) <= radius * radius])


def small_norm(form: Array, shift: Array) -> float:
    """Return xᵀ form x for a short x of Z^d + shift: rounding from the last coordinate on (Babai's
    nearest plane).
    """
    upper = np.linalg.cholesky(form).T
    x = np.zeros(shift.size)
    norm = 0.0
    for i in range(shift.size - 1, -1, -1):
        centre = -(upper[i, i + 1 :] @ x[i + 1 :]) / upper[i, i]
        x[i] = np.rint(centre - shift[i]) + shift[i]
        norm += float(upper[i, i] * (x[i] - centre)) ** 2
    return norm


def lattice_points(form: Array, radius: float, shift: Array) -> Array:
    """Return the points x ∈ Z^d + shift with xᵀ form x ≤ radius², shape (K, d), by descent through
    the Cholesky factor.
    """
    dimension = form.shape[0]
    if dimension == 0:
        return np.zeros((1, 0))
    upper = np.linalg.cholesky(form).T
    points = np.zeros((1, 0))
    left = np.array([radius * radius])
    for i, offset in zip(range(dimension - 1, -1, -1), shift[::-1].tolist(), strict=True):
        length = float(upper[i, i])
        # of the whole numbers x_i − shift_i
        centre = points @ (upper[i, i + 1 :] / -length) - offset
        reach = np.sqrt(left) / length
        first = np.ceil(centre - reach)
        counts = (np.floor(centre + reach) - first).astype(np.int64) + 1
        parent = np.repeat(np.arange(len(points)), counts)
        ends = np.cumsum(counts)
        whole = (first - (ends - counts))[parent] + np.arange(len(parent))
        left = np.maximum(left[parent] - (length * (whole - centre[parent])) ** 2, 0.0)
        points = np.concatenate([whole[:, None] + offset, points[parent]], axis=1)
    return points


def half_of(points: Any) -> Any:
    """Return one of each pair ±x of points (K, d): that whose first coordinate beside zero is
    positive, and zero itself.
    """
    if not points.shape[1]:
        return points
    return points[points[np.arange(len(points)), np.argmax(points != 0, axis=1)] >= 0]
