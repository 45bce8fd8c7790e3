"""What a stranger may do to a server: one test, at least, for each thing that it must withstand."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

from conftest import PATIENCE, Server, running_server
from hostile import GOOD
from hostile_bodies import hostile_bodies, hostile_sweeps
from test_http import is_problem, post
from veselova.service.json_text import decoded

#: The longest that a body may keep others waiting, in seconds.
LONGEST_WAIT = 0.1


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server of one worker that only these tests use."""
    with running_server(tmp_path_factory.mktemp("small"), workers="1") as running:
        yield running


def longest_wait(server: Server, path: str, body: bytes) -> tuple[float, httpx2.Response]:
    """Return the longest time that /healthz took while a body was answered, and the answer."""
    waits: list[float] = []
    over = threading.Event()

    def watch() -> None:
        with httpx2.Client(timeout=PATIENCE) as client:
            while not over.is_set():
                began = time.perf_counter()
                client.get(f"{server.url}/healthz")
                waits.append(time.perf_counter() - began)
                time.sleep(0.002)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        answer = post(server, path, body)
        time.sleep(0.05)
    finally:
        over.set()
        watcher.join()
    return max(waits), answer


BODIES = [("/v1/trajectories", *row) for row in hostile_bodies()] + [("/v1/sweeps", *row) for row in hostile_sweeps()]


@pytest.mark.parametrize(("path", "body"), [(path, body) for path, _, body in BODIES], ids=[row[1] for row in BODIES])
def test_no_body_keeps_others_waiting(small: Server, path: str, body: bytes) -> None:
    for _ in range(5):  # other processes may take the processors; the loop is held every time or never
        wait, answer = longest_wait(small, path, body)
        assert answer.status_code in (200, 202, 400, 422), answer.text[:300]
        if wait < LONGEST_WAIT:
            break
    assert wait < LONGEST_WAIT
    if answer.status_code == 202:
        small.ask("DELETE", f"/v1/jobs/{answer.json()['id']}", params={"remove": True})


def test_repeated_names_are_found_in_linear_time() -> None:
    def seconds(count: int) -> float:
        text = ("{" + ",".join(f'"{k // 2}":1' for k in range(count)) + "}").encode()
        began = time.process_time()
        with pytest.raises(ValueError, match="each field once"):
            decoded(text)
        return time.process_time() - began

    seconds(1000)
    assert min(seconds(80_000) for _ in range(3)) < 16 * min(seconds(10_000) for _ in range(3))


def test_repeated_names_have_their_pointers(small: Server) -> None:
    text = json.dumps(GOOD)
    inner = text.replace('"A": [3, 2, 1]', '"A": [3, 2, 1], "A": [{"b": 1, "b": 2}], "q": [1, 0, 0]')
    document = is_problem(post(small, "/v1/trajectories", inner), 422, "invalid-input")
    assert [fault["pointer"] for fault in document["errors"]] == ["/problem/A", "/problem/q", "/problem/A/0/b"]


def test_halves_of_surrogate_pairs_are_spelled_out(small: Server) -> None:
    document = is_problem(post(small, "/v1/tori", b'{"\\ud800":1,"\\ud800":2}'), 422, "invalid-input")
    assert document["errors"][0]["pointer"] == "/\\ud800"
    for path in ("/v1/trajectories", "/v1/tori", "/v1/sweeps"):
        for field in ("\ud800", "x\udfff"):
            is_problem(post(small, path, {**GOOD, field: field, "method": field, "engine": field}), 422, "invalid-input")


@pytest.mark.parametrize("numeral", ["1e400", "-1e400", "1.5E+999", "NaN", "Infinity", "-Infinity"])
@pytest.mark.parametrize("field", ["A", "times", "budget_s"])
def test_numbers_beyond_the_range_are_shown_as_they_were_given(small: Server, numeral: str, field: str) -> None:
    changed: dict[str, Any] = {**GOOD, "problem": {**GOOD["problem"]}}
    if field == "budget_s":
        changed[field] = "HERE"
    else:
        (changed["problem"] if field == "A" else changed)[field] = [3, 2, "HERE"]
    body = json.dumps(changed).replace('"HERE"', numeral)
    document = is_problem(post(small, "/v1/trajectories", body), 422, "invalid-input")
    assert any(fault["detail"].endswith(f"given {numeral}.") for fault in document["errors"])
