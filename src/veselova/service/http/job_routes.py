"""The resources of sweeps: POST makes a job, and the job tells how far it is, gives its results,
and is cancelled or removed.
"""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import orjson
from fastapi import APIRouter, Depends, Header, Query, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.responses import FileResponse, Response, StreamingResponse

from veselova.service.answers.request_reading import Reader
from veselova.service.api.caller import ADMIN, caller_of
from veselova.service.api.content_negotiation import joined_field, negotiate_type
from veselova.service.api.problem_details import Refused
from veselova.service.client.download import MEDIA_TYPES
from veselova.service.http.job_document import JobDocument, JobList, job_document
from veselova.service.http.job_service import JobService
from veselova.service.http.json_schemas import PREFIX
from veselova.service.http.readable import add_readable

if TYPE_CHECKING:
    from veselova.service.sweeps.job_store import Jobs, JobStatus

__all__ = ["job_router"]

#: The path of one job.
_ONE = "/v1/jobs/{job_id}"

#: Seconds after which an event says again how far a job is, though no chunk was finished.
_REPEAT_S = 2.0

_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": f"{PREFIX}SweepRequest"}}},
    }
}

#: Formats of a table: media type → how its file ends.
_TABLES = {MEDIA_TYPES[name]: name for name in ("parquet", "csv", "arrow")}

_BINARY = {"schema": {"type": "string", "format": "binary"}}

_Key = Annotated[
    str | None,
    Header(
        min_length=1,
        max_length=255,
        description="a request that comes again with its key never makes a second job",
    ),
]
_All = Annotated[
    bool, Query(alias="all", description="those of everybody; for keys of scope admin")
]
_Remove = Annotated[bool, Query(description="forget the job and its results, too")]


def _describe(operation: str, summary: str, status: int = 200, **content: Any) -> dict[str, Any]:
    """Return how a route is described, and the content of its answer."""
    return {
        "operation_id": operation,
        "summary": summary,
        "responses": {status: {"description": summary, **content}},
    }


def job_router(reader: Reader, service: JobService) -> APIRouter:
    """Return the routes of one server's jobs."""
    routes = APIRouter(tags=["sweeps"])
    jobs = _JobRoutes(reader, service)
    routes.add_api_route(
        "/v1/sweeps",
        jobs.sweep,
        methods=["POST"],
        status_code=202,
        openapi_extra=_BODY,
        **_describe("create_sweep", "Solve many problems", 202, model=JobDocument),
    )
    listed = _describe("list_jobs", "List the jobs, newest first", model=JobList)
    add_readable(routes, "/v1/jobs", jobs.list_jobs, **listed)
    one = _describe("get_job", "Tell how far a job is", model=JobDocument)
    add_readable(routes, _ONE, jobs.job, **one)
    tables = dict.fromkeys(_TABLES, _BINARY)
    table = _describe("get_job_result", "Give the table of a finished job", content=tables)
    add_readable(routes, f"{_ONE}/result", jobs.result, **table)
    archive = _describe(
        "get_job_trajectories",
        "Give the trajectories that a job kept",
        content={"application/zip": _BINARY},
    )
    add_readable(routes, f"{_ONE}/trajectories", jobs.trajectories, **archive)
    ended = _describe("cancel_job", "Cancel a job, or remove it", model=JobDocument)
    ended["responses"][204] = {"description": "The job is forgotten"}
    routes.add_api_route(_ONE, jobs.end, methods=["DELETE"], **ended)
    # The check comes before the stream: an event stream that has begun can no longer be refused.
    routes.add_api_route(
        f"{_ONE}/events",
        jobs.events,
        operation_id="watch_job",
        summary="Tell each time that a job moves on",
        response_class=EventSourceResponse,
        dependencies=[Depends(jobs.require)],
    )
    return routes


class _JobRoutes:
    """The endpoints, over one server's reader and jobs."""

    def __init__(self, reader: Reader, service: JobService) -> None:
        self._reader = reader
        self._service = service

    async def sweep(self, request: Request, idempotency_key: _Key = None) -> Response:
        """Make a job, or find the one that the same request made."""
        negotiate_type(joined_field(request.headers, "accept"), ["application/json"])
        plan = await self._reader.parse_sweep(request)
        owner = caller_of(request).owner
        job = await self._service.ask(lambda jobs: jobs.submit(plan, idempotency_key, owner))
        sweeps = await self._service.sweeps()
        if not job.ended:
            sweeps.begin(job.id)
        document = {**await self._document(job), "request": None}
        return _json(document, 202, {"Location": document["links"]["self"]})

    async def list_jobs(self, request: Request, everybody: _All = False) -> Response:
        """List the last jobs of the caller, or of all."""
        caller = caller_of(request)
        if everybody and not caller.may(ADMIN):
            raise Refused(
                "insufficient-scope",
                f"The jobs of all: required a key of scope {ADMIN}; given {caller.scope}.",
            )
        owner = None if everybody else caller.owner
        found = await self._service.ask(lambda jobs: jobs.newest(owner))
        return _json({"jobs": [await self._document(job) for job in found]})

    async def job(self, job_id: str, request: Request) -> Response:
        """Tell all of a job, its request included."""
        owner = caller_of(request).seen
        job = await self._service.ask(lambda jobs: jobs.get(job_id, owner))
        return _json(await self._document(job))

    async def require(self, job_id: str, request: Request) -> None:
        """Raise Refused unless the caller sees such a job."""
        await self._status(job_id, request)

    async def events(self, job_id: str, request: Request) -> AsyncIterator[ServerSentEvent]:
        """Tell how far a job is until it has ended, or the server is to. What moves other jobs on,
        which may be those of another key, is no event of this one.
        """
        told: object = None
        due = 0.0
        while not request.scope.get("state", {}).get("ending"):
            try:
                document = await self._document(await self._status(job_id, request))
            except Refused as error:  # a stream that has begun cannot be refused
                if error.code == "no-such-job":
                    return
            else:
                now = [document[name] for name in ("state", "detail", "done")]
                if now != told or time.monotonic() >= due:
                    told = now
                    due = time.monotonic() + _REPEAT_S
                    data = orjson.dumps(document).decode()
                    yield ServerSentEvent(raw_data=data, event=document["state"])
                if document["finished_at"] is not None:
                    return
            await (await self._service.sweeps()).wait_changed(_REPEAT_S)

    async def result(self, job_id: str, request: Request) -> Response:
        """Give the table of a finished job as Parquet, CSV or an Arrow stream."""
        media_type = negotiate_type(joined_field(request.headers, "accept"), list(_TABLES))
        path = await self._file(
            job_id,
            request,
            lambda jobs: jobs.result_path(job_id),
            "The files of this job are gone; POST its request again.",
        )
        form = _TABLES[media_type]
        name = f"{job_id}.{form}"
        vary = {"Vary": "Accept"}
        if form == "parquet":
            return FileResponse(path, headers=vary, media_type=media_type, filename=name)
        from veselova.service.sweeps.result_files import table_stream

        headers = {**vary, "Content-Disposition": f'attachment; filename="{name}"'}
        return StreamingResponse(table_stream(path, form), headers=headers, media_type=media_type)

    async def trajectories(self, job_id: str, request: Request) -> Response:
        """Give the Zarr store of a finished job in one file."""
        path = await self._file(
            job_id,
            request,
            lambda jobs: jobs.packed_path(job_id),
            "The sweep did not ask for its trajectories to be kept, or none could be computed.",
        )
        return FileResponse(path, media_type="application/zip", filename=f"{job_id}.zarr.zip")

    async def end(self, job_id: str, request: Request, remove: _Remove = False) -> Response:
        """Cancel a job; one that has ended stays as it is, unless it is to be removed."""
        await self.require(job_id, request)
        await self._service.cancel(job_id)
        if not remove:
            return _json(await self._document(await self._status(job_id, request)))
        await self._service.ask(lambda jobs: jobs.remove(job_id))
        return Response(status_code=204)

    async def _status(self, job_id: str, request: Request) -> JobStatus:
        owner = caller_of(request).seen
        return await self._service.ask(lambda jobs: jobs.status(job_id, owner))

    async def _document(self, job: JobStatus) -> dict[str, Any]:
        sweeps = await self._service.sweeps()
        kept = sweeps.jobs.packed_path(job.id).exists()
        return job_document(job, sweeps.progress(job.id), kept, self._service.root_path)

    async def _file(
        self, job_id: str, request: Request, path: Callable[[Jobs], Path], absent: str
    ) -> Path:
        """Return a file of a finished job; raises Refused where there is none, with ``absent`` as
        the reason if the job is there.
        """
        job = await self._status(job_id, request)
        if job.state != "finished":
            detail = f"The job is {job.state}; its result is there when it has finished."
            raise Refused("not-finished", detail, retry_after=2)
        found = path((await self._service.sweeps()).jobs)
        if not found.exists():
            raise Refused("no-such-resource", absent)
        return found


def _json(
    document: dict[str, Any], status: int = 200, headers: dict[str, str] | None = None
) -> Response:
    return Response(orjson.dumps(document), status, headers, "application/json")
