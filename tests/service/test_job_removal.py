"""What is answered about a job that is removed at the same time."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
import sqlalchemy as sa
from pyarrow import csv, ipc, parquet
from starlette.requests import Request
from starlette.responses import Response
from test_security_storage import a_waiting_job
from test_sweeps import request as sweep_request

from veselova.service.access.database import jobs as job_table
from veselova.service.access.database import writing
from veselova.service.api.media_types import MEDIA_TYPES
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.sweeps import job_store
from veselova.service.sweeps.job_files import write_whole
from veselova.service.sweeps.job_store import Jobs

TABLE = pa.table({"row": [0, 1], "A_1": [2.5, 3.5]})

#: How the body of each format is read.
READERS: dict[str, Callable[[bytes], pa.Table]] = {
    "parquet": lambda body: parquet.read_table(io.BytesIO(body)),
    "csv": lambda body: csv.read_csv(io.BytesIO(body)),
    "arrow": lambda body: ipc.open_stream(body).read_all(),
}


def finish(jobs: Jobs, job_id: str) -> None:
    """Give a job a table and a file of trajectories, and end it."""
    content = io.BytesIO()
    parquet.write_table(TABLE, content)
    write_whole(jobs.result_path(job_id), content.getvalue())
    write_whole(jobs.packed_path(job_id), b"an archive")
    jobs.advance(job_id, "finished")


def request_of(method: str = "GET", **headers: str) -> Request:
    fields = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return Request({"type": "http", "method": method, "path": "/", "headers": fields})


async def body_of(response: Response, request: Request) -> bytes:
    sent: list[Any] = []

    async def receive() -> Any:
        await asyncio.sleep(3600)

    async def send(message: Any) -> None:
        sent.append(message)

    await response(request.scope, receive, send)
    return b"".join(message.get("body", b"") for message in sent)


@pytest.mark.parametrize("form", READERS)
def test_a_table_is_given_whole_though_its_job_is_removed(tmp_path: Path, form: str) -> None:
    async def ask() -> pa.Table:
        async with a_waiting_job(tmp_path) as (sweeps, job, routes):
            finish(sweeps.jobs, job.id)
            request = request_of(accept=MEDIA_TYPES[form])
            response = await routes.result(job.id, request)
            sweeps.jobs.remove(job.id)
            return READERS[form](await body_of(response, request))

    assert asyncio.run(ask()).equals(TABLE)


def test_trajectories_are_given_whole_though_their_job_is_removed(tmp_path: Path) -> None:
    async def ask() -> bytes:
        async with a_waiting_job(tmp_path) as (sweeps, job, routes):
            finish(sweeps.jobs, job.id)
            response = await routes.trajectories(job.id, request_of())
            sweeps.jobs.remove(job.id)
            return await body_of(response, request_of())

    assert asyncio.run(ask()) == b"an archive"


@pytest.mark.parametrize("name", ["result", "trajectories"])
def test_a_job_that_is_removed_before_its_file_is_opened_is_unknown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    async def ask() -> None:
        async with a_waiting_job(tmp_path) as (sweeps, job, routes):
            jobs = sweeps.jobs
            finish(jobs, job.id)
            paths = "result_path" if name == "result" else "packed_path"
            path = getattr(jobs, paths)(job.id)

            def removing(_: str) -> Path:
                jobs.remove(job.id)
                return Path(path)

            monkeypatch.setattr(jobs, paths, removing)
            with pytest.raises(Refused) as refused:
                await getattr(routes, name)(job.id, request_of())
            assert refused.value.code == "no-such-job"

    asyncio.run(ask())


def test_a_job_is_told_as_it_was_made_though_it_is_removed_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def removing(engine: sa.Engine, lock: str = "") -> Iterator[sa.Connection]:
        with writing(engine, lock) as connection:
            yield connection
        with writing(engine) as connection:
            connection.execute(sa.delete(job_table))

    monkeypatch.setattr(job_store, "writing", removing)
    with closing(Jobs(Settings(data_dir=tmp_path))) as jobs:
        job = jobs.submit(sweep_request())
        assert (job.state, job.total, job.done) == ("queued", 15, 0)
        assert job.sweep == sweep_request()
