"""Chebyshev series in balls, several at once at many points.

Sums go over even and odd terms apart: T_2j(x) = T_j(y) with y = 2x²−1, and T_2j+1(x) = x (2T_j(y) −
2T_{j−1}(y) + … ± T_0), so half as many polynomials are formed, by T_{j+k} = 2T_jT_k − T_{j−k}. Up
to a hundred digits that is done in fixed point.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.fixed_point import LARGEST, LEAST, UPWARDS, FixedPoint
from veselova.mechanics.core.budget import checkpoint

__all__ = ["ChebyshevSeriesInBalls"]

Array = NDArray[np.float64]

#: Digits beyond which fixed-point numbers take more time than Arb's.
_MOST_FIXED = 100

#: Points at once: their polynomials stay in the cache.
_POINTS = 1000

#: Digits that recurrence loses in T_m: half a bit for every doubling of m, twice.
_RECURRENCE_DIGITS = 6

#: Digits of fixed-point numbers beyond those of the series.
_SPARE_DIGITS = 4

#: What an error ε of x and of every operation makes of 2x²−1, in ε: 4 and 1, and what is of second
#: order.
_OF_SQUARE = 6

#: Points beyond ±1 by more than the rounding of an end are left to balls; UPWARDS makes up for
#: that.
_ROUNDING = 1e-15


class ChebyshevSeriesInBalls:
    """C series Σ_m c_cm T_m(x), |x| ≤ 1, on each of W intervals, for coefficients (W,
    C, M), balls.
    """

    def __init__(self, coefficients: Values, arithmetic: Any) -> None:
        self._xp = arithmetic
        intervals, series, count = coefficients.shape
        terms = np.moveaxis(coefficients, 2, 0)
        even, odd = np.zeros((2, (count + 1) // 2, intervals, series), dtype=object)
        even[:] = terms[::2]
        above: Any = 0  # d_j = 2c_{2j+1} − d_{j+1}, and half of that for d_0
        for j in reversed(range(count // 2)):
            above = odd[j] = 2 * terms[2 * j + 1] - above
        odd[0] = odd[0] / 2
        self._coefficients = np.concatenate([even, odd], axis=2)
        sizes = (
            np.sum(np.abs(self._coefficients.astype(float)), axis=0)
            .reshape(intervals, 2, series)
            .sum(axis=1)
        )
        fits = arithmetic.digits <= _MOST_FIXED and np.all(
            (sizes == 0) | ((sizes > LEAST) & (sizes < LARGEST))
        )
        self._in_fixed_point = (
            _InFixedPoint(self._coefficients, sizes, arithmetic) if fits else None
        )

    def __call__(self, interval: int, x: Values) -> Values:
        """Return the sums of an interval at points (N,), one at least, shape (N, C)."""
        return np.concatenate(
            [self._at(interval, x[first : first + _POINTS]) for first in range(0, len(x), _POINTS)]
        )

    def _at(self, interval: int, x: Values) -> Values:
        checkpoint()
        spread = max(float(ball.rad()) for ball in x)
        inside = float(np.max(np.abs(x.astype(float)))) + spread <= 1 + _ROUNDING
        if inside and self._in_fixed_point is not None:
            return self._in_fixed_point(interval, x, spread)
        return self._in_balls(interval, x)

    def _in_balls(self, interval: int, x: Values) -> Values:
        xp = self._xp
        coefficients = self._coefficients[:, interval]
        y = 2 * x * x - 1
        series = coefficients.shape[1] // 2
        with xp.at(xp.digits + _RECURRENCE_DIGITS):
            table = np.stack(_polynomials(1 + 0 * y, y, len(coefficients)), axis=1)
        sums = xp.product(table, coefficients)
        return np.asarray(sums[:, :series] + x[:, None] * sums[:, series:])


class _InFixedPoint:
    """The same sums, of coefficients (terms, W, 2C), even and odd; of sizes (W, C), sums of
    absolute values.
    """

    def __init__(self, coefficients: Values, sizes: Array, arithmetic: Any) -> None:
        self._xp, self._bits = (
            arithmetic,
            math.ceil((arithmetic.digits + _SPARE_DIGITS) * math.log2(10)),
        )
        #: Powers of two above the sums.
        self._scales = np.exp2(np.ceil(np.log2(np.where(sizes > 0, sizes, 1.0))) + 1)
        middle = arithmetic.midpoints(coefficients)
        self._weights = FixedPoint.of_numbers(middle / np.tile(self._scales, 2), self._bits)
        # What an error of x and of every operation does, and what the coefficients leave open.
        growth = FixedPoint.growth(len(coefficients), _OF_SQUARE)[:, None, None] + 2
        sensitivity = np.sum(growth * np.abs(coefficients.astype(float)), axis=0)
        both = (*sizes.shape[:1], 2, *sizes.shape[1:])
        self._sensitivity = (
            sensitivity.reshape(both).sum(axis=1) + (2 * len(growth) + 4) * self._scales
        ) * UPWARDS
        self._open = (
            np.sum(arithmetic.upper_bound(coefficients - middle), axis=0).reshape(both).sum(axis=1)
        )

    def __call__(self, interval: int, x: Values, spread: float) -> Values:
        """Return the sums of an interval at points that are open by ``spread`` at most."""
        xp = self._xp
        scales = self._scales[interval]
        weights = self._weights[:, interval]
        series = len(scales)
        slack = (spread + 2.0**-self._bits) * xp.array(self._sensitivity[interval])
        point = FixedPoint.of_numbers(x, self._bits)
        square = point.polynomials(3)[2, :]  # 2x² − 1
        sums = square.polynomials(weights.limbs.shape[1]).weighted_sums(weights)
        total = sums[:, :series] + point[:, None] * sums[:, series:]
        result = np.broadcast_to(xp.zero_ball(self._open[interval] + slack), (len(x), series))
        for part in total.parts():
            result = result + part * scales
        return np.asarray(result)


def _polynomials(one: Values, y: Values, count: int) -> list[Values]:
    """Return T_0(y) … ."""
    polynomials = [one, y]
    doubled = [2 * one, 2 * y]
    for m in range(2, count):
        polynomials.append(doubled[m // 2] * polynomials[m - m // 2] - polynomials[m % 2])
        if 2 * m <= count:
            doubled.append(2 * polynomials[m])
    return polynomials[:count]
