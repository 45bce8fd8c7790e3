"""Real theta functions with half-integer characteristics,

    θ[ε;δ](z) = Σ_{m∈Z^g} exp(−π(m+ε)ᵀT(m+ε)) cos 2π(m+ε)·(z+δ),   T symmetric, positive definite.

Where T is small this sum cancels: θ(z) falls to e^(−π/4T) of θ(0). Poisson summation over some of the variables (set G, the
rest being F) turns their waves into Gaussians. With y = z+δ, C = T_FG T_GG⁻¹ and S = T_FF − C T_GF,

    θ[ε;δ](z) = det T_GG^{−1/2} Σ_{x∈Z^F+ε_F} Σ_{k∈Z^G} e^{−π xᵀSx − π dᵀT_GG⁻¹d} cos 2π[x·(y_F + Cd) + k·ε_G],   d = k−y_G.

F is kept to directions where S is not small, so θ(z) = θ[0;0](z) is a sum without cancellation, and its values are accurate
relative to themselves. F = everything is the defining series, G = everything a lattice sum of Gaussians.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.characteristic import Characteristic

__all__ = ["Theta", "cheapest_waves", "largest_corner", "lattice_points", "small_norm"]

Array = NDArray[np.float64]

#: Terms below e^(−39) = 1e-17 of the largest are left out.
_EXPONENT = 39.0

#: Least eigenvalue of S for waves: there θ(z)/θ(0) stays above ((1−2e^(−π/2))/(1+2e^(−π/2)))^|F| = 0.42^|F|.
_WAVE_FLOOR = 0.5

#: A term with waves costs this many without: its exponentials are complex, and each characteristic has its own.
_WAVE_COST = 6.0

#: Entries of one block of (points × lattice): 16 MB of temporaries.
_BLOCK = 2_000_000


@dataclass(frozen=True)
class Theta:
    """The theta functions of T, shape (g, g); ``waves`` is the set F of the sum, None for the cheapest accurate one."""

    T: Array
    waves: tuple[int, ...] | None = None

    @property
    def genus(self) -> int:
        """Return g."""
        return int(self.T.shape[0])

    @cached_property
    def _split(self) -> tuple[list[int], list[int]]:
        everything = range(self.genus)
        chosen = self.waves if self.waves is not None else cheapest_waves(self.T)
        return list(chosen), [i for i in everything if i not in chosen]

    @cached_property
    def _parts(self) -> tuple[Array, Array, Array, float]:
        """Return (S, C, T_GG⁻¹, det T_GG^{−1/2})."""
        F, G = self._split
        return _schur(self.T, F, G)

    @cached_property
    def _gaussian_lattice(self) -> Array:
        """Return the k that matter for some y_G in the unit cell around zero, shape (K, |G|)."""
        _, _, inverse, _ = self._parts
        corner = float(np.sqrt(largest_corner(inverse)))
        return lattice_points(inverse, np.sqrt(_EXPONENT / np.pi) + corner, np.zeros(inverse.shape[0]))

    @cached_property
    def size(self) -> int:
        """Return the number of lattice terms for characteristic zero."""
        return int(self._gaussian_lattice.shape[0] * self._wave_lattice((0,) * self.genus).shape[0])

    def _wave_lattice(self, epsilon: tuple[int, ...]) -> Array:
        """Return the x with a term above e^−39 of the largest: where T is large (a narrow cut) ε = ½ makes all of them small."""
        S = self._parts[0]
        shift = np.array([epsilon[i] / 2 for i in self._split[0]])
        return lattice_points(S, np.sqrt(_EXPONENT / np.pi + small_norm(S, shift)), shift)

    def values(self, z: Array, characteristics: Sequence[Characteristic]) -> Array:
        """Return θ[ε;δ](z) at points of shape (N, g) for each characteristic, shape (N, len(characteristics)).

        |error| ≤ about 1e-15 (1 + π/min T) Σ|terms|; for characteristic zero Σ|terms| = θ(z) up to the factor of _WAVE_FLOOR.
        """
        result = np.empty((z.shape[0], len(characteristics)))
        groups: dict[tuple[int, ...], list[int]] = defaultdict(list)
        _, G = self._split
        for index, characteristic in enumerate(characteristics):
            groups[tuple(characteristic.delta[i] for i in G)].append(index)
        block = max(1, _BLOCK // max(1, self._gaussian_lattice.shape[0]))
        for first in range(0, z.shape[0], block):
            rows = slice(first, first + block)
            for delta_G, members in groups.items():
                bells = self._bells(z[rows], np.array(delta_G) / 2)
                for index in members:
                    result[rows, index] = self._sum(z[rows], characteristics[index], *bells)
        return result

    def _bells(self, z: Array, delta_G: Array) -> tuple[Array, Array, Array]:
        """Return (e^{−π|k−r|²}, r, n) with y_G = n + r reduced to the unit cell around zero, k on the Gaussian lattice."""
        y = z[:, self._split[1]] + delta_G
        nearest = np.rint(y)
        r = y - nearest
        inverse, k = self._parts[2], self._gaussian_lattice
        if k.shape[1] == 0:
            return np.ones((z.shape[0], 1)), r, nearest
        projected = r @ inverse
        quadratic = np.sum((k @ inverse) * k, axis=1) - 2 * projected @ k.T + np.sum(projected * r, axis=1)[:, None]
        return np.exp(-np.pi * quadratic), r, nearest

    def _sum(self, z: Array, characteristic: Characteristic, bells: Array, r: Array, nearest: Array) -> Array:
        F, (_, C, _, factor) = self._split[0], self._parts
        if characteristic not in self._terms:
            self._terms[characteristic] = self._term(characteristic)
        epsilon_G, signs, x, weights, crossing = self._terms[characteristic]
        outer_sign = factor * (1 - 2 * np.mod(nearest @ epsilon_G, 2))
        if not F:
            return np.asarray(outer_sign * (bells @ signs))
        y_F = z[:, F] + np.array([characteristic.delta[i] / 2 for i in F])
        waves = np.exp(2j * np.pi * ((y_F - r @ C.T) @ x.T)) * weights
        return np.asarray(outer_sign * np.sum(waves * (bells @ crossing), axis=1).real)

    @cached_property
    def _terms(self) -> dict[Characteristic, tuple[Array, ...]]:
        return {}

    def _term(self, characteristic: Characteristic) -> tuple[Array, ...]:
        """Return what a sum takes at any z: ε_G, the signs of the bells, the x, their weights, and e^{2πi x·Ck}."""
        k, (S, C, _, _) = self._gaussian_lattice, self._parts
        epsilon_G = np.array([characteristic.epsilon[i] for i in self._split[1]], dtype=float)
        signs = 1 - 2 * np.mod(k @ epsilon_G, 2)
        x = self._wave_lattice(characteristic.epsilon)
        return (
            epsilon_G,
            signs,
            x,
            np.exp(-np.pi * np.sum((x @ S) * x, axis=1)),
            np.exp(2j * np.pi * (k @ C.T @ x.T)) * signs[:, None],
        )


def _schur(T: Array, F: list[int], G: list[int]) -> tuple[Array, Array, Array, float]:
    inverse = np.linalg.inv(T[np.ix_(G, G)]) if G else np.empty((0, 0))
    C = T[np.ix_(F, G)] @ inverse
    S = T[np.ix_(F, F)] - C @ T[np.ix_(G, F)]
    return (S + S.T) / 2, C, (inverse + inverse.T) / 2, float(np.sqrt(np.linalg.det(inverse))) if G else 1.0


def largest_corner(form: Array) -> float:
    """Return max rᵀ form r over the cell |r_i| ≤ ½, a convex function: the maximum over its corners."""
    size = form.shape[0]
    if size == 0:
        return 0.0
    corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * size, indexing="ij")).reshape(size, -1).T
    return float(np.max(np.sum((corners @ form) * corners, axis=1)))


def cheapest_waves(T: Array) -> tuple[int, ...]:
    """Return the set F with the fewest terms, by volume, among those whose S stays above the floor."""
    genus = T.shape[0]
    best: tuple[int, ...] = ()
    best_count = np.inf
    for size in range(genus + 1):
        for F in combinations(range(genus), size):
            G = [i for i in range(genus) if i not in F]
            S, _, inverse, _ = _schur(T, list(F), G)
            if F and np.linalg.eigvalsh(S)[0] < _WAVE_FLOOR:
                continue
            radius = np.sqrt(_EXPONENT / np.pi)
            spread = radius + np.sqrt(largest_corner(inverse))
            volume = np.sqrt((np.linalg.det(S) if F else 1.0) * (np.linalg.det(inverse) if G else 1.0))
            count = radius ** len(F) * spread ** len(G) / volume * (_WAVE_COST if F else 1.0)
            if count < best_count:
                best, best_count = F, count
    return best


def small_norm(form: Array, shift: Array) -> float:
    """Return xᵀ form x for a short x of Z^d + shift: rounding from the last coordinate on (Babai's nearest plane)."""
    upper = np.linalg.cholesky(form).T
    x, norm = np.zeros(shift.size), 0.0
    for i in range(shift.size - 1, -1, -1):
        centre = -(upper[i, i + 1 :] @ x[i + 1 :]) / upper[i, i]
        x[i] = np.rint(centre - shift[i]) + shift[i]
        norm += float(upper[i, i] * (x[i] - centre)) ** 2
    return norm


def lattice_points(form: Array, radius: float, shift: Array) -> Array:
    """Return the points x ∈ Z^d + shift with xᵀ form x ≤ radius², shape (K, d), by descent through the Cholesky factor."""
    dimension = form.shape[0]
    if dimension == 0:
        return np.zeros((1, 0))
    upper = np.linalg.cholesky(form).T
    points, left = np.zeros((1, 0)), np.array([radius * radius])
    for i in range(dimension - 1, -1, -1):
        centre = -(points @ upper[i, i + 1 :]) / upper[i, i]
        reach = np.sqrt(left) / upper[i, i]
        first = np.ceil(centre - reach - shift[i])
        counts = np.maximum(np.floor(centre + reach - shift[i]) - first + 1, 0).astype(np.int64)
        parent = np.repeat(np.arange(points.shape[0]), counts)
        offset = np.arange(parent.size) - np.repeat(np.cumsum(counts) - counts, counts)
        x = first[parent] + offset + shift[i]
        left = np.maximum(left[parent] - (upper[i, i] * (x - centre[parent])) ** 2, 0.0)
        points = np.column_stack([x, points[parent]])
    return points
