"""All faults of an input come back together, each at its place, at every door."""

from __future__ import annotations

from typing import Any

import pytest

import veselova as vs
from conftest import Server, command_line
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.api.problem_details import problem_document


def faults_of(call: Any, *arguments: Any, **options: Any) -> tuple[set[str], str]:
    """Return the places of all faults of a call, and all of their sentences."""
    with pytest.raises(InvalidInput) as raised:
        call(*arguments, **options)
    found = problem_document(raised.value)["errors"]
    places = [fault["pointer"] for fault in found]
    assert len(places) == len(set(places)), places
    return set(places), " ".join(fault["detail"] for fault in found)


def test_solve_reports_options_and_times_together() -> None:
    body = vs.Veselova([2, 1], [1, 0], [0, 1])
    found, text = faults_of(
        vs.solve, body, {"strat": 0, "stop": "x", "count": 0}, "analytc", digits=3
    )
    assert found == {
        "/engine",
        "/digits",
        "/times/strat",
        "/times/start",
        "/times/stop",
        "/times/count",
    }
    assert "did you mean start?" in text
    assert faults_of(vs.compare, body, [0, "x", "y"], "dop")[0] == {
        "/times/1",
        "/times/2",
        "/method",
    }


#: A ball whose state is wrong as well as its body.
BAD_BALL = {
    "system": "rubber-ball",
    "inertia": "x",
    "mass": -1,
    "radius": 1,
    "gamma": [0, 0, 2],
    "Omega": [0, "w", 1],
}
OF_BALL = {f"/problem/{name}" for name in ("inertia", "mass", "gamma", "Omega/1")}

BAD_PROBLEM = {"system": "veselova", "A": [-1, 2, "x"], "q": [1, 0], "q_dot": [0, 1, 0]}
OF_PROBLEM = {"/problem/A/0", "/problem/A/2", "/problem/q"}

#: Kind of request: its body, and the places of its faults.
BODIES: dict[str, tuple[dict[str, Any], set[str]]] = {
    "trajectory": (
        {
            "problem": {**BAD_PROBLEM, "normalise": True},
            "times": [0, "x"],
            "engine": "analytc",
            "methd": "theta",
            "budget_s": -1,
            "outputs": ["qq", 7],
        },
        OF_PROBLEM
        | {"/problem/normalise", "/times/1", "/engine", "/methd", "/budget_s"}
        | {"/outputs/0", "/outputs/1"},
    ),
    "trajectory-ball": ({"problem": BAD_BALL, "times": [0, "x"]}, OF_BALL | {"/times/1"}),
    "sweep": (
        {
            "problem": BAD_PROBLEM,
            "vary": {"/A/9": [1], "/q_dot/0": {"start": "z", "stop": 1, "count": 0}},
            "times": [0, "x"],
            "method": "dop",
            "samples": 0,
        },
        OF_PROBLEM
        | {"/vary/~1A~19", "/vary/~1q_dot~10/start", "/vary/~1q_dot~10/count"}
        | {"/times/1", "/method", "/samples"},
    ),
    "ensemble": (
        {
            "A": [3, "x", 1],
            "starts": {"q": [["y", 0, 0]], "qdot": [[0, 1, 0]]},
            "times": {"start": 1, "stop": "x", "cout": 3},
            "outputs": ["qdot"],
        },
        {"/A", "/starts/q", "/starts/qdot", "/starts/q_dot", "/outputs/0"}
        | {"/times/cout", "/times/count", "/times/stop"},
    ),
    "curve": (
        {
            "branch_points": [1, 2, 3],
            "sign": 5,
            "points": ["a"],
            "z": [["c"]],
            "outputs": ["Quasi"],
            "digts": 20,
        },
        {"/sign", "/points/0", "/w", "/z/0/0", "/outputs/0", "/digts"},
    ),
    "theta": (
        {"z": "x", "tau": [[1]], "T": [[1]], "derivatives": 9, "characteristic": 3, "Z": 1},
        {"/z", "/tau", "/derivatives", "/characteristic", "/Z"},
    ),
    "closed-form": (
        {"problem": BAD_PROBLEM, "accuracy": "x", "digits": 5000, "accurcy": 1},
        OF_PROBLEM | {"/accuracy", "/digits", "/accurcy"},
    ),
}

#: Kind of request → the place that takes it.
PATHS = {
    "trajectory": "trajectories",
    "comparison": "comparisons",
    "torus": "tori",
    "sweep": "sweeps",
    "ensemble": "ensembles",
    "curve": "curves",
    "theta": "theta",
    "closed": "closed-forms",
}


@pytest.mark.parametrize("case", BODIES)
def test_the_service_reports_them_all(server: Server, case: str) -> None:
    """With a limit of the server besides, and each fault once."""
    path = f"/v1/{PATHS[case.partition('-')[0]]}"
    budgets: tuple[dict[str, float], ...] = ({}, {"budget_s": 1e9})
    for budget in budgets:
        response = server.ask("POST", path, json={**BODIES[case][0], **budget})
        assert response.status_code == 422
        pointers = [fault["pointer"] for fault in response.json()["errors"]]
        limits = {f"/{name}" for name in budget}
        assert sorted(pointers) == sorted(BODIES[case][1] | limits)


def test_a_hundred_faults_are_spelled_out_and_the_rest_counted() -> None:
    with pytest.raises(InvalidInput) as raised:
        vs.solve(vs.Veselova([2, 1], [1, 0], [0, 1]), ["x"] * 250)
    document = problem_document(raised.value)
    assert len(document["errors"]) == 100
    assert document["further_errors"] == 150


def test_the_command_line_reports_them_all() -> None:
    answer = command_line("solve", "-", stdin=BODIES["trajectory"][0])
    assert answer.returncode == 2
    places = "problem.A[0]", "problem.A[2]", "problem.q:", "times[1]", "engine", "budget_s"
    assert all(place in answer.stderr for place in places), answer.stderr
