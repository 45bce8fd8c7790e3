"""Fourier series on the torus of functions of period 2 in the phases, and their integrals along an
orbit.

The measure of the torus is a determinant of one-variable forms. So every coefficient of a product
Π_s φ_s(λ_s) is a determinant of one-variable integrals, as in ``fourier``. A factor that is the
signed root of λ_s minus an end of its own cut changes sign with ψ_s → ψ_s + 2π: the modes m are
then half-integers in z_s, and no mode is zero. Modes are kept doubled, M = 2m, and belong to the
halved phases z/2.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.frame import Frame
from veselova.analytic.curve.periods import Periods
from veselova.analytic.time_map.rate import TorusFunction

__all__ = ["NormalComponent", "SeriesComponent"]


@dataclass(frozen=True)
class SeriesComponent(TorusFunction[Periods]):
    """A function on the torus whose Fourier coefficients are determinants, of period 2 in the phase
    of one cut and without mean.

    place  the number of the branch point, at least 1, that ends this cut
    """

    frame: Frame
    place: int

    @property
    def cut(self) -> int:
        """Return the cut s = 0 … g−1 that the branch point ends."""
        return int(self.frame.periods.curve.cut_of(self.place)) - 1

    @property
    def is_lower(self) -> bool:
        """Return whether it is the lower end, where the signed root is odd in ψ_s."""
        return self.place % 2 == 1

    @property
    @abstractmethod
    def odd(self) -> NDArray[np.bool_]:
        """Return which rows of which columns of the determinants are odd in ψ, (g, g)."""

    @property
    @abstractmethod
    def turn(self) -> float:
        """Return the phase of the series, in cycles."""

    def _roots_of_all_cuts(self, psi: Values) -> tuple[Values, Values]:
        """Return ``Frame.roots`` where every cut has the angles (N,): the same for all columns."""
        known = self._known_roots.get(psi.size)
        if known is None or not np.array_equal(known[0], psi):
            angles = np.repeat(psi[:, None], self.inversion.periods.genus, axis=1)
            known = (psi, *self.frame.roots(angles))
            self._known_roots[psi.size] = known
        return known[1:]

    @cached_property
    def _known_roots(self) -> dict[int, tuple[Values, Values, Values]]:
        return {}

    @property
    def needed_nodes(self) -> tuple[int, ...]:
        """Return those of the forms' own series: the factors are analytic in their strips."""
        return tuple(int(series.shape[-1]) for series in self.inversion.periods.cut_series)


@dataclass(frozen=True)
class NormalComponent(SeriesComponent):
    """(q',n_k) = scale · Π_s φ_s(λ_s), φ_s = √|c_k−λ_s|, signed on the cut that c_k ends.

    place  the number of the branch point c_k
    """

    @property
    def odd(self) -> NDArray[np.bool_]:
        """Return all rows of the cut that c_k ends, where that is its lower end."""
        genus = self.inversion.periods.genus
        return np.tile(self.is_lower & (np.arange(genus) == self.cut), (genus, 1))

    @property
    def turn(self) -> float:
        """Return −¼ for an odd column, of −i sin: −i e^{ix} + c.c. is 2 cos(x − π/2)."""
        return -0.25 if self.is_lower else 0.0

    def factors_at(self, psi: Values) -> Values:
        """Return φ_s at angles (N, g), shape (g, N)."""
        return self._factors(*self.frame.roots(psi))

    def _factors(self, roots: Values, own: Values) -> Values:
        """Return φ_s from the roots at angles (N, g), shape (g, N)."""
        factors = roots[:, self.place].copy()
        factors[self.cut] = own[self.place]
        return np.asarray(factors)

    def _weight_forms(self, s: int, psi: Values) -> Values:
        cut = self.inversion.periods.cuts[s]
        below, above = cut.distances(psi)
        sign = (-1) ** (self.inversion.periods.genus - s - 1)
        factors = self._factors(*self._roots_of_all_cuts(psi))
        return np.asarray(sign * cut.forms(below, above) * factors[s])
