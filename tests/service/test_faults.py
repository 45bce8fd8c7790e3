"""All faults of an input come back together, each at its place, at every door."""

from __future__ import annotations

import json
import re
from functools import partial
from typing import Any

import pytest

import veselova as vs
from conftest import Server
from veselova.mechanics.core.errors import MOST_FAULTS, Faults, InvalidInput
from veselova.mechanics.core.exact_input import exact_vector
from veselova.service.answers.rendering import beyond_limits
from veselova.service.api.ensemble_request import EnsembleRequest
from veselova.service.api.examples import BODY4_PROBLEM
from veselova.service.api.problem_details import problem_document
from veselova.service.api.request_models import (
    ComparisonRequest,
    TorusRequest,
    TrajectoryRequest,
    read_request,
)
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.api.toolkit_requests import ClosedFormRequest, CurveRequest, ThetaRequest
from veselova.service.cli.main import main
from veselova.service.workers.tasks import compare_request, solve_request, torus_request

#: Constructor, arguments, the places of all their faults, and words that the message has.
PROBLEMS: dict[str, tuple[Any, dict[str, Any], set[str], list[str]]] = {
    "veselova": (
        vs.Veselova,
        {"A": [-1, 0, "x"], "q": [1, 2], "q_dot": [0, "y", 0], "frame": [[1], 2, "z"]},
        {"/A/0", "/A/1", "/A/2", "/q", "/q_dot/1", "/frame/0", "/frame/1", "/frame/2"},
        [],
    ),
    "veselova-off": (
        vs.Veselova,
        {"A": [3, 2], "q": [1, 1], "q_dot": [1, 0], "normalize": False},
        {"/q", "/q_dot"},
        ["length", "cosine"],
    ),
    "neumann": (
        vs.NeumannSystem,
        {"A": [1, -2], "q": ["a", 0], "q_prime": [0, True]},
        {"/A/1", "/q/0", "/q_prime/1"},
        [],
    ),
    "ellipsoid": (
        vs.EllipsoidGeodesic,
        {"A": [1, "x", 3], "X": [0, 0, 0], "X_dot": [1, 0], "normalize": "yes"},
        {"/A/1", "/X", "/X_dot", "/normalize"},
        [],
    ),
    "separable": (
        vs.SeparableVeselova,
        {
            "A": [1, 2, 2],
            "q": [1, 0, 0],
            "q_dot": [0, 1],
            "potential": {"quartc": 1, "quadratic": "x"},
        },
        {"/A/2", "/q_dot", "/potential/quartc", "/potential/quadratic"},
        ["did you mean quartic?"],
    ),
    "so3": (
        vs.VeselovaSO3,
        {
            "inertia": [1, 2, -3],
            "gamma": [1, 1, 0],
            "Omega": [0, 0, "w"],
            "potential": {
                "clebch": 1,
                "polynomial": [
                    {"coefficient": "c", "power": [1, 0, 0]},
                    {"coefficient": 1, "powers": [0, 0.5, 99]},
                ],
            },
        },
        {
            "/inertia/2",
            "/gamma",
            "/Omega/2",
            "/potential/clebch",
            "/potential/polynomial/0/power",
            "/potential/polynomial/0/powers",
            "/potential/polynomial/0/coefficient",
            "/potential/polynomial/1/powers/1",
            "/potential/polynomial/1/powers/2",
        },
        ["did you mean clebsch?", "did you mean powers?"],
    ),
    **{
        name: (
            kind,
            {
                "inertia": "x",
                "mass": -1,
                "radius": "r",
                "gamma": [0, 0, 2],
                "Omega": [1, "w", 0],
                "frame": [[1], 2, "z"],
                "position": [0],
                "strict": 1,
            },
            {"/inertia", "/mass", "/radius", "/gamma", "/Omega/1", "/frame/0", "/frame/1"}
            | {"/frame/2", "/position", "/strict"},
            ["length 2"],
        )
        for name, kind in (("rubber", vs.RubberBall), ("chaplygin", vs.ChaplyginBall))
    },
    "lr-size": (
        vs.LRSystem,
        {"n": "x", "rank": 1, "inertia": {"special": [1, 2, 3]}, "homogeneous": 2},
        {"/n", "/homogeneous"},
        [],
    ),
    "lr": (
        vs.LRSystem,
        {
            "n": 3,
            "rank": 7,
            "inertia": {"specal": [1, 2, 3]},
            "omega": [[0, "x", 0], [1, 0], [[], 0, 0]],
            "potential": [
                {"coefficient": 1, "powers": [[0, 1, 1]]},
                {"coeficient": 1, "powers": []},
            ],
        },
        {
            "/rank",
            "/inertia/specal",
            "/omega/0/1",
            "/potential/0/powers/0/0",
            "/potential/1/coeficient",
            "/potential/1/coefficient",
        },
        ["did you mean special?", "did you mean coefficient?"],
    ),
    "stiefel": (
        vs.StiefelFlow,
        {"inertia": {"special": [1, -2, 3]}, "X": [[1], [1], [0]], "P": [[0], ["p"], [0]]},
        {"/inertia/special/1", "/X", "/P/1/0"},
        [],
    ),
}


def faults_of(call: Any, *arguments: Any, **options: Any) -> tuple[set[str], str]:
    """Return the places of all faults of a call, and all of their sentences."""
    with pytest.raises(InvalidInput) as raised:
        call(*arguments, **options)
    found = problem_document(raised.value)["errors"]
    places = [fault["pointer"] for fault in found]
    assert len(places) == len(set(places)), places
    return set(places), " ".join(fault["detail"] for fault in found)


@pytest.mark.parametrize("case", PROBLEMS)
def test_a_problem_reports_all_faults_of_its_fields(case: str) -> None:
    kind, arguments, places, words = PROBLEMS[case]
    found, text = faults_of(kind, **arguments)
    assert found == places
    for word in words:
        assert word in text


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

#: Kind of request, its body, and the places of its faults.
BODIES: dict[str, tuple[Any, Any, dict[str, Any], set[str]]] = {
    "trajectory": (
        TrajectoryRequest,
        solve_request,
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
    "trajectory-missing": (
        TrajectoryRequest,
        solve_request,
        {"problem": {"system": "veselova", "q": [1, 0], "q_dot": [0, "v"]}, "digits": 5},
        {"/problem/A", "/problem/q_dot/1", "/times", "/digits"},
    ),
    "trajectory-system": (
        TrajectoryRequest,
        solve_request,
        {"problem": {"system": "veslova"}, "times": ["x"], "certified": 1},
        {"/problem/system", "/times/0", "/certified"},
    ),
    "trajectory-nameless": (
        TrajectoryRequest,
        solve_request,
        {"problem": {**BAD_PROBLEM, "system": [["veselova"]]}, "times": ["x"]},
        {"/problem/system", "/times/0"},
    ),
    "trajectory-plain": (
        TrajectoryRequest,
        solve_request,
        {"problem": BAD_PROBLEM, "times": [0, "x"]},
        OF_PROBLEM | {"/times/1"},
    ),
    "trajectory-many-times": (
        TrajectoryRequest,
        solve_request,
        {"problem": BAD_PROBLEM, "times": [*range(3000), "x"], "method": "dop853"},
        OF_PROBLEM | {"/times/3000", "/method"},
    ),
    "trajectory-digits": (
        TrajectoryRequest,
        solve_request,
        {
            "problem": {
                "system": "euler-poisson",
                "inertia": [1, 2, 0],
                "gamma": [1, 0, 0],
                "Omega": 3,
            },
            "times": [0],
            "digits": 30,
        },
        {"/digits", "/problem/inertia/2", "/problem/Omega"},
    ),
    "trajectory-ball": (
        TrajectoryRequest,
        solve_request,
        {"problem": BAD_BALL, "times": [0, "x"]},
        OF_BALL | {"/times/1"},
    ),
    "comparison": (
        ComparisonRequest,
        compare_request,
        {"problem": BAD_PROBLEM, "times": [0, "x"]},
        OF_PROBLEM | {"/times/1"},
    ),
    "comparison-options": (
        ComparisonRequest,
        compare_request,
        {
            "problem": BAD_PROBLEM,
            "times": {"start": 0, "stop": "x", "count": 5000},
            "method": "dop",
            "digits": 20,
        },
        OF_PROBLEM | {"/times/stop", "/method", "/digits"},
    ),
    "torus": (TorusRequest, torus_request, {"problem": BAD_PROBLEM}, OF_PROBLEM),
    "torus-fields": (
        TorusRequest,
        torus_request,
        {"problem": {**BAD_PROBLEM, "fram": None}, "budget_s": "x", "times": [0]},
        OF_PROBLEM | {"/problem/fram", "/budget_s", "/times"},
    ),
    "sweep": (
        SweepRequest,
        None,
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
    "sweep-varied": (
        SweepRequest,
        None,
        {
            "problem": {**BAD_PROBLEM, "q": [1, 1, 0]},
            "vary": {"/q/0": {"uniformm": [0, 1]}, "/q_dto": [1]},
            "times": {"start": 0, "stop": 1},
        },
        {"/problem/A/0", "/problem/A/2", "/problem/q_dot", "/times/count"}
        | {"/vary/~1q~10", "/vary/~1q_dto"},
    ),
    "sweep-nowhere": (
        SweepRequest,
        None,
        {"problem": BAD_PROBLEM, "vary": {"A": [1]}},
        OF_PROBLEM | {"/vary/A"},
    ),
    "ensemble": (
        EnsembleRequest,
        None,
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
        CurveRequest,
        None,
        {
            "branch_points": [1, 2, 3],
            "sign": 5,
            "points": ["a"],
            "z": [["c"]],
            "outputs": ["Thomae"],
            "digts": 20,
        },
        {"/sign", "/points/0", "/w", "/z/0/0", "/outputs/0", "/digts"},
    ),
    "theta": (
        ThetaRequest,
        None,
        {"z": "x", "tau": [[1]], "T": [[1]], "derivatives": 9, "characteristic": 3, "Z": 1},
        {"/z", "/tau", "/derivatives", "/characteristic", "/Z"},
    ),
    "theta-points": (
        ThetaRequest,
        None,
        {"z": [["x"]], "derivatives": 1.5},
        {"/z/0/0", "/tau", "/derivatives"},
    ),
    "closed-form": (
        ClosedFormRequest,
        None,
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
def test_a_request_reports_all_faults_of_its_body(case: str) -> None:
    model, compute, body, places = BODIES[case]

    def door() -> None:
        request = read_request(model, body)
        assert compute is not None
        compute(request)

    found, _ = faults_of(door)
    assert found == places


@pytest.mark.parametrize("case", BODIES)
def test_the_service_reports_them_all(server: Server, case: str) -> None:
    """With a limit of the server besides, and each fault once."""
    path = f"/v1/{PATHS[case.partition('-')[0]]}"
    budgets: tuple[dict[str, float], ...] = ({}, {"budget_s": 1e9})
    for budget in budgets:
        response = server.ask("POST", path, json={**BODIES[case][2], **budget})
        assert response.status_code == 422
        pointers = [fault["pointer"] for fault in response.json()["errors"]]
        limits = {f"/{name}" for name in budget}
        assert sorted(pointers) == sorted(BODIES[case][3] | limits)


@pytest.mark.parametrize(
    ("case", "near"),
    [
        ("curve", {"thomae", "digits"}),
        ("theta", {"z"}),
        ("ensemble", {"q_dot", "count"}),
        ("sweep-varied", {"uniform", "q_dot"}),
        ("closed-form", {"accuracy"}),
    ],
)
def test_names_that_are_nearly_right_are_suggested(
    server: Server, case: str, near: set[str]
) -> None:
    path = f"/v1/{PATHS[case.partition('-')[0]]}"
    text = server.ask("POST", path, json=BODIES[case][2]).text
    assert near <= set(re.findall(r"did you mean (\w+)", text))


def test_limits_of_the_server_come_with_the_other_faults(server: Server) -> None:
    body = {**BODIES["trajectory-plain"][2], "budget_s": 1e9}
    response = server.ask("POST", "/v1/trajectories", json=body)
    found = {fault["pointer"] for fault in response.json()["errors"]}
    assert found == OF_PROBLEM | {"/times/1", "/budget_s"}


@pytest.mark.parametrize(
    ("case", "named"),
    [
        (
            "trajectory",
            ("problem.A[0]", "problem.A[2]", "problem.q:", "times[1]", "engine", "budget_s"),
        ),
        (
            "trajectory-ball",
            ("problem.inertia", "problem.mass", "problem.gamma", "problem.Omega[1]", "times[1]"),
        ),
    ],
)
def test_the_command_line_reports_them_all(
    case: str,
    named: tuple[str, ...],
    tmp_path: Any,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Any,
) -> None:
    path = tmp_path / "request.json"
    path.write_text(json.dumps(BODIES[case][2]))
    monkeypatch.setattr("sys.argv", ["veselova", "solve", str(path)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    text = capsys.readouterr().err
    for place in named:
        assert place in text


def test_faults_keep_no_frames() -> None:
    """A hundred thousand of them would take a minute."""
    faults = Faults()
    faults.attempt(exact_vector, ["x"] * 200, ("A",))
    assert len(faults.found[0].faults) == MOST_FAULTS
    assert all(fault.__context__ is None is fault.__traceback__ for fault in faults.found)


def test_a_hundred_faults_are_spelled_out_and_the_rest_counted() -> None:
    with pytest.raises(InvalidInput) as raised:
        vs.solve(vs.Veselova([2, 1], [1, 0], [0, 1]), ["x"] * 250)
    document = problem_document(raised.value)
    assert len(document["errors"]) == 100
    assert document["further_errors"] == 150


#: A problem of 250 dimensions.
WIDE_PROBLEM = {
    "system": "veselova",
    "A": [2] * 250,
    "q": [1] + [0] * 249,
    "q_dot": [0] * 249 + [1],
}


@pytest.mark.parametrize(
    ("model", "body", "count"),
    [
        (CurveRequest, {"branch_points": [0, 1, 2], "points": ["x"] * 250}, 251),
        (CurveRequest, {"branch_points": [0, 1, 2], "points": [1], "w": ["x"] * 250}, 250),
        (ThetaRequest, {"z": [["x"]] * 250, "tau": [[[0, 1]]], "Z": 1}, 251),
        (TrajectoryRequest, {"problem": BAD_PROBLEM, "times": ["x"] * 250, "methd": 1}, 254),
        (SweepRequest, {"problem": BAD_PROBLEM, "vary": {"/A/0": [[]] * 250}}, 252),
        (SweepRequest, {"problem": WIDE_PROBLEM, "vary": {"/A": [["x"] * 250]}}, 250),
        (
            EnsembleRequest,
            {"A": [3, 2], "starts": {"q": [[1, 0]], "q_dot": [[0, 1]]}, "times": ["x"] * 250},
            250,
        ),
    ],
)
def test_all_faults_of_a_body_are_counted(model: Any, body: Any, count: int) -> None:
    with pytest.raises(InvalidInput) as raised:
        read_request(model, body)
    document = problem_document(raised.value)
    assert len(document["errors"]) == MOST_FAULTS
    assert document["further_errors"] == count - MOST_FAULTS


def test_faults_beyond_the_first_are_counted_without_their_words() -> None:
    """A quarter of a million of them take a second, and no memory."""
    faults = Faults()
    for i in range(1000):
        faults.attempt(exact_vector, ["x"] * 3, ("A", i))
    assert len(faults.found) == MOST_FAULTS
    assert faults.further == 3 * (1000 - MOST_FAULTS)
    with pytest.raises(InvalidInput) as raised:
        faults.require_none()
    assert raised.value.further == 3000 - MOST_FAULTS
    assert "And 2990 more." in str(raised.value)


HUGE = int("9" * 3999)


@pytest.mark.parametrize(
    ("model", "changes"),
    [
        (TrajectoryRequest, {"times": {"start": 0, "stop": 1, "count": HUGE}}),
        (TrajectoryRequest, {"problem": {**BODY4_PROBLEM, "A": HUGE}}),
        (ComparisonRequest, {"problem": {**BODY4_PROBLEM, "A": HUGE}}),
        (SweepRequest, {"problem": {**BODY4_PROBLEM, "system": []}, "vary": {"/A/0": [2, 3]}}),
    ],
)
def test_what_cannot_be_printed_or_has_no_place_is_refused_by_name(
    model: Any, changes: dict[str, Any]
) -> None:
    """Python prints no integers of more than 4300 digits; the products of others have more."""
    body = {"problem": BODY4_PROBLEM, "times": [0, 1], **changes}
    with pytest.raises(InvalidInput, match="required"):
        read_request(model, body, partial(beyond_limits, settings=Settings()))
