"""Integrals along one orbit that the path of a rolling ball is made of, by Fourier series or on
panels, as its time map is.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.motion.displacement import Displacement
from veselova.analytic.time_map.chebyshev_panels import Panels
from veselova.analytic.time_map.panel_quadrature import integrate_together
from veselova.analytic.time_map.torus_series import SeriesIntegral

__all__ = ["FourierPath", "PanelPath", "TransversePath"]

Array = NDArray[np.float64]

#: Method: by how much farther panels go than they are asked for.
_FARTHER = 1.25


class TransversePath(Protocol):
    """The integrals y_1 … y_K of the functions of a ``Displacement`` along one orbit."""

    def at(self, tau1: Array, z: Array) -> Array:
        """Return y at Neumann times (N,) with their phases (N, g), shape (N, K)."""

    def error(self, tau1: Array, of_start: Array, of_rates: Array) -> Array:
        """Return a bound on what the path adds to the error of the Neumann times, (N, K)."""


class FourierPath:
    """The path by Fourier series, at a cost that does not grow with time."""

    def __init__(self, displacement: Displacement) -> None:
        flow = displacement.solution.in_tau1
        self._integrals = [SeriesIntegral(series, flow) for series in displacement.series]

    def at(self, tau1: Array, z: Array) -> Array:
        """Return y at Neumann times with their phases."""
        result = np.empty((tau1.size, len(self._integrals)))
        for k, integral in enumerate(self._integrals):
            result[:, k] = integral.at(tau1, z)
        return result

    def error(self, tau1: Array, of_start: Array, of_rates: Array) -> Array:
        """Return the errors of the series."""
        result = np.empty((tau1.size, len(self._integrals)))
        for k, integral in enumerate(self._integrals):
            result[:, k] = integral.error(tau1, of_start, of_rates)
        return result


class PanelPath:
    """The path by Chebyshev panels along the orbit; they are extended when times ask for it."""

    def __init__(self, displacement: Displacement, method: str) -> None:
        self._displacement = displacement
        self._solution = displacement.solution
        self._method = method
        self._known: list[Panels] = []

    def _panels(self, tau1: Array) -> list[Panels]:
        low = min(0.0, float(np.min(tau1, initial=0.0)))
        high = max(0.0, float(np.max(tau1, initial=0.0)))
        if self._known:
            borders = self._known[0].borders
            if borders[0] <= low and high <= borders[-1]:
                return self._known
            low, high = min(low, float(borders[0])), max(high, float(borders[-1]))
        if self._displacement.count:
            self._known = integrate_together(
                lambda z: self._displacement.integrands(self._solution.attitude(z, self._method)),
                self._solution.in_tau1,
                _FARTHER * low,
                _FARTHER * high,
                1.0,
            )
        return self._known

    def at(self, tau1: Array, z: Array) -> Array:
        """Return y at Neumann times."""
        result = np.empty((tau1.size, self._displacement.count))
        for k, panels in enumerate(self._panels(tau1)):
            result[:, k] = panels.at(tau1)
        return result

    def error(self, tau1: Array, of_start: Array, of_rates: Array) -> Array:
        """Return the tails of the panels, and what errors of the phases make over the time
        elapsed.
        """
        slopes = self._solution.sensitivity.by_phase
        elapsed = np.abs(tau1)
        phases = float(of_start @ slopes) + float(of_rates @ slopes) * elapsed
        result = np.empty((tau1.size, self._displacement.count))
        for k, panels in enumerate(self._panels(tau1)):
            result[:, k] = panels.error(tau1) + phases * elapsed
        return result
