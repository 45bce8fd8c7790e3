"""Windows that adjoin from τ₁ = 0 on: dt/dτ₁ at their nodes tells the time, and no clock needs nodes of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.dense_output.chebyshev_window import MOST_HALVINGS, Cells, Evaluation, Trial
from veselova.analytic.dense_output.output_array import Filling
from veselova.analytic.dense_output.piecewise_polynomial import ORDER, Pieces
from veselova.analytic.time_map.chebyshev_panels import Panels
from veselova.analytic.time_map.linear_flow import LinearFlow

__all__ = ["Track"]

Array = NDArray[np.float64]

#: Numbers that are kept: 128 MB.
_MOST_KEPT = 2**24


@dataclass(frozen=True)
class _Part:
    """Windows of one trial that are resolved: columns of their panels, their pieces and tails."""

    panels: tuple[Array, ...]
    pieces: Pieces
    tails: Array


class Track:
    """A motion on windows that adjoin, each resolved in so many pieces or halved."""

    def __init__(self, filling: Filling, evaluation: Evaluation, in_tau1: LinearFlow) -> None:
        self._filling, self._evaluation, self._in_tau1 = filling, evaluation, in_tau1
        self._parts: list[_Part] = []
        self._kept = self._columns = 0

    def trial(self, cells: Cells) -> Trial:
        """Return windows of Neumann time."""
        z, rates = self._in_tau1.phases(cells.starts), self._in_tau1.rates
        trial = self._filling.noted(Trial.of(self._evaluation, cells.starts, z, cells.length, rates, cells.tails))
        self._columns = 1 + trial.series.shape[2]
        return trial

    def extend(self, cells: Cells, count: int) -> bool:
        """Add windows; return whether all could be resolved in so many pieces, and kept."""
        for _ in range(MOST_HALVINGS):
            if self._kept + len(cells) * count * ORDER * self._columns > _MOST_KEPT:
                return False
            cells = cells.left_by(lambda some: self._unresolved(some, count))
            if not len(cells):
                return True
            cells = cells.halved()
        return False

    def _unresolved(self, cells: Cells, count: int) -> Cells:
        trial = self.trial(cells)
        pieces, tails = trial.in_pieces(count)
        settled = trial.settled(tails)
        starts, rates = trial.starts[settled], trial.rates[settled]
        panels = (starts, np.full(starts.size, trial.stretch), rates, trial.rate_tails[settled], rates[:, 0])
        self._parts.append(_Part(panels, pieces[settled], tails[settled]))
        self._kept += starts.size * count * ORDER * self._columns
        return Cells(cells.length, cells.starts, tails)[~settled]

    def panels(self) -> Panels:
        """Return t(τ₁) on the windows."""
        return Panels.of(*(np.concatenate(columns) for columns in zip(*(part.panels for part in self._parts), strict=True)))

    def fill(self, times: Array, panels: Panels) -> None:
        """Fill the answer at increasing times within the windows."""
        for part in self._parts:
            k = np.searchsorted(panels.borders, part.panels[0])
            low, high = panels.values[k], panels.values[k + 1]
            first, last = np.searchsorted(times, [low, high])
            last[high == panels.values[-1]] = times.size
            self._filling.fill(part.pieces, first, last, low, np.zeros_like(low), part.tails)
