"""Real theta functions with half-integer characteristics,

    θ[ε;δ](z) = Σ_{m∈Z^g} exp(−π(m+ε)ᵀT(m+ε)) cos 2π(m+ε)·(z+δ),   T symmetric, positive definite.

Where T is small this sum cancels: θ(z) falls to e^(−π/4T) of θ(0). Poisson summation over some of
the variables (set G, the rest being F) turns their waves into Gaussians. With y = z+δ, C = T_FG
T_GG⁻¹ and S = T_FF − C T_GF,

    θ[ε;δ](z) = det T_GG^{−1/2} Σ_{x∈Z^F+ε_F} Σ_{k∈Z^G} e^{−π xᵀSx − π dᵀT_GG⁻¹d} cos 2π[x·(y_F +
    Cd) + k·ε_G],   d = k−y_G.

F is kept to directions where S is not small, so θ(z) = θ[0;0](z) is a sum without cancellation, and
its values are accurate relative to themselves. F = everything is the defining series, G =
everything a lattice sum of Gaussians. Coordinates are those in which the sum is short
(analytic.theta.lattice).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.theta.characteristic import Characteristic
from veselova.analytic.theta.lattice import (
    RADIUS,
    Coordinates,
    Member,
    half_of,
    largest_corner,
    lattice_points,
    points_near_cell,
    schur,
)
from veselova.analytic.theta.theta_tables import SIGNS, Family, Group
from veselova.mechanics.core.budget import checkpoint

__all__ = ["Theta"]

Array = NDArray[np.float64]

#: Derived: e^−630 = 1e-274: smaller Gaussians are zero, since products with subnormal numbers are a
#: hundred times slower.
_VANISHING = -630.0

#: i^m.
_QUARTER_TURNS = np.array([1, 1j, -1, -1j])

#: Budget: entries of one block of (points × lattice): temporaries that stay in the cache.
_BLOCK = 100_000


@dataclass(frozen=True)
class Theta:
    """The theta functions of T, shape (g, g); ``waves`` is the set F of the sum over Z^g, None for
    the cheapest accurate one.
    """

    T: Array
    harmonics: tuple[int, ...] | None = None

    @property
    def genus(self) -> int:
        """Return g."""
        return int(self.T.shape[0])

    @cached_property
    def _chosen(self) -> tuple[Coordinates, float]:
        return (
            Coordinates.cheapest(self.T)
            if self.harmonics is None
            else Coordinates.unreduced(self.T, self.harmonics)
        )

    @property
    def coordinates(self) -> Coordinates:
        """Return the basis and the set F in which the sums are formed."""
        return self._chosen[0]

    @cached_property
    def _split(self) -> tuple[list[int], list[int]]:
        return list(self.coordinates.harmonics), self.coordinates.gaussians

    @cached_property
    def _to_coordinates(self) -> Array:
        """Return the matrix from z to y, (g, g): first the coordinates with Gaussians, then those
        of the waves.
        """
        F, G = self._split
        return np.asarray(self.coordinates.U[[*G, *F]].T, dtype=np.float64)

    @cached_property
    def _parts(self) -> tuple[Array, Array, Array, float]:
        """Return (S, C, T_GG⁻¹, det T_GG^{−1/2})."""
        S, C, inverse = schur(self.coordinates.form(self.T), *self._split)
        return S, C, inverse, float(np.sqrt(np.linalg.det(inverse))) if len(inverse) else 1.0

    @cached_property
    def _gaussian_lattice(self) -> Array:
        """Return the k that matter for some y_G in the unit cell around zero, shape (K, |G|)."""
        return points_near_cell(self._parts[2], RADIUS)

    @cached_property
    def _of_cell(self) -> tuple[Array, Array]:
        """Return −πkᵀT_GG⁻¹k, (K,), all k at once, and what a point r of the cell is multiplied
        with, (|G|, K + |G| + |F|).

        These are 2πT_GG⁻¹k and −πT_GG⁻¹, of which the exponents −π(k−r)ᵀT_GG⁻¹(k−r) are made, and
        −πC, which turns the waves.
        """
        k = self._gaussian_lattice
        inverse = -np.pi * self._parts[2]
        return np.sum((k @ inverse) * k, axis=1), np.hstack(
            [-2 * inverse @ k.T, inverse, -np.pi * self._parts[1].T]
        )

    @property
    def cost(self) -> float:
        """Return about the number of lattice terms, without forming them, and what their Gaussians
        and waves take.
        """
        return self._chosen[1]

    @cached_property
    def size(self) -> int:
        """Return the number of lattice terms for characteristic zero."""
        of_zero = self._cross_terms(frozenset({0}))[1][0]
        return len(self._gaussian_lattice) * (of_zero.stop - of_zero.start)

    def values(self, z: Array, characteristics: Sequence[Characteristic]) -> Array:
        """Return θ[ε;δ](z) at points of shape (N, g) for each characteristic, shape (N,
        len(characteristics)).

        |error| ≤ about 1e-15 (1 + π/min T) Σ|terms|; for characteristic zero Σ|terms| = θ(z) up to
        the waves' floor.
        """
        wanted = tuple(characteristics)
        y = (z - 2 * np.rint(z / 2)) @ self._to_coordinates
        result = np.empty((len(characteristics), z.shape[0]))
        groups = self._groups(wanted)
        block = max(
            1,
            _BLOCK
            // (
                len(self._gaussian_lattice)
                + max(len(f.tables) for group in groups for f in group.families)
            ),
        )
        at_once = max(1, block // max(len(z), 1))  # groups, of few points
        for first in range(0, z.shape[0], block):
            rows = slice(first, first + block)
            for k in range(0, len(groups), at_once):
                checkpoint()
                self._fill(groups[k : k + at_once], y[rows], result[:, rows])
        return result.T

    def _fill(self, groups: list[Group], y: Array, result: Array) -> None:
        """Write the values of some groups at points y (N, g) to their places, the rows of the
        result.
        """
        gaussian_factors, angles, nearest = self._gaussian_factors(
            y, np.array([group.delta_G for group in groups])
        )
        for k, group in enumerate(groups):
            half_turns = (group.parities.T @ nearest[k].T).astype(np.int64)
            signs = group.signs[:, None] * SIGNS[half_turns & 1]
            result[group.places] = group.sums(gaussian_factors[k], angles[k]) * signs

    def _gaussian_factors(self, y: Array, shifts: Array) -> tuple[Array, Array, Array]:
        """Return (e^{−π|k−r|²}, π(y_F − Cr), n), k on the Gaussian lattice, with y_G + δ_G = n + r,
        r in the cell around zero.

        ``shifts`` (P, |G|) are the δ_G; shapes (P, N, K), (P, N, |F|) and (P, N, |G|).
        """
        gaussians = shifts.shape[1]
        y_G = y[:, :gaussians] + shifts[:, None, :]
        nearest = np.rint(y_G)
        if not gaussians:
            return np.ones((*y_G.shape[:2], 1)), np.pi * y[None], nearest
        constant, of_cell = self._of_cell
        r = y_G - nearest
        ends = (constant.size, constant.size + gaussians)
        made = r @ of_cell
        angles = np.pi * y[:, gaussians:] + made[:, :, ends[1] :]
        exponents = constant + made[:, :, : ends[0]]
        exponents += (made[:, :, ends[0] : ends[1]] * r).sum(axis=2, keepdims=True)
        exponents[exponents <= _VANISHING] = -np.inf
        return np.exp(exponents, out=exponents), angles, nearest

    def _groups(self, characteristics: tuple[Characteristic, ...]) -> list[Group]:
        """Return the families by δ_G."""
        if (found := self._grouped.get(characteristics)) is None:
            found = self._grouped[characteristics] = self._by_shift(characteristics)
        return found

    @cached_property
    def _grouped(self) -> dict[tuple[Characteristic, ...], list[Group]]:
        return {}

    def _by_shift(self, characteristics: tuple[Characteristic, ...]) -> list[Group]:
        families = self.coordinates.families(characteristics).items()
        members = [c for _, of in families for given in of.values() for _, c, _ in given]
        self._cross_terms(frozenset(self._codes(members)))  # at once
        return [self._group(delta_G, list(of.values())) for delta_G, of in families]

    def _group(self, delta_G: tuple[int, ...], members: list[list[Member]]) -> Group:
        places, characteristics, signs = zip(
            *(given for of in members for given in of), strict=True
        )
        families = [self._family([c for _, c, _ in of]) for of in members]
        parities = self._parities(characteristics)
        return Group(
            np.array(delta_G) / 2,
            families,
            list(places),
            parities,
            self._parts[3] * np.array(signs),
        )

    def _parities(self, members: Sequence[Characteristic]) -> Array:
        G = self._split[1]
        return (
            np.array([[c.epsilon[i] for i in G] for c in members], dtype=float)
            .reshape(len(members), len(G))
            .T
        )

    def _family(self, members: list[Characteristic]) -> Family:
        of, doubled, rotated = self._characteristic_phases(members)
        each = rotated.reshape(len(rotated), len(members), -1)
        parts = [each.real, -each.imag] if self._split[0] else [each.real]
        tables = np.stack(parts, axis=2).reshape(len(rotated), -1)
        return Family(doubled[of == 0], np.ascontiguousarray(tables.T))

    def _characteristic_phases(
        self, members: Sequence[Characteristic]
    ) -> tuple[NDArray[np.intp], NDArray[np.int64], NDArray[np.complex128]]:
        """Return what is summed, characteristic after characteristic: which it is, (X,), 2x of its
        waves, (X, |F|), and (−1)^{2k·ε_G} w_x e^{2πi x·(Ck + δ_F)}, (K, X).
        """
        F = self._split[0]
        codes = self._codes(members)
        doubled, places, cross_terms = self._cross_terms(frozenset(codes))
        ranges = [places[code] for code in codes]
        of = np.repeat(np.arange(len(members)), [len(each) for each in ranges])
        harmonics = np.concatenate(ranges)
        delta = np.array([[c.delta[i] for i in F] for c in members], dtype=np.int64)
        signs = 1 - 2 * np.mod(self._gaussian_lattice @ self._parities(members), 2)
        doubled = doubled[harmonics]
        rotated = cross_terms[:, harmonics]
        rotated *= signs[:, of]
        rotated *= _QUARTER_TURNS[(doubled * delta[of]).sum(axis=1) % 4]
        return of, doubled, rotated

    def _codes(self, members: Sequence[Characteristic]) -> list[int]:
        """Return the bits of 2ε_F of each."""
        return [
            sum(c.epsilon[i] << place for place, i in enumerate(self._split[0])) for c in members
        ]

    def _cross_terms(
        self, wanted: frozenset[int]
    ) -> tuple[NDArray[np.int64], dict[int, range], NDArray[np.complex128]]:
        """Return 2x of the waves of some ε_F, (X, |F|), the rows of each, and w_x e^{2πi x·Ck}, (K,
        X); w_x counts x and −x.

        ``wanted``: the ``_codes`` of these ε_F; there may be others beside them. Of ε_F these are
        one of each pair ±x with a term above e^−39 of the largest: where T is large ε = ½ makes all
        small.
        """
        known = list(self._crossed)  # a copy: another thread may add to them
        if (
            found := next((selected for selected in known if wanted <= selected), None)
        ) is not None:
            return self._crossed[found]
        self._crossed[wanted] = self._form_cross_terms(sorted(wanted))
        return self._crossed[wanted]

    def _form_cross_terms(
        self, codes: list[int]
    ) -> tuple[NDArray[np.int64], dict[int, range], NDArray[np.complex128]]:
        """Return the ``_crossings`` of these codes and no others."""
        S, C, _, _ = self._parts
        doubled = half_of(self._double_points(codes))
        of = (doubled & 1) @ (1 << np.arange(len(S)))
        x = doubled / 2
        norms = ((x @ S) * x).sum(axis=1)
        least = np.full(2 ** len(S), -np.inf)
        least[codes] = np.inf
        np.minimum.at(least, of, norms)
        selected = norms <= RADIUS**2 + least[of]
        order = np.flatnonzero(selected)[np.argsort(of[selected], kind="stable")]
        doubled = doubled[order]
        x = x[order]
        weights = np.where(doubled.any(axis=1), 2.0, 1.0) * np.exp(-np.pi * norms[order])
        firsts, ends = (
            np.searchsorted(of[order], codes, side=side).tolist() for side in ("left", "right")
        )
        places = {code: range(*pair) for code, *pair in zip(codes, firsts, ends, strict=True)}
        return doubled, places, weights * np.exp(2j * np.pi * (self._gaussian_lattice @ C.T @ x.T))

    def _double_points(self, codes: list[int]) -> NDArray[np.int64]:
        """Return 2x for the x of these ε_F, and maybe others, whose terms may count; one descent
        finds all of them at once.
        """
        S = self._parts[0]
        bits = np.arange(len(self._parts[0]))
        # No point of space is farther from a lattice than a corner of its cell is from the middle.
        reach = float(np.sqrt(RADIUS**2 + largest_corner(S)))
        if 2 ** len(S) <= 2 * len(codes):
            return lattice_points(S / 4, reach, np.zeros(len(S))).astype(np.int64)
        return np.concatenate(
            [2 * lattice_points(S, reach, (code >> bits & 1) / 2) for code in codes]
        ).astype(np.int64)

    @cached_property
    def _crossed(
        self,
    ) -> dict[frozenset[int], tuple[NDArray[np.int64], dict[int, range], NDArray[np.complex128]]]:
        return {}
