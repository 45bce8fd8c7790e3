"""Geodesics to many digits, proven lengths, and all geodesics between two points."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_geodesics import NAMES, rows

import veselova as vs
from deviations import decimals_of
from veselova.geodesics import Ellipsoid, Geodesics

Array = NDArray[Any]

KARNEY, WGS84 = Ellipsoid(("1.5", 1, "0.5")), Ellipsoid("WGS84")


def row_of(name: str, kind: str) -> dict[str, str]:
    return next(row for row in rows() if (row["ellipsoid"], row["kind"]) == (name, kind))


def solve(row: dict[str, str], **options: Any) -> Geodesics:
    body = Ellipsoid([float(row[k]) for k in "abc"])
    ends = ([float(row[f"{k}{i}"]) for k in ("beta", "omega")] for i in (1, 2))
    return body.inverse(*ends, "ellipsoidal", **options)


@pytest.mark.daily(4)
@pytest.mark.parametrize("kind", ["random", "near-cut", "equator"])
@pytest.mark.parametrize("name", NAMES)
def test_digits_are_those_of_the_reference(name: str, kind: str) -> None:
    row = row_of(name, kind)
    found = decimals_of(solve(row, digits=30))
    fields = ("s12", "m12", "M12", "M21") if row["n_shortest"] == "1" else ("s12",)
    for field in fields:
        known = Decimal(row[field])
        off = abs(found.midpoints[field] - known)
        assert off <= abs(known) * Decimal("1e-26") + found.radii[field]


@pytest.mark.daily(4)
@pytest.mark.parametrize("kind", ["random", "near-cut"])
@pytest.mark.parametrize("name", NAMES)
def test_proven_lengths_hold_the_reference(name: str, kind: str) -> None:
    row = row_of(name, kind)
    found = decimals_of(solve(row, certified=True, digits=18))
    assert set(found.midpoints) == {"s12"}
    assert found.certified
    length, b = Decimal(row["s12"]), Decimal(row["b"])
    off = abs(found.midpoints["s12"] - length)
    assert off <= found.radii["s12"] <= max(length, b) * Decimal(10) ** -18


@pytest.mark.parametrize(
    ("axes", "P", "Q", "length"),
    [
        # an umbilic by ω = −180
        ((2**0.5, 1, 0.5**0.5), (-45, 135), (-90, -180), "0.5609950924819116891924132"),
        # the equator of a needle
        ((10, 1, 0.1), (0, 135), (0, 120), "2.077304780493401097743204"),
        ((10, 1, 0.1), (0, 179.34), (0, -33.8), "18.32257856085579194321689"),
        # near umbilics
        (
            (1.0001, 1, 0.9999),
            (-89.97551213152933, -179.98853919419184),
            (-37.51138687133789, -99.94487285614014),
            "1.003283430425520803319349",
        ),
        # nearly prolate
        (
            (2, 1, 0.9999999999),
            (8.35994815826416, -167.0690679550171),
            (-8.36004408067076, 12.931100132703632),
            "4.754301677795041643404265",
        ),
    ],
)
def test_cases_that_geographiclib_2_7_has_wrong(axes: Any, P: Any, Q: Any, length: str) -> None:
    body = Ellipsoid(axes)
    line = body.inverse(P, Q, "ellipsoidal", digits=25)
    assert abs(decimals_of(line).midpoints["s12"] - Decimal(length)) <= Decimal("1e-23")
    doubles = body.inverse(P, Q, "ellipsoidal")
    assert abs(doubles.s12 - line.s12) <= doubles.error


@pytest.mark.parametrize("body", [KARNEY, WGS84, Ellipsoid((2, 1, 1)), Ellipsoid((1, 1, 1))])
def test_errors_cover_what_more_digits_change(body: Ellipsoid) -> None:
    ends = [(10, 20), (-35, 160)]
    few, many = (decimals_of(body.inverse(*ends, digits=digits)) for digits in (20, 50))
    for name, middle in few.midpoints.items():
        off = np.abs(np.ravel(middle) - np.ravel(many.midpoints[name]))
        assert np.all(off <= np.ravel(few.radii[name]))
        size = np.maximum(np.abs(np.ravel(middle)), Decimal(1))
        assert np.all(np.ravel(many.radii[name]) <= size * Decimal("1e-48"))
    proven = decimals_of(body.inverse(*ends, digits=20, certified=True))
    assert abs(proven.midpoints["s12"] - many.midpoints["s12"]) <= proven.radii["s12"]


PLACES = [(-90, 0), (90, 180), (0, 0), (0, 90), (90, 90), (30, 40), (-30, -140)]


@pytest.mark.daily(3)
@pytest.mark.parametrize("body", [KARNEY, WGS84, Ellipsoid((2, 1, 1)), Ellipsoid((1, 1, 1))])
def test_special_places_have_digits_too(body: Ellipsoid) -> None:
    for P, Q in [(PLACES[i], PLACES[j]) for i, j in ((0, 5), (2, 3), (3, 4), (5, 6), (4, 4))]:
        doubles = body.inverse(P, Q, "ellipsoidal")
        line = body.inverse(P, Q, "ellipsoidal", digits=16)
        assert abs(line.s12 - doubles.s12) <= doubles.error
        assert bool(line.unique) == bool(doubles.unique)


@pytest.mark.daily(3)
def test_a_thousand_digits_agree_with_those_of_a_hundred() -> None:
    many, few = (
        decimals_of(KARNEY.inverse([0, 20], [0, -50], "ellipsoidal", digits=digits))
        for digits in (300, 100)
    )
    off = abs(many.midpoints["s12"] - few.midpoints["s12"])
    assert off <= few.radii["s12"] <= Decimal("1e-100")
    assert many.radii["s12"] <= Decimal("1e-300")


@pytest.mark.parametrize("body", [KARNEY, WGS84])
def test_direct_in_digits_ends_where_inverse_did(body: Ellipsoid) -> None:
    there = body.inverse(["40.6", "-73.8"], ["49.9", "-1.3"], digits=40)
    known = decimals_of(there).strings
    back = body.direct(["40.6", "-73.8"], known("azi1"), known("s12"), digits=35)
    off = decimals_of(back).midpoints["P2"] - np.array([Decimal("49.9"), Decimal("-1.3")])
    assert max(abs(off)) <= Decimal("1e-33")
    assert abs(decimals_of(back).midpoints["m12"] - decimals_of(there).midpoints["m12"]) <= Decimal(
        "1e-27"
    )


def test_text_is_exact_and_rows_keep_their_shape() -> None:
    line = KARNEY.inverse([["10.1", "7"], [10.1, 7]], [0, -50], digits=20)
    assert line.s12.shape == (2,)
    one, two = decimals_of(line).midpoints["s12"]
    assert Decimal("1e-20") < abs(one - two) < Decimal("1e-17")
    assert decimals_of(line[0]).midpoints["s12"] == one
    assert decimals_of(line).midpoints["v1"].shape == (2, 3)
    assert "estimated" in repr(decimals_of(line))


def test_one_shortest_way_is_proven_off_the_cut_locus() -> None:
    P, Q = [[30, 20], [30, 20], [0, 10], [0, 5]], [[-35, 160], [-30, 190], [0, 50], [0, 5]]
    body = Ellipsoid((3, 2, 1))
    assert body.inverse(P, Q, "ellipsoidal", digits=16).unique.tolist() == [True, False, True, True]
    line = body.inverse(P, Q, "ellipsoidal", digits=16, certified=True)
    assert line.unique.tolist() == [True, False, None, True]


@pytest.mark.parametrize(
    ("P", "Q", "coordinates"),
    [
        (("33.3", 17), ("-33.3", 190), "parametric"),
        ((20, 0), (-20, 179), "geodetic"),
        (("10.1", "20.3"), ("-10.1", "200.3"), "geodetic"),
    ],
)
def test_of_two_ways_of_one_length_digits_have_that_to_the_pole_of_the_first(
    P: Any, Q: Any, coordinates: str
) -> None:
    line = Ellipsoid((2, 2, 1)).inverse(P, Q, coordinates, digits=25)
    assert not line.unique
    assert abs(line.azi1) < 90
    assert decimals_of(line).radii["azi1"] <= Decimal("1e-23")


def test_many_digits_at_umbilics_take_few_panels() -> None:
    few, many = (
        decimals_of(KARNEY.inverse([90, 0], [20, 30], "ellipsoidal", digits=digits))
        for digits in (30, 80)
    )
    off = abs(few.midpoints["s12"] - many.midpoints["s12"])
    assert off <= few.radii["s12"] <= Decimal("1e-30")
    assert many.radii["s12"] <= Decimal("1e-80")


@pytest.mark.daily(4)
@pytest.mark.parametrize("digits", [15, 20])
@pytest.mark.parametrize("coordinates", ["geodetic", "parametric"])
@pytest.mark.parametrize("axes", [(3, 3, 2), (1, 1, 2), (1, 1, 1)])
def test_azimuths_at_poles_count_from_their_longitude(
    axes: Any, coordinates: str, digits: int
) -> None:
    body = Ellipsoid(axes)
    start = body.direct([90, 30], 40, 0.3, coordinates, digits=digits)
    away = body.inverse([90, 0], [12, 34], coordinates, digits=digits).azi1
    to = body.inverse([12, 34], [[90, 50], [-90, 50]], coordinates, digits=digits).azi2
    # β grows along meridians of an oblate one, ω from x to z of a prolate one
    known = (80, 56, -74, 74) if axes == (1, 1, 2) else (170, 146, 16, 164)
    assert np.allclose([start.P2[1], away, *to], known, rtol=0, atol=1e-10)


@pytest.mark.parametrize("digits", [15, 20])
@pytest.mark.parametrize("axes", [(3, 2, 1), (3, 3, 2), (1, 1, 2), (1, 1, 1)])
def test_a_way_to_the_same_point_starts_towards_growing_beta(axes: Any, digits: int) -> None:
    P = np.array([[90, 30], [90, 30], [-90, 0], [12, 34], [0, 0], [0, 90]])
    Q = P + [[0, 40], *[[0, 0]] * 5]
    line = Ellipsoid(axes).inverse(P, Q, digits=digits)
    assert not np.any([line.s12, line.m12])
    assert np.allclose(line.azi1, 0, rtol=0, atol=1e-13)
    assert np.all(line.unique & (line.M12 == 1) & (line.M21 == 1))
    back = Ellipsoid(axes).direct(P, line.azi1, line.s12, digits=digits)
    assert np.allclose(back.v1, line.v2, rtol=0, atol=1e-15)
    assert np.allclose(back.P2, P, rtol=0, atol=1e-12)


def test_the_pole_of_a_disc_is_at_its_place() -> None:
    disc = Ellipsoid((1, 1, "1e-6"))
    found, exact = (disc.inverse([90, 30], [[0, 0], [20, 5]], digits=n) for n in (15, 20))
    assert np.all(np.abs(found.s12 - exact.s12) <= found.error)


def test_what_is_not_proven_is_refused() -> None:
    with pytest.raises(vs.Unsolved, match="not-enclosed"):
        Ellipsoid((1, 1, 1)).inverse([30, 40], [-30, -140], digits=16, certified=True)


def shoot(body: Ellipsoid, P: Array, Q: Array, most: float) -> Array:
    """Return the lengths of geodesics to Q, by Newton’s method from many directions."""
    unit, target = float(np.sort(body.semiaxes)[1]), body.cartesian(Q)
    azimuths, lengths = np.arange(-179.9, 180, 0.5), np.linspace(0, most, int(most / unit * 40))
    fan = body.direct(np.tile(P, (azimuths.size, 1)), azimuths, unit)
    away = np.linalg.norm(fan.at(lengths, "cartesian") - target, axis=-1)
    near = (
        (away[:, 1:-1] <= away[:, :-2])
        & (away[:, 1:-1] < away[:, 2:])
        & (away[:, 1:-1] < 0.3 * unit)
    )
    i, j = np.nonzero(near)
    alpha, s = azimuths[i], lengths[j + 1]
    for _ in range(12):
        line = body.direct(np.tile(P, (alpha.size, 1)), alpha, s)
        ends = body.cartesian(line.P2)
        off, side = target - ends, np.cross(ends / body.semiaxes**2, line.v2)
        side /= np.linalg.norm(side, axis=1)[:, None]
        m = np.where(np.abs(line.m12) > 1e-6 * unit, line.m12, np.inf)
        alpha = alpha - np.degrees(np.clip(np.sum(off * side, axis=1) / m, -0.01, 0.01))
        s = s + np.clip(np.sum(off * line.v2, axis=1), -0.03 * unit, 0.03 * unit)
    good = (np.linalg.norm(off, axis=1) < 1e-9 * unit) & (s > 1e-6 * unit) & (s < most)
    found = np.sort(s[good])
    return found[np.diff(found, prepend=-1.0) > 1e-7 * unit]


@pytest.mark.daily(4)
@pytest.mark.parametrize("axes", [(1.5, 1, 0.5), (1, 1, 0.5), (2, 1, 1)])
def test_no_geodesic_between_two_points_is_missing(axes: Any) -> None:
    body = Ellipsoid(axes)
    for P, Q in (([10.3, 20.1], [-35.7, 160.2]), ([20.0, 10.0], [-19.2, -171.1])):
        lines = body.geodesics_between(P, Q, 8)
        assert np.all(np.diff(lines.s12) >= 0)
        known = shoot(body, np.array(P), np.array(Q), 6.0)
        own = lines.s12[lines.s12 < 6.0]
        assert own.size == known.size < 8
        assert np.allclose(own, known, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("P", "Q"), [((40.6, -73.8), (49.9, -73.8)), ((0, 10), (0, 50)), ((5, 7), (5, 7))]
)
def test_geodesics_in_a_plane_of_symmetry_are_among_all(P: Any, Q: Any) -> None:
    lines = WGS84.geodesics_between(P, Q, 6)
    shortest = WGS84.inverse(P, Q)
    assert abs(lines.s12[0] - shortest.s12) <= shortest.error
    ends = WGS84.direct(np.tile(P, (6, 1)), lines.azi1, lines.s12)
    assert np.allclose(ends.P2, Q, rtol=0, atol=1e-9)
    assert len(lines) == 6


@pytest.mark.parametrize("body", [KARNEY, WGS84, Ellipsoid((2, 1, 1)), Ellipsoid((1, 1, 1))])
@pytest.mark.parametrize("is_first", [True, False])
def test_geodesics_to_one_pole_or_umbilic_are_counted(body: Ellipsoid, is_first: bool) -> None:
    focus = [0, 0] if body.semiaxes[0] == 2 else [-90, 0]
    ends = (focus, [20, 30]) if is_first else ([20, 30], focus)
    lines = body.geodesics_between(*ends, 4, "ellipsoidal")
    shortest = body.inverse(*ends, "ellipsoidal")
    assert abs(lines.s12[0] - shortest.s12) <= shortest.error
    assert np.all(np.diff(lines.s12) > 0)
    known = body.direct(lines.P1, lines.azi1, lines.s12, "ellipsoidal")
    off = body.cartesian(known.P2, "ellipsoidal") - body.cartesian(ends[1], "ellipsoidal")
    assert np.max(np.abs(off)) <= 1e-11 * body.semiaxes[0]
    assert np.allclose(known.v2, lines.v2, rtol=0, atol=1e-9)
    assert np.allclose(known.m12, lines.m12, rtol=0, atol=1e-8 * body.semiaxes[0])
    assert np.allclose(known.M12, lines.M12, rtol=0, atol=1e-8)


def test_infinitely_many_geodesics_are_refused() -> None:
    for body, P, Q in (
        (Ellipsoid((1, 1, 1)), [10, 0], [-10, 180]),
        (KARNEY, [-90, 0], [90, 180]),
        (KARNEY, [-90, 0], [-90, 0]),
        (WGS84, [90, 0], [-90, 10]),
    ):
        with pytest.raises(vs.Unsolved, match="continuous-family"):
            body.geodesics_between(P, Q, 3, "ellipsoidal")


TEN = ["earth3", "haumea", "cayley", "karney", "nearobl6", "nearobl10"]
TEN += ["wgs84", "prolate", "nearpro10", "nearsph4"]


@pytest.mark.slow
@pytest.mark.parametrize("name", TEN)
def test_ten_thousand_pairs_keep_their_digits(name: str) -> None:
    row = row_of(name, "random")
    body, unit = Ellipsoid([float(row[k]) for k in "abc"]), float(row["b"])
    rng = np.random.default_rng(20)
    P, Q, R = rng.uniform([-90, -180], [90, 180], (3, 10_000, 2))
    there, back = body.inverse(P, Q), body.inverse(Q, P)
    assert np.max(np.abs(there.s12 - back.s12)) <= 1e-14 * unit
    detour = body.inverse(P, R).s12 + body.inverse(R, Q).s12
    assert np.all(there.s12 <= detour + 2e-14 * unit)
    exact = body.inverse(P[:30], Q[:30], digits=20)
    off = np.abs(there.s12[:30] - exact.s12)
    assert np.max(off) <= 1e-14 * unit
    assert np.median(off / (5e-16 * unit + 1e-15 * exact.s12)) <= 1
