"""What a server refuses before, during and after the work, and that it survives what it lets in."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from test_http import is_problem, post

from conftest import PATIENCE, running_server
from hostile import GOOD
from veselova.mechanics.core.errors import InvalidRequest
from veselova.service.api.examples import BODY4_PROBLEM
from veselova.service.api.problem_details import problem_document
from veselova.service.api.settings import Settings
from veselova.service.workers.answers import render

BODY4: dict[str, Any] = {"problem": BODY4_PROBLEM, "engine": "numeric"}


def many(count: int) -> dict[str, Any]:
    return {"start": 0, "stop": 10, "count": count}


@pytest.mark.daily(3)
def test_work_beyond_the_memory_of_a_worker_is_a_problem_and_the_worker_lives_on(
    tmp_path: Path,
) -> None:
    limits = {"worker_memory_mb": "384", "max_budget_s": str(PATIENCE)}
    with running_server(tmp_path, **limits) as own:
        workers = own.workers()
        large = {**BODY4, "times": many(800_000), "budget_s": PATIENCE}
        document = is_problem(post(own, "/v1/trajectories", large), 507, "worker-memory")
        assert "384 MB" in document["detail"]
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
