"""All geodesics between two points of an ellipsoid, the shortest first.

With L and C as in ``analytic.geodesics.shortest``, L oscillates with the half period H of J from a
phase p₁ to p₂, and C goes round with 2H_C from c₁ to c₂:

    p₂ − p₁ + 2Hm = ±(c₂ − c₁) + 2H_C k,   whole m, k ≥ 0,

and the same sums of S, halved, are the length. For each m, each sense at both ends and each way
round, k is a function of z, and a geodesic is where it is whole. At each z the length grows with m,
which says how many m there are.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import scipy  # its parts are loaded when they are asked for
from numpy.typing import NDArray

from veselova.analytic.closed.surface import Surface
from veselova.analytic.geodesics.coordinates import Place
from veselova.analytic.geodesics.flow import REDUCED, SCALE, TANGENT
from veselova.analytic.geodesics.many import COLUMNS, FIELDS, GAMMA, START, STOP
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import InternalContradiction, Unsolved

__all__ = ["geodesics_between"]

Array = NDArray[np.float64]

#: Derived: the columns of a geodesic of those of it the other way, and their signs.
_REVERSED = [0, 4, 5, 6, 1, 2, 3, 7, 9, 8]
_SIGNS = np.array([1, *[-1] * 6, 1, 1, 1])

#: A geodesic from the first point: its length and its unit tangent.
Start = tuple[float, Array]

#: Method: log z/(1−z) between which zeros are looked for; beyond, z or 1−z is rounding.
_GRID = np.concatenate([np.linspace(-45.0, 14.0, 237), [17.0, 21.0, 26.0, 35.0]])

#: Budget: oscillations of L.
_MOST_TURNS = 300

#: Derived: sines of an umbilic, and of a point in a plane of symmetry; the rounding of k.
_UMBILIC, _IN_PLANE, _ROUNDING = 1e-9, 1e-15, 1e-10

#: Calibrated: what two geodesics differ by, and Newton's steps on the end of one.
_APART, _STEPS = 1e-6, 3


class _Kind:
    """The geodesics on which β turns, or ω; phases: J and S (T, 2, 6) on the grid."""

    def __init__(self, surface: Surface, one: Place, two: Place, is_beta: bool) -> None:
        self._surface, self._is_beta, self._start = surface, is_beta, one
        self._K = surface.shape.K2 if is_beta else surface.shape.K1
        self._ends = [self._end(at) for at in (one, two)]
        self._least = min(X for _, X, _, _ in self._ends)
        points = _GRID[: _GRID.size if self._least > 0 else 0]
        self.phases = np.array([self._phases(y) for y in points]).reshape(-1, 2, 6)

    def _end(self, at: Place) -> tuple[float, float, float, float]:
        """Return sin θ and X of L, and sine and cosine of C on its circle."""
        if self._is_beta:
            return at.sb, self._K * at.cb**2, -at.co, at.so
        side = -1.0 if at.so < 0 else 1.0  # (180°−β, −ω) is the same place
        return -at.co, self._K * at.so**2, at.sb, side * at.cb

    def _constants(self, y: float) -> tuple[float, list[float]]:
        """Return g, and X−g at both ends."""
        z, rest = 1 / (1 + np.exp(-y)), 1 / (1 + np.exp(y))
        rests = [X - self._least + self._least * rest**2 for _, X, _, _ in self._ends]
        return self._least * z * (1 + rest), rests

    def _phases(self, y: float) -> Array:
        """Return J and S (2, 6): of L to both ends and to its turn, and the same of C."""
        text, shape, found = self._surface.text, self._surface.shape, []
        g, rests = self._constants(y)

        def sums(form: Any, n: float, d: float) -> Array:
            return np.array(text.between(form, -1.0, 0.0, float(n), float(d))[:2])

        for (s, _, _, _), q in zip(self._ends, rests, strict=True):
            form = text.turning(shape, self._is_beta, g, self._K * s**2 + q)
            found.append(sums(form, np.sqrt(self._K) * s, np.sqrt(q)))
        found.append(sums(form, 1, 0))
        form = text.circling(shape, not self._is_beta, g)
        half = sums(form, 1, 0)
        for _, _, n, d in self._ends:
            found.append(half + sums(form, -n, -d) if d < 0 else sums(form, n, d))
        return np.array([*found, half]).T

    @staticmethod
    def windings(phases: Array, senses: tuple[int, ...], m: int) -> tuple[Any, Any]:
        """Return k and the length (…) of phases (…, 2, 6); senses: of L at both ends, and of C."""
        p1, p2, half, c1, c2, half_C = np.moveaxis(phases, -1, 0)
        p1, p2 = (p if up > 0 else 2 * half - p for p, up in zip((p1, p2), senses, strict=False))
        one, two = p2 - p1 + 2 * half * m, senses[2] * (c2 - c1)
        k = (one - two)[..., 0] / (2 * half_C[..., 0])
        return k, (one + two)[..., 1] + 2 * half_C[..., 1] * k

    def starts(self, senses: tuple[int, ...], m: int) -> list[Start]:
        """Return the geodesics of one m."""
        values, _ = self.windings(self.phases, senses, m)
        if np.all(np.abs(values) < _ROUNDING):  # from a point to itself
            return []
        numbers = range(max(0, int(np.min(values))), int(np.ceil(np.max(values))) + 1)
        zeros = [y for k in numbers for y in self._zeros(values - k, senses, m, k)]
        found = [self._start_at(y, senses, m) for y in zeros]
        return [each for each in found if each[0] > _ROUNDING]  # and not those the other way

    def _zeros(self, values: Array, senses: tuple[int, ...], m: int, k: int) -> list[float]:
        def off(y: float, sign: float = 1.0) -> float:
            return sign * float(self.windings(self._phases(y), senses, m)[0] - k)

        signs = np.where(values >= 0, 1.0, -1.0)
        brackets = [(i, i + 1) for i in np.flatnonzero(signs[:-1] != signs[1:])]
        edges = [(_GRID[i], _GRID[j]) for i, j in brackets]
        inner = np.abs(values[1:-1])
        least = (inner <= np.abs(values[:-2])) & (inner < np.abs(values[2:]))
        alike = (signs[:-2] == signs[1:-1]) & (signs[1:-1] == signs[2:])
        for i in np.flatnonzero(least & alike):  # perhaps two zeros
            ends, sign = (_GRID[i], _GRID[i + 2]), signs[i]
            dip = scipy.optimize.minimize_scalar(off, bounds=ends, args=(sign,), method="bounded")
            if dip.fun < 0:
                edges += [(ends[0], dip.x), (dip.x, ends[1])]
        found = [float(scipy.optimize.brentq(off, *ends, xtol=1e-13)) for ends in edges]
        return [*found, _GRID[-1]] if abs(values[-1]) < _ROUNDING else found

    def _start_at(self, y: float, senses: tuple[int, ...], m: int) -> Start:
        length = float(self.windings(self._phases(y), senses, m)[1])
        shape, at, (g, rests) = self._surface.shape, self._start, self._constants(y)
        X, Y = shape.K2 * at.cb**2, shape.K1 * at.so**2
        along, across = (
            senses[0] * np.sqrt(rests[0]),
            senses[2] * np.sqrt((Y if self._is_beta else X) + g),
        )
        north, east = (along, across) if self._is_beta else (across, along)
        side = -1.0 if not self._is_beta and at.so < 0 else 1.0
        size = side / np.sqrt(X + Y)
        return length, np.array(self._surface.text.combine(shape, at, north * size, east * size))


def _along_ellipse(r1: Array, r2: Array, axes: Array, plane: int, most: int) -> list[Start]:
    """Return the geodesics along the section of a plane of symmetry."""
    i, j = (k for k in range(3) if k != plane)
    p, q = axes[i], axes[j]
    angles = [np.arctan2(r[j] / q, r[i] / p) for r in (r1, r2)]
    arcs = [q * scipy.special.ellipeinc(x, 1 - (p / q) ** 2) for x in (*angles, 2 * np.pi)]
    tangent = np.zeros(3)
    tangent[i], tangent[j] = -p * np.sin(angles[0]), q * np.cos(angles[0])
    tangent /= np.linalg.norm(tangent)
    found = []
    for way in (1, -1):
        first = way * (arcs[1] - arcs[0]) % arcs[2]
        found += [(first + k * arcs[2], way * tangent) for k in range(most)]
    return [(length, v) for length, v in found if length > 0]


def _at_focus(surface: Surface, ends: Array, shortest: Array, count: int, is_first: bool) -> Array:
    """Return the rows of ``many`` of geodesics between places (2, 4), of which the first or the
    last is an umbilic, a pole of a spheroid, or any point of a sphere.

    All geodesics from it meet at its antipode, and again there after a perimeter of the ellipse
    with semiaxes a and c: those from the other end are one line, followed both ways.
    """
    a, _, c = surface.semiaxes
    points = surface.points(ends)
    if min(np.linalg.norm(points[0] - x * points[1]) for x in (1, -1)) < _UMBILIC * a:
        raise Unsolved(
            "continuous-family",
            "geodesics from an umbilic, a pole or a point of a sphere all meet again there",
        )
    around, length = 4 * a * scipy.special.ellipe(1 - (c / a) ** 2), shortest[0]
    v = -shortest[STOP:FIELDS] if is_first else shortest[START:STOP]
    near, far = points[::-1] if is_first else points
    rows = np.zeros((count, COLUMNS))
    for k in range(count):
        turns, back = divmod(k, 2)
        whole = turns * around + (around - length if back else length)
        row = _polish(surface, near, far, (whole, -v if back else v))
        rows[k, :GAMMA] = row[_REVERSED] * _SIGNS if is_first else row
    return rows


def _polish(surface: Surface, r1: Array, r2: Array, start: Start) -> Array:
    """Return the columns of ``many`` up to the scales, after Newton's steps on its end."""
    length, v = start
    normal = r1 / surface.semiaxes**2
    across = np.cross(normal, v) / np.linalg.norm(normal)
    for step in range(_STEPS + 1):
        state = surface.follow(r1[None], v[None], np.array([[length]]))[0, 0]
        off, w = r2 - state[:3], state[TANGENT : TANGENT + 3]
        last = r2 / surface.semiaxes**2
        side = np.cross(last, w) / np.linalg.norm(last)
        m = state[REDUCED]
        if step == _STEPS:
            break
        length += float(off @ w)
        if abs(m) > _APART:
            angle = float(off @ side) / m
            v, across = (
                np.cos(angle) * v + np.sin(angle) * across,
                np.cos(angle) * across - np.sin(angle) * v,
            )
    if np.linalg.norm(off) > _APART * surface.semiaxes[0]:
        raise Unsolved(
            "integration-failed", "a geodesic between the points was not followed to its end"
        )
    return np.array([length, *v, *state[TANGENT:REDUCED], *state[[REDUCED, SCALE, REDUCED + 1]]])


def geodesics_between(surface: Surface, start: Array, stop: Array, count: int) -> dict[str, Array]:
    """Return the numbers of the ``count`` shortest geodesics between places (4,), by growing
    length.

    Two that differ by less than 1e-6 in length and direction count as one. Raises Unsolved
    (``continuous-family``) between umbilics, poles of spheroids or any points of a sphere that are
    equal or opposite, and (``too-far``) near the limit of a short oscillation.
    """
    text, shape = surface.text, surface.shape
    prepared = surface.shortest(start[None], stop[None])[0]
    small1, small2 = shape.K1 <= text.ROUND, shape.K2 <= text.LEAST_K2
    focal = [
        (small1 or abs(at[2]) < _UMBILIC) and (small2 or abs(at[1]) < _UMBILIC)
        for at in (start, stop)
    ]
    if any(focal):
        rows = _at_focus(surface, np.stack([start, stop]), prepared, count, not focal[1])
    else:
        rows = _elsewhere(surface, start, stop, prepared, count)
    starts, stops = (np.tile(at, (count, 1)) for at in (start, stop))
    azimuths = surface.azimuths(starts, rows[:, START:STOP])
    rows[:, GAMMA] = surface.tangents(starts, azimuths)[1]
    numbers = surface.numbers((starts, stops), rows)
    if abs(numbers["s12"][0] - prepared[0] * surface.unit) > 10 * numbers["error"][0]:
        raise InternalContradiction("the shortest geodesic is not among those found")
    return numbers


def _elsewhere(surface: Surface, start: Array, stop: Array, shortest: Array, count: int) -> Array:
    """Return the rows of ``many`` of geodesics, by growing length, from the columns of the
    shortest.
    """
    text, shape = surface.text, surface.shape
    one, two, c, s = text.in_plane(shape, Place(*start.tolist()), Place(*stop.tolist()))
    r1, r2 = (np.array(text.position(shape, at)) for at in (one, two))
    ends = one, two
    planes = [
        all(abs(at.co) < _IN_PLANE for at in ends),
        all(abs(at.cb * at.so) < _IN_PLANE for at in ends),
        all(abs(at.sb) < _IN_PLANE for at in ends),
    ]
    found = [
        each
        for plane in range(3)
        if planes[plane]
        for each in _along_ellipse(r1, r2, surface.semiaxes, plane, count)
    ]
    if np.all(start == stop):
        found.append((0.0, shortest[1:4]))
    kinds = [_Kind(surface, one, two, is_beta) for is_beta in (True, False)]
    choices = list(product(kinds, (1, -1), (1, -1), (1, -1)))
    for m in range(_MOST_TURNS):
        checkpoint("geodesics", m, _MOST_TURNS)
        limit = np.inf
        for kind, *senses in choices:
            k, lengths = kind.windings(kind.phases, tuple(senses), m)
            ahead = (k > -_ROUNDING) & (lengths > _ROUNDING)
            limit = min(limit, np.min(lengths[ahead], initial=np.inf))
        found = _distinct(found)
        if len(found) >= count and found[count - 1][0] < limit:
            break
        for kind, *senses in choices:
            if kind.phases.size:
                found += kind.starts(tuple(senses), m)
    else:
        raise Unsolved("too-far", f"there are more than {_MOST_TURNS} oscillations in one")
    rows = []
    for each in found[:count]:
        row = _polish(surface, r1, r2, each)
        ends = tuple(row[START:STOP]), tuple(row[STOP:FIELDS])
        turned = [text.back_from_plane(shape, x, c, s) for x in ends]
        rows.append([row[0], *turned[0], *turned[1], *row[FIELDS:], 0.0, 0.0])
    return np.array(rows)


def _distinct(found: list[Start]) -> list[Start]:
    """Return geodesics by growing length, each once."""
    kept: list[Start] = []
    for length, v in sorted(found, key=lambda each: each[0]):
        near = [w for other, w in kept if length - other < _APART]
        if not any(np.max(np.abs(v - w)) < _APART for w in near):
            kept.append((length, v))
    return kept
