"""Windows that adjoin from τ₁ = 0 on: dt/dτ₁ at their nodes tells the time, and no time map needs
nodes of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.dense_output.chebyshev_window import (
    MOST_HALVINGS,
    Evaluation,
    WindowBatch,
    WindowGrid,
)
from veselova.analytic.dense_output.output_array import OutputArray
from veselova.analytic.dense_output.piecewise_polynomial import ORDER, PiecewisePolynomial
from veselova.analytic.time_map.chebyshev_panels import Panels
from veselova.analytic.time_map.linear_flow import LinearFlow

__all__ = ["AdjoiningWindows"]

Array = NDArray[np.float64]

#: Numbers that are kept: 128 MB.
_MOST_KEPT = 2**24


@dataclass(frozen=True)
class _Part:
    """Windows of one trial that are resolved: columns of their panels, their pieces and tails."""

    panels: tuple[Array, ...]
    polynomials: PiecewisePolynomial
    tails: Array


class AdjoiningWindows:
    """A motion on windows that adjoin, each resolved in so many pieces or halved."""

    def __init__(self, output: OutputArray, evaluation: Evaluation, in_tau1: LinearFlow) -> None:
        self._output = output
        self._evaluation = evaluation
        self._in_tau1 = in_tau1
        self._parts: list[_Part] = []
        self._selected = self._columns = 0

    def batch(self, window_grid: WindowGrid) -> WindowBatch:
        """Return windows of Neumann time."""
        z = self._in_tau1.phases(window_grid.starts)
        rates = self._in_tau1.rates
        batch = self._output.count_evaluations(
            WindowBatch.of(
                self._evaluation,
                window_grid.starts,
                z,
                window_grid.length,
                rates,
                window_grid.tails,
            )
        )
        self._columns = 1 + batch.series.shape[2]
        return batch

    def extend(self, window_grid: WindowGrid, count: int) -> bool:
        """Add windows; return whether all could be resolved in so many pieces, and kept."""
        for _ in range(MOST_HALVINGS):
            if self._selected + len(window_grid) * count * ORDER * self._columns > _MOST_KEPT:
                return False
            window_grid = window_grid.remaining(lambda some: self._select_unresolved(some, count))
            if not len(window_grid):
                return True
            window_grid = window_grid.halve()
        return False

    def _select_unresolved(self, window_grid: WindowGrid, count: int) -> WindowGrid:
        batch = self.batch(window_grid)
        polynomials, tails = batch.in_pieces(count)
        resolved = batch.is_resolved(tails)
        starts = batch.starts[resolved]
        rates = batch.rates[resolved]
        panels = (
            starts,
            np.full(starts.size, batch.length_tau1),
            rates,
            batch.rate_tails[resolved],
            rates[:, 0],
        )
        self._parts.append(_Part(panels, polynomials[resolved], tails[resolved]))
        self._selected += starts.size * count * ORDER * self._columns
        return WindowGrid(window_grid.length, window_grid.starts, tails)[~resolved]

    def panels(self) -> Panels:
        """Return t(τ₁) on the windows."""
        return Panels.of(
            *(
                np.concatenate(columns)
                for columns in zip(*(part.panels for part in self._parts), strict=True)
            )
        )

    def fill(self, times: Array, panels: Panels) -> None:
        """Fill the answer at increasing times within the windows."""
        for part in self._parts:
            k = np.searchsorted(panels.borders, part.panels[0])
            low = panels.values[k]
            high = panels.values[k + 1]
            first, last = np.searchsorted(times, [low, high])
            last[high == panels.values[-1]] = times.size
            self._output.fill(part.polynomials, first, last, low, np.zeros_like(low), part.tails)
