"""The states of a motion at many times while they are filled in: by windows (analytic.windows) first, then time by time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.clock import Clock
from veselova.analytic.pieces import Pieces
from veselova.analytic.precision import DOUBLE

__all__ = ["NODES", "Along", "Cells", "Evaluation", "Filling"]

Array = NDArray[np.float64]

#: From phases (N, g) to dt/dτ₁, (N,), and the series, each with first axis N.
Evaluation = Callable[[Array], tuple[Array, tuple[Array, ...]]]

#: Chebyshev points of a window.
NODES = 48

#: A window is resolved when its last coefficients fall below this part of the series' size; or below the second without having
#: fallen to the third of what they were in longer ones: then they are rounding of the evaluation.
_TAIL, _NOISE_TAIL, _STALLED = 4e-15, 1e-12, 0.25

#: Times evaluated one by one at once. It bounds the memory.
_TIMES = 32768

#: What a sum of polynomials rounds to.
_SUM_ROUNDING = 4 * float(np.finfo(float).eps)

#: Chebyshev points of [0, 1], and the matrix from values there to coefficients.
_OFFSETS, _TO_COEFFICIENTS = (np.cos(DOUBLE.nodes(NODES)) + 1) / 2, DOUBLE.cosine_series(np.eye(NODES)).T


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
class Cells:
    """W windows of one length: the mean times u at which they start; ``tails`` (W,) of longer ones there."""

    length: float
    starts: Array
    tails: Array

    def __len__(self) -> int:
        return int(self.starts.size)

    def __getitem__(self, chosen: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Cells:
        return Cells(self.length, self.starts[chosen], self.tails[chosen])

    @classmethod
    def joined(cls, parts: Sequence[Cells]) -> Cells:
        """Return all windows of the parts."""
        return cls(parts[0].length, *(np.concatenate([getattr(part, name) for part in parts]) for name in ("starts", "tails")))

    def halved(self) -> Cells:
        """Return the halves, in their order."""
        length = self.length / 2
        return Cells(length, (self.starts[:, None] + np.array([0.0, length])).ravel(), np.repeat(self.tails, 2))


@dataclass(frozen=True)
class _Trial:
    """W windows in Neumann time: Chebyshev coefficients of dt/dτ₁ (W, NODES) and of the series (W, NODES, C), of size one.

    sizes (C,) of the series · stretch  the windows' Neumann time · before (W,) tails of longer windows
    """

    rates: Array
    series: Array
    sizes: Array
    stretch: float
    before: Array

    @cached_property
    def tails(self) -> Array:
        """Return the largest of the last coefficients, (W,)."""
        of_rates = np.max(np.abs(self.rates[:, -3:]), axis=1) / self.rates[:, 0]
        return np.asarray(np.maximum(of_rates, np.max(np.abs(self.series[:, -3:]), axis=(1, 2))))

    def settled(self, tails: Array) -> NDArray[np.bool_]:
        """Return which windows are resolved, by the tails of anything that was made of them."""
        return (tails <= _TAIL) | ((tails <= _NOISE_TAIL) & (tails > _STALLED * self.before))

    def in_pieces(self, count: int) -> tuple[Pieces, Array]:
        """Return the pieces in time, and their tails or those of the windows, whichever are larger."""
        pieces = Pieces.of(self.rates, self.series, self.stretch, count)
        return pieces, np.maximum(self.tails, pieces.tails)


class Filling:
    """The answer while it is filled. A time's state is one row, of τ₁ and all series."""

    def __init__(self, times: Array, fewest: int, clock: Clock, rates: Array, evaluation: Evaluation) -> None:
        self._times, self._fewest, self._clock, self._rates, self._evaluation = times, fewest, clock, rates, evaluation
        self._tau1, self._error, self._open = np.empty(times.size), np.zeros(times.size), np.ones(times.size, dtype=bool)
        self._shapes: list[tuple[int, ...]] = []
        self._evaluations = 0

    @cached_property
    def _states(self) -> Array:
        return np.empty((self._times.size, 1 + sum(int(np.prod(shape)) for shape in self._shapes)))

    def completed(self) -> Along:
        """Return the answer, with what is still open evaluated time by time."""
        if self._times.size <= _TIMES and np.all(self._open):
            tau1, z = self._clock.tau1(self._times)
            return Along(tau1, self._evaluation(z)[1], self._error, int(tau1.size))
        rest = np.flatnonzero(self._open)
        for k in range(0, rest.size, _TIMES):
            rows = rest[k : k + _TIMES]
            self._tau1[rows], z = self._clock.tau1(self._times[rows])
            _, series = self._evaluation(z)
            self._evaluations += rows.size
            self._shapes = [part.shape[1:] for part in series]
            self._states[rows, 1:] = np.concatenate([part.reshape(rows.size, -1) for part in series], axis=1)
        ends = np.cumsum([1, *(int(np.prod(shape)) for shape in self._shapes)])
        series = tuple(
            self._states[:, a:b].reshape(-1, *shape) for a, b, shape in zip(ends[:-1], ends[1:], self._shapes, strict=True)
        )
        return Along(self._tau1, series, self._error, self._evaluations)

    def trial(self, cells: Cells, z: Array | None = None) -> _Trial:
        """Return windows in Neumann time; z (W, g) are the phases at their starts."""
        z = self._clock.ahead(cells.starts)[1] if z is None else z
        stretch = cells.length / self._clock.mean
        rate, series = self._evaluation((z[:, None, :] + (_OFFSETS * stretch)[:, None] * self._rates).reshape(-1, z.shape[1]))
        self._evaluations += rate.size
        self._shapes = [part.shape[1:] for part in series]
        columns = [part.reshape(len(cells), NODES, -1) for part in series]
        sizes = np.repeat([float(np.max(np.abs(part))) or 1.0 for part in series], [part.shape[2] for part in columns])
        in_tau1 = _TO_COEFFICIENTS @ (np.concatenate(columns, axis=2) / sizes)
        return _Trial(rate.reshape(-1, NODES) @ _TO_COEFFICIENTS.T, in_tau1, sizes, stretch, cells.tails)

    def by_windows(self, cells: Cells, count: int) -> Cells:
        """Fill the times of the windows that are resolved in so many pieces; return the others that hold times enough."""
        ends, places = np.unique(np.concatenate([cells.starts, cells.starts + cells.length]), return_inverse=True)
        ahead, z = self._clock.ahead(ends)
        first, last = np.searchsorted(self._times, ends + ahead)[places].reshape(2, -1)
        held = last - first >= self._fewest
        if not np.any(held):
            return cells[held]
        cells, first, last, places = cells[held], first[held], last[held], places[: len(cells)][held]
        trial = self.trial(cells, z[places])
        pieces, tails = trial.in_pieces(count)
        settled = trial.settled(tails)
        pieces.tables[..., 1:] *= trial.sizes
        pieces.tables[..., 0] *= trial.stretch
        pieces.tables[:, :, 0, 0] += (cells.starts / self._clock.mean)[:, None]
        for w in np.flatnonzero(settled).tolist():
            rows = slice(first[w], last[w])
            since = (self._times[rows] - cells.starts[w]) - ahead[places[w]]
            pieces.fill(w, since, self._states[rows])
            self._tau1[rows] = self._states[rows, 0]
            self._open[rows] = False
            self._error[rows] = 2 * tails[w] + _SUM_ROUNDING
        return Cells(cells.length, cells.starts, tails)[~settled]
