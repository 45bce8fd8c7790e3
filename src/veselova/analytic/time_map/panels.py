"""The time map by quadrature: Chebyshev panels of dt/dτ₁ along the orbit. Cost grows with t, hardly
with the genus.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.time_map.chebyshev_panels import Panels
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.panel_quadrature import integrate_on_panels
from veselova.analytic.time_map.rate import TimeMap

__all__ = ["SHARED_ROUNDING", "TURN", "ChebyshevTimeMap"]

Array = NDArray[np.float64]

#: Rounding of dt/dτ₁ that all panels share, in ε.
SHARED_ROUNDING = 4 * float(np.finfo(float).eps)

#: By how much a phase moves slow parts of t, against their range: π times its order in those that
#: matter.
TURN = 3 * np.pi

#: Method: cycles over which all other parts average out, and the highest order at which some are
#: looked for.
_AVERAGED = 16.0
_HIGHEST = 8


class ChebyshevTimeMap(TimeMap):
    """t(τ₁) by Chebyshev panels over a stretch of the orbit that holds the wanted times.

    ``rate`` gives dt/dτ₁ at phases z of shape (N, g); ``mean`` is F_0.
    """

    name: ClassVar[str] = "panels"

    def __init__(
        self,
        rate: Callable[[Array], Array],
        mean: float,
        in_tau1: LinearFlow,
        earliest: float,
        latest: float,
    ) -> None:
        self._rate = rate
        self._mean = mean
        self.in_tau1 = in_tau1
        self._earliest, self._latest = min(earliest, 0.0), max(latest, 0.0)
        self._panels: Panels | None = None

    @property
    def panels(self) -> Panels:
        """Return the panels, which are made when they are first needed."""
        if self._panels is None:
            self._panels = self._integrate()
        return self._panels

    def _integrate(self) -> Panels:
        low = self._earliest / self._mean
        high = self._latest / self._mean
        panels = integrate_on_panels(self._rate, self.in_tau1, low, high)
        # The mean time map's estimate; extended where that was short.
        while panels.values[0] > self._earliest or panels.values[-1] < self._latest:
            low, high = (border and 1.5 * border for border in panels.borders[[0, -1]].tolist())
            panels = integrate_on_panels(self._rate, self.in_tau1, low, high)
        return panels

    @property
    def size(self) -> int:
        """Return the number of nodes."""
        return self.panels.size

    @property
    def mean(self) -> float:
        """Return F_0."""
        return self._mean

    def error(self, tau1: Array, of_start: Array, of_rates: Array) -> tuple[Array, float]:
        """Return the panels' own error: the tails from zero on, and the rounding of dt/dτ₁ that
        they share.

        What errors of the phases do is judged by how far slow parts of dt/dτ₁ lead t/F_0 from τ₁.
        """
        panels = self.panels
        # The tails are those of t; divided by F_0, whatever dt/dτ₁ is along these panels: whoever
        # takes the error multiplies by F_0 over the rate at each time.
        error = panels.error(tau1) / self._mean
        # The fastest phase has no part in them where it takes orders that are not there to make up
        # for it.
        rates = np.abs(self.in_tau1.rates)
        slow = _HIGHEST * (rates.sum() - rates) >= rates
        if slow.any():
            # Nor do they lead farther than the time elapsed, where little of it passes at first.
            elapsed = np.abs(np.interp(tau1, panels.borders, panels.values)) / self._mean
            error += (
                TURN
                * np.minimum(self._drift(tau1), elapsed)
                * (float(of_start @ slow) + float(of_rates @ slow) * np.abs(tau1))
            )
        return np.asarray(error), SHARED_ROUNDING

    def _drift(self, tau1: Array) -> Array:
        """Return how far t/F_0 − τ₁, averaged over stretches of some cycles, has gone between zero
        and Neumann times, (N,).
        """
        borders = self.panels.borders
        values = self.panels.values
        stretches = np.floor(borders * (np.max(np.abs(self.in_tau1.rates)) / _AVERAGED))
        if stretches[0] == stretches[-1]:
            return np.zeros(tau1.size)
        begins = np.flatnonzero(np.diff(stretches, prepend=-np.inf))
        counts = np.diff(begins, append=borders.size)
        centres, means = (
            np.add.reduceat(x, begins) / counts for x in (borders, values / self._mean - borders)
        )
        first = int(np.argmin(np.abs(centres)))
        gone = np.abs(means - means[first])
        gone[first:] = np.maximum.accumulate(gone[first:])
        gone[: first + 1] = np.maximum.accumulate(gone[first::-1])[::-1]
        return np.asarray(np.interp(tau1, centres, gone))

    def time(self, tau1: Array) -> Array:
        """Return t at Neumann times within the panels."""
        return self.panels.at(tau1)

    def tau1(self, times: Array) -> tuple[Array, Array]:
        """Return (τ₁, z) at physical times within the panels, by Newton's method on the panel's
        polynomial.
        """
        panels = self.panels
        panel, offset = panels.find_arguments(times)
        z = self.in_tau1.phases(panels.borders[panel]) + offset[:, None] * self.in_tau1.rates
        return panels.borders[panel] + offset, z
