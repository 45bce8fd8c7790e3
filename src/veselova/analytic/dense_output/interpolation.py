"""A motion at many times from few: Chebyshev windows of time along its orbit.

Windows are of mean time u = F_0τ₁. They begin at multiples of their length, a number of few bits: t
− u and the phases there come from the time map, exact however far out, and no window hands its
error to the next. A window takes one sum of the time map, at its start, and one evaluation of the
motion at each of its nodes; on its pieces the series become polynomials in t
(analytic.dense_output.piecewise_polynomial). All times in it are sums of these, whatever the genus
and the route.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.dense_output.chebyshev_window import (
    MOST_HALVINGS,
    Evaluation,
    WindowBatch,
    WindowGrid,
)
from veselova.analytic.dense_output.output_array import AT_ONCE, OutputArray, Samples
from veselova.analytic.time_map.rate import TimeMap
from veselova.tunings import INTERPOLATED_TIMES

__all__ = ["Windows"]

Array = NDArray[np.float64]

#: Method: cycles of the fastest phase in a window at first; lengths that are tried, and how many
#: before they are halved.
_CYCLES = 2.0
_MOST_LENGTHS = 16
_CLOSE_LENGTHS = 6

#: Pieces of a window, the fewest that serve.
_PARTS = (6, 8, 16, 32)

#: Derived: lengths of a window from t = 0 at which times have too few bits left to lie densely in
#: one.
_FARTHEST = 2.0**32

#: Method: windows tried before all of the same length.
_FIRST_WINDOWS = 8


@dataclass(frozen=True)
class _Stretches:
    """Where times lie densely: the first and the last one of each stretch; the windows in all of
    them, and the times.
    """

    first: NDArray[np.intp]
    last: NDArray[np.intp]
    windows: int
    held: int


_NONE = _Stretches(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp), 0, 0)


class Windows:
    """The windows of one orbit at increasing times.

    ``fastest`` is the most cycles that a phase makes in a unit of time, ``fewest`` the times that
    make a window worth its while.
    ``remainders`` are what exact times are beyond the doubles.
    """

    def __init__(
        self, times: Array, fastest: float, fewest: int, remainders: Array | None = None
    ) -> None:
        self._times = times
        self._fastest = fastest
        self._fewest = fewest
        self._remainders = remainders

    @cached_property
    def _length(self) -> float:
        return _few_bits(_CYCLES / self._fastest)

    @cached_property
    def _stretches(self) -> _Stretches:
        if self._times.size < INTERPOLATED_TIMES:
            return _NONE
        times = self._times
        length = self._length
        low, high = np.floor(times[[0, -1]] / length)
        if high - low < times.size:
            keys = np.arange(low, high + 1)
            borders = np.append(np.searchsorted(times, keys * length), times.size)
        else:
            keys = np.floor(times / length)
            borders = np.concatenate([[0], np.flatnonzero(np.diff(keys)) + 1, [keys.size]])
            keys = keys[borders[:-1]]
        dense = (np.diff(borders) >= self._fewest) & (np.abs(keys) < _FARTHEST)
        first = borders[:-1][dense]
        last = borders[1:][dense] - 1
        keys = keys[dense]
        begins = np.flatnonzero(np.diff(keys, prepend=-np.inf) > 1)
        ends = np.flatnonzero(np.diff(keys, append=np.inf) > 1)
        return _Stretches(first[begins], last[ends], int(keys.size), int(np.sum(last - first + 1)))

    @property
    def span(self) -> tuple[float, float]:
        """Return the stretch of time over which the time map will be asked."""
        margin = 2 * self._length if self._stretches.windows else 0.0
        return float(self._times[0]) - margin, float(self._times[-1]) + margin

    @property
    def inversions(self) -> int:
        """Return how often the time map will be asked at least: at the starts of windows, and at
        times in none.
        """
        return int(self._times.size) - self._stretches.held + self._stretches.windows

    def interpolate(self, time_map: TimeMap, rates: Array, evaluation: Evaluation) -> Samples:
        """Return the motion; ``rates`` are f, cycles per unit of τ₁."""
        if not self._stretches.windows and self._times.size <= AT_ONCE:
            tau1, z = time_map.tau1(self._times, self._remainders)
            series = evaluation(tau1, z)[1]
            return Samples(tau1, series, np.zeros(tau1.size), int(tau1.size), time_map)
        output = OutputArray(
            self._times, self._fewest, time_map, rates, evaluation, self._remainders
        )
        if self._stretches.windows:
            window_grid, count = self._over_stretches(output, time_map)
            for _ in range(MOST_HALVINGS):
                window_grid = window_grid.remaining(
                    lambda some: output.by_windows(some, count)
                ).halve()
                if not len(window_grid):
                    break
        return output.complete()

    def _over_stretches(self, output: OutputArray, time_map: TimeMap) -> tuple[WindowGrid, int]:
        """Return windows of a length at which most are resolved, and in how many pieces."""
        dense = self._times[np.stack([self._stretches.first, self._stretches.last])]
        ends = time_map.tau1(dense.ravel())[0].reshape(dense.shape) * time_map.mean

        def over(length: float, tail: float) -> WindowGrid:
            pairs = np.floor(ends / length) + np.array([[0.0], [1.0]])
            starts = np.unique(np.concatenate([np.arange(*pair) for pair in pairs.T])) * length
            return WindowGrid(length, starts, np.full(starts.size, tail))

        return _resolving(over, output.batch, self._length)


def _resolving(
    over: Callable[[float, float], WindowGrid],
    batch: Callable[[WindowGrid], WindowBatch],
    length: float,
) -> tuple[WindowGrid, int]:
    """Return the windows ``over`` all times of a length, the first tried or below, at which most
    are resolved, and in how many pieces; ``over`` takes the length, and the tail of the ones
    before.
    """
    tail = np.inf
    count = _PARTS[-1]
    for k in range(_MOST_LENGTHS):
        window_grid = over(length, tail)
        tried = batch(
            window_grid[np.unique(np.linspace(0, len(window_grid) - 1, _FIRST_WINDOWS).astype(int))]
        )
        enough = 1.0 if k < _CLOSE_LENGTHS else 0.5
        if np.mean(tried.is_resolved(tried.tails)) >= enough:
            for count in _PARTS:
                if np.mean(tried.is_resolved(tried.in_pieces(count)[1])) >= enough:
                    return window_grid, count
        tail = float(np.max(tried.tails))
        length = _shorter(length) if k < _CLOSE_LENGTHS else length / 2
    return window_grid, count


def _few_bits(length: float) -> float:
    """Return the next smaller number of three bits."""
    mantissa, exponent = math.frexp(length)
    return math.ldexp(math.floor(8 * mantissa) / 8, exponent)


def _shorter(length: float) -> float:
    """Return the next length of three bits."""
    mantissa, exponent = math.frexp(length)
    return (
        math.ldexp(mantissa - 0.125, exponent)
        if mantissa > 0.5
        else math.ldexp(0.875, exponent - 1)
    )
