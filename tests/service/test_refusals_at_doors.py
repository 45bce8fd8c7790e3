"""Two refusals of every system at each door but Python's: HTTP, the client, the command line and
sweeps name the same field.
"""

from __future__ import annotations

import re
from typing import Any

import httpx2
import pytest
from test_client_faults import unsent
from test_http import is_problem, post

from conftest import Server, command_line
from refusals import GEODESIC, GEODESICS_REFUSED, GOOD, REFUSED
from veselova import Client, InvalidInput
from veselova.service.api.request_models import read_request
from veselova.service.api.sweep_request import SweepRequest

rows = pytest.mark.parametrize(
    ("field", "problem"),
    [
        pytest.param(field, {"system": system, **GOOD[system], **changes}, id=f"{system} {field}")
        for system, rows in REFUSED.items()
        for field, changes, _ in rows[:2]
    ],
)


@rows
def test_the_server_points_at_the_field(server: Server, field: str, problem: Any) -> None:
    answer = post(server, "/v1/trajectories", {"problem": problem, "times": [0, 1]})
    fault = is_problem(answer, 422, "invalid-input")["errors"][0]
    assert fault["pointer"] == "/problem/" + re.sub(r"\[(\d+)\]", r"/\1", field).replace(".", "/")
    assert "; given " in fault["detail"]


@rows
def test_the_client_sends_nothing(field: str, problem: Any) -> None:
    transport = httpx2.MockTransport(unsent)
    with (
        Client("http://server", transport=transport) as client,
        pytest.raises(InvalidInput, match=re.escape(f"{field}: required ")),
    ):
        client.trajectory(problem, [0, 1])


@rows
def test_the_command_line_exits_2_with_one_sentence(field: str, problem: Any) -> None:
    answer = command_line("solve", "-", stdin={"problem": problem, "times": [0, 1]})
    assert answer.returncode == 2
    assert answer.stderr.startswith(f"veselova: problem.{field}: required ")
    assert answer.stderr.count("\n") == 1


@rows
def test_no_sweep_begins(field: str, problem: Any) -> None:
    good = GOOD[problem["system"]]
    kept = next(name for name in good if problem[name] == good[name])
    vary = {f"/{kept}": [good[kept]]}
    with pytest.raises(InvalidInput, match=re.escape(f"{field}: required ")):
        read_request(SweepRequest, {"problem": problem, "vary": vary, "times": [0]})


@pytest.mark.parametrize(("field", "changes", "words"), GEODESICS_REFUSED)
def test_geodesics_are_refused_alike(server: Server, field: str, changes: Any, words: str) -> None:
    body = {**GEODESIC, **changes}
    answer = post(server, "/v1/geodesics", body)
    (fault,) = is_problem(answer, 422, "invalid-input")["errors"]
    assert fault["detail"].startswith(f"{field}: required ")
    assert words in fault["detail"]
    with (
        Client("http://server", transport=httpx2.MockTransport(unsent)) as client,
        pytest.raises(InvalidInput) as raised,
    ):
        client.geodesics(**body)
    assert str(raised.value) == fault["detail"]
    printed = command_line("geodesic", "-", stdin=body).stderr
    assert printed == f"veselova: {fault['detail']}\n"
