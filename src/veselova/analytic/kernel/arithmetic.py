"""Doubles: functions of them, compiled where numba is installed."""

from __future__ import annotations

from math import atan, cos, exp, log, pi, sin, sqrt
from typing import Any

import numpy as np

from .compiler import jit, jit_sum

__all__ = [
    "EPSILON",
    "NATS",
    "atan",
    "cos",
    "dot",
    "exp",
    "jit",
    "jit_sum",
    "log",
    "pi",
    "sin",
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
