"""An ellipsoid with its axes sorted and its middle semiaxis one, and arrays of geodesics on it."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.geodesics import flow, many
from veselova.analytic.geodesics.flow import POINT, ROWS, TANGENT
from veselova.analytic.geodesics.integrals import Shape
from veselova.analytic.geodesics.shortest import LEAST_K2, ROUND
from veselova.analytic.kernel.compiler import prepare
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.geometry.geographic import ellipsoidal_point, ellipsoidal_sines

__all__ = ["Surface"]

Array = NDArray[np.float64]

#: Budget: geodesics between two checkpoints, some milliseconds.
_CHUNK = 200

#: Method: Gauss–Legendre nodes on one part of a side, and parts in a unit of length, and in one of
#: longitude round a pole.
_NODES, _PARTS, _TURNS = 16, 3.0, 1.5


class Surface:
    """The ellipsoid of three exact semiaxes a ≥ b ≥ c, in units of b."""

    def __init__(self, a: Fraction, b: Fraction, c: Fraction) -> None:
        K1 = max(float((a - b) * (a + b) / b**2), ROUND)
        K2 = float((b - c) * (b + c) / b**2)
        K2 = max(K2, ROUND if K1 > ROUND else LEAST_K2)  # a sphere is an oblate spheroid
        first, third = a / b, c / b
        squares = float(first**2), 1.0, float(third**2)
        self.shape = Shape(float(first), float(third), *squares, K1, K2)
        whole = K1 + K2
        #: k² and k'², which differences of rounded semiaxes would not give.
        self.moduli = K2 / whole, K1 / whole
        self.semiaxes = np.array([float(a / b), 1.0, float(c / b)])

    def places(self, U: Array) -> Array:
        """Return sines and cosines of β and ω (N, 4) of points x/a, y/b, z/c (N, 3)."""
        return ellipsoidal_sines(U, *self.moduli)

    def shortest(self, starts: Array, stops: Array) -> Array:
        """Return the geodesics (N, 12) of ``many`` between places (N, 4); NaN where these are."""
        prepare()
        found = np.full((len(starts), many.COLUMNS), np.nan)
        finite = np.all(np.isfinite(starts) & np.isfinite(stops), axis=1)
        rows = np.flatnonzero(finite)
        for k in range(0, rows.size, _CHUNK):
            checkpoint("geodesics", k, rows.size)
            part = rows[k : k + _CHUNK]
            solved = np.empty((part.size, many.COLUMNS))
            many.solve_pairs(self.shape, starts[part], stops[part], solved)
            found[part] = solved
        same = finite & np.all(starts == stops, axis=1)
        found[same, many.STOP : many.FIELDS] = found[same, many.START : many.STOP]
        found[same, many.LENGTH] = 0.0
        found[same, many.FIELDS : many.GAMMA] = 0.0, 1.0, 1.0
        return found

    def points(self, places: Array) -> Array:
        """Return the points (N, 3) of places (N, 4)."""
        return np.asarray(self.semiaxes * ellipsoidal_point(places, *self.moduli))

    def starts(self, places: Array, azimuths: Array) -> tuple[Array, Array]:
        """Return the tangents (N, 3), and γ (N,), of azimuths in degrees at places."""
        prepare()
        tangents, gammas = np.empty((len(places), 3)), np.empty(len(places))
        many.set_starts(self.shape, places, azimuths, tangents, gammas)
        return tangents, gammas

    def follow(self, points: Array, tangents: Array, lengths: Array) -> Array:
        """Return the states (N, T, 10) of ``flow`` at lengths (N, T), of any sign and order."""
        prepare()
        states, squares = np.full((*lengths.shape, ROWS), np.nan), self.semiaxes**2
        finite = np.all(np.isfinite(points) & np.isfinite(tangents), axis=1)
        for i in np.flatnonzero(finite).tolist():
            checkpoint("geodesics", i, len(points))
            order = np.argsort(np.abs(lengths[i]), kind="stable")
            for part in (order[lengths[i][order] >= 0], order[lengths[i][order] < 0]):
                way = np.empty((part.size, ROWS))
                given = squares, points[i], tangents[i], lengths[i, part]
                if part.size and flow.follow(*given, way) < part.size:
                    raise Unsolved(
                        "too-far",
                        f"a geodesic takes more than {flow.MOST_STEPS} steps of its series",
                    )
                states[i, part] = way
        return states

    def azimuths(self, places: Array, tangents: Array, arrive: bool) -> Array:
        """Return degrees (N,) from growing β towards growing ω."""
        azimuths = np.full(len(places), np.nan)
        many.set_azimuths(self.shape, places, tangents, np.bool_(arrive), azimuths)
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
        (x[0], y[0]), (x[-1], y[-1]) = point[:2] / (a, b), stop[:2] / (a, b)
        phi = np.arctan2(y, x)
        steps = np.arctan2(x[:-1] * y[1:] - y[:-1] * x[1:], x[:-1] * x[1:] + y[:-1] * y[1:])
        for k in range(count):
            parts = math.ceil(_TURNS * abs(steps[k])) + 1
            each = steps[k] / parts
            at = phi[k] + each * (np.arange(parts)[:, None] + (nodes + 1) / 2)
            zone = self._zone(np.ones(at.size), at.ravel()).reshape(at.shape)
            total += half[k] * each / 2 * float(np.sum(zone * weights))
        return total, float(np.sum(steps))
