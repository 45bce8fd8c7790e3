"""Doubles, and constants that follow their spacing; ``closed.geodesic_digits`` has those of Arb."""

from typing import Any

import numpy as np

from veselova.analytic.kernel.compiler import jit, jit_making

#: Derived: nodes and length of a panel: the rest falls like ϱ^(−2·12), ϱ = 5.2.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PANEL = 1.25

#: Derived: of places, of K₁ and K₂, of those of oblate ones, and of z: far below ε, and products
#: of all are doubles. The umbilics of a sphere are √(LEAST_K1/LEAST_K2) from its poles, far below
#: NUDGE. Rounding grows with the logarithms of the others.
NUDGE, ROUND, LEAST_K1, LEAST_K2, LEAST = 1e-18, 1e-60, 1e-80, 1e-20, 1e-70

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
def size(x: Any) -> Any:
    """Return |x| as a double."""
    return abs(x)


@jit
def whole(x: Any) -> Any:
    """Return the nearest integer."""
    return round(x)


@jit_making
def zeros(shape: Any) -> Any:
    """Return zeros of a shape."""
    return np.zeros(shape)


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
