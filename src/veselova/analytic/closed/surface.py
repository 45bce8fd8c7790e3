"""An ellipsoid with its axes sorted and its middle semiaxis one, and arrays of geodesics on it, in
doubles or in balls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.geodesics import (
    arithmetic,
    coordinates,
    flow,
    integrals,
    inverse,
    many,
    shortest,
)
from veselova.analytic.geodesics.flow import POINT, REDUCED, ROWS, SCALE, TANGENT
from veselova.analytic.geodesics.integrals import Shape
from veselova.analytic.geodesics.shortest import TURNED
from veselova.analytic.kernel.compiler import prepare
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.geometry.geographic import ellipsoidal_point, ellipsoidal_sines
from veselova.mechanics.geometry.places import from_places, sines_of_degrees, to_places

__all__ = ["EPSILON", "GAUSS", "LAST", "OF_AREA", "TEXT", "Surface"]

Array = NDArray[Any]

#: Budget: geodesics between two checkpoints, some milliseconds.
_CHUNK = 200

#: Method: Gauss–Legendre nodes on one part of a side, parts in a unit of length, and most of them
#: at first; parts in a unit of longitude round a pole; z/c beyond which a part is near one.
_NODES, _PARTS, _MOST, _TURNS, _POLAR = 16, 3.0, 16, 1.5, 0.5
GAUSS = np.polynomial.legendre.leggauss(_NODES)

#: Derived: what makes the last five coefficients of Legendre's series of weighted values.
LAST = np.polynomial.legendre.legvander(GAUSS[0], _NODES - 1)[:, -5:]
LAST = LAST * np.arange(_NODES - 4.5, _NODES)

#: Budget: halvings of parts of a side, edges of those that are halved again, and parts of
#: longitude round a pole.
_HALVINGS, _MOST_EDGES, _MOST_PARTS = 40, 2000, 100_000

#: Calibrated: the cosine of the most by which normals may turn between nodes: nothing that is
#: narrower, as the rim of a disc, lies between them unseen.
_TURNED = 0.8

#: Calibrated: roundings of areas.
OF_AREA = 16.0

EPSILON = float(np.finfo(float).eps)

#: Calibrated: roundings of s₁₂ and of the longest semiaxis, and at an umbilic, where phases cancel.
_OF_LENGTH, _OF_AXIS, _AT_UMBILIC = 12.0, 24.0, 800.0

#: Derived: a component of a unit tangent that rounding leaves.
_NO_COMPONENT = 1e-12

#: Derived: ε by which sines of one latitude differ; sines at a pole or an umbilic.
_ROUNDED, _AT_POLE = 8, 1e-9

#: The functions and constants of the text in doubles, by name.
TEXT: dict[str, Any] = {
    name: value
    for part in (arithmetic, coordinates, flow, integrals, shortest, inverse, many)
    for name, value in vars(part).items()
}


def _doubles(values: Any) -> Array:
    return np.asarray(values, dtype=np.float64)


def _identity(values: Any) -> Any:
    return values


class Surface:
    """The ellipsoid of three exact semiaxes.

    - text: the functions of ``analytic.geodesics`` by name, in doubles; over balls with
      ``numbers``, which makes balls of rationals, and ``rounded``, to which places are rounded
    - given: the semiaxes in their order and unit; order: of those sorted; unit: the middle one
    - semiaxes: sorted, in units of the middle one
    """

    def __init__(self, exact: Sequence[Fraction], text: dict[str, Any] | None = None) -> None:
        self.is_double = text is None
        self.text = SimpleNamespace(**(text or TEXT | {"numbers": _doubles, "rounded": _identity}))
        self.order = np.array(sorted(range(3), key=lambda i: -exact[i]))
        a, b, c = (exact[i] for i in self.order)
        numbers = self.text.numbers
        differences = numbers([(a - b) * (a + b) / b**2, (b - c) * (b + c) / b**2])
        least = self.text.ROUND
        K1 = max(differences[0], least)
        least2 = least if least < K1 else self.text.LEAST_K2  # a sphere is oblate
        K2 = max(differences[1], least2)
        first, third = numbers([a / b, c / b])
        squares = first**2 * (1 + least), numbers(1)[()], third**2 * (1 - least2)
        self.shape = Shape(first, third, *squares, K1, K2)
        whole = K1 + K2
        #: k² and k'², which differences of rounded semiaxes would not give.
        self.moduli = K2 / whole, K1 / whole
        self.semiaxes = numbers([a / b, 1, c / b])
        self.given = numbers(list(exact))
        self.unit = numbers(b)[()]

    def read(self, points: Array, coordinates: str) -> Array:
        """Return sines and cosines of β and ω (N, 4) of points (N, 2) or (N, 3)."""
        if coordinates == "ellipsoidal":
            return np.asarray(self.text.rounded(sines_of_degrees(points)))
        points = self.text.numbers(points) if coordinates == "cartesian" else points
        # farther from a pole than the umbilics of a spheroid are
        U = from_places(points, coordinates, self.given, self.text.NUDGE)
        return self.places(U[:, self.order])

    def show(self, points: Array, coordinates: str) -> Array:
        """Return points (N, 3) of the sorted ellipsoid in coordinates, (N, 2) or (N, 3)."""
        places = self.places(points / self.semiaxes)
        U = self.unsorted(points) * self.unit / self.given
        return to_places(U, places, coordinates, self.given)

    def unsorted(self, vectors: Array) -> Array:
        """Return vectors (N, 3) with their components in the order of the semiaxes given."""
        return vectors[:, np.argsort(self.order)]

    def places(self, U: Array) -> Array:
        """Return sines and cosines of β and ω (N, 4) of points x/a, y/b, z/c (N, 3)."""
        return np.asarray(self.text.rounded(ellipsoidal_sines(U, *self.moduli)))

    def shortest(self, starts: Array, stops: Array) -> Array:
        """Return the geodesics (N, 12) of ``many`` between places (N, 4); NaN where these are.

        Latitudes that differ by rounding are made equal: of two ways of one length the same is
        found in all digits.
        """
        if self.is_double:
            prepare()
        level, stops = self._level(starts, stops), stops.copy()
        opposite = starts[level, 0] * stops[level, 0] < 0
        stops[level, 0] = np.where(opposite, -starts[level, 0], starts[level, 0])
        stops[level, 1] = starts[level, 1]
        found = np.full((len(starts), many.COLUMNS), np.nan, dtype=starts.dtype)
        finite = np.all(np.isfinite((starts + stops).astype(float)), axis=1)
        rows = np.flatnonzero(finite)
        step = _CHUNK if self.is_double else 1
        for k in range(0, rows.size, step):
            checkpoint("geodesics", k, rows.size)
            part = rows[k : k + step]
            solved = np.empty((part.size, many.COLUMNS), dtype=starts.dtype)
            self.text.solve_pairs(self.shape, starts[part], stops[part], solved)
            found[part] = solved
        same = finite & np.all(starts == stops, axis=1)
        found[same, many.STOP : many.FIELDS] = found[same, many.START : many.STOP]
        found[same, many.LENGTH] = 0.0
        found[same, many.FIELDS : many.GAMMA] = 0.0, 1.0, 1.0
        return found

    def inverse(self, starts: Array, stops: Array) -> dict[str, Array]:
        """Return the numbers of the shortest geodesics between places (N, 4)."""
        found = self.shortest(starts, stops)
        numbers = self.numbers((starts, stops), found)
        return numbers | {"unique": self._unique((starts, stops), found, numbers["azi1"])}

    def direct(
        self, starts: Array, azimuths: Array, lengths: Array, coordinates: str
    ) -> dict[str, Array]:
        """Return the numbers of geodesics, and their ends P2, from places (N, 4) in the directions
        of azimuths in degrees.
        """
        if self.is_double:
            prepare()
        azimuths, lengths = self.text.numbers(azimuths), self.text.numbers(lengths) / self.unit
        points = self.points(starts)
        tangents, gammas = np.empty_like(points), np.empty_like(lengths)
        self.text.set_starts(self.shape, starts, azimuths, tangents, gammas)
        states = self.follow(points, tangents, lengths[:, None])[:, 0]
        fields = states[:, [REDUCED, SCALE, REDUCED + 1]]
        ends = self.places(states[:, :3] / self.semiaxes)
        tangents2 = states[:, TANGENT : TANGENT + 3]
        columns = lengths, tangents, tangents2, fields, gammas, np.zeros(len(starts))
        numbers = self.numbers((starts, ends), np.column_stack(columns))
        return numbers | {"P2": self.show(states[:, :3], coordinates)}

    def numbers(self, places: tuple[Array, Array], found: Array) -> dict[str, Array]:
        """Return what ``Geodesics`` has, in the units given, of the columns of ``many``."""
        v1, v2 = found[:, many.START : many.STOP], found[:, many.STOP : many.FIELDS]
        return {
            "s12": found[:, many.LENGTH] * self.unit,
            "azi1": self.azimuths(places[0], v1),
            "azi2": self.azimuths(places[1], v2),
            "v1": self.unsorted(v1),
            "v2": self.unsorted(v2),
            "m12": found[:, many.FIELDS] * self.unit,
            "M12": found[:, many.FIELDS + 1],
            "M21": found[:, many.FIELDS + 2],
            "caustic": (1 - found[:, many.GAMMA]) * self.unit**2,
            "error": self.errors(places, found[:, many.LENGTH]) * self.unit,
        }

    def errors(self, places: tuple[Array, Array], lengths: Array) -> Array:
        """Return the bound of the errors of lengths, in the middle semiaxis."""
        at_umbilic = [np.maximum(x[:, 1], np.abs(x[:, 2])) < _AT_POLE for x in places]
        axis = np.where(np.any(at_umbilic, axis=0), _AT_UMBILIC, _OF_AXIS) * self.semiaxes[0]
        return np.asarray(EPSILON * (_OF_LENGTH * np.abs(lengths) + axis))

    def points(self, places: Array) -> Array:
        """Return the points (N, 3) of places (N, 4)."""
        return np.asarray(self.semiaxes * ellipsoidal_point(places, *self.moduli))

    def follow(self, points: Array, tangents: Array, lengths: Array) -> Array:
        """Return the states (N, T, 10) of ``flow`` at lengths (N, T), of any sign and order."""
        if self.is_double:
            prepare()
        states = np.full((*lengths.shape, ROWS), np.nan, dtype=points.dtype)
        squares = self.semiaxes**2
        finite = np.all(np.isfinite((points + tangents).astype(float)), axis=1)
        for i in np.flatnonzero(finite).tolist():
            checkpoint("geodesics", i, len(points))
            order = np.argsort(np.abs(lengths[i]), kind="stable")
            for part in (order[lengths[i][order] >= 0], order[lengths[i][order] < 0]):
                way = np.empty((part.size, ROWS), dtype=points.dtype)
                given = squares, points[i], tangents[i], lengths[i, part]
                if part.size and self.text.follow(*given, way) < part.size:
                    raise Unsolved(
                        "too-far",
                        f"a geodesic takes more than {flow.MOST_STEPS} steps of its series",
                    )
                states[i, part] = way
        return states

    def azimuths(self, places: Array, tangents: Array) -> Array:
        """Return degrees (N,) from growing β towards growing ω."""
        azimuths = np.full(len(places), np.nan, dtype=places.dtype)
        self.text.set_azimuths(self.shape, places, tangents, azimuths)
        return azimuths

    @cached_property
    def area(self) -> float:
        """Return the surface, 4π R_G(a²b², a²c², b²c²)."""
        from scipy.special import elliprg

        a, b, c = self.semiaxes
        return float(4 * np.pi * elliprg((a * b) ** 2, (a * c) ** 2, (b * c) ** 2))

    def _zone(self, u: Array, phi: Array) -> Array:
        """Return F: the area between z = 0 and z = cu in a unit of φ, (x, y) = √(1−u²)(a cos φ,
        b sin φ): ½u(√(p+qu²) + p/√q asinh(u√(q/p))), p = c²(b²cos²φ+a²sin²φ), q = a²b²−p.
        """
        a, b, c = self.semiaxes
        p = c**2 * ((b * np.cos(phi)) ** 2 + (a * np.sin(phi)) ** 2)
        # a²b² − p without cancellation
        q = (b - c) * (b + c) * (a * np.sin(phi)) ** 2 + (a - c) * (a + c) * (b * np.cos(phi)) ** 2
        x = u * np.sqrt(q / p)
        ratio = np.divide(np.arcsinh(x), x, out=np.ones_like(x), where=np.abs(x) > 1e-150)
        return np.asarray(u * (np.sqrt(p + q * u**2) + np.sqrt(p) * ratio) / 2)

    def under(
        self, point: Array, tangent: Array, stop: Array, length: float, error: float
    ) -> tuple[float, float, float]:
        """Return the area between a geodesic and z = 0, positive where it goes east at z > 0, a
        bound of its error, and the change of an angle round z.

        - point, stop: (3,) its ends, which say at a pole too what the angle is
        - error: of the length, and of m₁₂ times the error of the azimuth
        """
        nodes, weights = GAUSS
        edges = np.linspace(0, length, min(max(4, math.ceil(_PARTS * length)), _MOST) + 1)
        smooth, before, miss = edges.size, np.empty(0), 0.0
        for _ in range(_HALVINGS):
            width = np.diff(edges)[:, None] / 2
            inner = edges[:-1, None] + width * (nodes + 1)
            states = self.follow(point[None], tangent[None], np.append(edges, inner)[None])[0]
            corners, rest = states[: edges.size, :3], states[edges.size :]
            values, half, size = self._smooth(rest)
            zones, steps = self._round_pole(corners[:, :2], (point, stop), half)
            parts, most = values @ weights * width[:, 0] + zones, np.max(size, axis=1)
            left_out, unseen = self._left_out(values), self._unseen(corners, rest[:, :3])
            halved = unseen | (left_out > OF_AREA * EPSILON * (most + self.area))
            if not np.any(halved):
                # a series that falls by chance is not told from one that ends: halves tell
                both = parts.reshape(-1, 2).sum(axis=1) if before.size else before
                differ = np.abs(both - before)
                miss = float(np.sum(differ))
                wrong = np.repeat(differ > OF_AREA * EPSILON * (np.max(most) + self.area), 2)
                done = before.size and (edges.size > _MOST_EDGES or not np.any(wrong))
                if edges.size == smooth or done:
                    break
                halved = wrong if before.size else np.ones(parts.size, dtype=bool)
                before = np.empty(0) if before.size else parts
            else:
                before = np.empty(0)
            edges = np.sort(np.append(edges, (edges[:-1] + edges[1:])[halved] / 2))
        left_out = np.where(unseen, most, left_out) * width[:, 0]
        moved = float(np.sum(np.abs(rest[:, REDUCED]).reshape(-1, _NODES) * weights * width))
        rounded = float(np.sum(size * weights * width)) + float(np.sum(np.abs(zones)))
        gap, closing, at_stop = self._closing(corners[-1], stop, half[-1])
        # of the direction, and of the start
        aside = moved / abs(states[edges.size - 1, REDUCED]) if moved else 0.0
        off = (error + gap) * (length + aside) + 2 * float(np.sum(left_out)) + miss
        off += OF_AREA * EPSILON * self.semiaxes[0] * (rounded + at_stop)
        return float(np.sum(parts)) + closing, float(off), float(np.sum(steps))

    @staticmethod
    def _left_out(values: Array) -> Array:
        """Return what Gauss's rule leaves out of values (N, nodes) on parts of length two: the
        coefficient 2·nodes of Legendre's series, which falls six times as far as the last five.
        """
        last = np.abs(values * GAUSS[1] @ LAST)
        before, after = np.max(last[:, :3], axis=1), np.max(last[:, 3:], axis=1)
        return np.asarray(after * np.minimum(1.0, after / np.maximum(before, 1e-300)) ** 6)

    def _unseen(self, corners: Array, rest: Array) -> NDArray[np.bool_]:
        """Return whether normals turn far between two of the points of a part, (N + 1, 3) at its
        ends and (N·nodes, 3) inside.
        """
        inner = rest.reshape(-1, _NODES, 3)
        points = np.concatenate([corners[:-1, None], inner, corners[1:, None]], axis=1)
        normals = points / self.semiaxes**2
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        return np.asarray(np.any(np.sum(normals[:, 1:] * normals[:, :-1], axis=-1) < _TURNED, 1))

    def _closing(self, end: Array, stop: Array, half: float) -> tuple[float, float, float]:
        """Return the distance from the end of a geodesic that was followed to the point where it
        is to stop, the area between both and z = 0 without what a pole makes singular, and the
        size of its terms in a unit of φ.
        """
        (x, y, u), (dx, dy, _) = end / self.semiaxes, (stop - end) / self.semiaxes
        step = math.atan2(x * dy - y * dx, x * (x + dx) + y * (y + dy))
        phi = np.array([math.atan2(y, x)])
        zone, of_pole = self._zone(np.array([u]), phi)[0], self._zone(np.ones(1), phi)[0]
        size = abs(zone) + abs(half) * of_pole
        return float(np.linalg.norm(end - stop)), float((zone - half * of_pole) * step), float(size)

    def _smooth(self, states: Array) -> tuple[Array, Array, Array]:
        """Return F dφ/ds (N, nodes) of states (N·nodes, 10) without what a pole makes singular,
        the sign of that pole or zero (N,), and the size of all terms (N, nodes).
        """
        x, y, u = (states[:, POINT : POINT + 3] / self.semiaxes).T
        rates = states[:, TANGENT : TANGENT + 3] / self.semiaxes
        turns = np.array([x * rates[:, 1], -y * rates[:, 0]]) / (x**2 + y**2)
        turn = turns[0] + turns[1]
        phi, shape = np.arctan2(y, x), (-1, _NODES)
        level = np.mean(u.reshape(shape), axis=1)
        half = np.where(np.abs(level) > _POLAR, np.sign(level), 0.0)
        zone, of_pole = self._zone(u, phi), self._zone(np.ones(u.size), phi)
        size = (np.abs(zone) + np.repeat(np.abs(half), _NODES) * of_pole) * np.sum(
            np.abs(turns), axis=0
        )
        values = (zone - np.repeat(half, _NODES) * of_pole) * turn
        return values.reshape(shape), half, size.reshape(shape)

    def _round_pole(
        self, corners: Array, ends: tuple[Array, Array], half: Array
    ) -> tuple[Array, Array]:
        """Return what was left out near poles between corners (N, 2), and the changes of θ, tan θ =
        √(a/b) tan φ, in which F(1, φ) has its peaks √(b/a) wide.
        """
        a, b = self.semiaxes[:2]
        ratio = math.sqrt(b / a)
        x, y = (corners / (a, b)).T
        for k, end in ((0, ends[0]), (-1, ends[1])):  # at a pole θ is zero on both sides
            x[k], y[k] = end[:2] / (a, b) if np.any(end[:2]) else (1.0, 0.0)
        x = ratio * x
        theta = np.arctan2(y, x)
        # twice the same number: differences are exact where parts are short
        terms = np.array(
            [[x[:-1] * y[1:], y[:-1] * x[1:]], [x[:-1] * np.diff(y), y[:-1] * np.diff(x)]]
        )
        sizes, (plain, near) = np.sum(np.abs(terms), axis=1), terms[:, 0] - terms[:, 1]
        sines = np.where(sizes[0] <= sizes[1], plain, near)
        steps = np.arctan2(sines, x[:-1] * x[1:] + y[:-1] * y[1:])
        zones = np.zeros(half.size)
        for k in np.flatnonzero(half).tolist():
            parts = math.ceil(_TURNS * abs(steps[k]) / ratio) + 1
            if parts > _MOST_PARTS:
                raise Unsolved("too-far", "areas of so long an ellipsoid take too many parts")
            each = steps[k] / parts
            at = theta[k] + each * (np.arange(parts)[:, None] + (GAUSS[0] + 1) / 2)
            x, y = np.cos(at), ratio * np.sin(at)
            zone = self._zone(np.ones(at.shape), np.arctan2(y, x)) / (x * x + y * y)
            zones[k] = half[k] * ratio * each / 2 * float(np.sum(zone * GAUSS[1]))
        return zones, steps

    def _level(self, starts: Array, stops: Array) -> NDArray[np.bool_]:
        """Return whether |β| is the same, but for rounding."""
        s, c = np.abs(starts[:, :2].T)
        off_s, off_c = np.abs(np.abs(stops[:, :2].T) - (s, c))
        near = _ROUNDED * self.text.EPSILON
        return np.asarray((off_s <= near * s) & (off_c <= near * c))

    def _unique(
        self, places: tuple[Array, Array], found: Array, azimuths: Array
    ) -> NDArray[np.bool_]:
        """Return whether no other path is as short: where one is, β₂ = −β₁ (Itoh and Kiyohara,
        2004; on spheroids Sinclair and Tanaka, 2007), and a symmetry makes it of the path.
        """
        one, two = places
        (sb1, cb1, so1, _), (sb2, cb2, so2, _) = one.T, two.T
        opposite = self._level(one, two) & ((sb1 * sb2 < 0) | (sb1 == 0))
        up = np.abs(np.cos(np.radians(azimuths.astype(np.float64)))) > _NO_COMPONENT
        beyond = (found[:, many.GAMMA] < 0) & (so1 * so2 < 0)
        turned = (found[:, many.GAMMA] >= 0) & (found[:, many.KIND] == TURNED)
        in_plane = (cb1 * so1 == 0) & (cb2 * so2 == 0)
        off_plane = np.abs(found[:, many.START + 1]) > _NO_COMPONENT
        mirrored = np.where(in_plane, off_plane, up & (beyond | turned))
        sums = ellipsoidal_point(one, *self.moduli) + ellipsoidal_point(two, *self.moduli)
        # poles of a sphere are so far from its umbilics
        near = _ROUNDED * self.text.EPSILON + 2 * self.text.sqrt(
            self.text.ROUND / self.text.LEAST_K2
        )
        antipodal = np.all(np.abs(sums) <= near, axis=1)
        apart = found[:, many.LENGTH] != 0
        return np.asarray(~(((opposite & mirrored) | antipodal) & apart))
