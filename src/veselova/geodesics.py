"""Geodesics between points of an ellipsoid with three axes.

from veselova import geodesics
haumea = geodesics.Ellipsoid("Haumea")
haumea.inverse([10, 20], [-35, 160]).s12
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.analytic.closed.polygons import polygon_area
from veselova.analytic.closed.surface import Surface
from veselova.analytic.geodesics.flow import POINT
from veselova.mechanics.core.arguments import (
    FEWEST_DIGITS,
    MOST_DIGITS,
    CheckedCall,
    read_precision,
    require_name,
    require_truth_value,
    whole_number,
)
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import double_array
from veselova.mechanics.geometry.geographic import read_ellipsoid
from veselova.mechanics.geometry.places import (
    PLACES,
    exact_array,
    from_places,
    read_places,
    sines_of_degrees,
)

__all__ = ["Ellipsoid", "Geodesics", "Polygon"]

Array = NDArray[Any]

#: Budget: most digits of ``direct``, whose series take seconds.
_MOST_OF_DIRECT = 250


@dataclass(frozen=True)
class Polygon:
    """Area and perimeter, as which it can be unpacked, and bounds of their errors. The area is
    positive where the corners go round anticlockwise, seen from outside, and at most half of the
    surface.
    """

    area: float
    perimeter: float
    area_error: float
    perimeter_error: float

    def __iter__(self) -> Iterator[float]:
        return iter((self.area, self.perimeter))


@dataclass(frozen=True)
class Geodesics:
    """Geodesics from points P1 to P2: arrays of one shape, () for one geodesic.

    - s12: length; azi1, azi2: azimuths of the way ahead, degrees from growing β to growing ω, at
      the pole of a spheroid or sphere those of its longitude; at an umbilic, where they count half
      of the angle from the middle ellipse, in (−90, 90]. From a point to itself azi1 is 0
    - v1, v2: (…, 3) unit tangents
    - m12: reduced length; M12, M21: geodesic scales; NaN near umbilics of ellipsoids whose longest
      semiaxis is over 1e6 times the shortest, where series take seconds
    - caustic: Jacobi's constant c; tangents touch the quadric Σ x_i²/(A_i−c) = 1
    - error: bound of s12, and of m12 times the error of an azimuth in radians
    - unique: whether no other geodesic is as short; None from ``direct``. certified: True is
      proven, False found by symmetry, None not known, on the line β₂ = −β₁
    - P1, P2: (…, 2) or (…, 3) in the coordinates that were asked for
    - decimals: the numbers to more digits than doubles have, by name; ``decimals.radii`` are their
      errors; None in doubles
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
    decimals: Decimals | None = None

    def __len__(self) -> int:
        return len(self.s12)

    def __getitem__(self, index: Any) -> Geodesics:
        kept = ("ellipsoid", "coordinates", "decimals")
        given = {k: x for k, x in vars(self).items() if k not in kept and x is not None}
        arrays: dict[str, Any] = {k: x[index] for k, x in given.items()}
        if self.decimals is not None:
            arrays["decimals"] = _changed(self.decimals, lambda x: x[index])
        return replace(self, **arrays)

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
        self._exact = read_ellipsoid(ellipsoid)
        self._surface = Surface(self._exact)
        self.semiaxes, self._unit = self._surface.given, float(self._surface.unit)
        # of a permutation, by which the sense of a turn changes
        self._sense = round(float(np.linalg.det(np.eye(3)[self._surface.order])))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._exact,)

    def __repr__(self) -> str:
        return f"Ellipsoid({', '.join(f'{x:.12g}' for x in self.semiaxes)})"

    @property
    def area(self) -> float:
        """Return the area of the surface."""
        return float(self._surface.area * self._unit**2)

    def cartesian(
        self, P: ArrayLike, coordinates: str = "geodetic", *, normalize: bool = False
    ) -> Array:
        """Return x, y, z (…, 3) of points P (…, 2) in degrees, or (…, 3)."""
        require_name(coordinates, ("coordinates",), PLACES)
        given = read_places(P, "P", coordinates, self.semiaxes, normalize=normalize)
        rows = given.reshape(-1, given.shape[-1])
        if coordinates == "ellipsoidal":
            X = self._surface.unsorted(self._surface.points(sines_of_degrees(rows))) * self._unit
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
        digits: int = FEWEST_DIGITS,
        certified: bool = False,
    ) -> Geodesics:
        """Return the shortest geodesics from P to Q, (…, 2) in degrees or (…, 3), broadcast.

        normalize: whether "cartesian" points off the ellipsoid are moved to it along its normal.
        Of two of one length it is that which starts towards the pole of the point with the larger
        |β|, of P if they are equal. Where P or Q has NaN the numbers are NaN.

        digits (15 … 1000): beyond 15 ``decimals`` has all numbers to 10^−digits, of the larger of
        one, of b for lengths, and of themselves. P and Q are then taken exactly, text too, and
        "cartesian" ones scaled to the ellipsoid. Radii are estimated from two working precisions.
        m12, M12 and M21 are unknown (radius infinite) at umbilics and between points of the middle
        ellipse beyond 250 digits. certified: ``decimals`` has s12 alone, whose radius is a proven
        bound of the distance. A pair of points takes 0.2 s at 50 digits and 20 s at 1000;
        at poles, umbilics and on meridians up to twenty times as long, certified hours at 1000.

        Raises InvalidInput, with all faults, and Unsolved where the digits are not reached
        (``no-digit-left``) or nothing is proven (``not-enclosed``).
        """
        beyond = _require_digits(coordinates, digits, MOST_DIGITS, certified, normalize)
        faults = Faults()
        given = self._ends(faults, P, Q, coordinates, normalize=normalize, exact=beyond)
        faults.require_none()
        required = "points of a shape that fits that of P"
        shape = _common_shape("Q", required, given, [])
        one, two = (np.broadcast_to(x, (*shape, x.shape[-1])) for x in given)
        rows = [x.reshape(-1, x.shape[-1]) for x in (one, two)]

        def places(surface: Surface) -> tuple[Array, Array]:
            return surface.read(rows[0], coordinates), surface.read(rows[1], coordinates)

        solve = lambda surface: surface.inverse(*places(surface))  # noqa: E731
        numbers, decimals = self._solve(solve, digits, beyond)
        if certified:
            from veselova.analytic.closed.geodesic_digits import proven_lengths

            decimals, proven = proven_lengths(self._exact, digits, places)
            known = proven | ~numbers["unique"]
            numbers["unique"] = numbers["unique"].astype(object)
            numbers["unique"][~known] = None
        return self._result(coordinates, {"P1": one, "P2": two} | numbers, decimals)

    def direct(
        self,
        P: ArrayLike,
        azi1: ArrayLike,
        s12: ArrayLike,
        coordinates: str = "geodetic",
        *,
        normalize: bool = False,
        digits: int = FEWEST_DIGITS,
    ) -> Geodesics:
        """Return the geodesics from P in the directions azi1, degrees from growing β to growing ω,
        of length s12, back where that is negative; broadcast.

        digits (15 … 250): as in ``inverse``; ``decimals`` has P2 too.
        """
        beyond = _require_digits(coordinates, digits, _MOST_OF_DIRECT, False, normalize)
        faults = Faults()
        options = {"normalize": normalize, "exact": beyond}
        read = faults.attempt(read_places, P, "P", coordinates, self.semiaxes, **options)
        own = exact_array if beyond else _numbers
        numbers = [faults.attempt(own, x, name) for x, name in ((azi1, "azi1"), (s12, "s12"))]
        faults.require_none()
        required = "points and numbers that can be broadcast together"
        shape = _common_shape("azi1", required, [read], numbers)
        one = np.broadcast_to(read, (*shape, read.shape[-1]))
        azimuths, lengths = (np.broadcast_to(x, shape).ravel() for x in numbers)
        rows = one.reshape(-1, one.shape[-1])

        def solve(surface: Surface) -> dict[str, Array]:
            starts = surface.read(rows, coordinates)
            return surface.direct(starts, azimuths, lengths, coordinates)

        found, decimals = self._solve(solve, digits, beyond)
        return self._result(coordinates, {"P1": one} | found, decimals)

    def geodesics_between(
        self,
        P: ArrayLike,
        Q: ArrayLike,
        count: int,
        coordinates: str = "geodetic",
        *,
        normalize: bool = False,
    ) -> Geodesics:
        """Return the ``count`` (1 … 100) shortest of all geodesics from P to Q, (2,) or (3,), by
        growing length: the shortest, those round the other side, and those that go round more than
        once. Two that differ by less than 1e-6 in length, in units of b, and direction count as
        one.

        Raises InvalidInput, and Unsolved between umbilics, poles of a spheroid or points of a
        sphere that are equal or opposite, which infinitely many join (``continuous-family``).
        """
        from veselova.analytic.closed.between import geodesics_between  # loads SciPy

        require_name(coordinates, ("coordinates",), PLACES)
        faults = Faults()
        faults.attempt(whole_number, count, ("count",), 1, 100)
        ends = self._ends(faults, P, Q, coordinates, normalize=normalize)
        for x, name in zip(ends, ("P", "Q"), strict=True):
            if x is not None and x.ndim > 1:
                faults.add((name,), "one point", f"shape {x.shape}")
        faults.require_none()
        places = [self._surface.read(x[None], coordinates)[0] for x in ends]
        numbers = geodesics_between(self._surface, places[0], places[1], count)
        many = {name: np.tile(x, (count, 1)) for name, x in zip(("P1", "P2"), ends, strict=True)}
        return self._result(coordinates, many | numbers, None)

    def follow(self, lines: Geodesics, lengths: Array, coordinates: str) -> Array:
        """Return the points (…, T, 2) or (…, T, 3) at lengths (T,) along geodesics."""
        require_name(coordinates, ("coordinates",), PLACES)
        starts = lines.P1.reshape(-1, lines.P1.shape[-1])
        points = self._surface.points(self._surface.read(starts, lines.coordinates))
        tangents = lines.v1.reshape(-1, 3)[:, self._surface.order]
        each = np.broadcast_to(lengths / self._unit, (len(points), lengths.size))
        found = self._surface.follow(points, tangents, each)[..., POINT : POINT + 3].reshape(-1, 3)
        shape = (*lines.s12.shape, lengths.size, 3 if coordinates == "cartesian" else 2)
        return self._surface.show(found, coordinates).reshape(shape)

    def polygon(
        self, points: ArrayLike, coordinates: str = "geodetic", *, normalize: bool = False
    ) -> Polygon:
        """Return area and perimeter of the polygon of shortest geodesics through points (N, 2) in
        degrees or (N, 3), and back to the first; a corner more than half of the way round a pole
        counts too.
        """
        require_name(coordinates, ("coordinates",), PLACES)
        corners = read_places(points, "points", coordinates, self.semiaxes, normalize=normalize)
        if corners.ndim != 2 or len(corners) < 3 or not np.all(np.isfinite(corners)):
            required = "three finite points or more, (N, 2) or (N, 3)"
            raise InvalidInput(("points",), required, show(points))
        places = self._surface.read(corners, coordinates)
        sides = self._surface.shortest(places, np.roll(places, -1, axis=0))
        starts = self._surface.points(places)
        errors = self._surface.errors((places, np.roll(places, -1, axis=0)), sides[:, 0])
        area, off = polygon_area(self._surface, starts, sides, errors)
        perimeter, error = (float(np.sum(x)) * self._unit for x in (sides[:, 0], errors))
        return Polygon(self._sense * area * self._unit**2, perimeter, off * self._unit**2, error)

    def _ends(self, faults: Faults, P: Any, Q: Any, coordinates: str, **options: bool) -> list[Any]:
        """Return the points P and Q, None where they are at fault."""
        return [
            faults.attempt(read_places, x, name, coordinates, self.semiaxes, **options)
            for x, name in ((P, "P"), (Q, "Q"))
        ]

    def _solve(
        self, solve: Callable[[Surface], dict[str, Array]], digits: int, beyond: bool
    ) -> tuple[dict[str, Array], Decimals | None]:
        """Return numbers in doubles, and decimals where they are asked for."""
        if not beyond:
            return solve(self._surface), None
        # loads python-flint
        from veselova.analytic.closed.geodesic_digits import in_digits

        return in_digits(self._exact, digits, solve)

    def _result(
        self, coordinates: str, numbers: dict[str, Array], decimals: Decimals | None
    ) -> Geodesics:
        """Return geodesics in the shape of P1."""
        shape = numbers["P1"].shape[:-1]

        def shaped(x: Array) -> Array:
            return x.reshape((*shape, *x.shape[1:]))[()]

        ends = {name: numbers.pop(name).astype(float) for name in ("P1", "P2")}
        ends = {name: x.reshape(*shape, x.shape[-1]) for name, x in ends.items()}
        if decimals is not None:
            decimals = _changed(decimals, shaped)
        values: Any = {"unique": None} | {name: shaped(x) for name, x in numbers.items()} | ends
        return Geodesics(self, coordinates, decimals=decimals, **values)


def _changed(decimals: Decimals, change: Callable[[Array], Array]) -> Decimals:
    """Return decimals with every array changed."""
    sides = decimals.midpoints, decimals.radii
    middles, radii = ({name: change(x) for name, x in side.items()} for side in sides)
    return replace(decimals, midpoints=middles, radii=radii)


def _require_digits(
    coordinates: Any, digits: Any, most: int, certified: Any, normalize: Any
) -> bool:
    """Return whether numbers beyond doubles are asked for; raises InvalidInput for options."""
    faults = Faults()
    faults.attempt(require_name, coordinates, ("coordinates",), PLACES)
    beyond = faults.attempt(read_precision, digits, certified, most)
    faults.attempt(require_truth_value, normalize, "normalize")
    faults.require_none()
    if beyond and normalize:
        required = f"False where digits > {FEWEST_DIGITS} or certified"
        raise InvalidInput(("normalize",), required, show(normalize))
    return beyond


def _numbers(values: ArrayLike, name: str) -> Array:
    """Return finite numbers as an array."""
    array = double_array(values, (name,), "finite numbers")
    if not np.all(np.isfinite(array)):
        raise InvalidInput((name,), "finite numbers", show(values))
    return array


def _common_shape(field: str, required: str, points: list[Array], numbers: list[Array]) -> Any:
    """Return the shape of points (…, 2) or (…, 3) and numbers that are broadcast."""
    try:
        return np.broadcast_shapes(*(x.shape[:-1] for x in points), *(x.shape for x in numbers))
    except ValueError:
        given = "shapes " + ", ".join(str(x.shape) for x in points + numbers)
        raise InvalidInput((field,), required, given) from None
