"""What a server refuses before, during and after the work, and that it survives what it lets in."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import httpx2
import pytest
from test_http import is_problem, post

from conftest import Server, running_server, wait_until
from hostile import GOOD
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.api.examples import BODY4_PROBLEM
from veselova.service.api.request_models import ComparisonRequest, TrajectoryRequest, read_request
from veselova.service.api.settings import Settings
from veselova.service.workers.cost_floor import cost, require_affordable

BODY4: dict[str, Any] = {"problem": BODY4_PROBLEM, "engine": "numeric"}


def many(count: int) -> dict[str, Any]:
    return {"start": 0, "stop": 10, "count": count}


def trajectory(**fields: Any) -> TrajectoryRequest:
    return read_request(TrajectoryRequest, {**GOOD, **fields})


def test_work_beyond_the_memory_of_a_worker_is_a_problem_and_the_worker_lives_on(
    tmp_path: Path,
) -> None:
    with running_server(tmp_path, workers="1", worker_memory_mb="256") as own:
        workers = own.workers()
        document = is_problem(
            post(own, "/v1/trajectories", {**BODY4, "times": many(400_000)}), 507, "worker-memory"
        )
        assert "256 MB" in document["detail"]
        assert post(own, "/v1/trajectories", GOOD).status_code == 200
        assert own.workers() == workers
        assert "Traceback" not in own.log.read_text()
        refused = is_problem(
            post(own, "/v1/trajectories", {**BODY4, "times": many(900_000)}), 422, "invalid-input"
        )
        assert refused["errors"][0]["pointer"] == "/times"
        assert "256 MB" in refused["detail"]


def test_hopeless_work_is_refused_before_it_begins(server: Server) -> None:
    wait_until(lambda: server.at_work() == (0, 0))  # what tests before it have left
    before = set(server.workers())
    hopeless = {"problem": GOOD["problem"], "digits": 1000, "times": many(100_000)}
    document = is_problem(post(server, "/v1/trajectories", hopeless), 422, "invalid-input")
    assert document["errors"][0]["pointer"] == "/times"
    assert "budget_s = 10 (at most 60)" in document["detail"]
    assert before <= set(server.workers())


def test_costs_grow_with_points_dimension_and_digits() -> None:
    one = cost(trajectory(times=many(1000)))
    assert cost(trajectory(times=many(2000))).seconds == pytest.approx(2 * one.seconds)
    assert cost(trajectory(times=many(1000), digits=30)).seconds > 10 * one.seconds
    assert (
        cost(trajectory(times=many(1000), digits=60)).seconds
        > cost(trajectory(times=many(1000), certified=True)).seconds
    )
    assert cost(trajectory(times=many(1000), engine="numeric")).seconds < one.seconds
    both = cost(read_request(ComparisonRequest, {**GOOD, "times": many(1000)}))
    assert both.seconds > one.seconds
    assert both.megabytes == 2 * one.megabytes


def test_the_slack_of_estimates_is_a_setting() -> None:
    exact = trajectory(digits=500, times=many(3000), budget_s=5.0)
    with pytest.raises(InvalidInput, match=r"budget_s = 5"):
        require_affordable(exact, Settings())
    require_affordable(exact, Settings(estimate_slack=0))


@pytest.mark.parametrize(
    ("limit", "body", "pointer"),
    [
        ({"max_depth": "4"}, {**GOOD, "problem": {**GOOD["problem"], "frame": [[[[[1]]]]]}}, ""),
        ({"max_text": "50"}, {**GOOD, "problem": {**GOOD["problem"], "A": [3, 2, "1" * 51]}}, ""),
        ({"max_digits": "30"}, {**GOOD, "digits": 31}, "/digits"),
        ({"max_times": "5"}, {**GOOD, "times": many(6)}, "/times"),
        ({"max_values": "50"}, {**GOOD, "times": many(6)}, "/times"),
        ({"max_dimension": "2"}, GOOD, "/problem/A"),
        ({"max_budget_s": "5"}, {**GOOD, "budget_s": 6}, "/budget_s"),
    ],
)
def test_every_limit_is_a_setting(
    limit: dict[str, str], body: dict[str, Any], pointer: str, monkeypatch: Any, tmp_path: Path
) -> None:
    from fastapi.testclient import TestClient

    from veselova.service.http.app import create_app

    ((name, value),) = limit.items()
    monkeypatch.setenv(f"VESELOVA_{name.upper()}", value)
    monkeypatch.setenv("VESELOVA_DATA_DIR", str(tmp_path))
    # Without its lifespan the application has no worker: what is refused is refused before one is
    # needed.
    response = TestClient(create_app(loopback=True)).post("/v1/trajectories", json=body)
    document = is_problem(response, 422, "invalid-input")  # type: ignore[arg-type]
    assert document["errors"][0]["pointer"] == pointer
    assert value in document["detail"]


def spooled(server: Server) -> list[str]:
    """Return the files that a server has open though they have no name any more."""
    folder = Path(f"/proc/{server.process.pid}/fd")
    links = []
    for entry in folder.iterdir():
        try:
            links.append(os.readlink(entry))
        except FileNotFoundError:
            continue
    return [link for link in links if "spool" in link and "deleted" in link]


def test_an_answer_is_let_go_when_its_client_leaves_in_the_middle(tmp_path: Path) -> None:
    with running_server(tmp_path, workers="1") as own:
        body = {**BODY4, "times": many(100_000), "budget_s": 60}
        with (
            httpx2.Client(timeout=60) as client,
            client.stream("POST", f"{own.url}/v1/trajectories", json=body) as response,
        ):
            assert response.status_code == 200
            chunks = response.iter_raw()  # let go, it would close the connection
            assert next(chunks)
            assert len(spooled(own)) == 1
        wait_until(lambda: not spooled(own))
        folder = next((tmp_path / "data" / "spool").iterdir())
        assert [path.name for path in folder.iterdir()] == ["lock"]
        assert post(own, "/v1/trajectories", GOOD).status_code == 200
        assert "Traceback" not in own.log.read_text()
    assert not list((tmp_path / "data" / "spool").iterdir())


def test_work_that_was_stopped_leaves_no_file(tmp_path: Path) -> None:
    with running_server(tmp_path, workers="1") as own:
        endless = {**BODY4, "times": {"start": 0, "stop": 1e7, "count": 100_000}, "budget_s": 0.5}
        is_problem(post(own, "/v1/trajectories", endless), 504, "over-budget")
        assert [
            path
            for path in (tmp_path / "data").rglob("*")
            if path.is_file() and "spool" in str(path) and path.name != "lock"
        ] == []
        assert not list((tmp_path / "data").glob("cache/*"))
