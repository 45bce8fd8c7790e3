"""Integrals along an orbit by Chebyshev panels. Cost grows with the length, hardly with the genus."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.orbit import LinearFlow
from veselova.analytic.precision import DOUBLE
from veselova.mechanics.errors import InternalContradiction

__all__ = ["PanelIntegral"]

Array = NDArray[np.float64]

#: Points per panel: the Chebyshev points of [−1, 1], from 1 downwards, and the matrix from values there to coefficients.
_PANEL_NODES = 24
_POINTS, _TO_COEFFICIENTS = np.cos(DOUBLE.nodes(_PANEL_NODES)), DOUBLE.cosine_series(np.eye(_PANEL_NODES))

#: Panels beyond an end, each of at most half a cycle of the fastest phase: ends come from means.
_MARGIN = 2

#: A panel is resolved when its last coefficients fall below this fraction of the first …
_PANEL_TAIL = 4e-15

#: … or below this one without having fallen to a quarter in the last halving: then they are rounding of the phases.
_NOISE_TAIL = 1e-11
_STALLED = 0.25

#: Halvings of a panel before giving up; near a separatrix integrands vary over a few hundredths of a cycle.
_MOST_HALVINGS = 30

#: Nodes evaluated at once.
_BLOCK = 4096


class PanelIntegral:
    """τ₁ ↦ ∫_0^{τ₁} f(z) along z = z⁰ + fτ₁, over a stretch of the orbit that starts as [low, high] and can be extended.

    low ≤ 0 ≤ high; ends other than zero, where the integral is known, get a margin. ``integrand`` gives f at phases z of shape
    (N, g); a panel is resolved to rounding of its mean, or of ``floor`` where that is larger: an integrand that changes sign has
    means near zero.
    """

    def __init__(
        self, integrand: Callable[[Array], Array], in_tau1: LinearFlow, low: float, high: float, floor: float = 0.0
    ) -> None:
        self._integrand, self._in_tau1, self._floor = integrand, in_tau1, floor
        fastest = float(np.max(np.abs(in_tau1.rates)))
        # Borders are whole multiples of a power of two, so that their products with it are exact.
        self._length = float(2.0 ** np.floor(np.log2(0.5 / fastest)))
        self._low = int(np.floor(low / self._length)) - _MARGIN if low < 0 else 0
        self._high = int(np.ceil(high / self._length)) + _MARGIN if high > 0 or self._low == 0 else 0
        self._tabulate(np.arange(self._low, self._high) * self._length, self._length)

    def extend(self) -> None:
        """Make the stretch about twice as long."""
        more = max(4, (self._high - self._low) // 2)
        self._low, self._high = self._low - more, self._high + more
        self._tabulate(np.arange(self._low, self._high) * self._length, self._length)

    @property
    def size(self) -> int:
        """Return the number of nodes."""
        return int(self._integrals.shape[0] * _PANEL_NODES)

    def at(self, tau1: Array) -> Array:
        """Return the integrals from zero to Neumann times within the stretch."""
        panel = self.panel_of(self.borders, tau1)
        x = 2 * (tau1 - self.borders[panel]) / self.lengths[panel] - 1
        return np.asarray(self.values[panel] + self.within(panel, x)[0])

    def error(self, tau1: Array) -> Array:
        """Return the tails of the panels between zero and increasing Neumann times, twice."""
        tails = 2 * np.maximum(np.abs(self._tails[1:]), np.abs(self._tails[:-1]))
        if tau1.size < tails.size:
            return np.asarray(tails[self.panel_of(self.borders, tau1)])
        ends = np.searchsorted(tau1, self.borders[1:-1])
        return np.repeat(tails, np.diff(ends, prepend=0, append=tau1.size))

    def panel_of(self, borders: Array, values: Array) -> NDArray[np.intp]:
        """Return the panels in which values lie, borders being those of τ₁ or of the integral."""
        return np.clip(np.searchsorted(borders, values, side="right") - 1, 0, self._integrals.shape[0] - 1)

    def _tabulate(self, lefts: NDArray[Any], length: float) -> None:
        """Fill panels that start at ``lefts``, zero among them; those not resolved are halved, each for itself."""
        done: list[tuple[Array, Array, Array, Array]] = []
        last = np.full(lefts.size, np.inf)
        for _ in range(_MOST_HALVINGS):
            coefficients = self._coefficients(lefts, length)
            tail = np.max(np.abs(coefficients[:, -3:]), axis=1) / self._size(coefficients)
            settled = (tail <= _PANEL_TAIL) | ((tail <= _NOISE_TAIL) & (tail > _STALLED * last))
            done.append((lefts[settled], np.full(np.sum(settled), length), coefficients[settled], tail[settled]))
            if np.all(settled):
                break
            length /= 2
            lefts = (lefts[~settled][:, None] + np.array([0.0, length])).ravel()
            last = np.repeat(tail[~settled], 2)
        else:
            raise InternalContradiction("a panel along the orbit was not resolved")
        left, lengths, coefficients, tail = (np.concatenate(parts) for parts in zip(*done, strict=True))
        order = np.argsort(left)
        self.lengths = lengths[order]
        self.borders = np.append(left[order], left[order[-1]] + self.lengths[-1])
        self._integrals = _integrated(coefficients[order]) * (self.lengths / 2)[:, None]
        self.values = self._summed(np.sum(self._integrals, axis=1))  # at x = 1 every Chebyshev polynomial is one
        rate_error = np.maximum(tail[order], _PANEL_TAIL) * self._size(coefficients[order])
        self._tails = self._summed(rate_error * self.lengths)
        self.mean_size = float(np.mean(self._size(coefficients)))

    def _summed(self, over_panels: Array) -> Array:
        """Return the running sum at the borders, zero at τ₁ = 0."""
        total = np.concatenate([[0.0], np.cumsum(over_panels)])
        return np.asarray(total - total[np.searchsorted(self.borders, 0.0)])

    def _coefficients(self, lefts: Array, length: float) -> Array:
        """Return the Chebyshev coefficients of the integrand on panels; node phases are those of the border plus a short way."""
        start = self._in_tau1.phases(lefts)
        offsets = (_POINTS + 1)[:, None] * (length / 2) * self._in_tau1.rates
        z = (start[:, None, :] + offsets).reshape(-1, start.shape[1])
        values = [self._integrand(z[first : first + _BLOCK]) for first in range(0, z.shape[0], _BLOCK)]
        return np.asarray(np.concatenate(values).reshape(lefts.size, -1) @ _TO_COEFFICIENTS)

    def _size(self, coefficients: Array) -> Array:
        return np.maximum(np.abs(coefficients[:, 0]), self._floor)

    def within(self, panel: NDArray[np.intp], x: Array) -> tuple[Array, Array]:
        """Return the integral from the panel's left border to x, and its derivative in x."""
        orders = np.arange(_PANEL_NODES + 1)
        angle = np.arccos(np.clip(x, -1.0, 1.0))
        table = self._integrals[panel]
        value = np.sum(table * np.cos(orders * angle[:, None]), axis=1)
        sine = np.sin(angle)
        inside = sine > 1e-8
        slopes = np.where(inside[:, None], np.sin(orders * angle[:, None]) / np.where(inside, sine, 1.0)[:, None], orders)
        # At x = −1 the limit of sin(kα)/sin α is (−1)^{k+1} k.
        slopes = np.where((~inside & (x < 0))[:, None], -((-1.0) ** orders) * orders, slopes)
        return value, np.sum(table * orders * slopes, axis=1)


def _integrated(coefficients: Array) -> Array:
    """Return the Chebyshev coefficients of the integrals from −1, shape (panels, N+1)."""
    return np.asarray(np.polynomial.chebyshev.chebint(coefficients, lbnd=-1, axis=1), dtype=np.float64)
