"""The resources of sweeps: POST makes a job, and the job tells how far it is, gives its results,
and is cancelled or removed.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, BinaryIO
from weakref import WeakValueDictionary

import orjson
from fastapi import APIRouter, Depends, Header, Query, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.responses import Response

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.answers.request_reading import Reader
from veselova.service.api.caller import ADMIN, caller_of
from veselova.service.api.content_negotiation import joined_field, negotiate_type
from veselova.service.api.media_types import MEDIA_TYPES
from veselova.service.api.problem_details import Refused
from veselova.service.http.job_document import JobDocument, JobList, job_document
from veselova.service.http.job_file import file_response
from veselova.service.http.job_service import JobService
from veselova.service.http.json_schemas import PREFIX
from veselova.service.http.readable import add_readable
from veselova.service.http.shared_look import SharedLook

if TYPE_CHECKING:
    from veselova.service.sweeps.job_store import Jobs, JobStatus

__all__ = ["job_router"]

#: Longest Idempotency-Key.
_LONGEST_KEY = 255

#: The path of one job.
_ONE = "/v1/jobs/{job_id}"

#: Seconds after which an event says again how far a job is, though no chunk was finished.
_REPEAT_S = 2.0

#: Seconds between two looks at a job for all who follow its events.
_LOOK_S = 0.2

_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": f"{PREFIX}SweepRequest"}}},
    }
}
_JOB: dict[int | str, dict[str, Any]] = {200: {"model": JobDocument, "description": "The job"}}
_LIST: dict[int | str, dict[str, Any]] = {200: {"model": JobList, "description": "The jobs"}}
_ACCEPTED: dict[int | str, dict[str, Any]] = {
    202: {"model": JobDocument, "description": "The job, at Location"}
}
_REMOVED: dict[int | str, dict[str, Any]] = {204: {"description": "The job is forgotten"}}

#: Formats of a table: media type → how its file ends.
_TABLES = {MEDIA_TYPES[name]: name for name in ("parquet", "csv", "arrow")}
_TABLE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The table",
        "content": {name: {"schema": {"type": "string", "format": "binary"}} for name in _TABLES},
    }
}
_ARCHIVE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "A Zarr store in one file",
        "content": {"application/zip": {"schema": {"type": "string", "format": "binary"}}},
    }
}

_Key = Annotated[
    str | None,
    Header(description="a request that comes again with its key never makes a second job"),
]
_All = Annotated[
    bool, Query(alias="all", description="those of everybody; for keys of scope admin")
]
_Remove = Annotated[bool, Query(description="forget the job and its results, too")]


def job_router(reader: Reader, service: JobService) -> APIRouter:
    """Return the routes of one server's jobs."""
    routes = APIRouter(tags=["sweeps"])
    jobs = _JobRoutes(reader, service)
    accepted: dict[str, Any] = {"status_code": 202, "openapi_extra": _BODY}
    table: tuple[tuple[str, str, Any, str, str, dict[str, Any], dict[int | str, Any]], ...] = (
        (
            "POST",
            "/v1/sweeps",
            jobs.sweep,
            "create_sweep",
            "Solve many problems",
            accepted,
            _ACCEPTED,
        ),
        ("GET", "/v1/jobs", jobs.list_jobs, "list_jobs", "List the jobs, newest first", {}, _LIST),
        ("GET", _ONE, jobs.job, "get_job", "Tell how far a job is", {}, _JOB),
        (
            "GET",
            f"{_ONE}/result",
            jobs.result,
            "get_job_result",
            "Give the table of a finished job",
            {},
            _TABLE,
        ),
        (
            "GET",
            f"{_ONE}/trajectories",
            jobs.trajectories,
            "get_job_trajectories",
            "Give the trajectories that a job kept",
            {},
            _ARCHIVE,
        ),
        (
            "DELETE",
            _ONE,
            jobs.end,
            "cancel_job",
            "Cancel a job, or remove it",
            {},
            {**_JOB, **_REMOVED},
        ),
    )
    for method, path, endpoint, operation, summary, options, responses in table:
        described: dict[str, Any] = {
            "operation_id": operation,
            "summary": summary,
            "responses": responses,
            **options,
        }
        if method == "GET":
            add_readable(routes, path, endpoint, **described)
        else:
            routes.add_api_route(path, endpoint, methods=[method], **described)
    _add_events(routes, jobs)
    return routes


def _add_events(routes: APIRouter, jobs: _JobRoutes) -> None:
    # The check comes before the stream: an event stream that has begun can no longer be refused.
    routes.add_api_route(
        f"{_ONE}/events",
        jobs.events,
        operation_id="watch_job",
        summary="Tell each time that a job moves on",
        response_class=EventSourceResponse,
        dependencies=[Depends(jobs.require)],
    )


class _JobRoutes:
    """The endpoints, over one server's reader and jobs."""

    def __init__(self, reader: Reader, service: JobService) -> None:
        self._reader = reader
        self._service = service
        #: What those who follow the events of a job look at together, for as long as anyone does.
        self._followed = WeakValueDictionary[str, SharedLook[tuple[dict[str, Any], str]]]()

    async def sweep(self, request: Request, idempotency_key: _Key = None) -> Response:
        """Make a job, or find the one that the same request made."""
        negotiate_type(joined_field(request.headers, "accept"), ["application/json"])
        if idempotency_key is not None and not 1 <= len(idempotency_key) <= _LONGEST_KEY:
            raise InvalidInput(
                ("Idempotency-Key",), f"1 to {_LONGEST_KEY} characters", f"{len(idempotency_key)}"
            )
        plan = await self._reader.parse_sweep(request)
        owner = caller_of(request).owner

        def submit(jobs: Jobs) -> tuple[JobStatus, bool]:
            job = jobs.submit(plan, idempotency_key, owner)
            return job, jobs.packed_path(job.id).exists()

        # Told as it was made: it may be removed before it is looked at again.
        job, kept = await self._service.ask(submit)
        sweeps = await self._service.sweeps()
        if not job.ended:
            sweeps.begin(job.id)
        document = job_document(job, sweeps.progress(job.id), kept, self._service.root_path)
        return _json({**document, "request": None}, 202, {"Location": document["links"]["self"]})

    async def list_jobs(self, request: Request, everybody: _All = False) -> Response:
        """List the last jobs of the caller, or of all."""
        caller = caller_of(request)
        if everybody and not caller.may(ADMIN):
            raise Refused(
                "insufficient-scope",
                f"The jobs of all: required a key of scope {ADMIN}; given {caller.scope}.",
            )
        owner = None if everybody else caller.owner
        found = await self._service.ask(
            lambda jobs: [(job, jobs.packed_path(job.id).exists()) for job in jobs.newest(owner)]
        )
        sweeps = await self._service.sweeps()
        return _json(
            {
                "jobs": [
                    job_document(job, sweeps.progress(job.id), kept, self._service.root_path)
                    for job, kept in found
                ]
            }
        )

    async def job(self, job_id: str, request: Request) -> Response:
        """Tell all of a job, its request included."""
        return _json(await self._document(job_id, request))

    async def require(self, job_id: str, request: Request) -> None:
        """Raise Refused unless the caller has such a job: that of another is as good as absent."""
        await self._status(job_id, request)

    async def events(self, job_id: str, request: Request) -> AsyncIterator[ServerSentEvent]:
        """Tell how far a job is until it has ended, or the server is to. What moves other jobs on,
        which may be those of another key, is no event of this one.
        """
        look = self._follow(job_id)
        told: object = None
        due = 0.0
        while not request.scope.get("state", {}).get("ending"):
            try:
                document, text = await look()
            except Refused as error:  # a stream that has begun cannot be refused
                if error.code == "no-such-job":
                    return
                await asyncio.sleep(_REPEAT_S)
                continue
            now = time.monotonic()
            reached = [document[name] for name in ("state", "detail", "done")]
            if reached != told or now >= due:
                told = reached
                due = now + _REPEAT_S
                yield ServerSentEvent(raw_data=text, event=document["state"])
            if document["finished_at"] is not None:
                return
            await (await self._service.sweeps()).wait_changed(due - now)

    def _follow(self, job_id: str) -> SharedLook[tuple[dict[str, Any], str]]:
        """Return the look at a job, which its followers share: a job has one owner for ever."""
        look = self._followed.get(job_id)
        if look is None:

            async def document() -> tuple[dict[str, Any], str]:
                found = await self._found(job_id, None, whole=False)
                return found, orjson.dumps(found).decode()

            look = self._followed[job_id] = SharedLook(document, _LOOK_S)
        return look

    async def result(self, job_id: str, request: Request) -> Response:
        """Give the table of a finished job as Parquet, CSV or an Arrow stream."""
        media_type = negotiate_type(joined_field(request.headers, "accept"), list(_TABLES))
        file = await self._open(
            job_id,
            request,
            lambda jobs: jobs.result_path(job_id),
            "The files of this job are gone; POST its request again.",
        )
        from veselova.service.sweeps.result_files import table_stream

        form = _TABLES[media_type]
        content = None if form == "parquet" else table_stream(file, form)
        return file_response(request, file, media_type, f"{job_id}.{form}", content, "Accept")

    async def trajectories(self, job_id: str, request: Request) -> Response:
        """Give the Zarr store of a finished job in one file."""
        file = await self._open(
            job_id,
            request,
            lambda jobs: jobs.packed_path(job_id),
            "The sweep did not ask for its trajectories to be kept, or none could be computed.",
        )
        return file_response(request, file, "application/zip", f"{job_id}.zarr.zip")

    async def end(self, job_id: str, request: Request, remove: _Remove = False) -> Response:
        """Cancel a job; one that has ended stays as it is, unless it is to be removed."""
        await self.require(job_id, request)
        await self._service.cancel(job_id)
        if not remove:
            return _json(await self._document(job_id, request, whole=False))
        await self._service.ask(lambda jobs: jobs.remove(job_id))
        return Response(status_code=204)

    async def _status(self, job_id: str, request: Request) -> JobStatus:
        owner = caller_of(request).seen
        return await self._service.ask(lambda jobs: jobs.status(job_id, owner))

    async def _document(self, job_id: str, request: Request, whole: bool = True) -> dict[str, Any]:
        return await self._found(job_id, caller_of(request).seen, whole)

    async def _found(self, job_id: str, owner: str | None, whole: bool) -> dict[str, Any]:
        def parse(jobs: Jobs) -> tuple[JobStatus, bool]:
            return (jobs.get if whole else jobs.status)(job_id, owner), jobs.packed_path(
                job_id
            ).exists()

        job, kept = await self._service.ask(parse)
        progress = (await self._service.sweeps()).progress(job_id)
        return job_document(job, progress, kept, self._service.root_path)

    async def _open(
        self, job_id: str, request: Request, path: Callable[[Jobs], Path], absent: str
    ) -> BinaryIO:
        """Return an open file of a finished job; raises Refused where there is none, with
        ``absent`` as the reason if the job is there.
        """
        owner = caller_of(request).seen

        def open_file(jobs: Jobs) -> BinaryIO:
            _require_finished(jobs.status(job_id, owner))
            try:
                return path(jobs).open("rb")
            except FileNotFoundError:
                # removed, or asked for again, since it was looked at
                _require_finished(jobs.status(job_id, owner))
                raise Refused("no-such-resource", absent) from None

        return await self._service.ask(open_file)


def _require_finished(job: JobStatus) -> None:
    if job.state != "finished":
        raise Refused(
            "not-finished",
            f"The job is {job.state}; its result is there when it has finished.",
            retry_after=2,
        )


def _json(
    document: dict[str, Any], status: int = 200, headers: dict[str, str] | None = None
) -> Response:
    return Response(orjson.dumps(document), status, headers, "application/json")
