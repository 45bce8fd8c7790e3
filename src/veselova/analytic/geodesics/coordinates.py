"""Ellipsoidal coordinates β, ω by their sines and cosines, cos β ≥ 0, where b is one.

x = a cos ω √((K₁+X)/K),  y = cos β sin ω,  z = c sin β √((K₂+Y)/K),   X = K₂cos²β, Y = K₁sin²ω
"""

from math import sqrt
from typing import Any, NamedTuple

from veselova.analytic.kernel.compiler import jit


class Place(NamedTuple):
    """Sines and cosines of β and ω."""

    sb: Any
    cb: Any
    so: Any
    co: Any


@jit
def position(shape: Any, at: Any) -> Any:
    """Return x, y, z."""
    K = shape.K1 + shape.K2
    x = shape.a * at.co * sqrt((shape.K1 + shape.K2 * at.cb * at.cb) / K)
    z = shape.c * at.sb * sqrt((shape.K2 + shape.K1 * at.so * at.so) / K)
    return x, at.cb * at.so, z


@jit
def unit(x: Any, y: Any, z: Any) -> Any:
    """Return the vector in unit length."""
    norm = sqrt(x * x + y * y + z * z)
    return x / norm, y / norm, z / norm


@jit
def axes(shape: Any, at: Any) -> Any:
    """Return unit vectors towards growing β and growing ω, which no umbilic has."""
    K = sqrt(shape.K1 + shape.K2)
    first = sqrt(shape.K1 + shape.K2 * at.cb * at.cb)
    second = sqrt(shape.K2 + shape.K1 * at.so * at.so)
    north = unit(
        -shape.a * at.co * at.sb * (shape.K2 * at.cb / first) / K,
        -at.sb * at.so,
        shape.c * at.cb * second / K,
    )
    east = unit(
        -shape.a * at.so * first / K,
        at.cb * at.co,
        shape.c * at.sb * at.co * (shape.K1 * at.so / second) / K,
    )
    return north, east
