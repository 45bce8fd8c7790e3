"""A motion at many times from few: Chebyshev windows of time along its orbit.

A window [t_k, t_k+L] takes two inversions of the clock, at its ends, and one evaluation of the motion at each of its nodes. These
lie at Chebyshev points in τ₁, where dt/dτ₁ is integrated and inverted as a polynomial; then the series go over to such points
in t. All times in the window are sums of polynomials, whatever the genus and the route. Windows begin at multiples of a power of
two, so t − t_k is exact however far out, and none hands its error to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from veselova.analytic.clock import Clock
from veselova.analytic.increasing import increasing_root

__all__ = ["NODES", "Along", "Windows"]

Array = NDArray[np.float64]

#: From phases (N, g) to dt/dτ₁, (N,), and the series, each with first axis N.
Evaluation = Callable[[Array], tuple[Array, tuple[Array, ...]]]

#: Chebyshev points of a window.
NODES = 32

#: Times below which windows are not worth their overhead.
_FEW_TIMES = 500

#: Cycles of the fastest phase in a window at first, and halvings after which its times are taken one by one.
_CYCLES = 1.0
_MOST_HALVINGS = 12

#: A window is resolved when its last coefficients fall below this part of the series' size; or below the second without having
#: fallen to the third of what they were before the last halving: then they are rounding of the evaluation.
_TAIL, _NOISE_TAIL, _STALLED = 4e-15, 1e-12, 0.25

#: Lengths of a window from t = 0 at which times have too few bits left to lie densely in one.
_FARTHEST = 2.0**32

#: A Newton step of this size, in half windows, leaves an error of its square.
_SETTLED = 1e-9

#: Windows tried before the others of the same length.
_FIRST_WINDOWS = 8

#: Windows made at once; times evaluated one by one at once, and in a window. They bound the memory.
_WINDOWS, _TIMES, _TIMES_IN_WINDOW = 256, 32768, 4096

#: What a sum of polynomials rounds to.
_SUM_ROUNDING = 4 * float(np.finfo(float).eps)

_X = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
#: From values at the nodes to coefficients; whole numbers are reduced before they meet π.
_TRANSFORM = np.cos(np.outer(np.arange(NODES), 2 * np.arange(NODES) + 1) % (4 * NODES) * (np.pi / (2 * NODES))) * (2 / NODES)
_TRANSFORM[0] /= 2


@dataclass(frozen=True)
class Along:
    """A motion at N times: τ₁ (N,), its series, and the error (N,) that interpolation adds, relative to their size.

    evaluations: how often the motion was evaluated
    """

    tau1: Array
    series: tuple[Array, ...]
    error: Array
    evaluations: int


@dataclass(frozen=True)
class _Cells:
    """W windows of one length: where they start, and the times that each holds; ``tails`` (W,) of those twice as long."""

    length: float
    starts: Array
    first: NDArray[np.intp]
    last: NDArray[np.intp]
    tails: Array

    def __getitem__(self, chosen: slice | NDArray[np.bool_]) -> _Cells:
        return _Cells(self.length, self.starts[chosen], self.first[chosen], self.last[chosen], self.tails[chosen])

    def worth_while(self, fewest: int) -> NDArray[np.bool_]:
        """Return which hold times enough."""
        return (self.last - self.first >= fewest) & (np.abs(self.starts) < _FARTHEST * self.length)

    def halved(self, times: Array) -> _Cells:
        """Return the halves."""
        length = self.length / 2
        middle = self.first + np.array(
            [np.searchsorted(times[a:b], x) for a, b, x in zip(self.first, self.last, self.starts + length, strict=True)],
            dtype=int,
        )
        return _Cells(
            length,
            np.concatenate([self.starts, self.starts + length]),
            np.concatenate([self.first, middle]),
            np.concatenate([middle, self.last]),
            np.tile(self.tails, 2),
        )


class Windows:
    """The windows of one orbit at increasing times.

    ``fastest`` is the most cycles that a phase makes in a unit of time, ``fewest`` the times that make a window worth its while.
    """

    def __init__(self, times: Array, fastest: float, fewest: int) -> None:
        self._times, self._fewest = times, fewest
        self._length = float(2.0 ** np.floor(np.log2(_CYCLES / fastest)))

    @cached_property
    def _cells(self) -> _Cells:
        """Return the windows of the first length that are worth while."""
        if self._times.size < _FEW_TIMES:
            return _Cells(self._length, np.empty(0), np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp), np.empty(0))
        keys = np.floor(self._times / self._length)
        borders = np.concatenate([[0], np.flatnonzero(np.diff(keys)) + 1, [keys.size]])
        cells = _Cells(
            self._length, keys[borders[:-1]] * self._length, borders[:-1], borders[1:], np.full(borders.size - 1, np.inf)
        )
        return cells[cells.worth_while(self._fewest)]

    @property
    def span(self) -> tuple[float, float]:
        """Return the stretch of time over which the clock will be asked."""
        margin = self._length if self._cells.starts.size else 0.0
        return float(self._times[0]) - margin, float(self._times[-1]) + margin

    @property
    def inversions(self) -> int:
        """Return how often the clock will be inverted at least: at the ends of windows, and at times in none."""
        if self._times.size < _FEW_TIMES:
            return int(self._times.size)
        return int(self._times.size - np.sum(self._cells.last - self._cells.first) + 2 * self._cells.starts.size)

    def along(self, clock: Clock, rates: Array, evaluation: Evaluation) -> Along:
        """Return the motion; ``rates`` are f, cycles per unit of τ₁."""
        filling, cells = _Filling(self._times, clock, rates, evaluation), self._cells
        for _ in range(_MOST_HALVINGS):
            if cells.starts.size == 0:
                break
            left = [filling.by_windows(cells[:_FIRST_WINDOWS])]
            if 2 * left[0].starts.size > _FIRST_WINDOWS:
                left.append(cells[_FIRST_WINDOWS:])  # most of them are too long
            else:
                left += [filling.by_windows(cells[k : k + _WINDOWS]) for k in range(_FIRST_WINDOWS, cells.starts.size, _WINDOWS)]
            joined = (np.concatenate([getattr(part, name) for part in left]) for name in ("starts", "first", "last", "tails"))
            halves = _Cells(cells.length, *joined).halved(self._times)
            cells = halves[halves.worth_while(self._fewest)]
        return filling.completed()


class _Filling:
    """The answer while it is filled: by windows first, then time by time where none served."""

    def __init__(self, times: Array, clock: Clock, rates: Array, evaluation: Evaluation) -> None:
        self._times, self._clock, self._rates, self._evaluation = times, clock, rates, evaluation
        self._tau1, self._error = np.empty(times.size), np.zeros(times.size)
        self._series: tuple[Array, ...] | None = None
        self._open = np.ones(times.size, dtype=bool)
        self._evaluations = 0

    def _room(self, like: tuple[Array, ...]) -> tuple[Array, ...]:
        """Return the series to be filled."""
        if self._series is None:
            self._series = tuple(np.empty((self._times.size, *part.shape[1:])) for part in like)
        return self._series

    def completed(self) -> Along:
        """Return the answer, with what is still open evaluated time by time."""
        rest = np.flatnonzero(self._open)
        for k in range(0, rest.size, _TIMES):
            rows = rest[k : k + _TIMES]
            self._tau1[rows], z = self._clock.tau1(self._times[rows])
            _, series = self._evaluation(z)
            for whole, part in zip(self._room(series), series, strict=True):
                whole[rows] = part
        return Along(self._tau1, self._series or (), self._error, self._evaluations + int(rest.size))

    def by_windows(self, cells: _Cells) -> _Cells:
        """Fill the times of the windows that are resolved; return the others, with their tails."""
        count, length = cells.starts.size, cells.length
        ends, places = np.unique(np.concatenate([cells.starts, cells.starts + length]), return_inverse=True)
        found, z = (part[places] for part in self._clock.tau1(ends))
        tau1, stretch = found[:count], found[count:] - found[:count]
        offsets = (_X + 1) / 2 * stretch[:, None]
        rate, series = self._evaluation((z[:count, None, :] + offsets[:, :, None] * self._rates).reshape(count * NODES, -1))
        self._evaluations += rate.size
        sizes = [float(np.max(np.abs(part))) or 1.0 for part in series]
        columns = [np.reshape(part, (count, NODES, -1)) / size for part, size in zip(series, sizes, strict=True)]
        table, tails = _in_time(rate.reshape(count, NODES), stretch, length, np.concatenate(columns, axis=2))
        settled = (tails <= _TAIL) | ((tails <= _NOISE_TAIL) & (tails > _STALLED * cells.tails))
        borders = np.cumsum([1, *(part.shape[2] for part in columns)])
        tables = [table[:, :, a:b] * size for a, b, size in zip(borders[:-1], borders[1:], sizes, strict=True)]
        wholes = [part.reshape(self._times.size, -1) for part in self._room(series)]
        for w in np.flatnonzero(settled):
            for first in range(cells.first[w], cells.last[w], _TIMES_IN_WINDOW):
                rows = slice(first, min(first + _TIMES_IN_WINDOW, cells.last[w]))
                polynomials = _polynomials((self._times[rows] - cells.starts[w]) * (2 / length) - 1).T
                self._tau1[rows] = tau1[w] + (polynomials @ table[w, :, 0]) * stretch[w]
                for whole, coefficients in zip(wholes, tables, strict=True):
                    np.matmul(polynomials, coefficients[w], out=whole[rows])
            self._open[cells.first[w] : cells.last[w]] = False
            self._error[cells.first[w] : cells.last[w]] = 2 * tails[w] + _SUM_ROUNDING
        return replace(cells, tails=tails)[~settled]


def _in_time(rate: Array, stretch: Array, length: float, values: Array) -> tuple[Array, Array]:
    """Return Chebyshev coefficients in time over the windows, (W, NODES, 1 + columns), and the largest of the last ones, (W,).

    rate (W, NODES) dt/dτ₁ at the nodes in τ₁, values (W, NODES, columns) the series there; the first column that is returned is
    τ₁ since the start, as a part of ``stretch`` (W,), about what the window takes of it.
    """
    rates = rate @ _TRANSFORM.T
    elapsed = chebyshev.chebint(rates, lbnd=-1, axis=1).T[:, :, None] * (stretch[:, None] / 2)
    slope = rates.T[:, :, None] * (stretch[:, None] / 2)
    target = np.broadcast_to((_X + 1) / 2 * length, rate.shape)

    def excess(x: Array) -> tuple[Array, Array]:
        return chebyshev.chebval(x, elapsed, tensor=False) - target, chebyshev.chebval(x, slope, tensor=False)

    one = np.ones_like(target)
    x = increasing_root(excess, np.broadcast_to(_X, target.shape), -one, one, _SETTLED)
    in_tau1 = _TRANSFORM @ values
    at_times = np.moveaxis(_polynomials(x), 0, -1) @ in_tau1
    table = _TRANSFORM @ np.concatenate([(x[:, :, None] + 1) / 2, at_times], axis=2)
    last = [np.max(np.abs(part[:, -3:]), axis=(1, 2)) for part in (in_tau1, table)]
    return table, np.maximum(np.maximum(*last), np.max(np.abs(rates[:, -3:]), axis=1) / rates[:, 0])


def _polynomials(x: Array) -> Array:
    """Return T_0 … T_{NODES−1} at points of [−1, 1], the order first.

    Near 1 differences T_k − T_{k−1} keep the digits that the recurrence loses there (Reinsch); T_k is even or odd.
    """
    result = np.empty((NODES, *x.shape))
    size = np.abs(x)
    difference = size - 1
    twice = 2 * difference
    step = np.empty_like(twice)
    result[0], result[1] = 1.0, size
    for k in range(1, NODES - 1):
        difference += np.multiply(twice, result[k], out=step)
        np.add(result[k], difference, out=result[k + 1])
    result[1::2] *= np.sign(x)
    return result
