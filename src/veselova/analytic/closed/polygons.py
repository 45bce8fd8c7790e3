"""Areas of polygons of geodesics on an ellipsoid whose middle semiaxis is one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.surface import Surface
from veselova.analytic.geodesics.flow import POINT, REDUCED, TANGENT
from veselova.analytic.geodesics.many import LENGTH, START, STOP
from veselova.analytic.kernel.arithmetic import EPSILON
from veselova.mechanics.core.errors import Unsolved

__all__ = ["polygon_area"]

Array = NDArray[Any]

#: Method: Gauss–Legendre nodes on one part of a side, parts in a unit of length, and most of them
#: at first; parts in a unit of longitude round a pole; z/c beyond which a part is near one.
_COUNT, _PARTS, _MOST, _TURNS, _POLAR = 16, 3.0, 16, 1.5, 0.5
_GAUSS = np.polynomial.legendre.leggauss(_COUNT)

#: Derived: what makes the last five coefficients of Legendre's series of weighted values.
_LAST = np.polynomial.legendre.legvander(_GAUSS[0], _COUNT - 1)[:, -5:]
_LAST = _LAST * np.arange(_COUNT - 4.5, _COUNT)

#: Budget: halvings of parts of a side, edges of those that are halved again, and parts of
#: longitude round a pole.
_HALVINGS, _MOST_EDGES, _MOST_PARTS = 40, 2000, 100_000

#: Calibrated: the cosine of the most by which normals may turn between nodes: nothing that is
#: narrower, as the rim of a disc, lies between them unseen.
_TURNED = 0.8

#: Calibrated: roundings of areas.
_OF_AREA = 16.0

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
    if (found := _small(surface, corners, sides, errors)) is not None:
        return found[0], min(found[1], whole)
    area, turn, off = 0.0, 0.0, 0.0
    # a side between equal corners has no direction, and at a pole no azimuth
    moves = np.any(corners != (stops := np.roll(corners, -1, axis=0)), axis=1)
    rows = zip(*(x[moves] for x in (corners, stops, sides, errors)), strict=True)
    for point, stop, side, error in rows:
        part, miss, step = _under(surface, point, side[START:STOP], stop, side[LENGTH], error)
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
    nodes, weights = _GAUSS
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
    tails = np.max(np.abs(values * weights @ _LAST[:, -2:]), axis=1)
    off = np.sum((errors + gaps) * length) + np.sum(tails * length)
    off += _OF_AREA * EPSILON * np.sum(sizes @ weights * half)
    return float(area), float(off)


def _under(
    surface: Surface, point: Array, tangent: Array, stop: Array, length: float, error: float
) -> tuple[float, float, float]:
    """Return the area between a geodesic and z = 0, positive where it goes east at z > 0, a
    bound of its error, and the change of an angle round z.

    - point, stop: (3,) its ends, which say at a pole too what the angle is
    - error: of the length, and of m₁₂ times the error of the azimuth
    """
    semiaxes, (nodes, weights) = surface.semiaxes, _GAUSS
    edges = np.linspace(0, length, min(max(4, math.ceil(_PARTS * length)), _MOST) + 1)
    smooth, before, miss = edges.size, np.empty(0), 0.0
    for _ in range(_HALVINGS):
        width = np.diff(edges)[:, None] / 2
        inner = edges[:-1, None] + width * (nodes + 1)
        states = surface.follow(point[None], tangent[None], np.append(edges, inner)[None])[0]
        corners, rest = states[: edges.size, :3], states[edges.size :]
        values, half, size = _smooth(semiaxes, rest)
        zones, steps = _round_pole(semiaxes, corners[:, :2], (point, stop), half)
        parts, most = values @ weights * width[:, 0] + zones, np.max(size, axis=1)
        left_out, unseen = _left_out(values), _unseen(semiaxes, corners, rest[:, :3])
        halved = unseen | (left_out > _OF_AREA * EPSILON * (most + surface.area))
        if not np.any(halved):
            # a series that falls by chance is not told from one that ends: halves tell
            both = parts.reshape(-1, 2).sum(axis=1) if before.size else before
            differ = np.abs(both - before)
            miss = float(np.sum(differ))
            wrong = np.repeat(differ > _OF_AREA * EPSILON * (np.max(most) + surface.area), 2)
            done = before.size and (edges.size > _MOST_EDGES or not np.any(wrong))
            if edges.size == smooth or done:
                break
            halved = wrong if before.size else np.ones(parts.size, dtype=bool)
            before = np.empty(0) if before.size else parts
        else:
            before = np.empty(0)
        edges = np.sort(np.append(edges, (edges[:-1] + edges[1:])[halved] / 2))
    left_out = np.where(unseen, most, left_out) * width[:, 0]
    moved = float(np.sum(np.abs(rest[:, REDUCED]).reshape(-1, _COUNT) * weights * width))
    rounded = float(np.sum(size * weights * width)) + float(np.sum(np.abs(zones)))
    gap, closing, at_stop = _closing(semiaxes, corners[-1], stop, half[-1])
    # of the direction, and of the start
    aside = moved / abs(states[edges.size - 1, REDUCED]) if moved else 0.0
    off = (error + gap) * (length + aside) + 2 * float(np.sum(left_out)) + miss
    off += _OF_AREA * EPSILON * semiaxes[0] * (rounded + at_stop)
    return float(np.sum(parts)) + closing, float(off), float(np.sum(steps))


def _zone(semiaxes: Array, u: Any, phi: Any) -> Any:
    """Return F: the area between z = 0 and z = cu in a unit of φ, (x, y) = √(1−u²)(a cos φ,
    b sin φ): ½u(√(p+qu²) + p/√q asinh(u√(q/p))), p = c²(b²cos²φ+a²sin²φ), q = a²b²−p.
    """
    a, b, c = semiaxes
    p = c**2 * ((b * np.cos(phi)) ** 2 + (a * np.sin(phi)) ** 2)
    # a²b² − p without cancellation
    q = (b - c) * (b + c) * (a * np.sin(phi)) ** 2 + (a - c) * (a + c) * (b * np.cos(phi)) ** 2
    x = u * np.sqrt(q / p)
    ratio = np.divide(np.arcsinh(x), x, out=np.ones_like(x), where=np.abs(x) > 1e-150)
    return u * (np.sqrt(p + q * u**2) + np.sqrt(p) * ratio) / 2


def _left_out(values: Array) -> Array:
    """Return what Gauss's rule leaves out of values (N, nodes) on parts of length two: the
    coefficient 2·nodes of Legendre's series, which falls six times as far as the last five.
    """
    last = np.abs(values * _GAUSS[1] @ _LAST)
    before, after = np.max(last[:, :3], axis=1), np.max(last[:, 3:], axis=1)
    return np.asarray(after * np.minimum(1.0, after / np.maximum(before, 1e-300)) ** 6)


def _unseen(semiaxes: Array, corners: Array, rest: Array) -> NDArray[np.bool_]:
    """Return whether normals turn far between two of the points of a part, (N + 1, 3) at its
    ends and (N·nodes, 3) inside.
    """
    inner = rest.reshape(-1, _COUNT, 3)
    points = np.concatenate([corners[:-1, None], inner, corners[1:, None]], axis=1)
    normals = points / semiaxes**2
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.asarray(np.any(np.sum(normals[:, 1:] * normals[:, :-1], axis=-1) < _TURNED, 1))


def _closing(semiaxes: Array, end: Array, stop: Array, half: float) -> tuple[float, float, float]:
    """Return the distance from the end of a geodesic that was followed to the point where it
    is to stop, the area between both and z = 0 without what a pole makes singular, and the
    size of its terms in a unit of φ.
    """
    (x, y, u), (dx, dy, _) = end / semiaxes, (stop - end) / semiaxes
    step = math.atan2(x * dy - y * dx, x * (x + dx) + y * (y + dy))
    rate, size = _off_pole(semiaxes, u, np.arctan2(y, x), half)
    return float(np.linalg.norm(end - stop)), float(rate * step), float(size)


def _smooth(semiaxes: Array, states: Array) -> tuple[Array, Array, Array]:
    """Return F dφ/ds (N, nodes) of states (N·nodes, 10) without what a pole makes singular,
    the sign of that pole or zero (N,), and the size of all terms (N, nodes).
    """
    x, y, u = (states[:, POINT : POINT + 3] / semiaxes).T
    rates = states[:, TANGENT : TANGENT + 3] / semiaxes
    turns = np.array([x * rates[:, 1], -y * rates[:, 0]]) / (x**2 + y**2)
    phi, shape = np.arctan2(y, x), (-1, _COUNT)
    level = np.mean(u.reshape(shape), axis=1)
    half = np.where(np.abs(level) > _POLAR, np.sign(level), 0.0)
    rates, sizes = _off_pole(semiaxes, u, phi, np.repeat(half, _COUNT))
    values, sizes = rates * (turns[0] + turns[1]), sizes * np.sum(np.abs(turns), axis=0)
    return values.reshape(shape), half, sizes.reshape(shape)


def _off_pole(semiaxes: Array, u: Any, phi: Any, half: Any) -> tuple[Any, Any]:
    """Return F(u, φ) less F(1, φ) by the sign of the pole, and the size of both."""
    zone, of_pole = _zone(semiaxes, u, phi), _zone(semiaxes, 1.0, phi)
    return zone - half * of_pole, np.abs(zone) + np.abs(half) * of_pole


def _round_pole(
    semiaxes: Array, corners: Array, ends: tuple[Array, Array], half: Array
) -> tuple[Array, Array]:
    """Return what was left out near poles between corners (N, 2), and the changes of θ, tan θ =
    √(a/b) tan φ, in which F(1, φ) has its peaks √(b/a) wide.
    """
    a, b = semiaxes[:2]
    ratio = math.sqrt(b / a)
    x, y = (corners / (a, b)).T
    for k, end in ((0, ends[0]), (-1, ends[1])):  # at a pole θ is zero on both sides
        x[k], y[k] = end[:2] / (a, b) if np.any(end[:2]) else (1.0, 0.0)
    x = ratio * x
    theta = np.arctan2(y, x)
    # twice the same number: differences are exact where parts are short
    terms = np.array([[x[:-1] * y[1:], y[:-1] * x[1:]], [x[:-1] * np.diff(y), y[:-1] * np.diff(x)]])
    sizes, (plain, near) = np.sum(np.abs(terms), axis=1), terms[:, 0] - terms[:, 1]
    sines = np.where(sizes[0] <= sizes[1], plain, near)
    steps = np.arctan2(sines, x[:-1] * x[1:] + y[:-1] * y[1:])
    zones = np.zeros(half.size)
    for k in np.flatnonzero(half).tolist():
        parts = math.ceil(_TURNS * abs(steps[k]) / ratio) + 1
        if parts > _MOST_PARTS:
            raise Unsolved("too-far", "areas of so long an ellipsoid take too many parts")
        each = steps[k] / parts
        at = theta[k] + each * (np.arange(parts)[:, None] + (_GAUSS[0] + 1) / 2)
        x, y = np.cos(at), ratio * np.sin(at)
        zone = _zone(semiaxes, 1.0, np.arctan2(y, x)) / (x * x + y * y)
        zones[k] = half[k] * ratio * each / 2 * float(np.sum(zone * _GAUSS[1]))
    return zones, steps
