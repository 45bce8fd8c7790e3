"""The resources of sweeps: POST makes a job, which has a status, events and results and can be
cancelled or removed.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import orjson
from fastapi import APIRouter, Depends, Query, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import BaseModel, Field
from starlette.responses import FileResponse, Response, StreamingResponse

from veselova.service.access.keys import ADMIN
from veselova.service.api.media_types import MEDIA_TYPES, negotiate_type
from veselova.service.api.problem_details import Refused
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.http.job_service import JobService
from veselova.service.http.routes import FILE, refusals

if TYPE_CHECKING:
    from veselova.service.sweeps.job_store import Job

#: The path of one job.
_ONE = "/v1/jobs/{job_id}"

#: Seconds between two polls of the job by its event stream.
_POLL_S = 0.2

#: Formats of a table: media type → how its file ends.
_TABLES = {MEDIA_TYPES[name]: name for name in ("parquet", "csv", "arrow")}

_ARCHIVE = "application/zip"


def _files(*media_types: str) -> dict[int | str, dict[str, Any]]:
    """Return how an answer is described that is a file of one of some media types."""
    return {200: {"content": dict.fromkeys(media_types, FILE)}, **refusals(409)}


def _service_of(request: Request) -> JobService:
    service: JobService = request.app.state.jobs
    return service


_Service = Annotated[JobService, Depends(_service_of)]
_All = Annotated[
    bool, Query(alias="all", description="those of everybody; for keys of scope admin")
]
_Remove = Annotated[bool, Query(description="forget the job and its results, too")]


class JobDocument(BaseModel):
    """A requested sweep and its status."""

    id: str = Field(description="the same request has the same")
    state: Literal["queued", "running", "finished", "failed", "cancelled"]
    detail: str = Field(description="why a job failed, or what a running one waits for; empty else")
    total: int = Field(description="problems")
    done: int = Field(description="of them solved, or found to have no solution")
    rate: float | None = Field(
        description="problems per second since the server took the job; null unless it is running"
    )
    eta_s: float | None = Field(
        description="seconds to the end at this rate; null where it is unknown"
    )
    created_at: str
    finished_at: str | None
    request: dict[str, Any] | None = Field(
        description="the request, its defaults filled in; null in listings and events"
    )
    owner: str | None = Field(
        description="of the key that asked for it; null where no key is shown"
    )
    links: dict[str, str]


class JobList(BaseModel):
    """The last jobs, newest first."""

    jobs: list[JobDocument]


routes = APIRouter(tags=["sweeps"], responses=refusals(404, 406, 501, 507))


@routes.post(
    "/v1/sweeps",
    status_code=202,
    operation_id="create_sweep",
    responses=refusals(400, 413, 415),
)
async def create_sweep(
    asked: SweepRequest, request: Request, response: Response, service: _Service
) -> JobDocument:
    """Make a job, or return the one of the same request."""
    negotiate_type(request.headers, ["application/json"])
    await request.app.state.answers.check(SweepRequest, await request.body())
    job = await service.ask(lambda jobs: jobs.submit(asked, request.user.owner))
    if not job.ended:
        service.sweeps.begin(job.id)
    document = _document(service, job)
    response.headers["Location"] = document.links["self"]
    return document.model_copy(update={"request": None})


@routes.get("/v1/jobs", operation_id="list_jobs")
async def list_jobs(request: Request, service: _Service, everybody: _All = False) -> JobList:
    """List the last jobs of the caller, or of all."""
    caller = request.user
    if everybody and not caller.may(ADMIN):
        raise Refused(
            "insufficient-scope",
            f"The jobs of all: required a key of scope {ADMIN}; given {caller.scope}.",
        )
    owner = None if everybody else caller.owner
    found = await service.ask(lambda jobs: jobs.newest(owner))
    return JobList(jobs=[_document(service, job) for job in found])


@routes.get(_ONE, operation_id="get_job")
async def get_job(job_id: str, request: Request, service: _Service) -> JobDocument:
    """Return the status of a job, with its request."""
    owner = request.user.seen
    return _document(service, await service.ask(lambda jobs: jobs.get(job_id, owner)))


async def _status(job_id: str, request: Request, service: _Service) -> Job:
    """Return the status of a job; raises Refused unless the caller sees such a job."""
    owner = request.user.seen
    return await service.ask(lambda jobs: jobs.status(job_id, owner))


# The check comes before the stream: an event stream that has begun can no longer be refused.
@routes.get(
    f"{_ONE}/events",
    operation_id="watch_job",
    response_class=EventSourceResponse,
    dependencies=[Depends(_status)],
)
async def events(
    job_id: str, request: Request, service: _Service
) -> AsyncIterator[ServerSentEvent]:
    """Stream the status of a job until it or the server ends."""
    told: object = None
    while not request.app.state.ending():
        try:
            document = _document(service, await _status(job_id, request, service))
        except Refused as error:  # a stream that has begun cannot be refused
            if error.code == "no-such-job":
                return
        else:
            now = (document.state, document.detail, document.done)
            if now != told:
                told = now
                data = document.model_dump_json()
                yield ServerSentEvent(raw_data=data, event=document.state)
            if document.finished_at is not None:
                return
        await asyncio.sleep(_POLL_S)


@routes.get(
    f"{_ONE}/result",
    operation_id="get_job_result",
    response_class=Response,
    responses=_files(*_TABLES),
)
async def result(job_id: str, request: Request, service: _Service) -> Response:
    """Return the table of a finished job as Parquet, CSV or an Arrow stream."""
    media_type = negotiate_type(request.headers, list(_TABLES))
    path = service.sweeps.jobs.result_path(job_id)
    absent = "The files of this job are gone; POST its request again."
    _require_file(await _status(job_id, request, service), path, absent)
    form = _TABLES[media_type]
    name = f"{job_id}.{form}"
    headers = {"Vary": "Accept"}
    if form == "parquet":
        return FileResponse(path, headers=headers, media_type=media_type, filename=name)
    from veselova.service.sweeps.result_files import table_stream

    headers["Content-Disposition"] = f'attachment; filename="{name}"'
    return StreamingResponse(table_stream(path, form), headers=headers, media_type=media_type)


@routes.get(
    f"{_ONE}/trajectories",
    operation_id="get_job_trajectories",
    response_class=Response,
    responses=_files(_ARCHIVE),
)
async def trajectories(job_id: str, request: Request, service: _Service) -> Response:
    """Return the Zarr store of a finished job in one file."""
    path = service.sweeps.jobs.packed_path(job_id)
    absent = "The sweep did not ask for its trajectories to be kept, or none could be computed."
    _require_file(await _status(job_id, request, service), path, absent)
    return FileResponse(path, media_type=_ARCHIVE, filename=f"{job_id}.zarr.zip")


@routes.delete(
    _ONE,
    operation_id="cancel_job",
    response_model=JobDocument,
    responses={204: {"description": "The job is forgotten"}},
)
async def end(job_id: str, request: Request, service: _Service, remove: _Remove = False) -> Any:
    """Cancel a job; one that has ended stays as it is, unless it is to be removed."""
    await _status(job_id, request, service)
    await service.ask(lambda _: service.sweeps.cancel(job_id))
    if not remove:
        return _document(service, await _status(job_id, request, service))
    await service.ask(lambda jobs: jobs.remove(job_id))
    return Response(status_code=204)


def _document(service: JobService, job: Job) -> JobDocument:
    """Return the document of a job, with its request where ``job`` has it."""
    sweeps = service.sweeps
    progress = sweeps.progress(job.id)
    here = f"{service.root_path}/v1/jobs/{job.id}"
    rate = progress.rate if progress else None
    done = max(job.done, progress.done if progress else 0)
    links = {"self": here, "events": f"{here}/events"}
    if job.state == "finished":
        links["result"] = f"{here}/result"
        if sweeps.jobs.packed_path(job.id).exists():
            links["trajectories"] = f"{here}/trajectories"
    return JobDocument(
        id=job.id,
        state=job.state,  # type: ignore[arg-type]
        detail=f"waits for {progress.waits_for}" if progress and progress.waits_for else job.detail,
        total=job.total,
        done=done,
        rate=rate,
        eta_s=(job.total - done) / rate if rate else None,
        created_at=job.created_at.isoformat(),
        finished_at=None if job.finished_at is None else job.finished_at.isoformat(),
        request=orjson.loads(job.request) if job.request else None,
        owner=job.owner or None,
        links=links,
    )


def _require_file(job: Job, path: Path, absent: str) -> None:
    """Raise Refused unless a job has finished and its file is there; ``absent``: why it is not."""
    if job.state != "finished":
        detail = f"The job is {job.state}; its result is there when it has finished."
        raise Refused("not-finished", detail, retry_after=2)
    if not path.exists():
        raise Refused("no-such-resource", absent)
