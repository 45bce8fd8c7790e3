"""A sweep on a server, for both clients: what is done is said once, as flows of calls and pauses
that a client carries out.
"""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeAlias
from urllib.parse import quote

from veselova.mechanics.core.errors import InvalidInput, ServiceError, show
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.table import Target
from veselova.service.api.request_models import read_request
from veselova.service.api.sweep_request import SweepRequest, sweep_document
from veselova.service.client.answer import reading
from veselova.service.client.download import MEDIA_TYPES, sink_of
from veselova.service.client.requests import Call

__all__ = ["Flow", "Pause", "RemoteJob", "sweep_flow"]

#: Seconds that a finished table may be prepared before its first byte.
_PREPARATION_S = 60.0

#: Seconds that a server may take to end what its workers are in the midst of: a worker that does
#: not say where it is has 20.
_ENDING_S = 60.0

#: Seconds between two questions how far a job is, from the first to the longest.
_FIRST_PAUSE_S = 0.1
_LONGEST_PAUSE_S = 2.0


#: Characters of the id of a job, at most.
_LONGEST_ID = 1000

#: What is read of the document of a job: field → its types.
_FIELDS: Mapping[str, type | tuple[type, ...]] = {
    "id": str,
    "state": str,
    "detail": str,
    "done": int,
    "total": int,
    "finished_at": (str, type(None)),
    "links": dict,
}


def _job_document(document: Any) -> dict[str, Any]:
    """Return the document of a job; raises LookupError or TypeError for anything else."""
    for name, kind in _FIELDS.items():
        if not isinstance(document[name], kind):
            raise TypeError(f"{name} is of another type")
    return dict(document)


@dataclass(frozen=True)
class Pause:
    """A wait between two calls."""

    seconds: float


#: Calls and pauses, one after the other; each call is given its result.
Flow: TypeAlias = "Generator[Call[Any] | Pause, Any, Any]"


class Runner(Protocol):
    """A client: it carries out a flow of calls and pauses."""

    def run(self, flow: Flow) -> Any:
        """Carry out a flow, and return what it ends with: at once, or as something to
        be awaited.
        """


class RemoteJob:
    """A sweep on a server. Every method of an AsyncClient's job is to be awaited; those of a
    Client's job return at once.

    ``id``: the same request has the same, so that ``client.job(id)`` finds it again.
    """

    def __init__(self, client: Runner, job_id: str) -> None:
        # no part of an address is empty, or dots alone, and none is without bounds
        fits = isinstance(job_id, str) and job_id.isprintable() and len(job_id) <= _LONGEST_ID
        if not fits or not job_id.strip("."):
            raise InvalidInput(("job_id",), "the id of a job", show(job_id))
        self._client = client
        self.id = job_id

    def __repr__(self) -> str:
        return f"<RemoteJob {self.id}>"

    def status(self) -> Any:
        """Return the document of the job: state, done, total, rate, eta_s, detail …"""
        return self._client.run(self._one(self._get()))

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
        return self._client.run(
            self._one(Call(self._link(), None, _ENDING_S, _job_document, method="DELETE"))
        )

    def remove(self) -> Any:
        """Stop the job and forget it, with its results."""
        return self._client.run(
            self._one(
                Call(
                    self._link("?remove=true"),
                    None,
                    _ENDING_S,
                    lambda _: None,
                    method="DELETE",
                    status=204,
                )
            )
        )

    def download(self, target: Target) -> Any:
        """Write the table, as Parquet, to a path or a binary stream when the job has finished."""
        return self._client.run(self._download(target))

    def dataset(self, progress: Callable[[int, int], object] | None = None) -> Any:
        """Return the results as an xarray Dataset (see ``veselova.sweep``) when the job has
        finished.
        """
        return self._client.run(self._dataset(progress))

    def _link(self, more: str = "") -> str:
        return f"/v1/jobs/{quote(self.id, safe='')}{more}"

    def _get(self) -> Call[dict[str, Any]]:
        return Call(self._link(), None, 0.0, _job_document, method="GET")

    @staticmethod
    def _one(call: Call[Any]) -> Flow:
        return (yield call)

    def _finish(self, progress: Callable[[int, int], object] | None) -> Flow:
        if progress is not None and not callable(progress):
            raise InvalidInput(("progress",), "a function of (done, total)", show(progress))
        pause = _FIRST_PAUSE_S
        while True:
            document = yield self._get()
            if progress is not None:
                progress(document["done"], document["total"])
            if document["state"] == "finished":
                return document
            if document["finished_at"] is not None:
                raise ServiceError(
                    f"job {self.id} is {document['state']}: "
                    f"{document['detail'] or 'no detail given'}"
                )
            yield Pause(pause)
            pause = min(2 * pause, _LONGEST_PAUSE_S)

    def _fetch(self, part: str, media_type: str, target: Target) -> Call[None]:
        return Call(
            self._link(part),
            None,
            _PREPARATION_S,
            lambda _: None,
            media_type,
            sink_of(target),
            "GET",
        )

    def _download(self, target: Target) -> Flow:
        fetch = self._fetch("/result", MEDIA_TYPES["parquet"], target)
        yield from self._finish(None)
        yield fetch

    def _dataset(self, progress: Callable[[int, int], object] | None) -> Flow:
        from veselova.service.api.sweep_dataset import sweep_dataset

        document = yield from self._finish(progress)
        with reading(self._link()):
            sweep = read_request(SweepRequest, document["request"])
        table = io.BytesIO()
        yield self._fetch("/result", MEDIA_TYPES["parquet"], table)
        with tempfile.TemporaryDirectory() as folder:
            packed = None
            if "trajectories" in document["links"]:
                packed = Path(folder) / "trajectories.zarr.zip"
                yield self._fetch("/trajectories", "application/zip", packed)
            with reading(self._link("/result")):
                return sweep_dataset(sweep, table.getvalue(), packed)


def sweep_flow(
    client: Runner,
    problem: Problem | Mapping[str, Any],
    vary: Mapping[str, Any],
    times: Any,
    options: dict[str, Any],
) -> Flow:
    """Return the flow that asks for a sweep and gives its RemoteJob; the request is validated
    before anything is sent.
    """
    asked = sweep_document(problem, vary, times)
    body = read_request(SweepRequest, {**asked, **options}).model_dump()

    def job(document: Any) -> RemoteJob:
        return RemoteJob(client, _job_document(document)["id"])

    return (yield Call("/v1/sweeps", body, _PREPARATION_S, job, status=202))
