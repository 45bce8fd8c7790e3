"""Cosine and Chebyshev series: of values at nodes, their sums, and the integrals of their sums."""

from typing import Any

import numpy as np

from .arithmetic import cos, dot, jit, jit_making, largest, pi


@jit
def set_cosines(table: Any) -> Any:
    """Fill cos(πj/2N), j = 0…4N−1."""
    n = table.size // 4
    for j in range(4 * n):
        table[j] = cos(pi * j / (2 * n))


@jit_making
def set_transform(matrix: Any) -> Any:
    """Fill the (N, N) matrix that takes values at ψ_j = π(2j+1)/2N to the c_m of Σ c_m cos mψ."""
    n = matrix.shape[0]
    table = np.zeros(4 * n)
    set_cosines(table)
    for m in range(n):
        place = m
        for j in range(n):
            matrix[m, j] = table[place] * (2 if m else 1) / n
            place += 2 * m if place + 2 * m < 4 * n else 2 * m - 4 * n


@jit
def transform(matrix: Any, values: Any, series: Any) -> Any:
    """Fill c_m, m = 0…N−1: Σ_m c_m cos mψ has the values (N,) at ψ_j; ``matrix``: set_transform."""
    n = values.size
    for m in range(n):
        series[m] = dot(matrix[m], values, n)


@jit
def chebyshev(series: Any, count: Any, x: Any) -> Any:
    """Return Σ c_m T_m(x) by Clenshaw's recurrence."""
    b1, b2 = 0.0, 0.0
    for m in range(count - 1, 0, -1):
        b1, b2 = series[m] + 2 * x * b1 - b2, b1
    return series[0] + x * b1 - b2


@jit
def integrate(series: Any, half: Any, integral: Any) -> Any:
    """Fill the Chebyshev series (N+1,) of ∫_{−1}^x Σ c_m T_m · half; return it at x = 1."""
    n = series.size
    at_left, at_right = 0.0, 0.0
    for m in range(1, n + 1):
        lower = series[m - 1] * (2 if m == 1 else 1)
        higher = series[m + 1] if m + 1 < n else 0.0
        integral[m] = (lower - higher) / (2 * m) * half
        at_right = at_right + integral[m]
        at_left = at_left + (integral[m] if m % 2 == 0 else -integral[m])
    integral[0] = -at_left
    return at_right - at_left


@jit
def tail(series: Any, count: Any) -> Any:
    """Return the largest of the last three coefficients: what the series is off by, about."""
    return largest(series[max(count - 3, 0) : count])
