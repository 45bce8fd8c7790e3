"""What a server refuses before, during and after the work, and that it survives what it lets in."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any

import httpx2
import pytest
from test_http import is_problem, post

from conftest import running_server, wait_until
from hostile import GOOD
from veselova.mechanics.core.errors import InvalidRequest
from veselova.service.answers.rendering import render
from veselova.service.api.examples import BODY4_PROBLEM
from veselova.service.api.problem_details import Refused, problem_document
from veselova.service.api.settings import Settings

BODY4: dict[str, Any] = {"problem": BODY4_PROBLEM, "engine": "numeric"}


def many(count: int) -> dict[str, Any]:
    return {"start": 0, "stop": 10, "count": count}


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


@pytest.mark.parametrize(
    ("limit", "body", "pointer"),
    [
        ({"max_values": 50}, {**GOOD, "times": many(6)}, "/times"),
        ({"max_dimension": 2}, GOOD, "/problem/A"),
        ({"max_budget_s": 5.0}, {**GOOD, "budget_s": 6}, "/budget_s"),
    ],
)
def test_every_limit_is_a_setting(
    limit: dict[str, float], body: dict[str, Any], pointer: str
) -> None:
    settings = Settings.model_validate(limit)
    with pytest.raises(InvalidRequest) as raised:
        render("trajectory", json.dumps(body).encode(), "json", Path(os.devnull), settings)
    ((_, value),) = limit.items()
    (fault,) = problem_document(raised.value)["errors"]
    assert fault["pointer"] == pointer
    assert f"{value:g}" in fault["detail"]


def answer_files(folder: Path) -> list[Path]:
    """Return the files of large answers."""
    return list((folder / "data" / "answers").iterdir())


def test_a_large_answer_is_removed_when_its_client_leaves_in_the_middle(tmp_path: Path) -> None:
    with running_server(tmp_path, workers="1") as own:
        body = {**BODY4, "times": many(100_000), "budget_s": 60}
        with (
            httpx2.Client(timeout=60) as client,
            client.stream("POST", f"{own.url}/v1/trajectories", json=body) as response,
        ):
            assert response.status_code == 200
            chunks = response.iter_raw()  # let go, it would close the connection
            assert next(chunks)
            assert len(answer_files(tmp_path)) == 1
        wait_until(lambda: not answer_files(tmp_path))
        assert post(own, "/v1/trajectories", GOOD).status_code == 200
        assert "Traceback" not in own.log.read_text()


def test_files_of_servers_that_were_killed_are_removed_at_the_next_start(tmp_path: Path) -> None:
    folder = tmp_path / "data" / "answers"
    folder.mkdir(parents=True, mode=0o700)
    for name, age in (("old", 4000), ("new", 0)):
        (folder / name).touch()
        os.utime(folder / name, (time.time() - age,) * 2)
    with running_server(tmp_path, workers="1"):
        assert [path.name for path in folder.iterdir()] == ["new"]


def test_a_disk_too_full_for_an_answer_is_a_refusal() -> None:
    body = json.dumps({**BODY4, "times": many(20_000)}).encode()
    with pytest.raises(Refused) as raised:
        render("trajectory", body, "csv", Path("/dev/full"), Settings())
    assert raised.value.code == "storage-full"


def test_work_that_was_stopped_leaves_no_file(tmp_path: Path) -> None:
    with running_server(tmp_path, workers="1") as own:
        endless = {**BODY4, "times": {"start": 0, "stop": 1e7, "count": 100_000}, "budget_s": 0.5}
        is_problem(post(own, "/v1/trajectories", endless), 504, "over-budget")
        assert not answer_files(tmp_path)
