"""Doubles: functions of them, compiled where numba is installed, and linear systems."""

from __future__ import annotations

from math import atan, cos, exp, log, pi, sin, sqrt
from typing import Any

import numpy as np

from .compiler import jit, jit_making, jit_sum

__all__ = [
    "EPSILON",
    "NATS",
    "assign",
    "atan",
    "cos",
    "dot",
    "dots",
    "eliminate",
    "exp",
    "inverse",
    "is_finite",
    "jit",
    "jit_making",
    "jit_sum",
    "largest",
    "log",
    "pi",
    "sin",
    "solve",
    "sqrt",
    "turns",
]

#: Derived: the spacing of doubles at one.
EPSILON = 2.0**-52

#: Derived: series are cut where their coefficients have fallen by e^−NATS: ε, and a little more.
NATS = 37.5


@jit
def turns(high: Any, low: Any, t: Any) -> Any:
    """Return (high + low)·t modulo two, to the last bit of a cycle: Dekker's product of doubles."""
    product = high * t
    a, b = 134217729.0 * high, 134217729.0 * t
    a, b = a - (a - high), b - (b - t)
    c, d = high - a, t - b
    error = c * d - (((product - a * b) - c * b) - a * d)
    return (product - 2 * np.rint(product / 2)) + (error + low * t)


@jit_sum
def dot(a: Any, b: Any, count: Any) -> Any:
    """Return Σ_{i<count} a_i b_i, in any order."""
    total = 0.0
    for i in range(count):
        total += a[i] * b[i]
    return total


@jit_sum
def dots(a: Any, b: Any, c: Any, d: Any, count: Any) -> Any:
    """Return Σ_{i<count} a_i b_i and Σ c_i d_i."""
    first, second = 0.0, 0.0
    for i in range(count):
        first += a[i] * b[i]
        second += c[i] * d[i]
    return first, second


@jit
def assign(values: Any, to: Any) -> Any:
    """Fill an array with the values of another one."""
    for i in range(values.size):
        to[i] = values[i]


@jit
def largest(values: Any) -> Any:
    """Return the largest |x| of values (n,)."""
    most = 0.0
    for x in values:
        most = max(most, abs(x))
    return most


@jit
def is_finite(values: Any) -> Any:
    """Return whether all numbers (n,) are finite."""
    finite = True
    for x in values:
        finite = finite and abs(x) < np.inf
    return finite


@jit
def eliminate(M: Any, v: Any) -> Any:
    """Bring M (n, n) to upper triangular form with v (n,) beside it; return its determinant."""
    n = v.size
    result = 1.0
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[p, k]):
                p = i
        if p != k:
            result = -result
            for j in range(n):
                M[k, j], M[p, j] = M[p, j], M[k, j]
            v[k], v[p] = v[p], v[k]
        result = result * M[k, k]
        if M[k, k] == 0:
            return result
        for i in range(k + 1, n):
            f = M[i, k] / M[k, k]
            for j in range(k + 1, n):
                M[i, j] = M[i, j] - f * M[k, j]
            v[i] = v[i] - f * v[k]
    return result


@jit
def solve(M: Any, v: Any, x: Any) -> Any:
    """Fill x of Mx = v; M and v are used up."""
    eliminate(M, v)
    n = v.size
    for k in range(n - 1, -1, -1):
        t = v[k]
        for j in range(k + 1, n):
            t = t - M[k, j] * x[j]
        x[k] = t / M[k, k]


@jit
def inverse(M: Any, work: Any, v: Any, x: Any, result: Any) -> Any:
    """Fill the inverse of M (n, n); ``work`` (n, n), v and x (n,) are room."""
    n = v.size
    for c in range(n):
        for i in range(n):
            v[i] = 1.0 if i == c else 0.0
            assign(M[i], work[i])
        solve(work, v, x)
        for i in range(n):
            result[i, c] = x[i]
