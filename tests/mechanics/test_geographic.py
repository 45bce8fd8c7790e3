"""Latitudes, longitudes and azimuths of geodesics, against published lines and by round trips."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from veselova import EllipsoidGeodesic, solve
from veselova.mechanics.geometry.geographic import ELLIPSOIDS, from_angles, to_angles

#: Lines on WGS84 of the published tests of GeographicLib: latitude, longitude and azimuth of both
#: ends, and the distance in metres.
LINES = [
    (35.60777, -139.44815, 111.098748429560326)
    + (-11.17491, -69.95921, 129.289270889708762, 8935244.5604818305),
    (55.52454, 106.05087, 22.020059880982801)
    + (77.03196, 197.18234, 109.112041110671519, 4105086.1713924406),
    (-21.97856, 142.59065, -32.44456876433189)
    + (41.84138, 98.56635, -41.84359951440466, 8394328.894657671),
    (-66.99028, 112.2363, 173.73491240878403)
    + (-12.70631, 285.90344, 2.512956620913668, 11150344.2312080241),
    (-17.42761, 173.34268, -159.033557661192928)
    + (-15.84784, 5.93557, -20.787484651536988, 16076603.1631180673),
    (6.96833, 52.74123, 92.581585386317712)
    + (-7.39675, 206.17291, 90.721692165923907, 17102477.2496958388),
    (-87.85331, 85.66836, -65.120313040242748)
    + (66.48646, 16.09921, -4.888658719272296, 17286615.3147144645),
    (-41.22777, 122.32875, 14.285113402275739)
    + (-7.57291, 130.37946, 10.805303085187369, 3812686.035106021),
]

AXES = {
    "triaxial": (3.0, 2.0, 1.0),
    "oblate": (3.0, 3.0, 1.0),
    "prolate": (3.0, 1.0, 1.0),
    "sphere": (2.0, 2.0, 2.0),
    "flat": (1.0, 0.999, 1e-3),
}


def difference(one: Any, other: Any) -> Any:
    """Return the difference of angles in degrees, −180 … 180."""
    return np.remainder(np.asarray(one) - other + 180, 360) - 180


@pytest.mark.parametrize("line", LINES)
def test_geodesics_end_where_geographiclib_says(line: tuple[float, ...]) -> None:
    problem = EllipsoidGeodesic.from_angles("WGS84", *line[:3])
    motion = solve(problem, line[6])
    latitude, longitude, azimuth = problem.geographic(motion)
    metres = np.radians([latitude[0] - line[3], difference(longitude[0], line[4])]) * 6.4e6
    metres[1] *= np.cos(np.radians(line[3]))
    assert np.max(np.abs(metres)) < 3e-8
    assert np.max(np.abs(metres)) < motion.error[0]
    assert abs(difference(azimuth[0], line[5])) < 2e-12
    back = solve(EllipsoidGeodesic.from_angles("WGS84", *line[3:5], line[5] + 180), line[6])
    assert np.allclose(back.X[0], problem.X, atol=3e-8)


@pytest.mark.parametrize("coordinates", ["geodetic", "ellipsoidal"])
@pytest.mark.parametrize("name", AXES)
def test_angles_come_back(name: str, coordinates: str, rng: np.random.Generator) -> None:
    axes = np.array(AXES[name])
    for _ in range(100):
        angles = rng.uniform([-90, -180, -180], [90, 180, 180])
        X, V = from_angles(axes, *angles, coordinates)
        assert np.sum((X / axes) ** 2) == pytest.approx(1, abs=1e-14)
        assert np.linalg.norm(V) == pytest.approx(1, abs=1e-14)
        assert abs(V @ (X / axes**2)) < 1e-13 * np.linalg.norm(X / axes**2)
        found = to_angles(axes, X[None], V[None], coordinates)
        assert np.max(np.abs(difference(np.ravel(found), angles))) < 1e-7
        again = from_angles(axes, *np.ravel(found), coordinates)
        assert np.allclose(again, (X, V), atol=1e-13)


@pytest.mark.parametrize("coordinates", ["geodetic", "ellipsoidal"])
def test_north_and_east_are_directions_of_growing_latitude_and_longitude(
    coordinates: str, rng: np.random.Generator
) -> None:
    axes = np.array(AXES["triaxial"])
    for _ in range(20):
        latitude, longitude = rng.uniform([-80, -170], [80, 170])
        ends = [
            from_angles(axes, latitude, longitude + d, 0, coordinates)[0] for d in (1e-4, -1e-4)
        ]
        X, east = from_angles(axes, latitude, longitude, 90, coordinates)
        step = (ends[0] - ends[1]) / np.linalg.norm(ends[0] - ends[1])
        north = from_angles(axes, latitude, longitude, 0, coordinates)[1]
        assert np.dot(np.cross(east, north), X) > 0
        if coordinates == "ellipsoidal":
            assert np.allclose(step, east, atol=1e-7)
        else:
            assert east[2] == pytest.approx(0, abs=1e-16)


def test_ellipsoidal_coordinates_are_roots_of_the_confocal_family() -> None:
    """X²/(a²−u) + Y²/(b²−u) + Z²/(c²−u) = 1 at u = b² sin²β + c² cos²β and a² sin²ω + b² cos²ω."""
    axes = np.array(AXES["triaxial"])
    X, _ = from_angles(axes, 35, 50, 10, "ellipsoidal")
    squares = axes**2
    s, c = np.sin(np.radians([35, 50])) ** 2, np.cos(np.radians([35, 50])) ** 2
    for u in (squares[1] * s[0] + squares[2] * c[0], squares[0] * s[1] + squares[1] * c[1]):
        assert np.sum(X**2 / (squares - u)) == pytest.approx(1, abs=1e-13)


def test_named_ellipsoids_have_their_axes() -> None:
    assert float(ELLIPSOIDS["WGS84"][2]) == pytest.approx(6356752.314245179, abs=1e-9)
    assert all(x >= y >= z for x, y, z in ELLIPSOIDS.values())
    moon = EllipsoidGeodesic.from_angles("moon-triaxial", 0, 0, 90)
    assert pytest.approx([1738256.3, 0, 0], abs=1e-9) == moon.X
    text = EllipsoidGeodesic.from_angles("WGS84", "90", "0", "1/3")
    assert abs(text.geographic().latitude[0]) == 90
