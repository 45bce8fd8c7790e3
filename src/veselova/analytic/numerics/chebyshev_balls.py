"""Chebyshev series in balls, several at once at many points.

Sums go over even and odd terms apart: T_2j(x) = T_j(y) with y = 2x²−1, and T_2j+1(x) = x (2T_j(y) −
2T_{j−1}(y) + … ± T_0), so half as many polynomials are formed, by T_{j+k} = 2T_jT_k − T_{j−k}.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.mechanics.core.budget import checkpoint

__all__ = ["ChebyshevSeriesInBalls"]

#: Budget: points at once: their polynomials stay in the cache.
_POINTS = 1000

#: Derived: digits that recurrence loses in T_m: half a bit for every doubling of m, twice.
_RECURRENCE_DIGITS = 6


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

    def __call__(self, interval: int, x: Values) -> Values:
        """Return the sums of an interval at points (N,), one at least, shape (N, C)."""
        return np.concatenate(
            [self._at(interval, x[first : first + _POINTS]) for first in range(0, len(x), _POINTS)]
        )

    def _at(self, interval: int, x: Values) -> Values:
        checkpoint()
        xp = self._xp
        coefficients = self._coefficients[:, interval]
        y = 2 * x * x - 1
        series = coefficients.shape[1] // 2
        with xp.at(xp.digits + _RECURRENCE_DIGITS):
            table = np.stack(_polynomials(1 + 0 * y, y, len(coefficients)), axis=1)
        sums = xp.product(table, coefficients)
        return np.asarray(sums[:, :series] + x[:, None] * sums[:, series:])


def _polynomials(one: Values, y: Values, count: int) -> list[Values]:
    """Return T_0(y) … ."""
    polynomials = [one, y]
    doubled = [2 * one, 2 * y]
    for m in range(2, count):
        polynomials.append(doubled[m // 2] * polynomials[m - m // 2] - polynomials[m % 2])
        if 2 * m <= count:
            doubled.append(2 * polynomials[m])
    return polynomials[:count]
