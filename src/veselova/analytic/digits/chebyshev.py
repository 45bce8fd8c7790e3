"""Sums of Chebyshev series in balls, several at once at many points.

Sums go over even and odd terms apart: T_2j(x) = T_j(y) with y = 2x²−1, and T_2j+1(x) = x (2T_j(y) −
2T_{j−1}(y) + … ± T_0), so half as many polynomials are formed, by T_{j+k} = 2T_jT_k − T_{j−k}.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.mechanics.core.budget import checkpoint

__all__ = ["ChebyshevSeries"]

#: Budget: points at once: their polynomials stay in the cache.
_POINTS = 1000

#: Derived: digits that recurrence loses in T_m: half a bit for every doubling of m, twice.
_RECURRENCE_DIGITS = 6


class ChebyshevSeries:
    """C series Σ_m c_cm T_m(x), |x| ≤ 1, of coefficients (C, M), balls."""

    def __init__(self, coefficients: Values, arithmetic: Any) -> None:
        self._xp = arithmetic
        series, count = coefficients.shape
        terms = coefficients.T
        even, odd = np.zeros((2, (count + 1) // 2, series), dtype=object)
        even[:] = terms[::2]
        above: Any = 0  # d_j = 2c_{2j+1} − d_{j+1}, and half of that for d_0
        for j in reversed(range(count // 2)):
            above = odd[j] = 2 * terms[2 * j + 1] - above
        odd[0] = odd[0] / 2
        self._coefficients = np.concatenate([even, odd], axis=1)

    def __call__(self, x: Values) -> Values:
        """Return the sums at points (N,), one at least, shape (N, C)."""
        return np.concatenate(
            [self._at(x[first : first + _POINTS]) for first in range(0, len(x), _POINTS)]
        )

    def _at(self, x: Values) -> Values:
        checkpoint()
        xp, coefficients = self._xp, self._coefficients
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
