"""The clock by quadrature: Chebyshev panels of dt/dτ₁ along the orbit. Cost grows with t, hardly with the genus."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.clock import Clock, ClockRate
from veselova.analytic.increasing import increasing_root
from veselova.analytic.orbit import LinearFlow

__all__ = ["PanelClock"]

Array = NDArray[np.float64]

#: Points per panel; panels are halved until the last coefficients are rounding.
_PANEL_NODES = 24

#: A panel is resolved when its last coefficients fall below this fraction of the first.
_PANEL_TAIL = 4e-15

#: A Newton step of this size, in half panels, leaves an error of its square.
_SETTLED = 1e-9


class PanelClock(Clock):
    """t(τ₁) by Chebyshev panels over a stretch of the orbit that holds the wanted times."""

    name: ClassVar[str] = "panels"

    def __init__(self, rate: ClockRate, in_tau1: LinearFlow, earliest: float, latest: float) -> None:
        self._rate, self._in_tau1 = rate, in_tau1
        mean = float(rate.mean)
        fastest = float(np.max(np.abs(in_tau1.rates)))
        # One cycle of the fastest phase on each side beyond the mean clock's estimate; extended below if that was short.
        margin = 1.0 / fastest
        self._length = 0.5 / fastest
        low, high = min(earliest, 0.0) / mean - margin, max(latest, 0.0) / mean + margin
        while True:
            self._tabulate(low, high)
            if self._times[0] <= min(earliest, 0.0) and self._times[-1] >= max(latest, 0.0):
                return
            low, high = low - margin, high + margin
            margin *= 2

    @property
    def size(self) -> int:
        """Return the number of nodes."""
        return int(self._integrals.shape[0] * _PANEL_NODES)

    def error(self, tau1: Array) -> Array:
        """Return the panels' own error: a tail of each and the rounding of their running sum."""
        return np.asarray(2 * _PANEL_TAIL * (self._length + np.abs(tau1) / np.sqrt(self._integrals.shape[0])))

    def _tabulate(self, low: float, high: float) -> None:
        """Fill the panels of [low, high], zero being one of their borders, halving them until all are resolved."""
        points = np.cos(np.pi * (np.arange(_PANEL_NODES) + 0.5) / _PANEL_NODES)
        transform = np.cos(np.outer(np.arange(_PANEL_NODES), np.arccos(points))) * (2 / _PANEL_NODES)
        transform[0] /= 2
        while True:
            before, after = int(np.ceil(-low / self._length)), int(np.ceil(high / self._length))
            borders = np.arange(-before, after + 1) * self._length
            middles = (borders[1:] + borders[:-1]) / 2
            nodes = middles[:, None] + points * (self._length / 2)
            z = self._in_tau1.phases(nodes.ravel())
            rates = self._rate.at(self._rate.inversion.invert(z)).reshape(nodes.shape)
            coefficients = rates @ transform.T
            tail = np.max(np.abs(coefficients[:, -3:]), axis=1) / np.abs(coefficients[:, 0])
            if np.max(tail) <= _PANEL_TAIL:
                break
            self._length /= 2
        self._borders = borders
        self._integrals = _integrated(coefficients) * (self._length / 2)
        over_panels = np.sum(self._integrals, axis=1)  # at x = 1 every Chebyshev polynomial is one
        total = np.concatenate([[0.0], np.cumsum(over_panels)])
        self._times = total - total[before]

    def _locate(self, borders: NDArray[Any], values: Array) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(borders, values, side="right") - 1, 0, self._integrals.shape[0] - 1)

    def time(self, tau1: Array) -> Array:
        """Return t at Neumann times within the panels."""
        panel = self._locate(self._borders, tau1)
        x = 2 * (tau1 - self._borders[panel]) / self._length - 1
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
        tau1 = self._borders[panel] + (x + 1) * (self._length / 2)
        return tau1, self._in_tau1.phases(tau1)


def _integrated(coefficients: Array) -> Array:
    """Return the Chebyshev coefficients of the integrals from −1, shape (panels, N+1)."""
    return np.asarray(np.polynomial.chebyshev.chebint(coefficients, lbnd=-1, axis=1), dtype=np.float64)
