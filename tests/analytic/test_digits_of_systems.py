"""Many digits and certified errors of Neumann's system and of geodesics: the same chain under
another time.
"""

from __future__ import annotations

import io
import json
import pickle
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

import veselova as vs
from conftest import slow
from deviations import decimals_of, enclosed
from taylor_truth import geodesic_at, neumann_at
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import encode, trajectory_document, trajectory_of

#: Points on the unit sphere and tangents, exactly; F_0 is not zero.
POINTS = {
    2: (["3", "1"], ["3/5", "4/5"], ["-4/5", "3/5"]),
    3: (["2", "1", "1/2"], ["2/3", "1/3", "2/3"], ["1", "2", "-2"]),
    4: (["3", "2", "3/2", "1"], ["1/2", "1/2", "1/2", "1/2"], ["1", "-1/3", "0", "-2/3"]),
    5: (
        ["5", "3", "2", "3/2", "1"],
        ["1/4", "1/2", "1/4", "3/4", "1/4"],
        ["1", "1/2", "-1", "-1/3", "0"],
    ),
}

#: An umbilic point: X_1² = A_1(A_1−A_2)/(A_1−A_3), X_3² = A_3(A_2−A_3)/(A_1−A_3), to the last
#: digit.
UMBILIC = (["1.69", "1.1716", "0.25"], ["0.78", "0", "0.4"])


def neumann(n: int, speed: str = "1") -> vs.NeumannSystem:
    A, q, v = POINTS[n]
    return vs.NeumannSystem(A, q, [str(Fraction(x) * Fraction(speed)) for x in v])


def geodesic(n: int) -> vs.EllipsoidGeodesic:
    A, q, v = POINTS[n]
    return vs.EllipsoidGeodesic(A, q, v, normalize=True)


def decimals(problem: Any, times: Sequence[Any], **options: Any) -> Decimals:
    return decimals_of(vs.solve(problem, times, **options))


def start_of(problem: vs.EllipsoidGeodesic, digits: int) -> tuple[list[Any], list[Any]]:
    """Return X and X_dot at s = 0 from the exact data, on the ellipsoid to so many digits."""
    with mpmath.workdps(digits + 15):
        exact = problem.exact
        A, q, tangent = (
            [mpmath.mpf(x.numerator) / x.denominator for x in row]
            for row in (exact.A, exact.q, exact.tangent)
        )
        norm = mpmath.sqrt(mpmath.fdot(q, q))
        root = mpmath.sqrt(sum(a * x * x for a, x in zip(A, q, strict=True))) / norm
        X = [a * x / norm / root for a, x in zip(A, q, strict=True)]
        # A times the velocity of q is along the tangent of the geodesic, but for a multiple of X.
        V = [a * x for a, x in zip(A, tangent, strict=True)]
        along = sum(x * y / a for x, y, a in zip(X, V, A, strict=True))
        V = [y - along * x for x, y in zip(X, V, strict=True)]
        size = mpmath.sqrt(mpmath.fdot(V, V))
        return X, [y / size for y in V]


def agree(found: Decimals, name: str, row: int, truth: Sequence[Any], digits: int) -> None:
    """Hold decimals against numbers of mpmath: within their radii, which have the digits that were
    asked for.
    """
    with mpmath.workdps(digits + 20):
        for x, radius, expected in zip(
            found.midpoints[name][row], found.radii[name][row], truth, strict=True
        ):
            assert radius < Decimal(10) ** -(digits - 2), (name, row)
            assert abs(mpmath.mpf(str(x)) - expected) <= mpmath.mpf(str(radius)) + mpmath.mpf(
                10
            ) ** -(digits + 8), (name, row)


def hold(problem: Any, times: Sequence[str], digits: int, **options: Any) -> None:
    """Hold the decimals of a motion against its equations, integrated by Taylor series."""
    found = decimals(problem, times, digits=digits, **options)
    assert max(found.error) < Decimal(10) ** -digits
    for row, t in enumerate(map(Fraction, times)):
        if problem.system == "neumann":
            names = "q", "q_prime"
            start = [[Fraction(x) for x in problem.given[name]] for name in names]
            truth = neumann_at(problem.exact.A, *start, t, digits)
        else:
            names = "X", "X_dot"
            truth = geodesic_at(problem.exact.A, *start_of(problem, digits), t, digits)
        for name, values in zip(names, truth, strict=True):
            agree(found, name, row, values, digits)


@pytest.mark.daily(3)
@pytest.mark.parametrize("n", [2, 3, slow(4), slow(5)])
def test_neumanns_point_has_fifty_digits_for_any_energy(n: int) -> None:
    for speed in ("1", "1/7") if n < 4 else ("1",):
        hold(neumann(n, speed), ["-1.3", "1.7"], 50)


@pytest.mark.parametrize("places", [3, 40, 166])
def test_a_point_released_beside_the_top_has_thirty_digits(places: int) -> None:
    """q_1 = sin θ with θ'' = ½ sin θ cos θ, from the top: 2θ is the angle of a pendulum, whose
    modulus is cos θ_0.
    """
    problem = vs.NeumannSystem(["2", "1"], [f"1e-{places}", "1"], ["0", "0"], normalize=True)
    t = places * 325 // 100
    found = decimals(problem, [t], digits=30)
    with mpmath.workdps(3 * places + 60):
        start = mpmath.mpf(10) ** -places
        m = 1 / (1 + start**2)
        along, at = mpmath.sqrt(0.5) * t, {"m": m}
        cosine = mpmath.ellipfun("sn", mpmath.ellipk(m) - along, **at) * mpmath.sqrt(m)
        sine = mpmath.ellipfun("dn", mpmath.ellipk(m) - along, **at)
        agree(found, "q", 0, [sine, cosine], 30)


@pytest.mark.daily(3)
@pytest.mark.parametrize("n", [2, 3, slow(4), slow(5)])
def test_a_geodesic_has_fifty_digits(n: int) -> None:
    hold(geodesic(n), ["-1.3", "1.7"], 50)


@pytest.mark.parametrize(
    "problem", [neumann(2), neumann(3, "2"), neumann(4), geodesic(2), geodesic(3)], ids=repr
)
def test_certified_radii_hold_the_motion(problem: Any) -> None:
    times = ["-2", 0, "1", "6"]
    proven, finer = decimals(problem, times, certified=True), decimals(problem, times, digits=40)
    ordinary = vs.solve(problem, times)
    assert proven.certified
    assert max(proven.error) < Decimal("1e-15")
    enclosed(proven, finer, problem.outputs)
    for name in problem.outputs:
        assert np.allclose(
            ordinary.series(name), finer.midpoints[name].astype(float), atol=1e-11, rtol=1e-11
        ), name


EQUAL = [
    vs.NeumannSystem(["2", "2", "1"], ["2/3", "1/3", "2/3"], ["1", "2", "-2"]),
    vs.NeumannSystem(["2", "1", "1/2"], ["3/5", "0", "4/5"], ["-4/5", "0", "3/5"]),
    vs.NeumannSystem(
        ["2", "2", "2", "1"], ["1/2", "1/2", "1/2", "1/2"], ["1", "-1/3", "0", "-2/3"]
    ),
    vs.NeumannSystem(["2", "2", "2"], ["2/3", "1/3", "2/3"], ["1", "2", "-2"]),
    vs.EllipsoidGeodesic(["2", "2", "1"], ["2", "1", "2"], ["1", "2", "-2"], normalize=True),
    vs.EllipsoidGeodesic(["3", "2", "1"], ["1", "0", "1"], ["1", "0", "-2"], normalize=True),
    vs.EllipsoidGeodesic(
        ["3", "3", "2", "1"], ["1", "1", "0", "1"], ["1", "2", "0", "-2"], normalize=True
    ),
]


@pytest.mark.daily(3)
@pytest.mark.parametrize(
    "problem", EQUAL, ids=lambda p: f"{p.system}-{'-'.join(map(str, p.given['A']))}"
)
@pytest.mark.parametrize("options", [slow({"digits": 40}), {"digits": 20, "certified": True}])
def test_equal_axes_and_resting_directions_have_all_digits(
    problem: Any, options: dict[str, Any]
) -> None:
    hold(problem, ["-1", "1.5"], **options)


@pytest.mark.slow
def test_an_umbilic_geodesic_of_exact_text_has_all_digits() -> None:
    """Its neighbours leave it like e^s, and it runs through the opposite umbilic point again and
    again.
    """
    problem = vs.EllipsoidGeodesic(*UMBILIC, ["0.4", "1", "-0.3"], normalize=True)
    found = vs.solve(problem, ["-2", "10"], digits=34)
    assert found.provenance.details["regime"] == "separatrix"
    start = start_of(problem, 60)
    for row, s in enumerate((-2, 10)):
        X, V = geodesic_at(problem.exact.A, *start, s, 60)
        agree(decimals_of(found), "X", row, X, 34)
        agree(decimals_of(found), "X_dot", row, V, 34)


@pytest.mark.parametrize("time", ["1", "120", slow("400")])
def test_a_separatrix_dwells_at_its_equilibrium_for_ever(time: str) -> None:
    """q = (sech t, tanh t). Neighbours that have fallen back dwell at the other one, both of them
    at the same times.
    """
    found = decimals(vs.NeumannSystem(["1", "1/2"], ["1", "0"], ["0", "1"]), [time], digits=30)
    with mpmath.workdps(60):
        agree(found, "q", 0, [mpmath.sech(mpmath.mpf(time)), mpmath.tanh(mpmath.mpf(time))], 30)


@pytest.mark.parametrize(
    "problem", [neumann(3), slow(neumann(5)), geodesic(2), slow(geodesic(3))], ids=repr
)
def test_thirty_digits_at_a_million_million(problem: Any) -> None:
    """Digits beyond those asked for change nothing, and doubles are as near as they say."""
    times = ["1e12"]
    found, finer, ordinary = (
        decimals(problem, times, digits=30),
        decimals(problem, times, digits=40),
        vs.solve(problem, [1e12]),
    )
    assert max(found.error) < Decimal("1e-30")
    enclosed(found, finer, problem.outputs)
    for name in problem.bounded:
        off = np.max(np.abs(ordinary.series(name) - finer.midpoints[name].astype(float)))
        assert off <= ordinary.error[0] + 1e-16, name


BODY = vs.Veselova(["3", "2", "1.2"], ["0.6", "0", "0.8"], ["0.4", "0.7", "-0.3"])


@pytest.mark.parametrize("problem", [neumann(3), geodesic(3), BODY], ids=repr)
def test_decimals_come_back_from_documents_archives_and_pickles(problem: Any) -> None:
    trajectory = vs.solve(problem, ["0.5", "2"], digits=30, certified=problem is BODY)
    expected = decimals_of(trajectory)
    stream = io.BytesIO()
    trajectory.to_npz(stream)
    stream.seek(0)
    document = json.loads(encode(trajectory_document(trajectory)))
    name, numbers = problem.stored[0], expected.midpoints[problem.stored[0]]
    assert np.ravel(document["series"][name]).tolist() == list(map(str, numbers.ravel()))
    again = trajectory_of(problem, document), Trajectory.from_arrays(problem, np.load(stream))
    for motion in (*again, pickle.loads(pickle.dumps(trajectory))):
        found = decimals_of(motion)
        assert found.certified == (problem is BODY)
        assert np.array_equal(motion.error, trajectory.error)
        for name in problem.stored:
            assert np.all(found.midpoints[name] == expected.midpoints[name]), name
            assert np.all(found.radii[name] == expected.radii[name]), name
        # others are formed anew, from what came: a valid enclosure of the same numbers
        enclosed(found, expected, problem.outputs)
        for name in problem.outputs:
            assert np.max(found.radii[name]) < Decimal("1e-29"), name
        assert max(found.error) < Decimal("1e-30")
