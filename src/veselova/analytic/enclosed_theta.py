"""Theta functions in balls: the sums of analytic.theta to any number of digits.

Every term is a constant times powers of a few numbers that depend on z, one for each coordinate, so a block of points costs a
table of powers and one product of matrices for each characteristic.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.characteristic import Characteristic
from veselova.analytic.lattice import Coordinates, centred_points, lattice_points, small_norm
from veselova.analytic.precision import Values
from veselova.mechanics.errors import Unsolved

__all__ = ["EnclosedTheta"]

Array = NDArray[np.float64]

#: Terms below e^(−nats−4) of the largest are left out: as many as there are near the edge add less than the precision.
_BEYOND_PRECISION = 4.0

#: Most terms of one sum: a second for each point.
_MOST_TERMS = 300_000


class EnclosedTheta:
    """The theta functions of T, shape (g, g), balls of ``arithmetic``. What is left out of the sums is estimated, not bounded."""

    def __init__(self, T: Values, arithmetic: Any) -> None:
        self._xp, self._coordinates = arithmetic, Coordinates.cheapest(_symmetric(T))
        self._T = self._coordinates.form(T)
        self._F, self._G = list(self._coordinates.waves), self._coordinates.gaussians
        self._constants: dict[Characteristic, tuple[Values, Values]] = {}
        if self.size > _MOST_TERMS:
            raise Unsolved("narrow-gap", f"theta sums of {arithmetic.digits} digits would have {self.size} terms at this gap")

    @property
    def genus(self) -> int:
        """Return g."""
        return len(self._T)

    @property
    def size(self) -> int:
        """Return the number of terms for characteristic zero."""
        return len(self._gaussian_lattice) * len(self._wave_lattice((0,) * self.genus))

    @cached_property
    def _parts(self) -> tuple[Values, Values, Values]:
        """Return (S, C, T_GG⁻¹)."""
        xp, F, G = self._xp, self._F, self._G
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
        return centred_points(_symmetric(self._parts[2]), self._radius).astype(np.int64)

    def _wave_lattice(self, epsilon: tuple[int, ...]) -> NDArray[np.int64]:
        """Return 2x for the x that matter, shape (X, |F|)."""
        S, shift = _symmetric(self._parts[0]), np.array([epsilon[i] / 2 for i in self._F])
        x = lattice_points(S, float(np.sqrt(self._radius**2 + small_norm(S, shift))), shift)
        return np.rint(2 * x).astype(np.int64)

    def values(self, z: Values, characteristics: Sequence[Characteristic]) -> Values:
        """Return θ[ε;δ](z)·√det T_GG at points of shape (N, g) for each characteristic, shape (N, len(characteristics)).

        The first characteristic must be zero: what the sums leave out is measured against its values, which have no zeros.
        """
        xp, result = self._xp, np.empty((len(z), len(characteristics)), dtype=object)
        bells: dict[tuple[int, ...], tuple[Values, Values, Values]] = {}
        turns: dict[tuple[Any, ...], tuple[Values, Values]] = {}
        z = self._coordinates.points(z)
        for index, given in enumerate(characteristics):
            characteristic, sign = self._coordinates.characteristic(given)
            delta = tuple(characteristic.delta[i] for i in self._G)
            if delta not in bells:
                bells[delta] = self._bells(z, delta)
            bell, r, nearest = bells[delta]
            epsilon = tuple(characteristic.epsilon[i] for i in self._F)
            if (delta, epsilon) not in turns:
                # 2x is whole for every characteristic, so turns of half of y_F have whole powers.
                phases = z[:, self._F] - (r @ self._parts[1].T if self._G and self._F else 0)
                turns[delta, epsilon] = xp.waves(self._wave_lattice(characteristic.epsilon), xp.turns(phases / 2))
            cosines, sines = turns[delta, epsilon]
            real, imaginary = self._table(characteristic)
            sums = np.sum(cosines.T * xp.product(bell, real) - sines.T * xp.product(bell, imaginary), axis=1)
            odd = np.array(nearest @ np.array([characteristic.epsilon[i] for i in self._G], dtype=int), dtype=float) % 2
            result[:, index] = sign * (np.where(odd == 1, -sums, sums) if self._G else sums)
        return np.asarray(xp.widened(result, np.abs(result[:, :1]) * xp.epsilon))

    def _bells(self, z: Values, delta: tuple[int, ...]) -> tuple[Values, Values, Values]:
        """Return (e^{−π rᵀT_GG⁻¹r + 2π kᵀT_GG⁻¹r}, r, n) with y_G = n + r, k on the Gaussian lattice."""
        xp = self._xp
        if not self._G:
            return xp.array(np.ones((len(z), 1))), z[:, :0], z[:, :0]
        y = z[:, self._G] + xp.array([xp.number(d) / 2 for d in delta])
        nearest = xp.floor(y + xp.number(1) / 2)
        r = y - nearest
        projected = r @ self._parts[2]
        heights = xp.powers(self._gaussian_lattice, xp.exp(2 * xp.pi * projected))
        return (heights * xp.exp(-xp.pi * np.sum(projected * r, axis=1))).T, r, nearest

    def _table(self, characteristic: Characteristic) -> tuple[Values, Values]:
        """Return e^{−πxᵀSx − πkᵀT_GG⁻¹k} (−1)^{2k·ε_G} e^{2πi x·(Ck + δ_F)}, real and imaginary parts, shape (K, X)."""
        if characteristic in self._constants:
            return self._constants[characteristic]
        xp, (S, C, inverse) = self._xp, self._parts
        k, x = self._gaussian_lattice, self._wave_lattice(characteristic.epsilon)
        weights = np.ones((len(k), len(x)), dtype=object)
        if self._G:
            signs = 1 - 2 * ((k @ np.array([characteristic.epsilon[i] for i in self._G], dtype=np.int64)) % 2)
            weights = weights * (signs * xp.exp(-xp.pi * np.sum((k @ inverse) * k, axis=1)))[:, None]
        if self._F:
            weights = weights * xp.exp(-xp.pi * np.sum((x @ S) * x, axis=1) / 4)
            delta = xp.array([xp.number(characteristic.delta[i]) / 2 for i in self._F])
            phases = (k @ C.T if self._G else xp.array(np.zeros((1, len(self._F))))) + delta
            cosines, sines = xp.waves(x, xp.turns(phases / 2))
            table = weights * cosines.T, weights * sines.T
        else:
            table = xp.array(weights), xp.array(np.zeros(weights.shape))
        self._constants[characteristic] = table
        return table


def _symmetric(form: Values) -> Array:
    coarse = form.astype(float)
    return np.asarray((coarse + coarse.T) / 2)
