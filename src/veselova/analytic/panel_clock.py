"""The clock by quadrature: Chebyshev panels of dt/dτ₁ along the orbit. Cost grows with t, hardly with the genus."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.clock import Clock
from veselova.analytic.increasing import increasing_root
from veselova.analytic.orbit import LinearFlow
from veselova.mechanics.errors import InternalContradiction

__all__ = ["PanelClock"]

Array = NDArray[np.float64]

#: Points per panel.
_PANEL_NODES = 24

#: A panel is resolved when its last coefficients fall below this fraction of the first …
_PANEL_TAIL = 4e-15

#: … or below this one without having fallen to a quarter in the last halving: then they are rounding of the phases.
_NOISE_TAIL = 1e-11
_STALLED = 0.25

#: Halvings of a panel before giving up; near a separatrix dt/dτ₁ varies over a few hundredths of a cycle.
_MOST_HALVINGS = 30

#: Rounding of dt/dτ₁ that all panels share, in ε.
_SHARED_ROUNDING = 4 * float(np.finfo(float).eps)

#: Nodes evaluated at once.
_BLOCK = 4096

#: A Newton step of this size, in half panels, leaves an error of its square.
_SETTLED = 1e-9


class PanelClock(Clock):
    """t(τ₁) by Chebyshev panels over a stretch of the orbit that holds the wanted times.

    ``rate`` gives dt/dτ₁ at phases z of shape (N, g); ``mean`` is F_0.
    """

    name: ClassVar[str] = "panels"

    def __init__(self, rate: Callable[[Array], Array], mean: float, in_tau1: LinearFlow, earliest: float, latest: float) -> None:
        self._rate, self._in_tau1 = rate, in_tau1
        points = np.cos(np.pi * (np.arange(_PANEL_NODES) + 0.5) / _PANEL_NODES)
        self._points = points
        self._transform = np.cos(np.outer(np.arange(_PANEL_NODES), np.arccos(points))) * (2 / _PANEL_NODES)
        self._transform[0] /= 2
        fastest = float(np.max(np.abs(in_tau1.rates)))
        # Borders are whole multiples of a power of two, so that their products with it are exact.
        length = float(2.0 ** np.floor(np.log2(0.5 / fastest)))
        # One cycle of the fastest phase on each side beyond the mean clock's estimate; extended below if that was short.
        low = int(np.floor(min(earliest, 0.0) / mean / length)) - 2
        high = int(np.ceil(max(latest, 0.0) / mean / length)) + 2
        self._tabulate(np.arange(low, high) * length, length)
        while self._times[0] > min(earliest, 0.0) or self._times[-1] < max(latest, 0.0):
            low, high = low - max(4, (high - low) // 2), high + max(4, (high - low) // 2)
            self._tabulate(np.arange(low, high) * length, length)

    @property
    def size(self) -> int:
        """Return the number of nodes."""
        return int(self._integrals.shape[0] * _PANEL_NODES)

    def error(self, tau1: Array) -> Array:
        """Return the panels' own error: the tails from zero on, and the rounding of dt/dτ₁ that they share."""
        panel = self._locate(self._borders, tau1)
        tails = np.maximum(np.abs(self._tails[panel + 1]), np.abs(self._tails[panel]))
        return np.asarray(2 * tails + _SHARED_ROUNDING * np.abs(tau1))

    def _tabulate(self, lefts: NDArray[Any], length: float) -> None:
        """Fill panels that start at ``lefts``, zero among them; those not resolved are halved, each for itself."""
        done: list[tuple[Array, Array, Array, Array]] = []
        last = np.full(lefts.size, np.inf)
        for _ in range(_MOST_HALVINGS):
            coefficients = self._coefficients(lefts, length)
            tail = np.max(np.abs(coefficients[:, -3:]), axis=1) / np.abs(coefficients[:, 0])
            settled = (tail <= _PANEL_TAIL) | ((tail <= _NOISE_TAIL) & (tail > _STALLED * last))
            done.append((lefts[settled], np.full(np.sum(settled), length), coefficients[settled], tail[settled]))
            if np.all(settled):
                break
            length /= 2
            lefts = (lefts[~settled][:, None] + np.array([0.0, length])).ravel()
            last = np.repeat(tail[~settled], 2)
        else:
            raise InternalContradiction("a panel of the clock was not resolved")
        left, lengths, coefficients, tail = (np.concatenate(parts) for parts in zip(*done, strict=True))
        order = np.argsort(left)
        self._lengths = lengths[order]
        self._borders = np.append(left[order], left[order[-1]] + self._lengths[-1])
        self._integrals = _integrated(coefficients[order]) * (self._lengths / 2)[:, None]
        self._times = self._summed(np.sum(self._integrals, axis=1))  # at x = 1 every Chebyshev polynomial is one
        rate_error = np.maximum(tail[order], _PANEL_TAIL) * np.abs(coefficients[order, 0])
        self._tails = self._summed(rate_error * self._lengths / np.mean(np.abs(coefficients[:, 0])))

    def _summed(self, over_panels: Array) -> Array:
        """Return the running sum at the borders, zero at τ₁ = 0."""
        total = np.concatenate([[0.0], np.cumsum(over_panels)])
        return np.asarray(total - total[np.searchsorted(self._borders, 0.0)])

    def _coefficients(self, lefts: Array, length: float) -> Array:
        """Return the Chebyshev coefficients of dt/dτ₁ on panels; node phases are those of the border plus a short way."""
        start = self._in_tau1.phases(lefts)
        offsets = (self._points + 1)[:, None] * (length / 2) * self._in_tau1.rates
        z = (start[:, None, :] + offsets).reshape(-1, start.shape[1])
        values = [self._rate(z[first : first + _BLOCK]) for first in range(0, z.shape[0], _BLOCK)]
        return np.asarray(np.concatenate(values).reshape(lefts.size, -1) @ self._transform.T)

    def _locate(self, borders: Array, values: Array) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(borders, values, side="right") - 1, 0, self._integrals.shape[0] - 1)

    def time(self, tau1: Array) -> Array:
        """Return t at Neumann times within the panels."""
        panel = self._locate(self._borders, tau1)
        x = 2 * (tau1 - self._borders[panel]) / self._lengths[panel] - 1
        return np.asarray(self._times[panel] + self._evaluate(panel, x)[0])

    def _evaluate(self, panel: NDArray[np.intp], x: Array) -> tuple[Array, Array]:
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

    def tau1(self, times: Array) -> tuple[Array, Array]:
        """Return (τ₁, z) at physical times within the panels, by Newton's method on the panel's polynomial."""
        panel = self._locate(self._times, times)
        target = times - self._times[panel]
        x = 2 * target / (self._times[panel + 1] - self._times[panel]) - 1

        def excess(x: Array) -> tuple[Array, Array]:
            value, slope = self._evaluate(panel, x)
            return value - target, slope

        x = increasing_root(excess, x, np.full_like(x, -1.0), np.full_like(x, 1.0), _SETTLED)
        offset = (x + 1) * (self._lengths[panel] / 2)
        z = self._in_tau1.phases(self._borders[panel]) + offset[:, None] * self._in_tau1.rates
        return self._borders[panel] + offset, z


def _integrated(coefficients: Array) -> Array:
    """Return the Chebyshev coefficients of the integrals from −1, shape (panels, N+1)."""
    return np.asarray(np.polynomial.chebyshev.chebint(coefficients, lbnd=-1, axis=1), dtype=np.float64)
