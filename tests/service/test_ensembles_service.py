"""Many starts in one request: by HTTP, the clients and the command line."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_http import is_problem, post

import veselova as vs
from conftest import Server, command_line
from hostile import BUDGET_S
from veselova.service.api.examples import ENSEMBLE

A = [3.0, 2.0, 1.0]
TIMES = [0.0, 2.0, 1e4]


#: As many starts as they have numbers.
THREE: dict[str, Any] = {"q": [[0.6, 0, 0.8]] * 3, "q_dot": [[0, 1, 0]] * 3}


def starts(rng: np.random.Generator, count: int) -> dict[str, Any]:
    return {"q": rng.normal(size=(count, 3)), "q_dot": rng.normal(size=(count, 3))}


def body(given: dict[str, Any], **others: Any) -> dict[str, Any]:
    rows = {name: values.tolist() for name, values in given.items()}
    return {"A": A, "starts": rows, "normalize": True, "times": TIMES, **others}


def test_arrays_over_http_are_those_of_the_library(
    server: Server, rng: np.random.Generator
) -> None:
    given = starts(rng, 20)
    found = post(server, "/v1/ensembles", body(given, budget_s=BUDGET_S)).json()
    expected = vs.solve_many({"A": A, **given, "normalize": True}, TIMES)
    assert found["rows"] == list(range(20))
    assert found["outcome"] == ["solved"] * 20
    assert set(found["series"]) == {"q_dot", "frame", "tau1"}
    for name, values in found["series"].items():
        assert np.array_equal(values, expected.arrays[name])
    assert np.array_equal(found["error"], expected.error)


def test_a_bad_row_is_named_and_the_others_are_served(
    server: Server, rng: np.random.Generator
) -> None:
    asked = body(starts(rng, 4), outputs=["q"])
    asked["starts"]["q"][1][2] = None
    found = post(server, "/v1/ensembles", asked).json()
    assert found["outcome"] == ["solved", "invalid-input", "solved", "solved"]
    assert found["rows"] == [0, 2, 3]
    assert "q[2]" in found["detail"][1]
    assert np.shape(found["series"]["q"]) == (3, 3, 3)
    nothing = body({"q": np.zeros((2, 3)), "q_dot": np.ones((2, 3))})
    assert post(server, "/v1/ensembles", nothing).json()["rows"] == []


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"starts": {"q": [[1, 0, 0]], "q_dot": [[0, 1, 0], [0, 1, 0]]}}, "/starts/q_dot"),
        ({"A": [3, 2]}, "/A"),
        ({"outputs": ["speed"]}, "/outputs/0"),
        ({"times": {"start": 0, "stop": 1, "count": 10**9}}, "/starts"),
    ],
)
def test_bad_arrays_are_refused_with_a_pointer(
    server: Server, change: dict[str, Any], pointer: str
) -> None:
    document = is_problem(
        post(server, "/v1/ensembles", {**ENSEMBLE, **change}), 422, "invalid-input"
    )
    assert pointer in [fault["pointer"] for fault in document["errors"]]


def test_limits_come_before_the_work(server: Server) -> None:
    wide = {"q": [[1.0] * 2000], "q_dot": [[1.0] * 2000]}
    refused = post(server, "/v1/ensembles", {**ENSEMBLE, "A": [1.0] * 2000, "starts": wide})
    assert "at most 64 entries" in is_problem(refused, 422, "invalid-input")["detail"]


def test_work_ends_with_its_budget(server: Server, rng: np.random.Generator) -> None:
    asked = body(starts(rng, 5000), budget_s=0.02)
    is_problem(post(server, "/v1/ensembles", asked), 504, "over-budget")


def test_both_clients_give_what_the_library_gives(server: Server, rng: np.random.Generator) -> None:
    given = {"A": A, **starts(rng, 6), "normalize": True}
    given["q"][2] = np.nan
    expected = vs.solve_many(given, TIMES)
    with vs.Client(server.url) as client:
        found = client.solve_many(given, TIMES, budget_s=BUDGET_S)
        positions = client.solve_many(given, TIMES, ["q"])
        with pytest.raises(vs.InvalidInput, match="frame: required no field of this name"):
            client.solve_many({**given, "frame": np.eye(3)}, TIMES)
        with pytest.raises(vs.InvalidInput, match="problems: required arrays by name"):
            client.solve_many([vs.Veselova(A, [1, 0, 0], [0, 1, 0])], TIMES)

    async def ask() -> Any:
        async with vs.AsyncClient(server.url) as client:
            return await client.solve_many(given, TIMES, budget_s=BUDGET_S)

    for answer in (found, asyncio.run(ask())):
        for name, values in expected.arrays.items():
            assert np.array_equal(getattr(answer, name), values, equal_nan=True)
        assert answer.outcome.tolist() == expected.outcome.tolist()
        assert answer.detail == expected.detail
    assert np.array_equal(positions.q, expected.q, equal_nan=True)


def test_matrices_and_as_many_bodies_as_numbers_have_one_meaning(server: Server) -> None:
    matrix = [[3, 0.1, 0], [0.1, 2, 0], [0, 0, 1]]
    alone = vs.solve(vs.Veselova(matrix, THREE["q"][0], THREE["q_dot"][0]), [0.5])
    bodies = {"A": [np.diag([3, 1]), np.diag([1, 2])]}
    bodies |= {"q": [[0.6, 0.8]] * 2, "q_dot": [[0.8, -0.6]] * 2}
    with vs.Client(server.url) as client:
        found = client.solve_many({"A": [matrix], **THREE}, [0.5])
        several = client.solve_many(bodies, [0.5])
    assert np.allclose(found.frame, alone.frame[None], atol=1e-12)
    assert np.allclose(several.frame, vs.solve_many(bodies, [0.5]).frame, atol=1e-12)


def test_the_command_line_solves_many_starts(tmp_path: Path, rng: np.random.Generator) -> None:
    given = starts(rng, 5)
    given["q"][3] = 0.0
    printed = command_line("solve", "-", "--json", stdin=body(given))
    assert json.loads(printed.stdout)["rows"] == [0, 1, 2, 4]
    place = tmp_path / "many.npz"
    shown = command_line("solve", "-", "--output", place, stdin=body(given))
    assert shown.returncode == 0
    assert "invalid-input" in shown.stdout
    assert "start 3: q: required a vector other than zero" in shown.stdout
    with np.load(place) as archive:
        assert archive["frame"].shape == (5, 3, 3, 3)
