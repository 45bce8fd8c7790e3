"""More digits than a double has, and certified errors: the same chain in ball arithmetic."""

from __future__ import annotations

import json
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import veselova as vs
from conftest import Server, slow
from deviations import agree
from draws import random_problem
from hostile import BUDGET_S
from problems import Case, tagged
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import encode, trajectory_document, trajectory_of

BODY3 = {"A": ["3", "2", "1.2"], "q": ["0.6", "0", "0.8"], "q_dot": ["0.4", "0.7", "-0.3"]}


def body3() -> vs.Veselova:
    return vs.Veselova(**BODY3)


def deviation(found: Decimals, other: Decimals, name: str) -> float:
    return float(np.max(np.abs(found.midpoints[name] - other.midpoints[name])))


@pytest.mark.parametrize("case", tagged("reference"), ids=lambda case: case.name)
def test_references_are_met_to_their_last_digits(case: Case) -> None:
    """References are printed to 30 digits, from starts whose frame is given to 35."""
    found = vs.solve(case.problem(), [point["t"] for point in case.points], digits=30).decimals
    assert found is not None
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
    proven = vs.solve(problem, times, certified=True).decimals
    finer = vs.solve(problem, times, digits=40).decimals
    assert proven is not None
    assert finer is not None
    assert proven.certified
    for name in proven.midpoints:
        assert np.all(
            np.abs(proven.midpoints[name] - finer.midpoints[name])
            <= proven.radii[name] + finer.radii[name]
        ), name
    ordinary = vs.solve(problem, times)
    assert np.all(proven.error.astype(float) < ordinary.error)
    true_error = np.max(
        np.abs(ordinary.frame - finer.midpoints["frame"].astype(float)), axis=(1, 2)
    )
    assert np.all(true_error <= ordinary.error)


@pytest.mark.parametrize("method", ["theta", "angles"])
@pytest.mark.parametrize("n", [2, 3])
def test_times_beyond_the_whole_numbers_of_doubles_lead_there_and_back(
    n: int, method: str, rng: np.random.Generator
) -> None:
    """Which cell of the torus a phase is in decides signs, and doubles do not tell those of 10²⁰
    apart.
    """
    body = random_problem(rng, n)
    there = vs.solve(body, ["1e20"], digits=42, method=method).decimals
    assert there is not None
    state = (list(map(str, there.midpoints[series][0])) for series in ("q", "q_dot"))
    back = vs.solve(
        vs.Veselova(body.A, *state, normalize=True), ["-1e20"], digits=20, method=method
    ).decimals
    start = vs.solve(body, [0], digits=20).decimals
    assert back is not None
    assert start is not None
    for series in ("q", "q_dot"):
        assert deviation(back, start, series) < 1e-19, series


def test_a_separatrix_has_all_digits_of_exact_data() -> None:
    """A great circle about the middle axis, and the umbilic motion that leaves it: c_2 = I_2
    exactly.
    """
    umbilic = vs.Veselova(
        ["3", "2", "1"], ["0.6", "0", "0.8"], ["0.8", "0.5", "-0.6"], normalize=True
    )
    near = vs.Veselova(["3", "2", "1"], ["0", "1", "0"], ["0.6", "1e-30", "0.8"], normalize=True)
    for problem in (
        umbilic,
        near,
        vs.Veselova(["3", "2", "1"], ["0", "1", "0"], ["0.6", "0", "0.8"]),
    ):
        found, finer = (vs.solve(problem, [-2, 5], digits=digits).decimals for digits in (20, 30))
        assert found is not None
        assert finer is not None
        assert deviation(found, finer, "frame") < 1e-20


def test_strings_are_taken_exactly_and_doubles_as_what_they_store() -> None:
    exact = vs.Veselova(["3", "2", "1.2"], ["0.6", "0", "0.8"], ["0.4", "0.7", "-0.3"])
    doubles = vs.Veselova([3, 2, 1.2], [0.6, 0, 0.8], [0.4, 0.7, -0.3])
    same_doubles = vs.Veselova([3, 2, Fraction(1.2)], [Fraction(0.6), 0, 0.8], [0.4, 0.7, -0.3])
    one, two, three = (
        vs.solve(p, ["0.1"], digits=30).decimals for p in (exact, doubles, same_doubles)
    )
    assert one is not None
    assert two is not None
    assert three is not None
    assert 1e-18 < deviation(one, two, "q") < 1e-14
    assert deviation(two, three, "q") == 0
    assert deviation(one, vs.solve(exact, [0.1], digits=30).decimals, "q") > 1e-19  # type: ignore[arg-type]


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
    assert found.decimals is not None
    assert finer.decimals is not None
    assert deviation(found.decimals, finer.decimals, "frame") < 1e-25
    ordinary = vs.solve(problem, [0, 3 * unit])
    agree(ordinary, found, "frame")


def made(trajectory: vs.Trajectory) -> Decimals:
    """The decimals of a trajectory, all of them made: that is done when they are asked for."""
    assert trajectory.decimals is not None
    return replace(
        trajectory.decimals,
        midpoints=dict(trajectory.decimals.midpoints),
        radii=dict(trajectory.decimals.radii),
    )


def test_decimals_come_back_from_their_document_to_the_last_digit() -> None:
    problem = body3()
    trajectory = vs.solve(problem, ["0.1", 2], digits=40, certified=True)
    document = json.loads(encode(trajectory_document(trajectory)))
    assert document["series"]["q"][1][0] == str(trajectory.decimals.midpoints["q"][1, 0])  # type: ignore[union-attr]
    back = trajectory_of(problem, document)
    assert back.decimals is not None
    assert trajectory.decimals is not None
    assert back.decimals.certified
    for name in ("q", "q_dot", "frame", "tau1", "spheroconic"):
        assert np.all(back.decimals.midpoints[name] == trajectory.decimals.midpoints[name])
        assert np.all(back.decimals.radii[name] == trajectory.decimals.radii[name])
    # ω is formed anew, from what came: a valid enclosure of the same numbers.
    assert deviation(back.decimals, trajectory.decimals, "omega") < 1e-40
    assert np.array_equal(back.error, trajectory.error)


def test_the_service_answers_in_decimals(server: Server) -> None:
    with vs.Client(server.url) as client:
        answer = client.trajectory(
            body3(), ["0.1", 2], digits=40, certified=True, budget_s=BUDGET_S
        )
    here = vs.solve(body3(), ["0.1", 2], digits=40, certified=True)
    assert answer.decimals is not None
    assert here.decimals is not None
    assert np.all(answer.decimals.midpoints["frame"] == here.decimals.midpoints["frame"])


def test_files_carry_all_digits(tmp_path: Path) -> None:
    trajectory = vs.solve(body3(), [1, 2], digits=30)
    assert trajectory.decimals is not None
    trajectory.to_csv(tmp_path / "motion.csv")
    header, first, _ = (tmp_path / "motion.csv").read_text().splitlines()
    row = dict(zip(header.split(","), first.split(","), strict=True))
    assert Decimal(row["frame_2_1"]) == trajectory.decimals.midpoints["frame"][0, 1, 0]
    assert Decimal(row["tau1"]) == trajectory.decimals.midpoints["tau1"][0]
    trajectory.to_npz(tmp_path / "motion.npz")
    with np.load(tmp_path / "motion.npz") as archive:
        assert Decimal(str(archive["q_decimal"][1, 2])) == trajectory.decimals.midpoints["q"][1, 2]
        assert Decimal(str(archive["q_radius"][1, 2])) == trajectory.decimals.radii["q"][1, 2]
        again = Trajectory.from_arrays(trajectory.problem, archive)
    assert again.decimals is not None
    assert np.all(again.decimals.midpoints["omega"] == trajectory.decimals.midpoints["omega"])
    assert np.array_equal(again.error, trajectory.error)
