"""The resources of sweeps: POST makes a job, and the job tells how far it is, gives its results, and is cancelled or removed."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated, Any

import anyio
import orjson
from fastapi import APIRouter, Depends, Header, Query, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.responses import FileResponse, Response

from veselova.mechanics.errors import InvalidInput
from veselova.service.admission import admit, read_json, require_acceptable
from veselova.service.job_document import JobDocument, job_document
from veselova.service.job_service import JobService
from veselova.service.problem_details import Refused
from veselova.service.schemas import read_request
from veselova.service.settings import Settings
from veselova.service.sweep_request import SweepRequest

__all__ = ["job_router"]

#: Longest Idempotency-Key.
_LONGEST_KEY = 255

#: Seconds after which an event says again how far a job is, though no chunk was finished.
_REPEAT_S = 2.0

_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/SweepRequest"}}},
    }
}
_JOB: dict[int | str, dict[str, Any]] = {200: {"model": JobDocument, "description": "The job"}}
_ACCEPTED: dict[int | str, dict[str, Any]] = {202: {"model": JobDocument, "description": "The job, at Location"}}

_Key = Annotated[str | None, Header(description="a request that comes again with its key never makes a second job")]


def job_router(settings: Settings, service: JobService) -> APIRouter:
    """Return the routes of one server's jobs."""
    routes = APIRouter(tags=["sweeps"])

    @routes.post("/v1/sweeps", status_code=202, summary="Solve many problems", openapi_extra=_BODY, responses=_ACCEPTED)
    async def sweep(request: Request, idempotency_key: _Key = None) -> Response:
        require_acceptable(request.headers.get("accept"))
        if idempotency_key is not None and not 1 <= len(idempotency_key) <= _LONGEST_KEY:
            raise InvalidInput(("Idempotency-Key",), f"1 to {_LONGEST_KEY} characters", f"{len(idempotency_key)}")
        document = await read_json(request, settings)
        asked = await anyio.to_thread.run_sync(read_request, SweepRequest, document)
        admit(asked, settings)
        job = await service.ask(lambda jobs: jobs.submit(asked, idempotency_key))
        if not job.ended:
            (await service.sweeps()).begin(job.id)
        return _json(await _document(job.id, whole=False), 202, {"Location": f"/v1/jobs/{job.id}"})

    @routes.get("/v1/jobs", summary="List the jobs, newest first")
    async def listed() -> Response:
        found = await service.ask(lambda jobs: jobs.newest())
        return _json({"jobs": [await _document(job_id, whole=False) for job_id in found]})

    @routes.get("/v1/jobs/{job_id}", summary="Tell how far a job is", responses=_JOB)
    async def job(job_id: str) -> Response:
        return _json(await _document(job_id))

    async def known(job_id: str) -> None:
        await service.ask(lambda jobs: jobs.get(job_id))

    # The check comes before the stream: an event stream that has begun can no longer be refused.
    @routes.get(
        "/v1/jobs/{job_id}/events",
        summary="Tell each time that a job moves on",
        response_class=EventSourceResponse,
        dependencies=[Depends(known)],
    )
    async def events(job_id: str) -> AsyncIterator[ServerSentEvent]:
        while True:
            document = await _document(job_id, whole=False)
            yield ServerSentEvent(data=document, event=document["state"])
            if document["finished_at"] is not None:
                return
            await (await service.sweeps()).changed(_REPEAT_S)

    @routes.get("/v1/jobs/{job_id}/result", summary="Give the table of a finished job", response_class=FileResponse)
    async def result(job_id: str) -> Response:
        await _require_finished(job_id)
        path = await service.ask(lambda jobs: jobs.result_path(job_id))
        return FileResponse(path, media_type="application/vnd.apache.parquet", filename=f"{job_id}.parquet")

    @routes.get(
        "/v1/jobs/{job_id}/trajectories", summary="Give the kept trajectories, Zarr in a zip", response_class=FileResponse
    )
    async def trajectories(job_id: str) -> Response:
        await _require_finished(job_id)
        path = await service.ask(lambda jobs: jobs.packed_path(job_id))
        if not path.is_file():
            raise Refused("no-such-resource", "The sweep did not ask for its trajectories to be kept, or none could be computed.")
        return FileResponse(path, media_type="application/zip", filename=f"{job_id}.zarr.zip")

    @routes.delete("/v1/jobs/{job_id}", summary="Cancel a job, or remove it", responses={**_JOB, 204: {"description": "Removed"}})
    async def end(
        job_id: str, remove: Annotated[bool, Query(description="forget the job and its results, too")] = False
    ) -> Response:
        await known(job_id)
        await (await service.sweeps()).cancel(job_id)
        if not remove:
            return _json(await _document(job_id))
        await service.ask(lambda jobs: jobs.remove(job_id))
        return Response(status_code=204)

    async def _document(job_id: str, whole: bool = True) -> dict[str, Any]:
        found = await service.ask(lambda jobs: jobs.get(job_id))
        return job_document(found, (await service.sweeps()).progress(job_id), whole)

    async def _require_finished(job_id: str) -> None:
        found = await service.ask(lambda jobs: jobs.get(job_id))
        if found.state != "finished":
            raise Refused("not-finished", f"The job is {found.state}; its result is there when it has finished.", retry_after=2)

    return routes


def _json(document: dict[str, Any], status: int = 200, headers: dict[str, str] | None = None) -> Response:
    return Response(orjson.dumps(document), status, headers, "application/json")
