"""Many geodesics, one after the other, where b is one."""

from math import atan2, cos, pi, sin, sqrt
from typing import Any

import numpy as np

from veselova.analytic.kernel.compiler import jit, jit_making

from .arithmetic import LONGEST, NUDGE, size, zeros
from .coordinates import Place, axes, position, unit
from .flow import REDUCED, ROWS, SCALE, follow
from .inverse import inverse

#: Columns of a result: s₁₂, v₁, v₂, m₁₂, M₁₂ and M₂₁, γ, kind.
LENGTH, START, STOP, FIELDS, GAMMA, KIND, COLUMNS = 0, 1, 4, 7, 10, 11, 12


@jit_making
def solve_pairs(shape: Any, starts: Any, stops: Any, found: Any) -> Any:
    """Fill the shortest geodesics (N, 12) between places (N, 4)."""
    squares, states = np.array([shape.A1, shape.A2, shape.A3]), zeros((1, ROWS))
    for i in range(starts.shape[0]):
        one = Place(starts[i, 0], starts[i, 1], starts[i, 2], starts[i, 3])
        two = Place(stops[i, 0], stops[i, 1], stops[i, 2], stops[i, 3])
        path = inverse(shape, one, two)
        fields = path.reduced, path.scale12, path.scale21
        if not path.sure:
            fields = np.nan, np.nan, np.nan
            along = np.array([path.length])
            is_short = shape.a / shape.c <= LONGEST
            if is_short and follow(squares, position(shape, one), path.v1, along, states):
                fields = states[0, REDUCED], states[0, SCALE], states[0, REDUCED + 1]
        found[i, LENGTH], found[i, GAMMA], found[i, KIND] = path.length, path.gamma, path.kind
        for k in range(3):
            found[i, START + k], found[i, STOP + k] = path.v1[k], path.v2[k]
            found[i, FIELDS + k] = fields[k]


@jit
def beside(at: Any) -> Any:
    """Return the place off the middle ellipse, where β and ω have directions."""
    so = at.so if size(at.so) > NUDGE else NUDGE
    return Place(at.sb, max(at.cb, NUDGE), so, at.co)


@jit
def zero_and_right(shape: Any, at: Any) -> Any:
    """Return whether a place is an umbilic, and the unit tangents from and towards which azimuths
    count. At an umbilic they are half of the angle from the middle ellipse, as a geodesic has them
    just after, but for 180°.
    """
    if at.cb > 0 or size(at.so) > 0:
        north, east = axes(shape, beside(at))
        return False, north, east
    k1, k2 = sqrt(shape.K1), sqrt(shape.K2)
    side = -1.0 if at.sb > 0 else 1.0
    x, y, z = unit(-shape.a * at.co * at.sb * k2, 0.0, shape.c * k1)
    return True, (side * x, side * y, side * z), (0 * x, side * at.co, 0 * x)


@jit
def set_starts(shape: Any, places: Any, azimuths: Any, tangents: Any, gammas: Any) -> Any:
    """Fill tangents (N, 3), and γ (N,), of azimuths in degrees at places (N, 4)."""
    for i in range(places.shape[0]):
        at = Place(places[i, 0], places[i, 1], places[i, 2], places[i, 3])
        umbilic, zero, right = zero_and_right(shape, at)
        angle = azimuths[i] * pi / (90 if umbilic else 180)
        cosine, sine = cos(angle), sin(angle)
        X, Y = shape.K2 * at.cb * at.cb, shape.K1 * at.so * at.so
        gammas[i] = X * sine * sine - Y * cosine * cosine
        for k in range(3):
            tangents[i, k] = cosine * zero[k] + sine * right[k]


@jit
def set_azimuths(shape: Any, places: Any, tangents: Any, azimuths: Any) -> Any:
    """Fill degrees (N,) from growing β towards growing ω, at places (N, 4)."""
    for i in range(places.shape[0]):
        at = Place(places[i, 0], places[i, 1], places[i, 2], places[i, 3])
        v = tangents[i]
        umbilic, zero, right = zero_and_right(shape, at)
        x = v[0] * zero[0] + v[1] * zero[1] + v[2] * zero[2]
        y = v[0] * right[0] + v[1] * right[1] + v[2] * right[2]
        azimuths[i] = atan2(y, x) * (90 if umbilic else 180) / pi
