"""Theta functions in balls: the sums of analytic.theta.riemann_theta to any number of digits.

Every term is a constant times powers of a few numbers that depend on z, one for each coordinate.
Characteristics with the same
Gaussians and waves share one product of matrices: ε_G only gives signs to classes of k, δ_F only
quarter turns to the waves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.theta.characteristic import Characteristic
from veselova.analytic.theta.lattice import (
    Coordinates,
    Halves,
    Member,
    half_of,
    lattice_points,
    points_near_cell,
    small_norm,
)
from veselova.mechanics.core.errors import Unsolved

__all__ = ["ThetaInBalls"]

Array = NDArray[np.float64]

#: Derived: terms below e^(−nats−4) of the largest are left out: as many as there are near the edge
#: add less than the precision.
_BEYOND_PRECISION = 4.0

#: Budget: most terms of one sum: a second for each point.
_MOST_TERMS = 300_000


class ThetaInBalls:
    """The theta functions of T, shape (g, g), balls of ``arithmetic``. What is left out of the sums
    is estimated, not bounded.
    """

    def __init__(self, T: Values, arithmetic: Any) -> None:
        self._xp, self._coordinates = arithmetic, Coordinates.cheapest(_symmetric(T))[0]
        self._T = self._coordinates.form(T)
        self._F, self._G = list(self._coordinates.harmonics), self._coordinates.gaussians
        self._cross_terms: dict[tuple[int, ...], tuple[NDArray[np.int64], Values]] = {}
        if self.size > _MOST_TERMS:
            raise Unsolved(
                "narrow-gap",
                f"theta sums of {arithmetic.digits} digits would have {self.size} terms at "
                "this gap",
            )

    @property
    def genus(self) -> int:
        """Return g."""
        return len(self._T)

    @property
    def size(self) -> int:
        """Return the number of terms for characteristic zero."""
        return len(self._gaussian_lattice) * len(self._wave_lattice((0,) * len(self._F)))

    @cached_property
    def _parts(self) -> tuple[Values, Values, Values]:
        """Return (S, C, T_GG⁻¹)."""
        xp = self._xp
        F = self._F
        G = self._G
        inverse = xp.inverse(self._T[np.ix_(G, G)]) if G else np.empty((0, 0), dtype=object)
        C = self._T[np.ix_(F, G)] @ inverse if G and F else xp.array(np.zeros((len(F), len(G))))
        S = self._T[np.ix_(F, F)] - (C @ self._T[np.ix_(G, F)] if G and F else 0)
        return np.asarray(S), C, inverse

    @cached_property
    def _radius(self) -> float:
        return float(np.sqrt((self._xp.nats + _BEYOND_PRECISION) / np.pi))

    @cached_property
    def _gaussian_lattice(self) -> NDArray[np.int64]:
        """Return the k that matter for some y_G in the unit cell around zero, shape (K, |G|)."""
        return points_near_cell(_symmetric(self._parts[2]), self._radius).astype(np.int64)

    def _wave_lattice(self, epsilon_F: tuple[int, ...]) -> NDArray[np.int64]:
        """Return 2x for one of each pair ±x that matters, shape (X, |F|)."""
        S = _symmetric(self._parts[0])
        shift = np.array(epsilon_F) / 2
        x = np.rint(
            2 * lattice_points(S, float(np.sqrt(self._radius**2 + small_norm(S, shift))), shift)
        ).astype(np.int64)
        return np.asarray(half_of(x))

    def values(self, z: Values, characteristics: Sequence[Characteristic]) -> Values:
        """Return θ[ε;δ](z)·√det T_GG at points of shape (N, g) for each characteristic, shape (N,
        len(characteristics)).

        The first characteristic must be zero: what the sums leave out is measured against its
        values, which have no zeros.
        """
        result = np.empty((len(z), len(characteristics)), dtype=object)
        z = self._coordinates.points(z)
        for delta_G, families in self._coordinates.families(characteristics).items():
            self._fill(result, z, delta_G, families)
        return np.asarray(self._xp.add_error(result, np.abs(result[:, :1]) * self._xp.epsilon))

    def _fill(
        self,
        result: Values,
        z: Values,
        delta_G: Halves,
        families: Mapping[Halves, Sequence[Member]],
    ) -> None:
        """Write the values of the characteristics with one δ_G, which share their Gaussians, to
        their places.
        """
        xp = self._xp
        F = self._F
        G = self._G
        heights, common, r, nearest = self._gaussian_factors(z, delta_G)
        x, tables = (list(parts) for parts in zip(*map(self._crossing, families), strict=True))
        table = np.concatenate(tables, axis=1)
        # Classes of k; for each family the real parts of its x, then the imaginary ones; points.
        products = np.stack(
            [xp.product(heights[:, rows], table[rows]).T for _, rows in self._classes]
        )
        # 2x is whole for every characteristic, so turns of half of y_F have whole powers.
        y_F = z[:, F] - (r @ self._parts[1].T if F and G else 0)
        harmonics = xp.exponentials(np.concatenate(x), xp.turns(y_F / 2)) if F else None
        first = 0
        for orders, members in zip(x, families.values(), strict=True):
            rows = slice(first, first + len(orders))
            first = first + len(orders)
            real, imaginary = np.split(products[:, 2 * rows.start : 2 * rows.stop], 2, axis=1)
            sums = _Sums(
                orders, real, imaginary, harmonics and (harmonics[0][rows], harmonics[1][rows])
            )
            for place, characteristic, sign in members:
                epsilon = _at(characteristic.epsilon, G)
                delta = _at(characteristic.delta, F)
                values = common * sums.of(
                    [-1 if parity @ epsilon % 2 else 1 for parity, _ in self._classes], delta
                )
                flipped = (nearest @ epsilon % 2 == 1) ^ (sign < 0)
                values[flipped] = -values[flipped]
                result[:, place] = values

    @cached_property
    def _classes(self) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Return the parities of k that there are, (|G|,), each with its places on the Gaussian
        lattice.
        """
        parities, which = np.unique(self._gaussian_lattice % 2, axis=0, return_inverse=True)
        return [
            (parity, np.flatnonzero(which.ravel() == place))
            for place, parity in enumerate(parities)
        ]

    def _gaussian_factors(
        self, z: Values, delta: tuple[int, ...]
    ) -> tuple[Values, Values, Values, NDArray[np.float64]]:
        """Return (e^{2π kᵀT_GG⁻¹r}, k on the Gaussian lattice, e^{−π rᵀT_GG⁻¹r}, r, n) with y_G = n
        + r.
        """
        xp = self._xp
        if not self._G:
            return (
                xp.array(np.ones((len(z), 1))),
                xp.array(np.ones(len(z))),
                z[:, :0],
                np.zeros((len(z), 0)),
            )
        y = z[:, self._G] + xp.array([xp.number(d) / 2 for d in delta])
        nearest = xp.floor(y + xp.number(1) / 2)
        r = y - nearest
        projected = r @ self._parts[2]
        heights = xp.powers(self._gaussian_lattice, xp.exp(2 * xp.pi * projected)).T
        return heights, xp.exp(-xp.pi * np.sum(projected * r, axis=1)), r, nearest.astype(float)

    def _crossing(self, epsilon_F: tuple[int, ...]) -> tuple[NDArray[np.int64], Values]:
        """Return 2x of the waves, one of each pair ±x, and the real and imaginary parts of

        w_x e^{−πxᵀSx − πkᵀT_GG⁻¹k} e^{2πi x·Ck}, w = 1 at zero and 2 elsewhere, side by side, shape
        (K, 2X).
        """
        if epsilon_F not in self._cross_terms:
            xp, (S, C, inverse) = self._xp, self._parts
            k = self._gaussian_lattice
            x = self._wave_lattice(epsilon_F)
            gaussian_factors = (
                xp.exp(-xp.pi * np.sum((k @ inverse) * k, axis=1))[:, None]
                if self._G
                else xp.array([[1]])
            )
            weights = gaussian_factors * (
                xp.exp(-xp.pi * np.sum((x @ S) * x, axis=1) / 4) if self._F else 1
            )
            weights = weights * np.where(np.any(x != 0, axis=1), 2, 1)
            cosines = weights
            sines = 0 * weights
            if self._F and self._G:
                cosines, sines = (
                    weights * wave.T for wave in xp.exponentials(x, xp.turns((k @ C.T) / 2))
                )
            self._cross_terms[epsilon_F] = x, np.concatenate([cosines, sines], axis=1)
        return self._cross_terms[epsilon_F]


class _Sums:
    """The sums of a family over its waves x: Σ_x Re i^{2x·2δ_F} (R_x + iI_x) e^{2πix·y_F}, class of
    k by class, at N points.

    - orders: (X, |F|): 2x
    - real, imaginary: (classes, X, N) R and I
    - waves: cos and sin 2πx·y_F, (X, N) each, None without F
    """

    def __init__(
        self,
        orders: NDArray[np.int64],
        real: Values,
        imaginary: Values,
        harmonics: tuple[Values, Values] | None,
    ) -> None:
        self._real = real
        self._imaginary = imaginary
        self._harmonics = harmonics
        quarters, which = np.unique(orders % 4, axis=0, return_inverse=True)
        self._quarters, self._rows = (
            quarters,
            [np.flatnonzero(which.ravel() == place) for place in range(len(quarters))],
        )
        self._parts: dict[bool, list[list[Values]]] = {}

    def of(self, signs: list[int], delta: NDArray[np.int64]) -> Values:
        """Return the sums over all classes of k, with signs, and over x, with 2δ_F; shape (N,)."""
        turns = self._quarters @ delta % 4
        # 2x is odd or even as ε_F is, so all turns are
        parts = self._characteristic_sums(bool(turns[0] % 2))
        total: Any = 0
        for sign, of_class in zip(signs, parts, strict=True):
            for turn, part in zip(turns, of_class, strict=True):
                # i^2 and i^3 are −1 and −i.
                total = total - part if (sign < 0) != (turn > 1) else total + part
        return np.asarray(total)

    def _characteristic_sums(self, odd: bool) -> list[list[Values]]:
        """Return the sums over the x alike modulo two, of each class of k; of i times the terms
        where ``odd``.
        """
        if odd not in self._parts:
            terms = self._real
            if self._harmonics is not None:
                cosines, sines = self._harmonics
                real = self._real
                imaginary = self._imaginary
                terms = (
                    -(sines * real + cosines * imaginary)
                    if odd
                    else cosines * real - sines * imaginary
                )
            self._parts[odd] = [
                [np.sum(of_class[rows], axis=0) for rows in self._rows] for of_class in terms
            ]
        return self._parts[odd]


def _at(entries: Halves, places: list[int]) -> NDArray[np.int64]:
    return np.array([entries[i] for i in places], dtype=np.int64)


def _symmetric(form: Values) -> Array:
    coarse = form.astype(float)
    return np.asarray((coarse + coarse.T) / 2)
