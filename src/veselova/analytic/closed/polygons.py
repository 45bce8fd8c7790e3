"""Areas of polygons of geodesics on an ellipsoid whose middle semiaxis is one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.surface import EPSILON, GAUSS, LAST, OF_AREA, Surface
from veselova.analytic.geodesics.flow import POINT, TANGENT
from veselova.analytic.geodesics.many import LENGTH, START, STOP

__all__ = ["polygon_area"]

Array = NDArray[Any]

#: Derived: the farthest point of a small polygon from its middle on the sphere of x/a, y/b, z/c,
#: in units of c/a, in which the density of areas is smooth: rules leave out less than 1e-18.
_SMALL = 0.25

#: Method: Gauss–Legendre's rule between the middle of a small polygon and its sides.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)


def polygon_area(
    surface: Surface, corners: Array, sides: Array, errors: Array
) -> tuple[float, float]:
    """Return the area to the left of shortest geodesics, sides (N, 12) of ``many`` between corners
    (N, 3), in (−A/2, A/2] of the whole area A, and a bound of its error.

    - errors: (N,) of the lengths of the sides, and of m₁₂ times the error of an azimuth
    """
    whole = surface.area
    found = _small(surface, corners, sides, errors)
    if found is not None:
        return found[0], min(found[1], whole)
    area, turn, off = 0.0, 0.0, 0.0
    stops = np.roll(corners, -1, axis=0)
    for point, stop, side, error in zip(corners, stops, sides, errors, strict=True):
        part, miss, step = surface.under(point, side[START:STOP], stop, side[LENGTH], error)
        area, turn, off = area - part, turn + step, off + miss
    if round(turn / (2 * np.pi)) % 2:  # round a pole
        area += whole / 2
    return area - whole * round(area / whole), min(off, whole)


def _small(
    surface: Surface, corners: Array, sides: Array, errors: Array
) -> tuple[float, float] | None:
    """Return area and bound of a small polygon, None of others: areas below long sides, whose
    difference it is, would leave roundings larger than it.

    On the sphere of U = (x/a, y/b, z/c), (p, q) = U − M across the middle M, the area is
    ∮ G (p dq − q dp), G = ∫ t f(tp, tq) dt from 0 to 1, f = |(bcU₁, acU₂, abU₃)| / (U·M).
    """
    a, b, c = semiaxes = surface.semiaxes
    middle = np.mean(corners / semiaxes, axis=0)
    size = float(np.linalg.norm(middle))
    most = _SMALL * c / a
    if 1 - size > most or np.max(sides[:, LENGTH]) > 2 * most * a:
        return None
    middle /= size
    if np.max(np.linalg.norm(corners / semiaxes - middle, axis=1)) > most:
        return None
    nodes, weights = GAUSS
    length = sides[:, LENGTH]
    along = length[:, None] * np.append((nodes + 1) / 2, 1.0)
    states = surface.follow(corners, sides[:, START:STOP], along)
    across = np.linalg.svd(middle[None])[2][1:]
    across[1] *= np.sign(np.linalg.det(np.vstack([across, middle])))
    places = (states[..., POINT : POINT + 3] / semiaxes - middle) @ across.T
    if np.max(np.linalg.norm(places, axis=-1)) > most:
        return None
    rates = states[:, :-1, TANGENT : TANGENT + 3] / semiaxes @ across.T

    def density(pq: Array) -> Array:
        """Return G of (p, q) (…, 2)."""
        t = (_NODES + 1) / 2
        inner = t[:, None] * pq[..., None, :]
        height = np.sqrt(1 - np.sum(inner * inner, axis=-1))
        U = inner @ across + height[..., None] * middle
        f = np.linalg.norm(U * (b * c, a * c, a * b), axis=-1) / height
        return np.asarray(f * t @ _WEIGHTS / 2)

    p, q = np.moveaxis(places[:, :-1], -1, 0)
    half, G = length / 2, density(places[:, :-1])
    values = G * (p * rates[..., 1] - q * rates[..., 0])
    sizes = G * (np.abs(p * rates[..., 1]) + np.abs(q * rates[..., 0]))
    # from where a geodesic came to, to the corner
    stops = np.roll(corners, -1, axis=0)
    ends, aims = places[:, -1], (stops / semiaxes - middle) @ across.T
    chords = ends[:, 0] * aims[:, 1] - ends[:, 1] * aims[:, 0]
    gaps = np.linalg.norm(states[:, -1, POINT : POINT + 3] - stops, axis=1)
    area = np.sum(values @ weights * half) + np.sum(density(ends) * chords)
    tails = np.max(np.abs(values * weights @ LAST[:, -2:]), axis=1)
    off = np.sum((errors + gaps) * length) + np.sum(tails * length)
    off += OF_AREA * EPSILON * np.sum(sizes @ weights * half)
    return float(area), float(off)
