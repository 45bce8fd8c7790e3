"""More digits than a double has, and certified errors: the same chain in ball arithmetic."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import veselova as vs
from conftest import Server, slow
from deviations import agree, apart, decimals_of, enclosed
from draws import random_problem
from hostile import BUDGET_S
from problems import Case, tagged
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.results.trajectory import Trajectory

BODY3 = {"A": ["3", "2", "1.2"], "q": ["0.6", "0", "0.8"], "q_dot": ["0.4", "0.7", "-0.3"]}


def body3() -> vs.Veselova:
    return vs.Veselova(**BODY3)


def deviation(found: Decimals, other: Decimals, name: str) -> float:
    return float(np.max(np.abs(found.midpoints[name] - other.midpoints[name])))


@pytest.mark.daily(3)
@pytest.mark.parametrize("case", tagged("reference"), ids=lambda case: case.name)
def test_references_are_met_to_their_last_digits(case: Case) -> None:
    """References are printed to 30 digits, from starts whose frame is given to 35."""
    times = [point["t"] for point in case.points]
    found = decimals_of(vs.solve(case.problem(), times, digits=30))
    for i, point in enumerate(case.points):
        for key in ("q", "q_dot", "frame", "tau1"):
            expected = np.vectorize(Decimal, otypes=[object])(np.array(point[key], dtype=object))
            assert max(np.abs(np.ravel(found.midpoints[key][i] - expected))) < Decimal("1e-27"), (
                key,
                point["t"],
            )


@pytest.mark.parametrize("n", [2, 3, slow(4), slow(5)])
def test_certified_balls_hold_the_motion(n: int, rng: np.random.Generator) -> None:
    """Proven radii hold what many more digits give, and the ordinary error is no smaller than what
    is proven.
    """
    problem = random_problem(rng, n)
    times = np.array([-2.0, 0.0, 1.0, 7.0])
    proven = decimals_of(vs.solve(problem, times, certified=True))
    finer = vs.solve(problem, times, digits=40)
    assert proven.certified
    enclosed(proven, decimals_of(finer), proven.midpoints)
    ordinary = vs.solve(problem, times)
    assert np.all(proven.error.astype(float) < ordinary.error)
    assert np.all(apart(ordinary, finer, ["frame"]) <= ordinary.error)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("A", [[3, 2, 1], [2, 3, 1], [1, 2, 3]])
def test_a_plane_nearer_than_any_digits_is_left_as_the_velocity_says(A: Any, sign: int) -> None:
    """λ is then at its end of the cut, for all that balls tell, and goes on through it or away."""
    body = vs.Veselova(A, [sign * 1e-190, 0.6, 0.8], [0.5, -0.8, 0.6], normalize=True)
    times = [-0.5, 0, 0.5, 2]
    found, finer = (vs.solve(body, times, digits=digits) for digits in (16, 250))
    assert np.all(apart(found, finer, ["frame"]) <= found.error)
    assert np.all(apart(vs.solve(body, times), finer, ["frame"]) <= 1e-14)


@pytest.mark.parametrize("method", ["theta", "angles"])
@pytest.mark.daily(3)
@pytest.mark.parametrize("n", [2, 3])
def test_times_beyond_the_whole_numbers_of_doubles_lead_there_and_back(
    n: int, method: str, rng: np.random.Generator
) -> None:
    """Which cell of the torus a phase is in decides signs, and doubles do not tell those of 10²⁰
    apart.
    """
    body = random_problem(rng, n)
    there = decimals_of(vs.solve(body, ["1e20"], digits=42, method=method))
    state = (list(map(str, there.midpoints[series][0])) for series in ("q", "q_dot"))
    later = vs.Veselova(body.A, *state, normalize=True)
    back = decimals_of(vs.solve(later, ["-1e20"], digits=20, method=method))
    start = decimals_of(vs.solve(body, [0], digits=20))
    for series in ("q", "q_dot"):
        assert deviation(back, start, series) < 1e-19, series


def test_a_separatrix_has_all_digits_of_exact_data() -> None:
    """A great circle about the middle axis, and the umbilic motion that leaves it: c_2 = I_2
    exactly.
    """
    umbilic = ["0.6", "0", "0.8"], ["0.8", "0.5", "-0.6"]
    near, circle = ((["0", "1", "0"], ["0.6", v, "0.8"]) for v in ("1e-30", "0"))
    for start in (umbilic, near, circle):
        problem = vs.Veselova(["3", "2", "1"], *start, normalize=True)
        found, finer = (decimals_of(vs.solve(problem, [-2, 5], digits=n)) for n in (20, 30))
        assert deviation(found, finer, "frame") < 1e-20


def test_strings_are_taken_exactly_and_doubles_as_what_they_store() -> None:
    exact = body3()
    doubles = vs.Veselova([3, 2, 1.2], [0.6, 0, 0.8], [0.4, 0.7, -0.3])
    same_doubles = vs.Veselova([3, 2, Fraction(1.2)], [Fraction(0.6), 0, 0.8], [0.4, 0.7, -0.3])
    one, two, three = (
        decimals_of(vs.solve(p, ["0.1"], digits=30)) for p in (exact, doubles, same_doubles)
    )
    assert 1e-18 < deviation(one, two, "q") < 1e-14
    assert deviation(two, three, "q") == 0
    assert deviation(one, decimals_of(vs.solve(exact, [0.1], digits=30)), "q") > 1e-19


@pytest.mark.parametrize(
    ("A", "q", "q_dot"),
    [
        (["2", "2", "1"], ["0.6", "0", "0.8"], ["0.4", "0.7", "-0.3"]),
        (["3", "2", "1", "0.5"], ["0.6", "0", "0.8", "0"], ["0.4", "0.7", "-0.3", "0"]),
        (["2", "2", "2"], ["0.6", "0", "0.8"], ["0.4", "0.7", "-0.3"]),
        (["1e-28", "2e-28", "4e-28"], ["1", "0", "0"], ["0", "3e28", "1e28"]),
    ],
    ids=["symmetric", "frozen", "isotropic", "scaled along an axis"],
)
def test_nice_starts_have_all_digits(A: Any, q: Any, q_dot: Any) -> None:
    problem = vs.Veselova(A, q, q_dot)
    unit = 1 / float(np.max(np.abs(problem.q_dot)))
    found, finer = (vs.solve(problem, [0, 3 * unit], digits=digits) for digits in (25, 35))
    assert deviation(decimals_of(found), decimals_of(finer), "frame") < 1e-25
    ordinary = vs.solve(problem, [0, 3 * unit])
    agree(ordinary, found, "frame")


@pytest.mark.daily(3)
def test_the_service_answers_in_decimals(server: Server) -> None:
    with vs.Client(server.url) as client:
        answer = client.trajectory(
            body3(), ["0.1", 2], digits=40, certified=True, budget_s=BUDGET_S
        )
    here = vs.solve(body3(), ["0.1", 2], digits=40, certified=True)
    found, known = (decimals_of(motion).midpoints["frame"] for motion in (answer, here))
    assert np.all(found == known)


def test_files_carry_all_digits(tmp_path: Path) -> None:
    trajectory = vs.solve(body3(), [1, 2], digits=30)
    known = decimals_of(trajectory)
    trajectory.to_csv(tmp_path / "motion.csv")
    header, first, _ = (tmp_path / "motion.csv").read_text().splitlines()
    row = dict(zip(header.split(","), first.split(","), strict=True))
    assert Decimal(row["frame_2_1"]) == known.midpoints["frame"][0, 1, 0]
    assert Decimal(row["tau1"]) == known.midpoints["tau1"][0]
    trajectory.to_npz(tmp_path / "motion.npz")
    with np.load(tmp_path / "motion.npz") as archive:
        assert Decimal(str(archive["q_decimal"][1, 2])) == known.midpoints["q"][1, 2]
        assert Decimal(str(archive["q_radius"][1, 2])) == known.radii["q"][1, 2]
        again = Trajectory.from_arrays(trajectory.problem, archive)
    assert np.all(decimals_of(again).midpoints["omega"] == known.midpoints["omega"])
    assert np.array_equal(again.error, trajectory.error)
