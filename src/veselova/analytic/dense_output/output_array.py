"""The states of a motion at many times while they are filled in: by windows
(analytic.dense_output.interpolation) first, then time by time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.dense_output.chebyshev_window import (
    SUM_ROUNDING,
    Evaluation,
    WindowBatch,
    WindowGrid,
)
from veselova.analytic.dense_output.piecewise_polynomial import PiecewisePolynomial
from veselova.analytic.time_map.rate import TimeMap
from veselova.mechanics.core.budget import iterate

__all__ = ["AT_ONCE", "OutputArray", "Samples"]

Array = NDArray[np.float64]
Places = NDArray[np.intp]

#: Budget: times evaluated one by one at once. It bounds the memory.
AT_ONCE = 32768


@dataclass(frozen=True)
class Samples:
    """A motion at N times: τ₁ (N,), its series, and the error (N,) that interpolation adds,
    relative to their size.

    - evaluations: how often the motion was evaluated
    - time_map: the one that was used, on the panels of the intervals where these adjoin
    """

    tau1: Array
    series: tuple[Array, ...]
    error: Array
    evaluations: int
    time_map: TimeMap


class OutputArray:
    """The answer while it is filled: a row for τ₁ and one for every component of the series, along
    the times.

    So the answer is written by long rows, in three fifths of the time of short ones, and functions
    of many states run along them.
    """

    def __init__(
        self,
        times: Array,
        fewest: int,
        time_map: TimeMap,
        rates: Array,
        evaluation: Evaluation,
        remainders: Array | None = None,
    ) -> None:
        self._times = times
        self._fewest = fewest
        self._time_map = time_map
        self._rates = rates
        self._evaluation = evaluation
        self._remainders = remainders
        self._error, self._open = np.zeros(times.size), np.ones(times.size, dtype=bool)
        self._shapes: list[tuple[int, ...]] = []
        self._evaluations = 0

    @cached_property
    def _states(self) -> Array:
        return np.empty((1 + sum(int(np.prod(shape)) for shape in self._shapes), self._times.size))

    def complete(self) -> Samples:
        """Return the answer, with what is still open evaluated time by time."""
        rest = np.flatnonzero(self._open)
        for k in iterate(range(0, rest.size, AT_ONCE), "motion"):
            rows = rest[k : k + AT_ONCE]
            tau1, z = self._time_map.tau1(self._times[rows], self._remainders_at(rows))
            _, series = self._evaluation(tau1, z)
            self._evaluations += rows.size
            self._shapes = [part.shape[1:] for part in series]
            self._states[0, rows] = tau1
            self._states[1:, rows] = np.concatenate(
                [part.reshape(rows.size, -1) for part in series], axis=1
            ).T
        ends = np.cumsum([1, *(int(np.prod(shape)) for shape in self._shapes)])
        series = tuple(
            np.moveaxis(self._states[a:b].reshape(*shape, -1), -1, 0)
            for a, b, shape in zip(ends[:-1], ends[1:], self._shapes, strict=True)
        )
        return Samples(self._states[0], series, self._error, self._evaluations, self._time_map)

    def batch(self, window_grid: WindowGrid, z: Array | None = None) -> WindowBatch:
        """Return windows of mean time; z (W, g) are the phases at their starts."""
        z = self._time_map.periodic_part(window_grid.starts)[1] if z is None else z
        mean = self._time_map.mean
        batch = WindowBatch.of(
            self._evaluation,
            window_grid.starts / mean,
            z,
            window_grid.length / mean,
            self._rates,
            window_grid.tails,
        )
        self._evaluations += batch.rates.size
        self._shapes = batch.shapes
        return batch

    def by_windows(self, window_grid: WindowGrid, count: int) -> WindowGrid:
        """Fill the times of the windows that are resolved in so many pieces; return the others that
        hold times enough.
        """
        ends, places = np.unique(
            np.concatenate([window_grid.starts, window_grid.starts + window_grid.length]),
            return_inverse=True,
        )
        periodic_part, z = self._time_map.periodic_part(ends)
        first, last = np.searchsorted(self._times, ends + periodic_part)[places].reshape(2, -1)
        held = last - first >= self._fewest
        if not np.any(held):
            return window_grid[held]
        window_grid, first, last, places = (
            window_grid[held],
            first[held],
            last[held],
            places[: len(window_grid)][held],
        )
        batch = self.batch(window_grid, z[places])
        polynomials, tails = batch.in_pieces(count)
        done = batch.is_resolved(tails)
        self.fill(
            polynomials[done],
            first[done],
            last[done],
            window_grid.starts[done],
            periodic_part[places][done],
            tails[done],
        )
        return WindowGrid(window_grid.length, window_grid.starts, tails)[~done]

    def fill(
        self,
        polynomials: PiecewisePolynomial,
        first: Places,
        last: Places,
        starts: Array,
        periodic_part: Array,
        tails: Array,
    ) -> None:
        """Fill the times, from the first up to the last, of W windows, which start at starts +
        periodic_part; (W,) all of them.
        """
        begins = np.flatnonzero(first != np.append(-1, last[:-1])).tolist()
        for run in map(slice, begins, [*begins[1:], first.size]):  # windows that adjoin
            rows = slice(first[run][0], last[run][-1])
            out = self._states[:, rows]
            remainders = self._remainders_at(rows)
            polynomials[run].fill(
                self._times[rows], starts[run], periodic_part[run], out, remainders
            )
            self._open[rows] = False
            self._error[rows] = np.repeat(2 * tails[run] + SUM_ROUNDING, (last - first)[run])

    def _remainders_at(self, rows: slice | Places) -> Array | None:
        return None if self._remainders is None else self._remainders[rows]
