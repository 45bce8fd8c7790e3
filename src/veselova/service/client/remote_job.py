"""A sweep on a server, for both clients: coroutines that a client carries out."""

from __future__ import annotations

import io
import re
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from veselova.mechanics.core.errors import InvalidInput, ServiceError, show
from veselova.mechanics.results.table import Target
from veselova.service.api.media_types import MEDIA_TYPES
from veselova.service.api.request_models import read_request
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.client.requests import Call, encode_body, reading, target_of

__all__ = ["RemoteJob", "sweep_call"]

Report = Callable[[int, int], object]

#: Seconds that a finished table may be prepared, or a job be ended, before the first byte.
_PREPARATION_S = 60.0

#: Seconds between two polls of a job, from the first to the longest.
_FIRST_POLL_S = 0.1
_LONGEST_POLL_S = 2.0

#: What is read of the document of a job.
_FIELDS = {"id", "state", "detail", "done", "total", "finished_at", "links"}


class RemoteJob:
    """A sweep on a server. Every method of an AsyncClient's job is to be awaited; those of a
    Client's job return at once.

    ``id``: the same request has the same, so that ``client.job(id)`` finds it again.
    """

    def __init__(self, client: Any, job_id: str) -> None:
        if not isinstance(job_id, str) or not re.fullmatch(r"[\w-]{1,200}", job_id, re.ASCII):
            raise InvalidInput(("job_id",), "the id of a job", show(job_id))
        self._client = client
        self.id = job_id
        self._link = f"/v1/jobs/{job_id}"

    def __repr__(self) -> str:
        return f"<RemoteJob {self.id}>"

    def status(self) -> Any:
        """Return the document of the job: state, done, total, rate, eta_s, detail …"""
        return self._client.run(self._status())

    def wait(self, progress: Report | None = None) -> Any:
        """Return the document of the job when it has finished; ``progress(done, total)`` is told on
        the way.

        Raises ServiceError where it has failed or was cancelled.
        """
        return self._client.run(self._finish(progress))

    def cancel(self) -> Any:
        """Stop the job, keeping what is done, and return its document; the same sweep asked for
        again goes on from there.
        """
        call = Call(self._link, _job_document, budget_s=_PREPARATION_S, method="DELETE")
        return self._client.run(self._client.ask(call))

    def remove(self) -> Any:
        """Stop the job and forget it, with its results."""
        link = f"{self._link}?remove=true"
        call = Call(link, _nothing, None, _PREPARATION_S, "", method="DELETE")
        return self._client.run(self._client.ask(call))

    def download(self, target: Target) -> Any:
        """Write the table, as Parquet, to a path or a binary stream when the job has finished."""
        return self._client.run(self._download(target_of(target)))

    def dataset(self, progress: Report | None = None) -> Any:
        """Return the results as an xarray Dataset (see ``veselova.sweep``) when the job has
        finished.
        """
        return self._client.run(self._dataset(progress))

    async def _status(self) -> dict[str, Any]:
        call = Call(self._link, _job_document, method="GET")
        document: dict[str, Any] = await self._client.ask(call)
        return document

    async def _finish(self, progress: Report | None = None) -> dict[str, Any]:
        pause = _FIRST_POLL_S
        while True:
            document = await self._status()
            if progress is not None:
                progress(document["done"], document["total"])
            if document["state"] == "finished":
                return document
            if document["finished_at"] is not None:
                detail = document["detail"] or "no detail given"
                raise ServiceError(f"job {self.id} is {document['state']}: {detail}")
            await self._client.sleep(pause)
            pause = min(2 * pause, _LONGEST_POLL_S)

    async def _fetch(self, part: str, media_type: str, target: Any) -> None:
        link = f"{self._link}/{part}"
        call = Call(link, _nothing, None, _PREPARATION_S, media_type, target, "GET")
        await self._client.ask(call)

    async def _download(self, target: Any) -> None:
        await self._finish()
        await self._fetch("result", MEDIA_TYPES["parquet"], target)

    async def _dataset(self, progress: Report | None) -> Any:
        from veselova.service.api.sweep_dataset import sweep_dataset

        document = await self._finish(progress)
        with reading(self._link):
            sweep = read_request(SweepRequest, document["request"])
        table = io.BytesIO()
        await self._fetch("result", MEDIA_TYPES["parquet"], table)
        with tempfile.TemporaryDirectory() as folder:
            packed = None
            if "trajectories" in document["links"]:
                packed = Path(folder) / "trajectories.zarr.zip"
                await self._fetch("trajectories", "application/zip", packed)
            with reading(f"{self._link}/result"):
                return sweep_dataset(sweep, table.getvalue(), packed)


def _job_document(document: Any) -> dict[str, Any]:
    """Return the document of a job; raises LookupError or AttributeError for anything else."""
    if missing := _FIELDS - document.keys():
        raise LookupError(f"no {missing.pop()}")
    return dict(document)


def _nothing(_: object) -> None:
    """Make nothing of an answer."""


def sweep_call(asked: Mapping[str, Any], job_of: Callable[[str], RemoteJob]) -> Call[RemoteJob]:
    """Return the call that asks for a sweep and gives its RemoteJob; the request is validated
    before anything is sent.
    """
    body = encode_body(read_request(SweepRequest, dict(asked)).model_dump())
    return Call(
        "/v1/sweeps", lambda document: job_of(_job_document(document)["id"]), body, _PREPARATION_S
    )
