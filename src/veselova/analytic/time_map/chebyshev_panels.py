"""Integrals along an orbit, as Chebyshev series on adjoining panels of Neumann time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.numerics.monotone_root import Rows, increasing_root

__all__ = ["CONVERGED", "STALLED", "TAIL", "Panels", "are_settled"]

Array = NDArray[np.float64]

#: Calibrated: a series whose last coefficients fall below this part of its size is resolved; what
#: it leaves out counts as no less.
TAIL = 4e-15

#: Calibrated: last coefficients that have not fallen to this part of what they were on a longer
#: panel are rounding, if they are small.
STALLED = 0.25

#: Derived: a Newton step of this size, in half panels, leaves an error of its square.
CONVERGED = 1e-9


def are_settled(tails: Array, before: Array | float, noise: float) -> NDArray[np.bool_]:
    """Return which series are resolved, or fall no more: by their tails, those on longer panels,
    and what may be rounding.
    """
    return (tails <= TAIL) | ((tails <= noise) & (tails > STALLED * before))


@dataclass(frozen=True)
class Panels:
    """τ₁ ↦ ∫_0^{τ₁} f(z) along an orbit, on P panels.

    - borders: (P+1,) in τ₁, zero among them
    - lengths: (P,)
    - integrals: (P, 2, N+1) coefficients of the integral from the left border, and of its
      derivative in x, −1 … 1 on a panel
    - values: (P+1,) of the integral at the borders
    - tails: (P+1,) what series and rounding leave out of them
    - mean_size: of f over τ₁
    """

    borders: Array
    lengths: Array
    integrals: Array
    values: Array
    tails: Array
    mean_size: float

    @classmethod
    def of(
        cls, lefts: Array, lengths: Array, coefficients: Array, tails: Array, sizes: Array
    ) -> Panels:
        """Return the integral from the coefficients (P, N) of f on panels in any order; tails (P,)
        are relative to sizes (P,).
        """
        order = np.argsort(lefts)
        left = lefts[order]
        lengths = lengths[order]
        sizes = sizes[order]
        borders = np.append(left, left[-1] + lengths[-1])
        zero = int(np.searchsorted(borders, 0.0))
        slopes = coefficients[order] * (lengths / 2)[:, None]
        integrals = np.zeros((len(slopes), 2, slopes.shape[1] + 1))
        integrals[:, 0], integrals[:, 1, :-1] = _integrate_series(slopes), slopes
        over_panels = np.sum(integrals[:, 0], axis=1)  # at x = 1 every Chebyshev polynomial is one
        # Over a panel T_k has an integral below 1/k; to what is left out comes the rounding of the
        # mean.
        count = slopes.shape[1]
        left_out = (
            (np.maximum(tails[order], TAIL) / count + np.finfo(float).eps / 2) * sizes * lengths
        )
        values, tails_from_zero = (
            _sum_panels(summands, zero) for summands in (over_panels, left_out)
        )
        return cls(
            borders,
            lengths,
            integrals,
            values,
            tails_from_zero,
            float(sizes @ lengths / np.sum(lengths)),
        )

    @property
    def size(self) -> int:
        """Return the number of nodes."""
        return int(self.integrals.shape[0] * (self.integrals.shape[2] - 1))

    def at(self, tau1: Array) -> Array:
        """Return the integrals from zero to Neumann times within the panels."""
        panel, x = self._places(tau1)
        return np.asarray(self.values[panel] + self.within(panel, x)[0])

    def integrand(self, tau1: Array) -> Array:
        """Return f at Neumann times within the panels."""
        panel, x = self._places(tau1)
        return np.asarray(2 / self.lengths[panel] * self.within(panel, x)[1])

    def _places(self, tau1: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the panels of Neumann times and where these lie in them, −1 … 1."""
        panel = self.panel_of(self.borders, tau1)
        return panel, 2 * (tau1 - self.borders[panel]) / self.lengths[panel] - 1

    def error(self, tau1: Array) -> Array:
        """Return the tails of the panels between zero and increasing Neumann times, twice."""
        if tau1.size < self.lengths.size:
            return 2 * np.abs(np.interp(tau1, self.borders, self.tails))
        # Of whole panels, which is faster, but next to zero.
        ends = np.searchsorted(tau1, self.borders)
        zero = int(np.searchsorted(self.borders, 0.0))
        ends[0], ends[-1] = 0, tau1.size  # whatever the first and the last time are rounded to
        tails = 2 * np.maximum(np.abs(self.tails[1:]), np.abs(self.tails[:-1]))
        result = np.repeat(tails, np.diff(ends[1:-1], prepend=0, append=tau1.size))
        near = slice(ends[max(0, zero - 1)], ends[min(zero + 1, tails.size)])
        result[near] = 2 * np.abs(np.interp(tau1[near], self.borders, self.tails))
        return result

    def panel_of(self, borders: Array, values: Array) -> NDArray[np.intp]:
        """Return the panels in which values lie, borders being those of τ₁ or of the integral."""
        return np.clip(
            np.searchsorted(borders, values, side="right") - 1, 0, self.integrals.shape[0] - 1
        )

    def find_arguments(self, values: Array) -> tuple[NDArray[np.intp], Array]:
        """Return where an increasing integral has values (N,): the panels, and the distances from
        their left borders. By Newton's method on the polynomials.
        """
        panel = self.panel_of(self.values, values)
        target = values - self.values[panel]
        x = 2 * target / (self.values[panel + 1] - self.values[panel]) - 1

        def excess(x: Array, rows: Rows) -> tuple[Array, Array]:
            value, slope = self.within(panel[rows], x)
            return value - target[rows], slope

        x = increasing_root(excess, x, np.full_like(x, -1.0), np.full_like(x, 1.0), CONVERGED)
        return panel, (x + 1) * (self.lengths[panel] / 2)

    def within(self, panel: NDArray[np.intp], x: Array) -> tuple[Array, Array]:
        """Return the integral from the panel's left border to x, and its derivative in x."""
        angle = np.arccos(np.minimum(np.maximum(x, -1.0), 1.0))
        exponentials = np.cos(np.arange(self.integrals.shape[2]) * angle[:, None])
        value, slope = (self.integrals[panel] @ exponentials[:, :, None])[:, :, 0].T
        return value, slope


def _sum_panels(over_panels: Array, zero: int) -> Array:
    """Return the sums at the borders, 0 at number ``zero``: outwards from it, so that far ones do
    not round near ones.
    """
    return np.concatenate(
        [-np.cumsum(over_panels[:zero][::-1])[::-1], [0.0], np.cumsum(over_panels[zero:])]
    )


def _integrate_series(coefficients: Array) -> Array:
    """Return the Chebyshev coefficients of the integrals from −1, shape (P, N+1): b_k = (c_{k−1} −
    c_{k+1})/2k, c_0 doubled.
    """
    count = coefficients.shape[1]
    padded = np.concatenate([coefficients, np.zeros((len(coefficients), 2))], axis=1)
    padded[:, 0] *= 2
    orders = np.arange(1, count + 1)
    result = np.empty((len(coefficients), count + 1))
    result[:, 1:] = (padded[:, :-2] - padded[:, 2:]) / (2 * orders)
    result[:, 0] = result[:, 1:] @ (2.0 * (orders % 2) - 1)  # zero at −1, where T_k is (−1)^k
    return result
