"""Sweeps over HTTP, through real server processes: jobs, their results, and what they survive."""

from __future__ import annotations

import io
import json
import os
import signal
import time
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import anyio
import httpx2
import numpy as np
import pyarrow.ipc
import pytest
from pyarrow import parquet
from test_http import is_problem, post
from test_sweeps import BASE

import veselova
from conftest import PATIENCE, Server, running_server, wait_until
from postgresql import new_database

#: Some seconds of work for two processors, in eight chunks.
LONG = {
    "problem": BASE,
    "vary": {"/A/0": [2, 3], "/q_dot": {"normal": [0, 1]}},
    "samples": 100,
    "times": {"start": 0, "stop": 9, "count": 1000},
    "outputs": ["q"],
    "budget_s": 60,
}

BASE_FIELDS = ("problem", "vary")


@pytest.fixture(scope="module")
def jobs_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with running_server(tmp_path_factory.mktemp("jobs"), sweep_workers="2") as running:
        yield running


def job(server: Server, link: str) -> dict[str, Any]:
    response = server.get(link)
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def wait_for(server: Server, link: str, reached: Any) -> dict[str, Any]:
    """Follow the events of a job until it has got somewhere."""
    deadline = time.monotonic() + PATIENCE
    with httpx2.stream("GET", f"{server.url}{link}/events", timeout=PATIENCE) as response:
        assert response.headers["content-type"].startswith("text/event-stream")
        for line in response.iter_lines():
            if line.startswith("data: ") and reached(document := json.loads(line[6:])):
                return dict(document)
            assert time.monotonic() < deadline, f"the job did not get there; last: {line}"
    raise AssertionError("the stream of events ended before the job got there")


def finished(document: dict[str, Any]) -> bool:
    assert document["state"] not in ("failed", "cancelled"), document
    return bool(document["state"] == "finished")


def half_way(document: dict[str, Any]) -> bool:
    assert document["state"] in ("queued", "running"), document
    return bool(0 < document["done"] < document["total"])


def table(server: Server, link: str) -> list[dict[str, Any]]:
    response = server.get(f"{link}/result")
    assert response.status_code == 200, response.text
    rows: list[dict[str, Any]] = parquet.read_table(io.BytesIO(response.content)).to_pylist()
    return rows


@pytest.fixture(scope="module")
def undisturbed(jobs_server: Server) -> bytes:
    """The result of the long sweep where nothing happens to it."""
    link = post(jobs_server, "/v1/sweeps", LONG).headers["location"]
    wait_for(jobs_server, link, finished)
    return jobs_server.get(f"{link}/result").content


def test_a_sweep_is_accepted_followed_and_answered(jobs_server: Server) -> None:
    body = {
        "problem": BASE,
        "vary": {"/A/0": [2, 3, -1]},
        "times": [0, 1],
        "outputs": ["q"],
        "trajectories": True,
    }
    response = post(jobs_server, "/v1/sweeps", body)
    assert response.status_code == 202
    link = response.headers["location"]
    assert response.json()["links"]["self"] == link
    assert wait_for(jobs_server, link, finished)["done"] == 3
    rows = table(jobs_server, link)
    assert [row["outcome"] for row in rows] == ["solved", "solved", "invalid-input"]
    assert rows[0]["q.max_1"] <= 1
    document = job(jobs_server, link)
    assert document["request"]["vary"] == body["vary"]
    assert document["created_at"].endswith("+00:00")
    packed = jobs_server.get(f"{document['links']['trajectories']}")
    assert packed.headers["content-type"] == "application/zip"
    assert link.endswith(jobs_server.get("/v1/jobs").json()["jobs"][0]["id"])
    # The same request is the same job, finished already.
    again = post(jobs_server, "/v1/sweeps", body)
    assert (again.headers["location"], again.json()["state"]) == (link, "finished")


def test_a_table_comes_in_the_format_asked_for(jobs_server: Server) -> None:
    link = post(jobs_server, "/v1/sweeps", {"problem": BASE, "vary": {"/A/0": [2, 3.5]}}).headers[
        "location"
    ]
    wait_for(jobs_server, link, finished)
    expected = table(jobs_server, link)
    url = f"{jobs_server.url}{link}/result"
    csv = httpx2.get(url, headers={"accept": "text/csv"})
    assert csv.headers["content-type"].startswith("text/csv")
    assert csv.text.splitlines()[0].startswith('"row","A_1"')
    assert len(csv.text.splitlines()) == 3
    arrow = httpx2.get(url, headers={"accept": "application/vnd.apache.arrow.stream"})
    assert pyarrow.ipc.open_stream(arrow.content).read_all().to_pylist() == expected
    is_problem(httpx2.get(url, headers={"accept": "image/png"}), 406, "not-acceptable")


def test_the_client_sweeps_as_the_library_does(jobs_server: Server, tmp_path: Path) -> None:
    options: dict[str, Any] = {
        "samples": 2,
        "seed": 3,
        "times": [0, 1],
        "outputs": ["q"],
        "trajectories": True,
    }
    said: list[tuple[int, int]] = []
    expected = veselova.sweep(
        BASE, {"/A/0": [2, 3], "/q_dot": {"normal": [0, 1]}}, folder=tmp_path, **options
    )
    with veselova.Client(jobs_server.url) as client:
        job = client.sweep(BASE, {"/A/0": [2, 3], "/q_dot": {"normal": [0, 1]}}, **options)
        assert job.dataset(progress=lambda done, total: said.append((done, total))).identical(
            expected
        )
        assert said[-1] == (4, 4)
        assert client.job(job.id).status()["state"] == "finished"
        job.download(tmp_path / "table.parquet")
        assert parquet.read_table(tmp_path / "table.parquet").num_rows == 4
        job.remove()
        with pytest.raises(veselova.ProblemResponse, match="There is no job"):
            job.status()
        with pytest.raises(veselova.InvalidRequest, match=r"vary\./B"):
            client.sweep(BASE, {"/B": [1]})


@pytest.mark.daily(3)
def test_the_awaited_client_has_the_same_jobs(jobs_server: Server) -> None:
    async def ask() -> tuple[Any, Any]:
        async with veselova.AsyncClient(jobs_server.url) as client:
            job = await client.sweep(
                LONG["problem"],
                LONG["vary"],
                **{k: v for k, v in LONG.items() if k not in BASE_FIELDS},
                seed=5,
            )
            document = await job.cancel()
            with pytest.raises(veselova.ServiceError, match="is cancelled"):
                await job.wait()
            other = await client.sweep(BASE, {"/A/0": [2, 3]})
            return document, await other.dataset()

    document, dataset = anyio.run(ask)
    assert document["state"] == "cancelled"
    assert dataset.outcome.values.tolist() == ["solved", "solved"]


def test_bad_sweeps_and_unknown_jobs_are_refused(jobs_server: Server) -> None:
    fault = is_problem(
        post(jobs_server, "/v1/sweeps", {"problem": BASE, "vary": {"/B": [1]}}),
        422,
        "invalid-input",
    )
    assert fault["errors"][0]["pointer"] == "/vary/~1B"
    is_problem(
        post(jobs_server, "/v1/sweeps", {"problem": BASE, "vary": {"/A/0": [1]}, "budget_s": 1e6}),
        422,
        "invalid-input",
    )
    for path in ("", "/events", "/result", "/trajectories"):
        is_problem(jobs_server.get(f"/v1/jobs/none{path}"), 404, "no-such-job")
    is_problem(jobs_server.ask("DELETE", "/v1/jobs/none"), 404, "no-such-job")


def test_a_job_is_cancelled_resumed_and_removed(jobs_server: Server, undisturbed: bytes) -> None:
    body = {**LONG, "seed": 1}
    link = post(jobs_server, "/v1/sweeps", body).headers["location"]
    wait_for(jobs_server, link, half_way)
    is_problem(jobs_server.get(f"{link}/result"), 409, "not-finished")
    cancelled = jobs_server.ask("DELETE", link).json()
    assert cancelled["state"] == "cancelled"
    assert 0 < cancelled["done"] < 200
    assert job(jobs_server, link)["done"] == cancelled["done"]  # nothing goes on behind it
    resumed = post(jobs_server, "/v1/sweeps", body)
    assert resumed.headers["location"] == link
    assert resumed.json()["done"] == cancelled["done"]
    assert jobs_server.ask("DELETE", f"{link}?remove=true").status_code == 204
    is_problem(jobs_server.get(link), 404, "no-such-job")


def test_the_death_of_a_worker_changes_nothing(jobs_server: Server, undisturbed: bytes) -> None:
    link = post(jobs_server, "/v1/sweeps", LONG).headers["location"]
    assert jobs_server.ask("DELETE", f"{link}?remove=true").status_code == 204
    assert post(jobs_server, "/v1/sweeps", LONG).headers["location"] == link
    wait_for(jobs_server, link, half_way)
    os.kill(max(jobs_server.workers()), signal.SIGKILL)  # the newest: one of sweeps
    wait_for(jobs_server, link, finished)
    assert jobs_server.get(f"{link}/result").content == undisturbed


@pytest.mark.daily(4)
def test_the_end_of_the_server_loses_no_finished_chunk(tmp_path: Path, undisturbed: bytes) -> None:
    with running_server(tmp_path, awaited="/healthz", sweep_workers="2") as server:
        link = post(server, "/v1/sweeps", LONG).headers["location"]
        done = wait_for(server, link, half_way)["done"]
        server.interrupt()
        assert server.process.wait(PATIENCE) == 0
        assert "Traceback" not in server.log.read_text()
    folder = tmp_path / "data" / "jobs" / link.rsplit("/", 1)[1] / "chunks"
    kept = list(folder.glob("*.parquet"))
    dates = [path.stat().st_mtime_ns for path in kept]
    assert kept
    with running_server(tmp_path, awaited="/healthz", sweep_workers="2") as server:
        assert job(server, link)["done"] >= done
        wait_for(server, link, lambda document: document["done"] > 100 or finished(document))
        # a finished sweep has none
        assert all(x.stat().st_mtime_ns == date for x, date in zip(kept, dates) if x.exists())
        wait_for(server, link, finished)
        assert server.get(f"{link}/result").content == undisturbed


@pytest.mark.slow
def test_a_server_that_is_killed_at_any_moment_finishes_the_sweep_after_its_restart(
    tmp_path: Path, undisturbed: bytes, rng: np.random.Generator
) -> None:
    link = ""
    for moment in (*rng.uniform(0, 5, 30), None):
        with running_server(tmp_path, awaited="/healthz", sweep_workers="2") as server:
            if link:
                wait_for(server, link, finished)
                assert server.get(f"{link}/result").content == undisturbed
                assert server.ask("DELETE", f"{link}?remove=true").status_code == 204
            if moment is None:
                return
            link = post(server, "/v1/sweeps", LONG).headers["location"]
            time.sleep(moment)
            server.process.kill()
            server.process.wait()


@pytest.mark.slow
def test_a_job_goes_on_by_another_server_when_its_own_is_killed(
    tmp_path: Path, undisturbed: bytes, postgresql: str
) -> None:
    (tmp_path / "other").mkdir()
    shared = {"data_dir": str(tmp_path / "data"), "sweep_workers": "1"}
    shared["database_url"] = new_database(postgresql, "jobs")
    with (
        running_server(tmp_path, **shared) as own,
        running_server(tmp_path / "other", **shared) as other,
    ):
        link = post(own, "/v1/sweeps", LONG).headers["location"]
        wait_for(own, link, half_way)
        assert job(other, link)["state"] == "running"
        assert "ERROR" not in other.log.read_text()
        own.process.kill()
        own.process.wait()
        wait_for(other, link, finished)
        assert other.get(f"{link}/result").content == undisturbed


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_streams_and_processes_end_with_their_server(tmp_path: Path, how: signal.Signals) -> None:
    with running_server(tmp_path) as own:
        far = {**LONG, "engine": "numeric", "times": [1e6]}
        link = post(own, "/v1/sweeps", far).headers["location"]
        with httpx2.stream("GET", f"{own.url}{link}/events", timeout=PATIENCE) as events:
            lines = events.iter_lines()
            next(lines)
            wait_until(lambda: len(own.workers()) > 1)
            workers = own.workers()
            own.process.send_signal(how)
            with nullcontext() if how == signal.SIGTERM else pytest.raises(httpx2.TransportError):
                list(lines)
        own.process.wait(PATIENCE)
        assert "Traceback" not in own.log.read_text()
        wait_until(lambda: not any(Path(f"/proc/{worker}/exe").exists() for worker in workers))
