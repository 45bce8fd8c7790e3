"""Geodesics between points of an ellipsoid with three axes.

from veselova import geodesics
haumea = geodesics.Ellipsoid("Haumea")
haumea.inverse([10, 20], [-35, 160]).s12
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.analytic.closed.surface import Surface
from veselova.analytic.geodesics import many
from veselova.analytic.geodesics.flow import POINT, REDUCED, SCALE, TANGENT
from veselova.analytic.geodesics.shortest import TURNED
from veselova.mechanics.core.arguments import CheckedCall
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import double_array
from veselova.mechanics.core.names import require_name
from veselova.mechanics.geometry.geographic import read_ellipsoid
from veselova.mechanics.geometry.places import (
    PLACES,
    from_places,
    read_places,
    sines_of_degrees,
    to_places,
)

__all__ = ["Ellipsoid", "Geodesics", "Polygon"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Calibrated: roundings of s₁₂ and of the longest semiaxis, and at an umbilic, where phases cancel.
_OF_LENGTH, _OF_AXIS, _AT_UMBILIC = 12.0, 24.0, 800.0

#: Derived: a component of a unit tangent that rounding leaves.
_NO_COMPONENT = 1e-12


class Polygon(NamedTuple):
    """Area and perimeter. The area is positive where the corners go round anticlockwise, seen from
    outside, and at most half of the surface.
    """

    area: float
    perimeter: float


@dataclass(frozen=True)
class Geodesics:
    """Geodesics from points P1 to P2: arrays of one shape, () for one geodesic.

    - s12: length; azi1, azi2: azimuths of the way ahead, degrees from growing β to growing ω
    - v1, v2: (…, 3) unit tangents
    - m12: reduced length; M12, M21: geodesic scales; NaN near umbilics of ellipsoids whose longest
      semiaxis is over 1000 times the shortest
    - caustic: Jacobi's constant c; tangents touch the quadric Σ x_i²/(A_i−c) = 1
    - error: bound of s12, and of m12 times the error of an azimuth in radians
    - unique: whether no symmetry of the points makes another geodesic as short; None from
      ``direct``
    - P1, P2: (…, 2) or (…, 3) in the coordinates that were asked for
    """

    ellipsoid: Ellipsoid
    coordinates: str
    P1: Array
    P2: Array
    s12: Array
    azi1: Array
    azi2: Array
    v1: Array
    v2: Array
    m12: Array
    M12: Array
    M21: Array
    caustic: Array
    error: Array
    unique: NDArray[np.bool_] | None

    def __len__(self) -> int:
        return len(self.s12)

    def __getitem__(self, index: Any) -> Geodesics:
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        kept = ("ellipsoid", "coordinates")
        arrays = {k: x[index] for k, x in values.items() if k not in kept and x is not None}
        return Geodesics(**{**values, **arrays})

    def __repr__(self) -> str:
        return f"Geodesics(s12={self.s12}, azi1={self.azi1}, azi2={self.azi2})"

    def at(self, s: ArrayLike, coordinates: str | None = None) -> Array:
        """Return the points at arc lengths s, (T,) or one, of any sign, from P1: (…, T, 2) or
        (…, T, 3), without T for one.
        """
        lengths = _numbers(s, "s")
        if lengths.ndim > 1:
            raise InvalidInput(("s",), "numbers (T,) or one", f"shape {lengths.shape}")
        coordinates = self.coordinates if coordinates is None else coordinates
        places = self.ellipsoid.follow(self, np.atleast_1d(lengths), coordinates)
        return places if lengths.ndim else places[..., 0, :]

    def plot(self, axes: Any = None) -> Any:
        """Draw the ellipsoid and the geodesics on it; return Matplotlib's axes."""
        import matplotlib.pyplot as plt

        if axes is None:
            axes = plt.figure().add_subplot(projection="3d")
        grid = np.meshgrid(np.linspace(-90, 90, 37), np.linspace(-180, 180, 73))
        surface = self.ellipsoid.cartesian(np.stack(grid, axis=-1), "parametric")
        axes.plot_wireframe(*np.moveaxis(surface, -1, 0), rcount=12, ccount=12, linewidth=0.3)
        for i in np.ndindex(self.s12.shape):
            lengths = np.linspace(0, float(self.s12[i]), 200)
            axes.plot(*self[i].at(lengths, "cartesian").T)
        axes.set_box_aspect(self.ellipsoid.semiaxes)
        return axes


class Ellipsoid(metaclass=CheckedCall):
    """The ellipsoid x²/a² + y²/b² + z²/c² = 1 with semiaxes in any order and unit.

    - ellipsoid: a name of ``geographic.ELLIPSOIDS``, or (a, b, c), numbers or text

    Points are "geodetic" (φ, λ of the normal), "parametric" (φ, λ of x/a, y/b, z/c), "ellipsoidal"
    (β, ω of Jacobi along the sorted axes), each in degrees, or "cartesian".

    Raises InvalidInput, with all faults. Accuracy: ``Geodesics.error``; tested against 25 digits on
    twelve ellipsoids, from the sphere to a needle.
    """

    def __init__(self, ellipsoid: str | Sequence[Any]) -> None:
        exact = read_ellipsoid(ellipsoid)
        self.semiaxes = np.array([float(x) for x in exact])
        self._order = np.argsort(-self.semiaxes, kind="stable")
        self._surface = Surface(*(exact[i] for i in self._order))
        self._unit = float(self.semiaxes[self._order[1]])
        # of a permutation, by which the sense of a turn changes
        self._sense = round(float(np.linalg.det(np.eye(3)[self._order])))

    def __repr__(self) -> str:
        return f"Ellipsoid({', '.join(f'{x:.12g}' for x in self.semiaxes)})"

    @property
    def area(self) -> float:
        """Return the area of the surface."""
        return self._surface.area * self._unit**2

    def cartesian(self, P: ArrayLike, coordinates: str = "geodetic") -> Array:
        """Return x, y, z (…, 3) of points P (…, 2) in degrees."""
        require_name(coordinates, ("coordinates",), PLACES)
        given = read_places(P, "P", coordinates, self.semiaxes, normalize=False)
        rows = given.reshape(-1, given.shape[-1])
        if coordinates == "ellipsoidal":
            X = self._unsorted(self._surface.points(sines_of_degrees(rows))) * self._unit
        else:
            X = self.semiaxes * from_places(rows, coordinates, self.semiaxes)
        return np.asarray(X.reshape(*given.shape[:-1], 3))

    def inverse(
        self,
        P: ArrayLike,
        Q: ArrayLike,
        coordinates: str = "geodetic",
        *,
        normalize: bool = False,
    ) -> Geodesics:
        """Return the shortest geodesics from P to Q, (…, 2) in degrees or (…, 3), broadcast.

        normalize: whether "cartesian" points off the ellipsoid are moved to it along its normal.
        Of two of one length it is that which starts towards the pole of the point with the larger
        |β|. Where P or Q has NaN the numbers are NaN.
        """
        require_name(coordinates, ("coordinates",), PLACES)
        faults = Faults()
        given = [
            faults.attempt(read_places, x, name, coordinates, self.semiaxes, normalize=normalize)
            for x, name in ((P, "P"), (Q, "Q"))
        ]
        faults.require_none()
        one, two = _broadcast(*given)
        places = [self._places(x, coordinates) for x in (one, two)]
        found = self._surface.shortest(*places)
        return self._result(coordinates, (one, two), places, found, _unique(places, found))

    def direct(
        self,
        P: ArrayLike,
        azi1: ArrayLike,
        s12: ArrayLike,
        coordinates: str = "geodetic",
        *,
        normalize: bool = False,
    ) -> Geodesics:
        """Return the geodesics from P in the directions azi1, degrees from growing β to growing ω,
        of length s12, back where that is negative; broadcast.
        """
        require_name(coordinates, ("coordinates",), PLACES)
        faults = Faults()
        read = faults.attempt(read_places, P, "P", coordinates, self.semiaxes, normalize=normalize)
        numbers = [faults.attempt(_numbers, x, name) for x, name in ((azi1, "azi1"), (s12, "s12"))]
        faults.require_none()
        shape = np.broadcast_shapes(read.shape[:-1], *(x.shape for x in numbers))
        one = np.broadcast_to(read, (*shape, read.shape[-1]))
        azimuths, lengths = (np.broadcast_to(x, shape).ravel() for x in numbers)
        starts = self._places(one, coordinates)
        points = self._surface.points(starts)
        tangents, gammas = self._surface.starts(starts, azimuths)
        lengths = lengths / self._unit
        states = self._surface.follow(points, tangents, lengths[:, None])[:, 0]
        ends = self._surface.places(states[:, :3] / self._surface.semiaxes)
        fields_ = states[:, [REDUCED, SCALE, REDUCED + 1]]
        kinds = np.zeros(lengths.size)
        columns = lengths, tangents, states[:, TANGENT : TANGENT + 3], fields_, gammas, kinds
        found = np.column_stack(columns)
        U = self._unsorted(states[:, :3]) * self._unit / self.semiaxes
        two = to_places(U, ends, coordinates, self.semiaxes).reshape(*shape, -1)
        return self._result(coordinates, (one, two), [starts, ends], found, None)

    def follow(self, lines: Geodesics, lengths: Array, coordinates: str) -> Array:
        """Return the points (…, T, 2) or (…, T, 3) at lengths (T,) along geodesics."""
        require_name(coordinates, ("coordinates",), PLACES)
        points = self._surface.points(self._places(lines.P1, lines.coordinates))
        tangents = lines.v1.reshape(-1, 3)[:, self._order]
        each = np.broadcast_to(lengths / self._unit, (len(points), lengths.size))
        found = self._surface.follow(points, tangents, each)[..., POINT : POINT + 3].reshape(-1, 3)
        U = self._unsorted(found) * self._unit / self.semiaxes
        ends = self._surface.places(U[:, self._order])
        shape = (*lines.s12.shape, lengths.size, -1)
        return to_places(U, ends, coordinates, self.semiaxes).reshape(shape)

    def polygon(self, points: ArrayLike, coordinates: str = "geodetic") -> Polygon:
        """Return area and perimeter of the polygon of shortest geodesics through points (N, 2) in
        degrees or (N, 3), and back to the first; a corner more than half of the way round a pole
        counts too.
        """
        require_name(coordinates, ("coordinates",), PLACES)
        corners = read_places(points, "points", coordinates, self.semiaxes, normalize=False)
        if corners.ndim != 2 or len(corners) < 3 or not np.all(np.isfinite(corners)):
            required = "three finite points or more, (N, 2) or (N, 3)"
            raise InvalidInput(("points",), required, show(points))
        places = self._places(corners, coordinates)
        sides = self._surface.shortest(places, np.roll(places, -1, axis=0))
        starts = self._surface.points(places)
        area, turn = 0.0, 0.0
        stops = np.roll(starts, -1, axis=0)
        for point, stop, side in zip(starts, stops, sides, strict=True):
            part, step = self._surface.under(point, side[1:4], stop, side[0])
            area, turn = area - part, turn + step
        whole = self._surface.area
        if round(turn / (2 * np.pi)) % 2:  # round a pole
            area += whole / 2
        area = self._sense * (area - whole * round(area / whole))
        return Polygon(area * self._unit**2, float(np.sum(sides[:, 0])) * self._unit)

    def _places(self, given: Array, coordinates: str) -> Array:
        """Return sines and cosines of β and ω (N, 4)."""
        rows = given.reshape(-1, given.shape[-1])
        if coordinates == "ellipsoidal":
            return sines_of_degrees(rows)
        U = from_places(rows, coordinates, self.semiaxes)
        return self._surface.places(U[:, self._order])

    def _unsorted(self, vectors: Array) -> Array:
        result = np.empty_like(vectors)
        result[:, self._order] = vectors
        return result

    def _result(
        self,
        coordinates: str,
        ends: tuple[Array, Array],
        places: list[Array],
        found: Array,
        unique: Any,
    ) -> Geodesics:
        shape, unit = ends[0].shape[:-1], self._unit
        v1, v2 = found[:, many.START : many.STOP], found[:, many.STOP : many.FIELDS]
        umbilic = np.any([np.maximum(x[:, 1], np.abs(x[:, 2])) < 1e-9 for x in places], axis=0)
        axis = np.where(umbilic, _AT_UMBILIC, _OF_AXIS) * self._surface.semiaxes[0]
        error = _EPSILON * (_OF_LENGTH * np.abs(found[:, 0]) + axis)
        numbers = {
            "s12": found[:, many.LENGTH] * unit,
            "azi1": self._surface.azimuths(places[0], v1, False),
            "azi2": self._surface.azimuths(places[1], v2, True),
            "m12": found[:, many.FIELDS] * unit,
            "M12": found[:, many.FIELDS + 1],
            "M21": found[:, many.FIELDS + 2],
            "caustic": (1 - found[:, many.GAMMA]) * unit**2,
            "error": error * unit,
        }
        vectors = {"v1": self._unsorted(v1), "v2": self._unsorted(v2)}
        return Geodesics(
            ellipsoid=self,
            coordinates=coordinates,
            P1=ends[0],
            P2=ends[1],
            unique=None if unique is None else unique.reshape(shape),
            **{name: x.reshape(shape)[()] for name, x in numbers.items()},
            **{name: x.reshape(*shape, 3) for name, x in vectors.items()},
        )


def _numbers(values: ArrayLike, name: str) -> Array:
    """Return finite numbers as an array."""
    array = double_array(values, (name,), "finite numbers")
    if not np.all(np.isfinite(array)):
        raise InvalidInput((name,), "finite numbers", show(values))
    return array


def _broadcast(one: Array, two: Array) -> tuple[Array, Array]:
    try:
        shape = np.broadcast_shapes(one.shape[:-1], two.shape[:-1])
    except ValueError:
        given = f"shapes {one.shape} and {two.shape}"
        raise InvalidInput(("Q",), "points of a shape that fits that of P", given) from None
    return tuple(np.broadcast_to(x, (*shape, x.shape[-1])) for x in (one, two))  # type: ignore[return-value]


def _unique(places: list[Array], found: Array) -> NDArray[np.bool_]:
    """Return whether no symmetry that keeps or exchanges the ends makes another path of them."""
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
    cut = (sb1 == -sb2) & (sb1 != 0) & (beyond | turned)
    antipodal = np.all(one * [-1, 1, -1, -1] == two, axis=1)
    twisted = antipodal & np.any(np.abs(v1 - v2) > _NO_COMPONENT, axis=1)
    apart = found[:, many.LENGTH] != 0
    return np.asarray(~((np.any(others, axis=0) | cut | twisted) & apart))
