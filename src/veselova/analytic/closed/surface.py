"""An ellipsoid with its axes sorted and its middle semiaxis one, and arrays of geodesics on it, in
doubles or in balls.
"""

from __future__ import annotations

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
from veselova.analytic.geodesics.flow import REDUCED, ROWS, SCALE, TANGENT
from veselova.analytic.geodesics.integrals import Shape
from veselova.analytic.geodesics.shortest import TURNED
from veselova.analytic.kernel.arithmetic import EPSILON
from veselova.analytic.kernel.compiler import prepare
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.geometry.geographic import ellipsoidal_point, ellipsoidal_sines
from veselova.mechanics.geometry.places import from_places, sines_of_degrees, to_places

__all__ = ["TEXT", "Surface"]

Array = NDArray[Any]

#: Budget: geodesics between two checkpoints, some milliseconds.
_CHUNK = 200

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
        K1, K2 = (max(x, self.text.ROUND) for x in differences)
        if differences[0] < self.text.ROUND:  # a sphere is oblate
            K1, K2 = self.text.LEAST_K1, max(K2, self.text.LEAST_K2)
        first, third = numbers([a / b, c / b])
        squares = first**2 + (K1 - differences[0]), numbers(1)[()], third**2 - (K2 - differences[1])
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
        # farther from a pole than the umbilics of a spheroid are, and below rounding on a disc
        near = self.text.NUDGE * self.shape.c / self.shape.a
        U = from_places(points, coordinates, self.given, near)
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
        found in all digits. A point's way to itself starts towards growing β.
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
        # one pole by two longitudes too
        same = found[:, many.LENGTH] <= 4 * self.text.NUDGE * self.shape.a
        same |= finite & np.all(starts == stops, axis=1)
        if np.any(same):
            found[same] = self._at_once(starts[same])
        return found

    def _at_once(self, places: Array) -> Array:
        """Return the geodesics of no length, towards growing β."""
        found = np.zeros((len(places), many.COLUMNS), dtype=places.dtype)
        tangents, found[:, many.GAMMA] = self.tangents(places, found[:, many.LENGTH])
        found[:, many.START : many.FIELDS] = np.tile(tangents, 2)
        found[:, many.FIELDS + 1 : many.GAMMA] = 1.0
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
        tangents, gammas = self.tangents(starts, azimuths)
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
                given = squares, points[i], np.array(tangents[i]), lengths[i, part]
                if part.size and self.text.follow(*given, way) < part.size:
                    raise Unsolved(
                        "too-far",
                        f"a geodesic takes more than {flow.MOST_STEPS} steps of its series",
                    )
                states[i, part] = way
        return states

    def tangents(self, places: Array, azimuths: Array) -> tuple[Array, Array]:
        """Return unit tangents (N, 3), and γ (N,), of azimuths in degrees at places (N, 4)."""
        tangents, gammas = np.empty_like(places[:, :3]), np.empty_like(places[:, 0])
        self.text.set_starts(self.shape, places, np.array(azimuths), tangents, gammas)
        return tangents, gammas

    def azimuths(self, places: Array, tangents: Array) -> Array:
        """Return degrees (N,) from growing β towards growing ω."""
        azimuths = np.full(len(places), np.nan, dtype=places.dtype)
        self.text.set_azimuths(self.shape, places, np.array(tangents, order="C"), azimuths)
        return azimuths

    @cached_property
    def area(self) -> float:
        """Return the surface, 4π R_G(a²b², a²c², b²c²)."""
        from scipy.special import elliprg

        a, b, c = self.semiaxes
        return float(4 * np.pi * elliprg((a * b) ** 2, (a * c) ** 2, (b * c) ** 2))

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
            self.text.LEAST_K1 / self.text.LEAST_K2
        )
        antipodal = np.all(np.abs(sums) <= near, axis=1)
        apart = found[:, many.LENGTH] != 0
        return np.asarray(~(((opposite & mirrored) | antipodal) & apart))
