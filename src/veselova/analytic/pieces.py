"""Series along a window of Neumann time, as polynomials in physical time on its pieces.

A window's Chebyshev series in τ₁ go over to each of a few equal pieces by constant matrices. There dt/dτ₁ varies little: t(τ₁) is
inverted at Chebyshev points in t, and short series in t follow, as powers of x ∈ [−1, 1]. Their coefficients fall fast enough
(by 5 and more from one to the next) that powers lose no digit, and a power costs one multiplication.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev, polynomial
from numpy.typing import NDArray

from veselova.analytic.increasing import Rows, increasing_root
from veselova.analytic.precision import DOUBLE

__all__ = ["ORDER", "Pieces"]

Array = NDArray[np.float64]

#: Coefficients of a piece in time.
ORDER = 20

#: A Newton step of this size, in half pieces, leaves an error of its square.
_SETTLED = 1e-9

#: Times whose powers are formed at once: they stay in the cache.
_TIMES = 4096


#: Chebyshev points of [−1, 1], from 1 downwards, and the matrix from values there to coefficients.
_X, _TO_COEFFICIENTS = np.cos(DOUBLE.nodes(ORDER)), DOUBLE.cosine_series(np.eye(ORDER)).T
#: Integrals of T_0 … T_{ORDER−1} over [−1, 1], and x^0 … x^ORDER at the points.
_INTEGRALS = np.array([2 / (1 - k * k) if k % 2 == 0 else 0.0 for k in range(ORDER)])
_AT_POINTS = polynomial.polyvander(_X, ORDER).T
#: From Chebyshev coefficients to those of powers.
_TO_POWERS = np.stack([np.pad(chebyshev.cheb2poly(row), (0, ORDER))[:ORDER] for row in np.eye(ORDER)], axis=1)


@lru_cache(maxsize=16)
def _restriction(nodes: int, count: int) -> Array:
    """Return the matrix from Chebyshev coefficients on [0, 1] to those on each of ``count`` pieces, (count, ORDER, nodes)."""
    places = (np.arange(count)[:, None] + (_X + 1) / 2) / count
    return np.asarray(_TO_COEFFICIENTS @ np.moveaxis(_polynomials(2 * places - 1, nodes), 0, -1))


@dataclass(frozen=True)
class Pieces:
    """The pieces of W windows.

    borders (W, count+1) in time since the window's start · tables (W, count, C, ORDER) of powers; the first row is the part of
    the window's Neumann time that has passed · tails (W,) the largest of the last Chebyshev coefficients
    """

    borders: Array
    tables: Array
    tails: Array

    @classmethod
    def of(cls, rates: Array, series: Array, stretch: float, count: int) -> Pieces:
        """Return the pieces from Chebyshev coefficients over windows: of dt/dτ₁ (W, nodes), of series (W, nodes, columns)."""
        windows, nodes = rates.shape
        restriction, half = _restriction(nodes, count), stretch / (2 * count)
        pace = np.transpose(restriction @ rates.T, (1, 2, 0)).reshape(ORDER, -1) * half
        durations, slope = _INTEGRALS @ pace, _TO_POWERS @ pace
        elapsed = polynomial.polyint(slope, lbnd=-1)
        # Axes: the pieces of all windows, the points in time, the columns.
        target = durations[:, None] * ((_X + 1) / 2)

        def excess(x: Array, rows: Rows) -> tuple[Array, Array]:
            value, rise = (polynomial.polyval(x, c[:, rows, None], tensor=False) for c in (elapsed, slope))
            return np.asarray(value - target[rows]), np.asarray(rise)

        one = np.ones_like(target)
        with np.errstate(all="ignore"):  # a first step of Newton's from the same points everywhere is a product of matrices
            guess = np.clip(_X - (elapsed.T @ _AT_POINTS - target) / (slope.T @ _AT_POINTS[:-1]), -1, 1)
        x = increasing_root(excess, guess, -one, one, _SETTLED)
        in_tau1 = (restriction.reshape(-1, nodes) @ series).reshape(windows * count, ORDER, -1)
        # Points first: the matrices that are the same for all pieces take them at once.
        at_times = np.empty((ORDER, windows * count, 1 + in_tau1.shape[2]))
        at_times[:, :, 0] = ((np.tile(np.arange(count), windows)[:, None] + (x + 1) / 2) / count).T
        np.matmul(np.moveaxis(_polynomials(x, ORDER), 0, -1), in_tau1, out=np.moveaxis(at_times, 0, 1)[:, :, 1:])
        coefficients = _TO_COEFFICIENTS @ at_times.reshape(ORDER, -1)
        borders = np.zeros((windows, count + 1))
        np.cumsum(durations.reshape(windows, count), axis=1, out=borders[:, 1:])
        tails = np.max(np.abs(coefficients[-3:]).reshape(3, windows, -1), axis=(0, 2))
        tables = (coefficients.T @ _TO_POWERS.T).reshape(windows, count, -1, ORDER)
        return cls(borders, np.asarray(tables), tails)

    def __getitem__(self, chosen: NDArray[np.bool_]) -> Pieces:
        return self if np.all(chosen) else Pieces(self.borders[chosen], self.tables[chosen], self.tails[chosen])

    def fill(self, window: int, since: Array, out: Array) -> None:
        """Fill ``out`` (C, N) with the series at increasing times since the start of a window."""
        borders, scale = self.borders[window], 2 / np.diff(self.borders[window])
        for first in range(0, since.size, _TIMES):
            block = since[first : first + _TIMES]
            ends = [0, *np.searchsorted(block, borders[1:-1]).tolist(), block.size]
            counts = np.diff(ends)
            x = block - np.repeat(borders[:-1], counts)
            x *= np.repeat(scale, counts)
            x -= 1
            powers = _powers(x)
            for table, begin, end in zip(self.tables[window], ends[:-1], ends[1:], strict=True):
                if begin < end:
                    np.matmul(table, powers[:, begin:end], out=out[:, first + begin : first + end])


def _powers(x: Array) -> Array:
    """Return x^0 … x^{ORDER−1}, the order first."""
    result = np.empty((ORDER, x.size))
    result[0], result[1] = 1.0, x
    for k in range(2, ORDER):
        np.multiply(result[k - 1], x, out=result[k])
    return result


def _polynomials(x: Array, count: int) -> Array:
    """Return T_0 … T_{count−1} at points of [−1, 1], the order first.

    Near 1 differences T_k − T_{k−1} keep the digits that the recurrence loses there (Reinsch); T_k is even or odd.
    """
    result = np.empty((count, *x.shape))
    size = np.abs(x)
    difference = size - 1
    twice = 2 * difference
    result[0], result[1] = 1.0, size
    for k in range(1, count - 1):
        difference = difference + twice * result[k]
        result[k + 1] = result[k] + difference
    result[1::2] *= np.sign(x)
    return result
