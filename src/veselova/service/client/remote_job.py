"""A sweep on a server, for both clients: what is done is said once, as flows of calls that
a client carries out.
"""

from __future__ import annotations

import io
import re
import tempfile
from collections.abc import Callable, Generator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from veselova.mechanics.core.errors import InvalidInput, ServiceError, show
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.table import Target
from veselova.service.api.media_types import MEDIA_TYPES
from veselova.service.api.request_models import read_request
from veselova.service.api.sweep_request import SweepRequest, sweep_document
from veselova.service.client.answer import reading
from veselova.service.client.requests import Call, encode_body, target_of

__all__ = ["Flow", "RemoteJob", "sweep_call"]

T = TypeVar("T")

#: Seconds that a finished table may be prepared before its first byte.
_PREPARATION_S = 60.0

#: Seconds that a server may take to end what its workers are in the midst of: a worker that does
#: not say where it is has 20.
_ENDING_S = 60.0

#: Seconds between two questions how far a job is, from the first to the longest.
_FIRST_PAUSE_S = 0.1
_LONGEST_PAUSE_S = 2.0


#: What is read of the document of a job.
_FIELDS = {"id", "state", "detail", "done", "total", "finished_at", "links"}


def _job_document(document: Any) -> dict[str, Any]:
    """Return the document of a job; raises LookupError or AttributeError for anything else."""
    if missing := _FIELDS - document.keys():
        raise LookupError(f"no {missing.pop()}")
    return dict(document)


#: Calls, one after the other; each is given its result, or the ServiceError that came instead.
Flow: TypeAlias = Generator[Call[Any], Any, T]


def _nothing(_: object) -> None:
    """Make nothing of an answer."""


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

    def __repr__(self) -> str:
        return f"<RemoteJob {self.id}>"

    def status(self) -> Any:
        """Return the document of the job: state, done, total, rate, eta_s, detail …"""
        return self._ask(_job_document, method="GET")

    def wait(self, progress: Callable[[int, int], object] | None = None) -> Any:
        """Return the document of the job when it has finished; ``progress(done, total)`` is told on
        the way.

        Raises ServiceError where it has failed or was cancelled.
        """
        return self._client.run(self._finish(progress))

    def cancel(self) -> Any:
        """Stop the job, keeping what is done, and return its document; the same sweep asked for
        again goes on from there.
        """
        return self._ask(_job_document, budget_s=_ENDING_S, method="DELETE")

    def remove(self) -> Any:
        """Stop the job and forget it, with its results."""
        return self._ask(_nothing, "?remove=true", budget_s=_ENDING_S, accept="", method="DELETE")

    def download(self, target: Target) -> Any:
        """Write the table, as Parquet, to a path or a binary stream when the job has finished."""
        return self._client.run(self._download(target))

    def dataset(self, progress: Callable[[int, int], object] | None = None) -> Any:
        """Return the results as an xarray Dataset (see ``veselova.sweep``) when the job has
        finished.
        """
        return self._client.run(self._dataset(progress))

    def _link(self, more: str = "") -> str:
        return f"/v1/jobs/{self.id}{more}"

    def _ask(self, result: Callable[[Any], Any], more: str = "", **options: Any) -> Any:
        return self._client.run(self._client.retrying(Call(self._link(more), result, **options)))

    def _finish(self, progress: Callable[[int, int], object] | None) -> Flow[Any]:
        state = Call(self._link(), _job_document, method="GET")
        pause = _FIRST_PAUSE_S
        while True:
            document = yield from self._client.retrying(state)
            if progress is not None:
                progress(document["done"], document["total"])
            if document["state"] == "finished":
                return document
            if document["finished_at"] is not None:
                detail = document["detail"] or "no detail given"
                raise ServiceError(f"job {self.id} is {document['state']}: {detail}")
            state = replace(state, after_s=pause)
            pause = min(2 * pause, _LONGEST_PAUSE_S)

    def _fetch(self, part: str, media_type: str, target: Target) -> Flow[None]:
        link, to = self._link(part), target_of(target)
        call = Call(link, _nothing, None, _PREPARATION_S, media_type, to, "GET")
        return self._client.retrying(call)  # type: ignore[no-any-return]

    def _download(self, target: Target) -> Flow[None]:
        fetch = self._fetch("/result", MEDIA_TYPES["parquet"], target)
        yield from self._finish(None)
        yield from fetch

    def _dataset(self, progress: Callable[[int, int], object] | None) -> Flow[Any]:
        from veselova.service.api.sweep_dataset import sweep_dataset

        document = yield from self._finish(progress)
        with reading(self._link()):
            sweep = read_request(SweepRequest, document["request"])
        table = io.BytesIO()
        yield from self._fetch("/result", MEDIA_TYPES["parquet"], table)
        with tempfile.TemporaryDirectory() as folder:
            packed = None
            if "trajectories" in document["links"]:
                packed = Path(folder) / "trajectories.zarr.zip"
                yield from self._fetch("/trajectories", "application/zip", packed)
            with reading(self._link("/result")):
                return sweep_dataset(sweep, table.getvalue(), packed)


def sweep_call(
    client: Any,
    problem: Problem | Mapping[str, Any],
    vary: Mapping[str, Any],
    times: Any,
    options: dict[str, Any],
) -> Call[RemoteJob]:
    """Return the call that asks for a sweep and gives its RemoteJob; the request is validated
    before anything is sent.
    """
    asked = sweep_document(problem, vary, times)
    body = read_request(SweepRequest, {**asked, **options}).model_dump()

    def job(document: Any) -> RemoteJob:
        return RemoteJob(client, _job_document(document)["id"])

    return Call("/v1/sweeps", job, encode_body(body), _PREPARATION_S)
