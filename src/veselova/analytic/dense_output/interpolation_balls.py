"""A motion at many times in balls, from few: Chebyshev series of time on windows of one length.

The series pass through midpoints alone. What the values at the nodes leave open enters times the
Lebesgue constant of the nodes, by which interpolation magnifies at most; what a series leaves out
follows from its last coefficients, so no window is certified.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Values
from veselova.analytic.numerics.chebyshev_balls import ChebyshevSeriesInBalls
from veselova.analytic.numerics.chebyshev_decay import MORE, SAMPLE, are_resolved, estimate_terms
from veselova.mechanics.core.budget import checkpoint
from veselova.tunings import BALL_INTERPOLANT_NODE, BALL_INTERPOLANT_TERM, BALL_INTERPOLATED_TIMES

__all__ = ["WindowsInBalls"]

Array = NDArray[np.float64]

#: Method: windows looked at for that.
_SAMPLED = 40

#: Calibrated: nodes taken over those expected, at so many working digits: series fall more slowly
#: than they begin, so it grows with the logarithm of the digits, and is below one at fewer than 32.
#: Of 330 random motions with n = 3 … 5 and 30 … 100 digits, 8 needed more, 1.22 times those
#: expected at most.
_SPARE = 1.08
_SPARE_DIGITS = 59
_SPARE_GROWTH = 0.13


@dataclass(frozen=True)
class WindowsInBalls:
    """``count`` windows from ``first`` on, each 2·half long with so many Chebyshev points: t =
    centre − half·cos θ.
    """

    arithmetic: Any
    first: Any
    half: Any
    count: int
    nodes: int

    @classmethod
    def worth_while(
        cls, times: Values, cycles: float, sampled: Callable[[Array], Array], arithmetic: Any
    ) -> WindowsInBalls | None:
        """Return the windows by which increasing times (N,), over so many cycles of the fastest
        phase, cost least; None without.

        ``sampled``: the motion in double precision at increasing times, columns (N, K) of size one.
        """
        if len(times) < BALL_INTERPOLATED_TIMES:
            return None
        xp = arithmetic
        first, last = (float(x) for x in (times[0], times[-1]))
        spare = _SPARE + _SPARE_GROWTH * math.log(xp.digits / _SPARE_DIGITS)
        choices = {}
        for length in (2.0, 1.0, 0.5, 0.25):
            count = max(1, math.ceil(cycles / length))
            nodes = math.ceil(
                spare * estimate_terms(_samples(first, last, count, sampled), xp.digits)
            )
            at_times = len(times) * nodes * BALL_INTERPOLANT_TERM
            choices[at_times + count * nodes * BALL_INTERPOLANT_NODE] = count, nodes
        cost = min(choices)
        if not cost < len(times):
            return None
        count, nodes = choices[cost]
        return cls(xp, times[0], (times[-1] - times[0]) / (2 * count), count, nodes)

    def cost_at(self, times: int) -> float:
        """Return what so many times take once the nodes are known, in motions at a time."""
        return times * self.nodes * BALL_INTERPOLANT_TERM

    def finer(self) -> WindowsInBalls:
        """Return the windows with more nodes."""
        return replace(self, nodes=math.ceil(MORE * self.nodes))

    @cached_property
    def _centres(self) -> Values:
        return np.asarray(self.first + self.half * (2 * np.arange(self.count) + 1))

    @cached_property
    def times(self) -> Values:
        """Return the nodes, exact numbers, shape (count·nodes,), increasing."""
        xp = self.arithmetic
        return np.asarray(
            xp.midpoints(self._centres[:, None] - self.half * xp.cos(xp.nodes(self.nodes))).ravel()
        )

    def at(self, times: Values, values: Values) -> Values | None:
        """Return a motion at times (N,) from its values at the nodes, (count·nodes, K); None where
        it is not resolved.
        """
        xp = self.arithmetic
        columns = values.shape[1]
        result = np.empty((len(times), columns), dtype=object)
        table = np.moveaxis(values.reshape(self.count, self.nodes, columns), 1, 2).reshape(
            -1, self.nodes
        )
        middle = xp.midpoints(table)
        open_ = np.max(xp.upper_bound(table - middle), axis=1)
        series = xp.cosine_series(middle)
        if not are_resolved(series, open_, np.max(xp.upper_bound(middle), axis=1), xp):
            return None
        # Lebesgue's constant of n Chebyshev points is at most 1 + (2/π) log n.
        slack = (1 + 2 / math.pi * math.log(self.nodes)) * open_ + xp.estimate_tail(series)
        sums = ChebyshevSeriesInBalls(series.reshape(self.count, columns, -1), xp)
        slack = slack.reshape(self.count, columns)
        for w, rows in self._rows(times):
            checkpoint("interpolation", w, self.count)
            x = (self._centres[w] - times[rows]) / self.half
            result[rows] = xp.add_error(sums(w, x), slack[w])
        return result

    def _rows(self, times: Values) -> Iterator[tuple[int, slice]]:
        """Return the windows that hold times, and which."""
        places = np.clip(
            np.floor(((times - self.first) / (2 * self.half)).astype(float)), 0, self.count - 1
        )
        borders = np.searchsorted(places, np.arange(self.count + 1)).tolist()
        for w, (first, last) in enumerate(pairwise(borders)):
            if first < last:
                yield w, slice(first, last)


def _samples(first: float, last: float, count: int, sampled: Callable[[Array], Array]) -> Array:
    """Return values (…, SAMPLE) of a motion at the nodes of some of the windows."""
    half = (last - first) / (2 * count)
    chosen = np.unique(np.linspace(0, count - 1, _SAMPLED).astype(np.int64))
    times = first + half * (2 * chosen[:, None] + 1) - half * np.cos(DOUBLE.nodes(SAMPLE))
    return np.moveaxis(sampled(times.ravel()).reshape(len(chosen), SAMPLE, -1), 1, 2)
