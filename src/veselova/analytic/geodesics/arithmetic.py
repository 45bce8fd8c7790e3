"""Doubles, and constants that follow their spacing; ``closed.geodesic_digits`` has those of Arb."""

from math import asinh, atan2, cos, exp, log, pi, sin, sqrt
from typing import Any

import numpy as np

from veselova.analytic.kernel.arithmetic import EPSILON
from veselova.analytic.kernel.compiler import jit

__all__ = [
    "EPSILON",
    "FARTHEST",
    "LAST_STEP",
    "LEAST",
    "LEAST_K2",
    "LONGEST",
    "LOST",
    "NEAR_UMBILIC",
    "NODES",
    "NUDGE",
    "ORDER",
    "PANEL",
    "ROUND",
    "SMALLEST",
    "WEIGHTS",
    "asinh",
    "atan2",
    "convolve",
    "cos",
    "enclose",
    "exp",
    "jit",
    "log",
    "midpoint",
    "number",
    "pi",
    "sin",
    "size",
    "sqrt",
    "whole",
    "widen",
    "zeros",
    "zeros2",
]

#: Derived: nodes and length of a panel: the rest falls like ϱ^(−2·12), ϱ = 5.2.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PANEL = 1.25

#: Derived: squares of these are far below ε, and products of all are doubles. LEAST_K2: of spheres.
NUDGE, ROUND, LEAST_K2, LEAST = 1e-18, 1e-60, 1e-30, 1e-70

#: Derived: largest |log z/(1−z)|, of LEAST; relative step from which Newton's next one is below
#: rounding.
FARTHEST, LAST_STEP = 161.0, 3e-9

#: Calibrated: cancellation in m₁₂, in ε of b, and D/K at an end, from which Jacobi's equation is
#: integrated in place of its closed form.
LOST, NEAR_UMBILIC = 300.0, 0.002

#: Budget: the largest ratio of semiaxes up to which Jacobi's equation is integrated, in about a
#: millisecond.
LONGEST = 1e6

#: Method: order of Taylor series, and what they leave out.
ORDER, SMALLEST = 24, 1e-17


@jit
def number(x: Any) -> Any:
    """Return a number of the arithmetic."""
    return float(x)


@jit
def size(x: Any) -> Any:
    """Return |x| as a double."""
    return abs(x)


@jit
def whole(x: Any) -> Any:
    """Return the nearest integer."""
    return round(x)


@jit
def zeros(n: Any) -> Any:
    """Return zeros of shape (n,)."""
    return np.zeros(n)


@jit
def zeros2(n: Any, m: Any) -> Any:
    """Return zeros of shape (n, m)."""
    return np.zeros((n, m))


@jit
def midpoint(x: Any) -> Any:
    """Return the midpoint of a number, which a double is."""
    return x


@jit
def widen(x: Any, terms: Any) -> Any:
    """Return a sum of panels with what they leave out of the terms, which no double has."""
    return x


@jit
def enclose(shape: Any, ends: Any, kind: Any, z: Any, rest: Any) -> Any:
    """Return z and 1−z of a zero of Θ as proven balls, which doubles are not."""
    return z, rest


@jit
def convolve(a: Any, b: Any, n: Any) -> Any:
    """Return Σ a_j b_{n−j}, j = 0 … n."""
    total = 0 * a[0]
    for j in range(n + 1):
        total = total + a[j] * b[n - j]
    return total
