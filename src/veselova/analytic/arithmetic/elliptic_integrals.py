"""Two elliptic integrals in double precision, entrywise: K by the arithmetic–geometric mean, and
Carlson's R_F by duplication (DLMF 19.8.5, 19.36.1). SciPy has both, and takes half of the time of a
first answer to load.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from veselova.tunings import FEW_MODULI

__all__ = ["carlson_rf", "quarter_period"]

#: Derived: relative distance of both means from which one more step leaves its square, below a
#: rounding.
NEAR_MEAN = 1e-8

#: Derived: relative distances of the arguments of R_F from their mean from which its series of the
#: eighth order leaves 1e-17.
NEAR = 7e-3

#: Derived: steps from any doubles: exponents are halved ten times, and digits doubled five times;
#: arguments come nearer by a factor of four.
MOST_MEANS = 20
MOST_DUPLICATIONS = 20


def quarter_period(complement: Any) -> Any:
    """Return K(k) for k'² = ``complement`` > 0, entrywise, to 2 roundings; infinite for 0."""
    if not isinstance(complement, np.ndarray):
        return _quarter(float(complement))
    if complement.size <= FEW_MODULI:
        found = [_quarter(x) for x in complement.ravel().tolist()]
        return np.array(found).reshape(complement.shape)
    a = np.ones(complement.shape)
    b = np.sqrt(complement)
    for _ in range(MOST_MEANS):
        remaining = np.abs(a - b) > NEAR_MEAN * a
        if not remaining.any():
            break
        # no entry depends on how many steps others take
        a, b = np.where(remaining, (a + b) / 2, a), np.where(remaining, np.sqrt(a * b), b)
    with np.errstate(divide="ignore"):
        return np.where(complement > 0, math.pi / (a + b), np.inf)


def _quarter(complement: float) -> float:
    if not complement > 0:
        return math.inf if complement == 0 else math.nan
    a = 1.0
    b = math.sqrt(complement)
    while abs(a - b) > NEAR_MEAN * a:
        a, b = (a + b) / 2, math.sqrt(a * b)
    return math.pi / (a + b)


def carlson_rf(x: Any, y: Any, z: Any) -> Any:
    """Return R_F(x, y, z) for numbers that are not negative, one of them zero at most, entrywise,
    to 4 roundings.
    """
    if not any(isinstance(value, np.ndarray) for value in (x, y, z)):
        return _rf(float(x), float(y), float(z))
    x, y, z = (np.array(value) for value in np.broadcast_arrays(x, y, z))
    for _ in range(MOST_DUPLICATIONS):
        mean = (x + y + z) / 3
        spread = np.maximum(np.maximum(np.abs(x - mean), np.abs(y - mean)), np.abs(z - mean))
        remaining = spread > NEAR * mean
        if not remaining.any():
            break
        rx, ry, rz = np.sqrt(x), np.sqrt(y), np.sqrt(z)
        shift = rx * ry + rx * rz + ry * rz
        # the values at a quarter of the arguments are twice as large: factors of four keep them
        x, y, z = (np.where(remaining, (u + shift) / 4, u) for u in (x, y, z))
    return _series(x, y, z, np.sqrt)


def _rf(x: float, y: float, z: float) -> Any:
    for _ in range(MOST_DUPLICATIONS):
        mean = (x + y + z) / 3
        if max(abs(x - mean), abs(y - mean), abs(z - mean)) <= NEAR * mean:
            break
        rx, ry, rz = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        shift = rx * ry + rx * rz + ry * rz
        x, y, z = (x + shift) / 4, (y + shift) / 4, (z + shift) / 4
    return _series(x, y, z, math.sqrt)


def _series(x: Any, y: Any, z: Any, root: Any) -> Any:
    """Return R_F of nearly equal arguments, by its series about their mean."""
    mean = (x + y + z) / 3
    X, Y = 1 - x / mean, 1 - y / mean
    Z = -X - Y
    e2, e3 = X * Y - Z * Z, X * Y * Z
    square = e2 * e2
    terms = -e2 / 10 + e3 / 14 + square / 24 - 3 * e2 * e3 / 44
    terms = terms - 5 * square * e2 / 208 + 3 * e3 * e3 / 104 + square * e3 / 16
    return (1 + terms) / root(mean)
