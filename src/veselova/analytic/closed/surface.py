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

__all__ = ["TEXT", "Surface"]

Array = NDArray[Any]

#: Budget: geodesics between two checkpoints, some milliseconds.
_CHUNK = 200

#: Method: Gauss–Legendre nodes on one part of a side, and parts in a unit of length, and in one of
#: longitude round a pole.
_NODES, _PARTS, _TURNS = 16, 3.0, 1.5

_EPSILON = float(np.finfo(float).eps)

#: Calibrated: roundings of s₁₂ and of the longest semiaxis, and at an umbilic, where phases cancel.
_OF_LENGTH, _OF_AXIS, _AT_UMBILIC = 12.0, 24.0, 800.0

#: Derived: a component of a unit tangent that rounding leaves.
_NO_COMPONENT = 1e-12

#: Derived: what sines of equal latitudes differ by; the cosine of a spheroid's pole.
_ROUNDED, _AT_POLE = 8 * _EPSILON, 1e-9

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
        return self.places(from_places(points, coordinates, self.given)[:, self.order])

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
        """Return the geodesics (N, 12) of ``many`` between places (N, 4); NaN where these are."""
        if self.is_double:
            prepare()
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
        return self.numbers((starts, stops), found) | {
            "unique": self._unique((starts, stops), found)
        }

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
        umbilic = np.any([np.maximum(x[:, 1], np.abs(x[:, 2])) < 1e-9 for x in places], axis=0)
        axis = np.where(umbilic, _AT_UMBILIC, _OF_AXIS) * self.semiaxes[0]
        return {
            "s12": found[:, many.LENGTH] * self.unit,
            "azi1": self.azimuths(places[0], v1, False),
            "azi2": self.azimuths(places[1], v2, True),
            "v1": self.unsorted(v1),
            "v2": self.unsorted(v2),
            "m12": found[:, many.FIELDS] * self.unit,
            "M12": found[:, many.FIELDS + 1],
            "M21": found[:, many.FIELDS + 2],
            "caustic": (1 - found[:, many.GAMMA]) * self.unit**2,
            "error": _EPSILON * (_OF_LENGTH * np.abs(found[:, 0]) + axis) * self.unit,
        }

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

    def azimuths(self, places: Array, tangents: Array, arrive: bool) -> Array:
        """Return degrees (N,) from growing β towards growing ω."""
        azimuths = np.full(len(places), np.nan, dtype=places.dtype)
        self.text.set_azimuths(self.shape, places, tangents, np.bool_(arrive), azimuths)
        return azimuths

    @cached_property
    def area(self) -> float:
        """Return the surface."""
        phi = np.linspace(0, 2 * np.pi, 256, endpoint=False)
        return float(4 * np.pi * np.mean(self._zone(np.ones(256), phi)))

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
        self, point: Array, tangent: Array, stop: Array, length: float
    ) -> tuple[float, float]:
        """Return the area between a geodesic and z = 0, positive where it goes east at z > 0, and
        the change of φ; point, stop: (3,) its ends, which say at a pole too what φ is.
        """
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        count = max(4, math.ceil(_PARTS * length))
        edges = np.linspace(0, length, count + 1)
        inner = (edges[:-1, None] + np.diff(edges)[:, None] * (nodes + 1) / 2).ravel()
        states = self.follow(point[None], tangent[None], np.append(edges, inner)[None])[0]
        a, b, c = self.semiaxes
        x, y, u = (states[:, POINT : POINT + 3] / (a, b, c)).T
        rates = states[:, TANGENT : TANGENT + 3] / (a, b, c)
        corners, rest = slice(0, count + 1), slice(count + 1, None)
        turn = (x * rates[:, 1] - y * rates[:, 0])[rest] / (x**2 + y**2)[rest]
        phi = np.arctan2(y, x)
        half = np.where(np.mean(u[rest].reshape(count, -1), axis=1) >= 0, 1.0, -1.0)
        pole = np.repeat(half, _NODES)
        # what a pole makes singular is integrated by φ
        smooth = self._zone(u[rest], phi[rest]) - pole * self._zone(np.ones(pole.size), phi[rest])
        total = float(np.sum(smooth * turn * np.tile(weights, count)) * length / count / 2)
        x, y = x[corners], y[corners]
        for k, end in ((0, point), (-1, stop)):  # at a pole φ is zero on both sides of a corner
            x[k], y[k] = end[:2] / (a, b) if np.any(end[:2]) else (1.0, 0.0)
        phi = np.arctan2(y, x)
        steps = np.arctan2(x[:-1] * y[1:] - y[:-1] * x[1:], x[:-1] * x[1:] + y[:-1] * y[1:])
        for k in range(count):
            parts = math.ceil(_TURNS * abs(steps[k])) + 1
            each = steps[k] / parts
            at = phi[k] + each * (np.arange(parts)[:, None] + (nodes + 1) / 2)
            zone = self._zone(np.ones(at.size), at.ravel()).reshape(at.shape)
            total += half[k] * each / 2 * float(np.sum(zone * weights))
        return total, float(np.sum(steps))

    def _unique(self, places: tuple[Array, Array], found: Array) -> NDArray[np.bool_]:
        """Return whether no symmetry that keeps or exchanges the ends makes another such path."""
        one, two = places
        v1, v2 = found[:, many.START : many.STOP], found[:, many.STOP : many.FIELDS]
        (sb1, cb1, so1, co1), (sb2, cb2, so2, co2) = one.T, two.T
        in_planes = (
            (co1 == 0) & (co2 == 0),
            (cb1 * so1 == 0) & (cb2 * so2 == 0),
            (sb1 == 0) & (sb2 == 0),
        )
        others = [fixed & (np.abs(v1[:, k]) > _NO_COMPONENT) for k, fixed in enumerate(in_planes)]
        beyond = (found[:, many.GAMMA] < 0) & (so1 * so2 < 0)
        turned = (found[:, many.GAMMA] >= 0) & (found[:, many.KIND] == TURNED)
        # sines of one latitude, rounded twice
        same = np.abs(sb1 + sb2) <= (_ROUNDED * np.abs(sb1) if self.is_double else 0)
        cut = same & (sb1 != 0) & (beyond | turned)
        on_axis = self.shape.K1 <= self.text.ROUND, self.shape.K2 <= self.text.LEAST_K2
        poles = on_axis[0] & (cb1 < _AT_POLE) & (cb2 < _AT_POLE) & (sb1 * sb2 < 0)
        poles |= on_axis[1] & (np.abs(so1) < _AT_POLE) & (np.abs(so2) < _AT_POLE) & (co1 * co2 < 0)
        antipodal = np.all(one * [-1, 1, -1, -1] == two, axis=1)
        twisted = antipodal & np.any(np.abs(v1 - v2) > _NO_COMPONENT, axis=1)
        apart = found[:, many.LENGTH] != 0
        return np.asarray(~((np.any(others, axis=0) | cut | twisted | poles) & apart))
