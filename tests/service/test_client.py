"""The Python client, synchronous and asynchronous: typed results, retries, timeouts, errors."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from test_answers import columns
from test_client_faults import JOB, answered

from conftest import Server
from hostile import BUDGET_S, PROBLEM
from problems import named
from veselova import (
    AsyncClient,
    Client,
    ProblemResponse,
    ServiceUnreachable,
    Trajectory,
    compare,
    solve,
    torus,
)
from veselova.service.api.media_types import MEDIA_TYPES

TIMES = np.linspace(-1, 2, 7)


@pytest.fixture(autouse=True)
def fast_retries(monkeypatch: pytest.MonkeyPatch) -> None:
    """Retries without pauses, as many as asked for."""
    for name in ("_FIRST_WAIT_S", "_JITTER_S", "_LONGEST_PAUSE_S"):
        monkeypatch.setattr(f"veselova.service.client.client.{name}", 0.0)


@pytest.mark.parametrize("engine", ["analytic", "numeric"])
def test_a_trajectory_comes_back_as_the_library_gives_it(server: Server, engine: str) -> None:
    with Client(server.url) as client:
        found = client.trajectory(PROBLEM, TIMES, engine, budget_s=BUDGET_S)
    expected = solve(PROBLEM, TIMES, engine)
    assert isinstance(found, Trajectory)
    for name in PROBLEM.outputs:
        assert np.array_equal(found.series(name), expected.series(name))
    assert np.array_equal(found.error, expected.error)
    assert found.provenance.method == expected.provenance.method
    assert found.drift.keys() == expected.drift.keys()


def test_problems_travel_exactly(server: Server) -> None:
    for name in ("matrix-inertia", "random-n4-0", "large-units"):
        problem = named(name).problem()
        for method in ("theta", "angles"):
            with Client(server.url) as client:
                found = client.trajectory(problem, [1.0, 2.0], method=method, budget_s=BUDGET_S)
            assert found.provenance.method == method
            assert np.array_equal(found.frame, solve(problem, [1.0, 2.0], method=method).frame)


def test_comparisons_and_tori_are_typed_too(server: Server) -> None:
    with Client(server.url) as client:
        comparison, found = (
            client.compare(PROBLEM, TIMES, "taylor", budget_s=BUDGET_S),
            client.torus(PROBLEM, budget_s=BUDGET_S),
        )
    assert comparison.agrees
    assert comparison.deviation["frame"] == compare(PROBLEM, TIMES, "taylor").deviation["frame"]
    expected = torus(PROBLEM)
    assert found.as_dict() == expected.as_dict()
    assert isinstance(found.periods, np.ndarray)


def test_the_asynchronous_client_has_the_same_methods(server: Server) -> None:
    async def ask() -> Any:
        async with AsyncClient(server.url) as client:
            motions = [
                client.trajectory(PROBLEM, times, budget_s=BUDGET_S) for times in (TIMES, [5.0])
            ]
            others = (
                client.compare(PROBLEM, TIMES, budget_s=BUDGET_S),
                client.torus(PROBLEM, budget_s=BUDGET_S),
            )
            return await asyncio.gather(*others, *motions)

    comparison, found, trajectory, later = asyncio.run(ask())
    assert np.array_equal(trajectory.frame, solve(PROBLEM, TIMES).frame)
    assert comparison.agrees
    assert found.n == 3
    assert later.times.tolist() == [5.0]


def test_both_clients_offer_the_same_methods_with_the_same_words() -> None:
    public = {name for name in dir(Client) if not name.startswith("_")}
    assert public == {name for name in dir(AsyncClient) if not name.startswith("_")}
    assert public == {
        "ask",
        "close",
        "closed_form",
        "compare",
        "curve",
        "download",
        "geodesics",
        "job",
        "run",
        "sleep",
        "solve_many",
        "sweep",
        "theta",
        "torus",
        "trajectory",
    }
    for name in public:
        assert getattr(Client, name).__doc__ == getattr(AsyncClient, name).__doc__


def test_a_problem_document_becomes_an_exception_that_carries_it(server: Server) -> None:
    with Client(server.url) as client:
        with pytest.raises(ProblemResponse) as raised:
            client.trajectory(PROBLEM, [0, 1], budget_s=1e6)
        assert raised.value.status == 422
        assert raised.value.document["errors"][0]["pointer"] == "/budget_s"
        assert "budget_s" in str(raised.value)
        with pytest.raises(ProblemResponse) as raised:
            client.trajectory(PROBLEM, [0, 1e7], "numeric", budget_s=0.3)
        assert raised.value.status == 504


class Script:
    """A transport that answers from a list of statuses or exceptions, and counts."""

    def __init__(self, *steps: Any, retry_after: str | None = None) -> None:
        self.steps, self.calls, self.retry_after = list(steps), 0, retry_after
        self.timeouts: list[Any] = []

    def __call__(self, request: httpx2.Request) -> httpx2.Response:
        self.calls += 1
        self.timeouts.append(request.extensions["timeout"])
        step = self.steps.pop(0)
        if isinstance(step, type):
            raise step("scripted", request=request)
        if step == 200:
            return httpx2.Response(200, json=torus(PROBLEM).as_dict())
        headers = {"retry-after": self.retry_after} if self.retry_after else {}
        return httpx2.Response(step, json={"detail": "scripted", "status": step}, headers=headers)


def ask(script: Script, asynchronous: bool, attempts: int = 4) -> Any:
    return answered(lambda client: client.torus(PROBLEM), script, asynchronous, attempts)


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize(
    "failure",
    [
        429,
        503,
        httpx2.ConnectError,
        httpx2.ReadError,
        httpx2.RemoteProtocolError,
        httpx2.ConnectTimeout,
    ],
)
def test_what_may_pass_is_tried_again(failure: Any, asynchronous: bool) -> None:
    script = Script(failure, failure, 200)
    assert ask(script, asynchronous).n == 3
    assert script.calls == 3


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize("status", [400, 404, 413, 422, 500, 501, 504])
def test_what_will_not_pass_is_not_tried_again(status: int, asynchronous: bool) -> None:
    script = Script(status, 200)
    with pytest.raises(ProblemResponse) as raised:
        ask(script, asynchronous)
    assert raised.value.status == status
    assert script.calls == 1


@pytest.mark.parametrize("asynchronous", [False, True])
def test_attempts_end(asynchronous: bool) -> None:
    script = Script(*[503] * 9)
    with pytest.raises(ProblemResponse) as raised:
        ask(script, asynchronous, attempts=3)
    assert raised.value.status == 503
    assert script.calls == 3
    script = Script(*[httpx2.ConnectError] * 9)
    with pytest.raises(ServiceUnreachable, match="http://server"):
        ask(script, asynchronous, attempts=2)
    assert script.calls == 2


@pytest.mark.parametrize("failure", [httpx2.ReadTimeout, httpx2.UnsupportedProtocol])
def test_a_late_answer_or_a_wrong_address_is_not_asked_for_again(failure: Any) -> None:
    script = Script(failure, 200)
    with pytest.raises(ServiceUnreachable):
        ask(script, False)
    assert script.calls == 1


@pytest.mark.parametrize("asynchronous", [False, True])
def test_the_pause_that_a_server_asks_for_is_kept(
    asynchronous: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("veselova.service.client.client._LONGEST_PAUSE_S", 30.0)
    pauses: list[float] = []

    async def keep(pause: float) -> None:
        pauses.append(pause)

    monkeypatch.setattr("veselova.service.client.client.time.sleep", pauses.append)
    monkeypatch.setattr("veselova.service.client.client.anyio.sleep", keep)
    for header in ("3", "999", "Wed, 21 Oct 2026 07:28:00 GMT"):
        assert ask(Script(503, 200, retry_after=header), asynchronous).n == 3
    assert pauses == [3.0, 30.0, 0.0]


@pytest.mark.parametrize("body", [b"<html>busy</html>", b"[]", b"\xff"])
def test_an_answer_that_is_no_problem_document_is_reported_all_the_same(body: bytes) -> None:
    transport = httpx2.MockTransport(lambda request: httpx2.Response(502, content=body))
    with (
        Client("http://proxy", transport=transport) as client,
        pytest.raises(ProblemResponse) as raised,
    ):
        client.torus(PROBLEM)
    assert raised.value.status == 502
    assert raised.value.document["status"] == 502


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize("kind", ["json", "csv", "npz", "arrow", "parquet"])
def test_downloads_are_the_files_of_the_library(
    server: Server, kind: str, asynchronous: bool, tmp_path: Path
) -> None:
    path, options = tmp_path / f"motion.{kind}", {"outputs": ["q", "tau1"], "engine": "numeric"}
    if asynchronous:

        async def fetch() -> Any:
            async with AsyncClient(server.url) as client:
                return await client.download(
                    PROBLEM, TIMES, path, kind, budget_s=BUDGET_S, **options
                )

        provenance = asyncio.run(fetch())
    else:
        with Client(server.url) as client:
            provenance = client.download(
                PROBLEM, TIMES, str(path), kind, budget_s=BUDGET_S, **options
            )
    expected = solve(PROBLEM, TIMES, "numeric")
    assert provenance.details == expected.provenance.details
    assert np.array_equal(columns(kind, path.read_bytes())["tau1"], expected.tau1)
    assert "omega" not in path.read_bytes().decode("latin-1")
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def broken(*chunks: bytes) -> Any:
    """Return a transport whose first answer breaks off after the chunks, and whose
    second is whole.
    """
    provenance = json.dumps(solve(PROBLEM, TIMES).provenance.as_dict())
    header = {"veselova-provenance": provenance, "content-type": MEDIA_TYPES["npz"]}
    answers = iter([True, False])

    def body(breaks: bool) -> Any:
        yield from chunks
        if breaks:
            raise httpx2.ReadError("cut off")

    return httpx2.MockTransport(
        lambda _: httpx2.Response(200, headers=header, content=body(next(answers)))
    )


def test_a_download_that_breaks_off_begins_again_or_leaves_no_file(tmp_path: Path) -> None:
    with Client("http://server", transport=broken(b"one", b"two")) as client:
        client.download(PROBLEM, TIMES, tmp_path / "whole.npz")
    assert (tmp_path / "whole.npz").read_bytes() == b"onetwo"
    with (
        Client("http://server", attempts=1, transport=broken(b"one")) as client,
        pytest.raises(ServiceUnreachable),
    ):
        client.download(PROBLEM, TIMES, tmp_path / "part.npz")
    assert [entry.name for entry in tmp_path.iterdir()] == ["whole.npz"]


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize("status", [206, 200])
def test_a_download_of_a_job_that_breaks_off_goes_on(
    status: int, asynchronous: bool, tmp_path: Path
) -> None:
    """A server that sends the rest alone, and one that sends all of it again."""
    asked: list[str] = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        if not request.url.path.endswith("/result"):
            return httpx2.Response(200, json=JOB)
        asked.append(request.headers.get("range", ""))
        first = len(asked) == 1

        def body() -> Any:
            yield b"one" if first or status == 200 else b"two"
            if first:
                raise httpx2.ReadError("cut off")
            if status == 200:
                yield b"two"

        header = {"content-type": MEDIA_TYPES["parquet"]}
        content = as_asynchronous(body()) if asynchronous else body()
        return httpx2.Response(status, headers=header, content=content)

    path = tmp_path / "table.parquet"
    answered(lambda client: client.job("some").download(path), answer, asynchronous, 4)
    assert asked == ["", "bytes=3-"]
    assert path.read_bytes() == b"onetwo"
    assert [*tmp_path.iterdir()] == [path]


async def as_asynchronous(chunks: Iterator[bytes]) -> AsyncIterator[bytes]:
    for chunk in chunks:
        yield chunk
