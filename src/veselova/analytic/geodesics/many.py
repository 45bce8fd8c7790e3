"""Many geodesics, one after the other, where b is one."""

from typing import Any

import numpy as np

from .arithmetic import LONGEST, NUDGE, atan2, cos, jit, pi, sin, size, sqrt, zeros2
from .coordinates import Place, axes, position, unit
from .flow import REDUCED, ROWS, SCALE, follow
from .inverse import inverse

#: Columns of a result: s₁₂, v₁, v₂, m₁₂, M₁₂ and M₂₁, γ, kind.
LENGTH, START, STOP, FIELDS, GAMMA, KIND, COLUMNS = 0, 1, 4, 7, 10, 11, 12


@jit
def solve_pairs(shape: Any, starts: Any, stops: Any, found: Any) -> Any:
    """Fill the shortest geodesics (N, 12) between places (N, 4)."""
    squares, states = np.array([shape.A1, shape.A2, shape.A3]), zeros2(1, ROWS)
    for i in range(starts.shape[0]):
        one = Place(starts[i, 0], starts[i, 1], starts[i, 2], starts[i, 3])
        two = Place(stops[i, 0], stops[i, 1], stops[i, 2], stops[i, 3])
        path = inverse(shape, one, two)
        fields = path.reduced, path.scale12, path.scale21
        if not path.sure and shape.a / shape.c > LONGEST:
            fields = np.nan, np.nan, np.nan
        elif not path.sure:
            along = np.array([path.length])
            follow(squares, position(shape, one), path.v1, along, states)
            fields = states[0, REDUCED], states[0, SCALE], states[0, REDUCED + 1]
        found[i, LENGTH], found[i, GAMMA], found[i, KIND] = path.length, path.gamma, path.kind
        for k in range(3):
            found[i, START + k], found[i, STOP + k] = path.v1[k], path.v2[k]
            found[i, FIELDS + k] = fields[k]


@jit
def umbilic_axis(shape: Any, at: Any) -> Any:
    """Return the unit tangent at an umbilic along the middle ellipse, towards growing |x|."""
    k1, k2 = sqrt(shape.K1), sqrt(shape.K2)
    return unit(-shape.a * at.co * at.sb * k2, 0.0, shape.c * k1)


@jit
def beside(at: Any) -> Any:
    """Return the place off the middle ellipse, where β and ω have directions."""
    so = at.so if size(at.so) > NUDGE else NUDGE
    return Place(at.sb, max(at.cb, NUDGE), so, at.co)


@jit
def set_starts(shape: Any, places: Any, azimuths: Any, tangents: Any, gammas: Any) -> Any:
    """Fill tangents (N, 3), and γ (N,), of azimuths in degrees at places (N, 4)."""
    for i in range(places.shape[0]):
        at = Place(places[i, 0], places[i, 1], places[i, 2], places[i, 3])
        cosine, sine = cos(azimuths[i] * pi / 180), sin(azimuths[i] * pi / 180)
        X, Y = shape.K2 * at.cb * at.cb, shape.K1 * at.so * at.so
        gammas[i] = X * sine * sine - Y * cosine * cosine
        north, east = axes(shape, beside(at))
        if at.cb == 0 and at.so == 0:  # half of an angle, as in ``set_azimuths``
            cosine, sine = cosine * cosine - sine * sine, 2 * sine * cosine
            if at.sb > 0:
                sine = -sine
            north, east = umbilic_axis(shape, at), (0.0, at.co, 0.0)
            if at.sb > 0:
                cosine = -cosine
        for k in range(3):
            tangents[i, k] = cosine * north[k] + sine * east[k]


@jit
def set_azimuths(shape: Any, places: Any, tangents: Any, arrive: Any, azimuths: Any) -> Any:
    """Fill degrees (N,) from growing β towards growing ω, at places (N, 4). At an umbilic it is
    half of the angle from the middle ellipse, the limit of its neighbours on the geodesic: where
    it leaves, or arrives.
    """
    for i in range(places.shape[0]):
        at = Place(places[i, 0], places[i, 1], places[i, 2], places[i, 3])
        v = tangents[i]
        umbilic = at.cb == 0 and at.so == 0
        north, east = axes(shape, beside(at))
        if umbilic:
            north, east = umbilic_axis(shape, at), (0.0, at.co, 0.0)
        x = v[0] * north[0] + v[1] * north[1] + v[2] * north[2]
        y = v[0] * east[0] + v[1] * east[1] + v[2] * east[2]
        if not umbilic:
            azimuths[i] = atan2(y, x) * 180 / pi
            continue
        way = -1.0 if arrive else 1.0
        half = atan2(way * y, -way * x if at.sb > 0 else way * x) * 90 / pi
        azimuth = (180 - half if at.sb > 0 else half) + (90 if arrive else 0)
        azimuths[i] = azimuth - 360 if azimuth > 180 else azimuth
