"""Series along a window of Neumann time, as polynomials in physical time on its pieces.

A window's Chebyshev series in τ₁ go over to each of a few equal pieces by constant matrices. There
dt/dτ₁ varies little: t(τ₁) is inverted at Chebyshev points in t, and short series in t follow, as
powers of x ∈ [−1, 1]. Their coefficients fall fast enough (by 5 and more from one to the next) that
powers lose no digit, and a power costs one multiplication.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev, polynomial
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.arithmetic.double_double import exact_sum
from veselova.analytic.numerics.monotone_root import Rows, fourth_order_divisor, increasing_root
from veselova.mechanics.core.budget import checkpoint

__all__ = ["ORDER", "PiecewisePolynomial"]

Array = NDArray[np.float64]

#: Method: coefficients of a piece in time.
ORDER = 20

#: Derived: a Newton step of this size, in half pieces, leaves an error of a quarter of its square
#: at most.
_CONVERGED = 2e-8

#: Budget: times that are placed in their pieces at once, and of which powers are formed at once:
#: they stay in the cache. No power of two: rows so far apart take turns in the same places of a
#: cache.
_PLACED = 64000
_TIMES = 4000


#: Chebyshev points of [−1, 1], from 1 downwards, and the matrix from values there to coefficients.
_X = np.cos(DOUBLE.nodes(ORDER))
_TO_COEFFICIENTS = DOUBLE.cosine_series(np.eye(ORDER)).T
#: Integrals of T_0 … T_{ORDER−1} over [−1, 1].
_INTEGRALS = np.array([2 / (1 - k * k) if k % 2 == 0 else 0.0 for k in range(ORDER)])
#: x^0 … x^ORDER at the points; and the integrals of those before the last in Taylor series there:
#: the coefficients of x, x², x³.
_AT_POINTS = polynomial.polyvander(_X, ORDER).T
_SLOPES = [polynomial.polyval(_X, polynomial.polyder(np.eye(ORDER), m)) for m in (1, 2)]
_EXPANDED = np.hstack([_AT_POINTS[:-1], _SLOPES[0] / 2, _SLOPES[1] / 6])
#: From Chebyshev coefficients to those of powers.
_TO_POWERS = np.stack(
    [np.pad(chebyshev.cheb2poly(row), (0, ORDER))[:ORDER] for row in np.eye(ORDER)], axis=1
)


@lru_cache(maxsize=16)
def _restriction(nodes: int, count: int) -> Array:
    """Return the matrix from Chebyshev coefficients on [0, 1] to those on each of ``count`` pieces,
    (count, ORDER, nodes).
    """
    places = (np.arange(count)[:, None] + (_X + 1) / 2) / count
    return np.asarray(_TO_COEFFICIENTS @ np.moveaxis(_polynomials(2 * places - 1, nodes), 0, -1))


@dataclass(frozen=True)
class PiecewisePolynomial:
    """The pieces of W windows.

    - borders: (W, count+1) in time since the window's start
    - tables: (W, count, C, ORDER) of powers; the first row is the part of the window's Neumann
      time that has passed
    - tails: (W,) the largest of the last Chebyshev coefficients, against their sizes
    """

    borders: Array
    tables: Array
    tails: Array

    @classmethod
    def of(
        cls, rates: Array, series: Array, sizes: Array, length_tau1: float, count: int
    ) -> PiecewisePolynomial:
        """Return the pieces from Chebyshev coefficients over windows: of dt/dτ₁ (W, nodes), of
        series (W, nodes, columns).

        sizes (columns,) of the series · stretch: how long a window is in τ₁
        """
        windows, nodes = rates.shape
        restriction = _restriction(nodes, count)
        half = length_tau1 / (2 * count)
        pace = np.transpose(restriction @ rates.T, (1, 2, 0)).reshape(ORDER, -1) * half
        durations = _INTEGRALS @ pace
        slope = _TO_POWERS @ pace
        elapsed = polynomial.polyint(slope, lbnd=-1)
        # Axes: the pieces of all windows, the points in time, the columns.
        target = durations[:, None] * ((_X + 1) / 2)

        def excess(x: Array, rows: Rows) -> tuple[Array, Array]:
            value, rise = (
                polynomial.polyval(x, c[:, rows, None], tensor=False) for c in (elapsed, slope)
            )
            return np.asarray(value - target[rows]), np.asarray(rise)

        one = np.ones_like(target)
        value = elapsed.T @ _AT_POINTS - target
        # from the same points everywhere a first step is made by products of matrices
        with np.errstate(all="ignore"):
            guess = np.clip(
                _X - value / fourth_order_divisor(value, *np.split(slope.T @ _EXPANDED, 3, axis=1)),
                -1,
                1,
            )
        x = increasing_root(excess, guess, -one, one, _CONVERGED)
        in_tau1 = (restriction.reshape(-1, nodes) @ series).reshape(windows * count, ORDER, -1)
        # Points first: the matrices that are the same for all pieces take them at once.
        at_times = np.empty((ORDER, windows * count, 1 + in_tau1.shape[2]))
        at_times[:, :, 0] = ((np.tile(np.arange(count), windows)[:, None] + (x + 1) / 2) / count).T
        np.matmul(
            np.moveaxis(_polynomials(x, ORDER), 0, -1),
            in_tau1,
            out=np.moveaxis(at_times, 0, 1)[:, :, 1:],
        )
        coefficients = _TO_COEFFICIENTS @ at_times.reshape(ORDER, -1)
        borders = np.zeros((windows, count + 1))
        np.cumsum(durations.reshape(windows, count), axis=1, out=borders[:, 1:])
        last = np.max(np.abs(coefficients[-3:]).reshape(3, windows, count, -1), axis=(0, 2))
        tails = np.max(last / np.append(1.0, sizes), axis=1)
        tables = (coefficients.T @ _TO_POWERS.T).reshape(windows, count, -1, ORDER)
        return cls(borders, np.asarray(tables), tails)

    def __getitem__(self, chosen: slice | NDArray[np.bool_]) -> PiecewisePolynomial:
        if isinstance(chosen, np.ndarray) and chosen.all():
            return self
        return PiecewisePolynomial(self.borders[chosen], self.tables[chosen], self.tails[chosen])

    def fill(
        self,
        times: Array,
        starts: Array,
        periodic_part: Array,
        out: Array,
        remainders: Array | None = None,
    ) -> None:
        """Fill ``out`` (C, N) with the series at increasing times in windows that adjoin, and start
        at starts + periodic_part, (W,) both.

        Starts of few bits are taken from the times exactly; only then comes what has all its
        digits, remainders of times too.
        """
        begins = np.repeat(starts, self.borders.shape[1] - 1)
        offsets = (periodic_part[:, None] + self.borders[:, :-1]).ravel()
        scales = (2 / np.diff(self.borders)).ravel()
        ends = np.append(_first_from(times, begins[1:], offsets[1:]), times.size)
        for first in range(0, times.size, _PLACED):
            checkpoint()
            block = times[first : first + _PLACED]
            counts = np.diff(np.clip(ends - first, 0, block.size), prepend=0)
            x = block - np.repeat(begins, counts)
            x -= np.repeat(offsets, counts)
            if remainders is not None:
                x += remainders[first : first + _PLACED]
            x *= np.repeat(scales, counts)
            x -= 1
            self._sum(x, counts, out[:, first : first + block.size])

    def _sum(self, x: Array, counts: NDArray[np.intp], out: Array) -> None:
        """Fill ``out`` (C, N) with the sums of powers at x (N,), so many of them in each piece."""
        tables = self.tables.reshape(-1, *self.tables.shape[2:])
        ends = np.cumsum(counts)
        cuts = np.unique(np.concatenate([[0], ends, np.arange(0, x.size, _TIMES)]))
        polynomials = np.searchsorted(ends, cuts[:-1], side="right").tolist()
        room = np.empty((ORDER, min(x.size, _TIMES)))
        for piece, begin, end in zip(
            polynomials, cuts[:-1].tolist(), cuts[1:].tolist(), strict=True
        ):
            if begin % _TIMES == 0:
                base = begin
                powers = _powers(x[begin : begin + _TIMES], room)
            np.matmul(tables[piece], powers[:, begin - base : end - base], out=out[:, begin:end])


def _first_from(times: Array, begins: Array, offsets: Array) -> NDArray[np.intp]:
    """Return the first of increasing times that is not before each begin + offset, as if these were
    not rounded.
    """
    sums, rest = exact_sum(begins, offsets)
    return np.maximum.accumulate(
        np.searchsorted(times, np.where(rest > 0, np.nextafter(sums, np.inf), sums))
    )


def _powers(x: Array, room: Array) -> Array:
    """Return x^0 … x^{ORDER−1}, the order first, in the room for as many or more."""
    result = room[:, : x.size]
    result[0], result[1] = 1.0, x
    for k in range(2, ORDER):
        np.multiply(result[k - 1], x, out=result[k])
    return result


def _polynomials(x: Array, count: int) -> Array:
    """Return T_0 … T_{count−1} at points of [−1, 1], the order first.

    Near 1 differences T_k − T_{k−1} keep the digits that the recurrence loses there (Reinsch); T_k
    is even or odd.
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
