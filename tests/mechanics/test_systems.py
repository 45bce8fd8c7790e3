"""Every system through every door: the same problem in Python, JSON, HTTP, the client, files and
pictures.
"""

from __future__ import annotations

import csv
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest

import veselova
from conftest import Server
from deviations import agree
from hostile import BUDGET_S
from refusals import GOOD
from veselova import Client, InvalidInput, InvalidRequest, compare, solve
from veselova.service.api.json_documents import encode, trajectory_document, trajectory_of
from veselova.service.api.request_models import (
    ComparisonRequest,
    TorusRequest,
    TrajectoryRequest,
    read_request,
)

TIMES = [-1.0, 0.0, 0.5, 2.0]

PROBLEMS: dict[str, dict[str, Any]] = {
    **GOOD,
    "ellipsoid-geodesic": {"A": [3, 2, 1], "X": [1, 1, 1], "X_dot": [1, -1, 0], "normalize": True},
    "veselova-so3": {**GOOD["veselova-so3"], "potential": {"clebsch": 1}},
    "chaplygin-ball": {**GOOD["rubber-ball"], "Omega": ["0.8", 1, "0.2"]},
    "separable": {
        "A": [3, "3/2", 1],
        "q": ["0.6", "0.48", "0.64"],
        "q_dot": ["0.8", "-0.36", "-0.48"],
        "potential": {"quadratic": 1, "centrifugal": [0, "0.01", 0]},
    },
}


def document(name: str) -> dict[str, Any]:
    return {"system": name, **PROBLEMS[name]}


def problem_of(name: str) -> Any:
    return read_request(TorusRequest, {"problem": document(name)}).problem.problem


@pytest.mark.parametrize("name", sorted(PROBLEMS))
def test_a_problem_and_its_trajectory_come_back_from_json_unchanged(name: str) -> None:
    problem = problem_of(name)
    again = read_request(
        TorusRequest, orjson.loads(orjson.dumps({"problem": problem.as_dict()}))
    ).problem.problem
    assert again.as_dict() == problem.as_dict()
    found = solve(problem, TIMES)
    assert found.provenance.engine == next(iter(problem.engines))
    back = trajectory_of(again, orjson.loads(encode(trajectory_document(found, problem.stored))))
    for output, axes in problem.outputs.items():
        assert np.array_equal(back.series(output), found.series(output))
        assert found.series(output).ndim == 1 + len(axes)
    assert {key: value.tolist() for key, value in back.integrals.items()} == {
        k: v.tolist() for k, v in found.integrals.items()
    }


@pytest.mark.parametrize("name", sorted(PROBLEMS))
def test_the_start_is_at_time_zero_and_dense_answers_agree(name: str) -> None:
    problem = problem_of(name)
    found = solve(problem, TIMES, "numeric")
    for output, values in problem.start.items():
        assert np.allclose(found.series(output)[1], values[0], atol=1e-12)
    assert np.allclose(
        found.at([2.0]).series(problem.portrait), found.series(problem.portrait)[3:], atol=1e-9
    )


@pytest.mark.parametrize("name", sorted(PROBLEMS))
def test_every_formulation_and_engine_agrees(name: str) -> None:
    problem = problem_of(name)
    motions = [
        solve(problem, TIMES, "numeric", formulation=formulation)
        for formulation in problem.formulations
    ]
    if "analytic" in problem.engines:
        motions.append(solve(problem, TIMES, "analytic"))
        both = compare(problem, TIMES)
        assert both.agrees
        for output in problem.bounded:
            assert f"{output} by " in repr(both)
            assert output in both._repr_html_()
    for other in motions[1:]:
        agree(other, motions[0])


@pytest.mark.daily(3)
@pytest.mark.parametrize("name", sorted(PROBLEMS))
def test_files_pictures_and_pickles_hold_every_system(name: str, tmp_path: Path) -> None:
    problem = problem_of(name)
    found = solve(problem, TIMES)
    found.to_csv(tmp_path / "x.csv")
    with (tmp_path / "x.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row[problem.time]) for row in rows] == TIMES
    found.to_npz(tmp_path / "x.npz")
    with np.load(tmp_path / "x.npz") as stored:
        assert all(
            np.array_equal(stored[output], found.series(output)) for output in problem.outputs
        )
    assert set(found.to_xarray().data_vars) == {*problem.outputs, "error"}
    found.plot().savefig(tmp_path / "x.png")
    again = pickle.loads(pickle.dumps(found))
    assert np.array_equal(again.series(problem.portrait), found.series(problem.portrait))
    assert name in repr(found)
    assert name in found._repr_html_()


@pytest.mark.daily(3)
@pytest.mark.parametrize("name", sorted(PROBLEMS))
def test_http_and_client_serve_every_system(name: str, server: Server) -> None:
    body = {"problem": document(name), "times": TIMES, "budget_s": BUDGET_S}
    response = server.ask("POST", "/v1/trajectories", json=body)
    assert response.status_code == 200, response.text
    problem = problem_of(name)
    assert list(response.json()["series"]) == list(problem.outputs)
    with Client(server.url) as client:
        found = client.trajectory(
            document(name),
            TIMES,
            "numeric",
            formulation=problem.formulations[-1],
            budget_s=BUDGET_S,
        )
    expected = solve(problem, TIMES, "numeric", formulation=problem.formulations[-1])
    assert np.array_equal(found.series(problem.portrait), expected.series(problem.portrait))
    assert found.provenance.details["formulation"] == problem.formulations[-1]
    listed = {item["system"]: item for item in server.get("/v1/systems").json()["systems"]}
    assert listed[name]["outputs"] == list(problem.outputs)
    assert set(listed[name]["fields"]) >= set(PROBLEMS[name])


@pytest.mark.parametrize("name", sorted(PROBLEMS))
def test_every_field_refuses_what_is_no_number(name: str) -> None:
    """NaN, booleans, texts, objects, ragged lists, wrong lengths wherever a number may stand: named
    faults, nothing else.
    """
    for field, value in PROBLEMS[name].items():
        if isinstance(value, bool):
            continue
        for wrong in (
            float("nan"),
            True,
            "x",
            {"a": 1},
            [[1], [1, 2]],
            [],
            None,
            [1, float("inf"), 2],
            10**400,
        ):
            problem = {**document(name), field: wrong}
            if wrong is None and field in ("potential", "g"):
                continue
            with pytest.raises((InvalidInput, InvalidRequest)) as caught:
                read_request(TorusRequest, {"problem": problem})
            # X of another shape makes another dimension, which the inertia then has not.
            ragged = (name, field) == ("stiefel", "X") and wrong == [[1], [1, 2]]
            assert f"problem.{'inertia' if ragged else field}" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"formulation": "none"},
            "formulation: required one of momentum, multipliers; given none.",
        ),
        (
            {"outputs": ["q"]},
            "outputs[0]: required one of omega, frame, momentum, multipliers; given q.",
        ),
        ({"engine": "analytic"}, "engine: required one of numeric for system lr; given analytic."),
    ],
)
def test_what_a_system_has_not_is_refused_by_name(change: dict[str, Any], message: str) -> None:
    from veselova.service.workers.tasks import solve_request

    with pytest.raises((InvalidInput, InvalidRequest)) as caught:
        solve_request(
            read_request(TrajectoryRequest, {"problem": document("lr"), "times": TIMES, **change})
        )
    assert message in str(caught.value)


@pytest.mark.parametrize("system", ["lr", "euler-poisson", "stiefel"])
def test_a_system_of_one_engine_is_compared_in_two_formulations(system: str) -> None:
    from veselova.service.api.json_documents import comparison_document, comparison_of
    from veselova.service.workers.tasks import compare_request

    stated = {"problem": document(system), "times": TIMES}
    found = compare_request(read_request(ComparisonRequest, stated))
    problem = found.first.problem
    assert found.names == tuple(problem.formulations[:2])
    assert found.agrees
    assert found.drift.keys() == found.seconds.keys() == set(found.names)
    for name, motion in found.trajectories.items():
        assert motion.provenance.details["formulation"] == name
    assert 0 < max(found.deviation.values()) < 1e-9
    with pytest.raises(AttributeError, match=r"has \.first and \.second"):
        _ = found.analytic
    written = comparison_document(found)
    assert list(written["formulations"]) == list(found.names)
    again = comparison_of(problem, written)
    assert again.names == found.names
    assert again.deviation == found.deviation
    with pytest.raises(InvalidInput, match="formulation: required another formulation"):
        veselova.compare(problem, TIMES, formulation=problem.formulations[0])


def test_a_comparison_of_engines_takes_another_formulation() -> None:
    problem = veselova.VeselovaSO3([1, 2, 2.5], [1, 0, 0], [0, 1, 0.5])
    found = veselova.compare(problem, TIMES, formulation="momentum")
    assert found.numeric.provenance.details["formulation"] == "momentum"
    assert found.agrees
    with pytest.raises(InvalidInput, match="formulation: required one of multiplier, momentum"):
        veselova.compare(problem, TIMES, formulation="momentun")
