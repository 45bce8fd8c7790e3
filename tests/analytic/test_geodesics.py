"""Geodesics between two points: the reference of 25 digits, and identities of the metric."""

from __future__ import annotations

import csv
import lzma
import pickle
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import veselova as vs
from veselova.geodesics import Ellipsoid, Geodesics

TABLE = Path(__file__).parent.parent / "agreement" / "frozen" / "geodesics.csv.xz"

Array = NDArray[np.float64]

HAUMEA, NEEDLE = Ellipsoid("Haumea"), Ellipsoid((10, 1, "0.1"))
SHAPES = {
    "Haumea": HAUMEA,
    "Earth": Ellipsoid("Earth"),
    "WGS84": Ellipsoid("WGS84"),
    "prolate": Ellipsoid((2, 1, 1)),
    "sphere": Ellipsoid((1, 1, 1)),
    "needle": NEEDLE,
}


@cache
def rows() -> list[dict[str, str]]:
    with lzma.open(TABLE, "rt") as file:
        return list(csv.DictReader(file))


def numbers(chosen: list[dict[str, str]], *names: str) -> Array:
    return np.array([[float(row[name]) for name in names] for row in chosen])


@cache
def of_reference(name: str) -> tuple[list[dict[str, str]], Geodesics]:
    chosen = [row for row in rows() if row["ellipsoid"] == name]
    body = Ellipsoid(numbers(chosen[:1], "a", "b", "c")[0])
    ends = (numbers(chosen, f"beta{i}", f"omega{i}") for i in (1, 2))
    return chosen, body.inverse(*ends, "ellipsoidal")


NAMES = ["earth3", "haumea", "cayley", "karney", "needle", "nearobl6", "nearobl10"]
NAMES += ["wgs84", "prolate", "nearpro10", "sphere", "nearsph4"]


@pytest.mark.parametrize("name", NAMES)
def test_lengths_and_directions_of_the_reference_are_within_the_error(name: str) -> None:
    chosen, line = of_reference(name)
    off = np.abs(line.s12 - numbers(chosen, "s12")[:, 0])
    assert np.all(off <= line.error)
    assert np.median(line.error / np.maximum(off, line.error / 1000)) <= 150
    alone = [row["n_shortest"] == "1" and not row["kind"].endswith("coincident") for row in chosen]
    known = numbers(chosen, "v1x", "v1y", "v1z"), numbers(chosen, "v2x", "v2y", "v2z")
    turned = np.maximum(*(np.max(np.abs(v - w), axis=1) for v, w in zip((line.v1, line.v2), known)))
    reduced = np.minimum(np.abs(numbers(chosen, "m12")[:, 0]), float(chosen[0]["b"]))
    assert np.all((turned * reduced <= line.error)[alone])


@pytest.mark.parametrize("name", NAMES)
def test_reduced_lengths_and_scales_are_those_of_the_reference(name: str) -> None:
    chosen, line = of_reference(name)
    alone, unit = [row["n_shortest"] == "1" for row in chosen], float(chosen[0]["b"])
    for own, field, size in ((line.m12, "m12", unit), (line.M12, "M12", 1), (line.M21, "M21", 1)):
        off = np.abs(own - numbers(chosen, field)[:, 0])[alone] / size
        assert np.max(off) <= 1e-11


@pytest.mark.parametrize("name", NAMES)
def test_symmetric_points_have_two_shortest_ways(name: str) -> None:
    chosen, line = of_reference(name)
    one = np.array([row["n_shortest"] == "1" for row in chosen])
    assert np.array_equal(line.unique, one | (line.s12 == 0))


def random_places(seed: int, count: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    P, Q = rng.uniform([-90, -180], [90, 180], (2, count, 2))
    return P, Q


@pytest.mark.parametrize("name", SHAPES)
def test_direct_ends_where_inverse_began(name: str) -> None:
    body = SHAPES[name]
    line = body.inverse(*random_places(1, 40))
    back = body.direct(line.P1, line.azi1, line.s12)
    off = np.linalg.norm(body.cartesian(back.P2) - body.cartesian(line.P2), axis=1)
    assert np.all(off <= line.error * np.maximum(1, np.abs(back.M12) + np.abs(back.M21)))
    assert np.allclose(back.m12, line.m12, rtol=0, atol=1e-10 * body.semiaxes[0])
    assert np.allclose(back.caustic, line.caustic, rtol=1e-12)
    assert np.allclose(line.at(0), line.P1)


@pytest.mark.parametrize("name", SHAPES)
def test_lengths_are_a_metric(name: str) -> None:
    body = SHAPES[name]
    P, Q = random_places(2, 40)
    R = np.roll(P, 1, axis=0)
    there, back = body.inverse(P, Q), body.inverse(Q, P)
    assert np.all(np.abs(there.s12 - back.s12) <= there.error)
    detour = body.inverse(P, R).s12 + body.inverse(R, Q).s12
    assert np.all(there.s12 <= detour + 2 * there.error)


@pytest.mark.parametrize("name", SHAPES)
def test_no_geodesic_is_shorter(name: str) -> None:
    """Whatever geodesic ends at a point, in any direction and past its conjugate points too."""
    body = SHAPES[name]
    P, _ = random_places(3, 200)
    rng = np.random.default_rng(4)
    azimuths, lengths = rng.uniform(-180, 180, 200), rng.uniform(0, 4, 200)
    line = body.direct(P, azimuths, lengths * np.sort(body.semiaxes)[1])
    shortest = body.inverse(line.P1, line.P2)
    assert np.all(shortest.s12 <= line.s12 + line.error * (1 + np.abs(line.M12)))
    near = np.abs(line.s12 - shortest.s12) <= 1e-9 * body.semiaxes[0]
    assert 0.3 < np.mean(near) < 1


def test_corners_may_be_anything() -> None:
    """Poles, umbilics, equal and opposite points, on every shape."""
    special = [
        (s, w) for s in (-90.0, -45.0, 0.0, 45.0, 90.0) for w in (-180.0, -90.0, 0.0, 30.0, 90.0)
    ]
    P, Q = np.array([(x, y) for x in special for y in special]).transpose(1, 0, 2)
    for body in [*SHAPES.values(), Ellipsoid((1e6, 1, 1e-6)), Ellipsoid((1 + 1e-15, 1, 1 - 1e-15))]:
        line = body.inverse(P, Q, "ellipsoidal")
        assert np.all(np.isfinite(line.s12))
        assert np.all(np.isfinite(line.v1))
        assert np.all(np.isfinite(line.azi1))
        straight = np.linalg.norm(
            body.cartesian(P, "ellipsoidal") - body.cartesian(Q, "ellipsoidal"), axis=1
        )
        assert np.all(line.s12 >= straight - line.error)


def test_axes_come_in_any_order_and_unit() -> None:
    x, y = np.array([300.0, 400.0, 200.0]), np.array([-100.0, 500.0, -300.0])
    lengths = []
    for order in ([0, 1, 2], [2, 0, 1], [1, 0, 2]):
        body = Ellipsoid(np.array([1161, 852, 513])[order])
        lengths.append(body.inverse(x[order], y[order], "cartesian", normalize=True).s12)
        assert lengths[-1] == pytest.approx(lengths[0], rel=1e-15)
    metres = Ellipsoid([1161e3, 852e3, 513e3])
    found = metres.inverse(1e3 * x, 1e3 * y, "cartesian", normalize=True)
    assert found.s12 == pytest.approx(1e3 * lengths[0], rel=1e-15)


def test_an_octant_of_a_spheroid_is_an_eighth_of_it() -> None:
    needles = [Ellipsoid((length, 1, 1)) for length in (100, 1e4)]
    for body in (SHAPES["WGS84"], SHAPES["sphere"], HAUMEA, *needles):
        octant = body.polygon([[0, 0], [0, 90], [90, 0]], "parametric")
        assert octant.area == pytest.approx(body.area / 8, rel=1e-13)
        assert abs(octant.area - body.area / 8) <= octant.area_error < 1e-6 * octant.area
        body, corners = pickle.loads(pickle.dumps(body)), [[90, 0], [90, 90], [0, 90], [0, 0]]
        assert body.polygon(corners, "parametric").area == pytest.approx(-octant.area, rel=1e-13)
    assert SHAPES["sphere"].area == pytest.approx(4 * np.pi, rel=1e-15)


def test_the_antarctic_polygon_of_geographiclib() -> None:
    """Area and perimeter of the example of GeographicLib's Planimeter, by its version 2.0."""
    corners = [(-63.1, -58), (-72.9, -74), (-71.9, -102), (-74.9, -102), (-74.3, -131)]
    corners += [(-77.5, -163), (-77.4, 163), (-71.7, 172), (-65.9, 140), (-65.7, 113)]
    corners += [(-66.6, 88), (-66.9, 59), (-69.8, 25), (-70.0, -4), (-71.0, -14)]
    corners += [(-77.3, -33), (-77.9, -46), (-74.7, -61)]
    found = SHAPES["WGS84"].polygon(corners)
    assert found.perimeter == pytest.approx(16831067.892790, abs=1e-5)
    assert found.area == pytest.approx(13662703680020.1, abs=0.5)


def test_areas_add_up() -> None:
    corners = np.array([[10.0, 0.0], [-20.0, 50.0], [40.0, 70.0]])
    inside = np.array([12.0, 40.0])
    whole = HAUMEA.polygon(corners).area
    sides = [HAUMEA.polygon([corners[i], corners[(i + 1) % 3], inside]) for i in range(3)]
    assert sum(side.area for side in sides) == pytest.approx(whole, rel=1e-12)
    assert 0 < sides[0].area_error < 1e-12 * HAUMEA.area


@pytest.mark.parametrize(
    ("semiaxes", "size"),
    [((6378137, 6378137, 6356752.3), 1e-7), ((3, 2, 1), 1e-3), ((1, 0.3, 1e-3), 1.0)],
)
def test_areas_of_parts_add_up_within_their_errors(semiaxes: Any, size: float) -> None:
    body, rng = Ellipsoid(semiaxes), np.random.default_rng(7)
    for middle in rng.normal(size=(6, 3)):
        corners = middle + size * rng.normal(size=(3, 3))
        A, B, C = body.cartesian(corners * semiaxes, "cartesian", normalize=True)
        side = body.inverse(A, B, "cartesian")
        D = side.at(0.4 * side.s12)
        whole, *parts = (body.polygon(P, "cartesian") for P in ([A, B, C], [A, D, C], [D, B, C]))
        off = sum(part.area for part in parts) - whole.area
        off -= body.area * round(off / body.area)
        assert abs(off) <= whole.area_error + sum(part.area_error for part in parts)
        assert whole.area_error < 1e-5 * abs(whole.area)


def test_a_perimeter_is_that_of_many_digits_but_for_its_error() -> None:
    corners = [[10, 0], [-20, 50], [40, 70]]
    area, perimeter = found = NEEDLE.polygon(corners)
    exact = NEEDLE.inverse(corners, np.roll(corners, -1, axis=0), digits=20).s12
    assert abs(perimeter - np.sum(exact)) <= found.perimeter_error < 1e-12
    moved = np.array(NEEDLE.cartesian(corners)) * 1.5
    with pytest.raises(vs.InvalidInput, match="normalize=True"):
        NEEDLE.polygon(moved, "cartesian")
    back = NEEDLE.cartesian(moved, "cartesian", normalize=True)
    assert np.allclose(np.sum((back / NEEDLE.semiaxes) ** 2, axis=1), 1, rtol=0, atol=1e-14)
    assert NEEDLE.polygon(moved, "cartesian", normalize=True).area != area


@pytest.mark.parametrize("P", [(-90, 0), (90, 0), (90, 180), (-90, 180)])
@pytest.mark.parametrize("azimuth", [-170.0, -89.0, 0.0, 30.0, 90.0, 120.0])
def test_azimuths_at_umbilics_lead_on(P: Any, azimuth: float) -> None:
    body = Ellipsoid((1.5, 1, 0.5))

    def end(start: Any, azimuth: Any, length: Any) -> Array:
        return body.cartesian(body.direct(start, azimuth, length, "ellipsoidal").P2, "ellipsoidal")

    line = body.direct(P, azimuth, 0.7, "ellipsoidal")
    assert -90 < line.azi1 <= 90
    assert abs((line.azi1 - azimuth + 90) % 180 - 90) < 1e-12
    near = body.direct(P, azimuth, 1e-6, "ellipsoidal")
    assert abs((near.azi2 - azimuth + 90) % 180 - 90) < 1e-4
    back = body.inverse(line.P2, P, "ellipsoidal")
    assert np.allclose(end(P, back.azi2, 0.3), end(line.P2, back.azi1, back.s12 + 0.3), atol=1e-12)
    assert np.allclose(end(P, line.azi1, 0.7), end(P, azimuth, 0.7), atol=1e-13)


def test_needles_have_reduced_lengths_near_umbilics() -> None:
    body = Ellipsoid((1e4, 1.5, 1))
    P, Q = random_places(5, 20)
    there, back = body.inverse(P, Q, "ellipsoidal"), body.inverse(Q, P, "ellipsoidal")
    assert np.allclose(there.m12, back.m12, rtol=1e-9, atol=1e-9)
    assert np.allclose(there.M12, back.M21, rtol=1e-6, atol=1e-6)


def test_ways_near_the_plane_of_umbilics_have_their_digits() -> None:
    P = [[0, 0], [0, 0], [0, 180], [5, 0]]
    Q = [[1e-7, 1e-7], [0.001, 1e-7], [1e-7, 180 + 1e-7], [5.0000001, 1e-7]]
    found, exact = (Ellipsoid((3, 2, 1)).inverse(P, Q, digits=n) for n in (15, 20))
    assert exact.azi1[0] == pytest.approx(75.9637565321)
    assert np.all(np.abs(found.s12 - exact.s12) <= found.error)
    off = np.radians(found.azi1 - exact.azi1) * exact.m12
    assert np.all(np.abs(off) <= found.error)


def test_rows_without_points_have_no_numbers() -> None:
    line = HAUMEA.inverse([[0, 0], [float("nan"), 1]], [30, 40])
    assert np.isfinite(line.s12[0])
    assert np.isnan(line.s12[1])
    assert len(line) == 2
    assert float(line[0].s12) == line.s12[0]


def test_a_picture_is_drawn() -> None:
    pytest.importorskip("matplotlib").use("Agg")
    axes = HAUMEA.inverse([[0, 0], [10, 20]], [-30, 140]).plot()
    assert len(axes.lines) == 2


@pytest.mark.parametrize(
    ("semiaxes", "corners"),
    [
        ((2, 2, 1), [[0, 0, 1], [2, 0, 0], [0, 2, 0]]),
        ((1, 1, 2), [[0, 1, 0], [0, 0, 2], [1, 0, 0]]),
        ((1.9, 2, 2.1), [[1.9, 0, 0], [0, 2, 0], [0, 0, 2.1]]),
    ],
)
def test_a_corner_at_the_end_of_an_axis_is_one_like_others(semiaxes: Any, corners: Any) -> None:
    body = Ellipsoid(semiaxes)
    for turned in range(3):
        area = body.polygon(np.roll(corners, turned, axis=0), "cartesian").area
        assert abs(abs(area) / body.area - 1 / 8) < 1e-14


def test_no_points_have_no_places() -> None:
    body, none = Ellipsoid((3, 2, 1)), np.zeros((0, 2))
    assert body.inverse(none, none).at([1.0]).shape == (0, 1, 2)
    assert body.inverse([0, 0], [1, 1]).at([]).shape == (0, 2)


@pytest.mark.daily(3)
@pytest.mark.parametrize(
    ("semiaxes", "P", "Q", "unique"),
    [
        ((2, 2, 1), [30, 0], [-30, 170], False),  # on the cut locus: latitudes are rounded twice
        ((2, 2, 1), [90, 0], [-90, 0], False),
        ((1, 1, 2), [90, 0], [-90, 0], False),
        ((2, 2, 1), [90, 0], [30, 0], True),
        ((1, 1, 2), [80, 0], [80, 180], True),  # over the pole
        ((1, 1, 2), [10, "33.3"], [-20, "213.3"], False),  # on either side of the meridian
        ((1, 1, 1), [30, 0], [-30, 170], True),
        ((1, 1, 1), [30, 0], [-30, 180], False),
        ((2, 2, 1), [0, 0], [0, 170], False),
        ((3, 2, 1), [30, 20], [-30, 195], True),
    ],
)
def test_ways_of_one_length_are_known(semiaxes: Any, P: Any, Q: Any, unique: bool) -> None:
    body = Ellipsoid(semiaxes)
    doubles = body.inverse([float(x) for x in P], [float(x) for x in Q])
    exact = body.inverse(P, Q, digits=25)
    assert (doubles.unique, exact.unique) == (unique, unique)
    assert abs(doubles.s12 - exact.s12) <= doubles.error
