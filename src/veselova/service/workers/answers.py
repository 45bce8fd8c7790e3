"""Requests for motions, tori, curves and theta functions: read in a worker process, computed there,
and rendered in the negotiated format, in memory or in a file.
"""

from __future__ import annotations

import asyncio
import io
import json
import time
import uuid
from collections.abc import Coroutine
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from fastapi import Request, Response
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from veselova.mechanics.core.arguments import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import write_document
from veselova.service.api.media_types import FORMATS, JSON, Format, negotiate_type
from veselova.service.api.private_files import make_private
from veselova.service.api.problem_details import Refused, loads
from veselova.service.api.request_models import (
    BudgetedRequest,
    ComparisonRequest,
    TorusRequest,
    read_request,
)
from veselova.service.api.settings import Settings
from veselova.service.observability.metrics import Metrics
from veselova.service.workers.pool import Workers
from veselova.service.workers.tasks import TASKS

T = TypeVar("T")

#: The header field that has the provenance of a trajectory, whatever its format, as JSON.
PROVENANCE = "Veselova-Provenance"

#: Seconds after which a file belongs to no request of a running server.
_OLD_S = 3600.0


class Answers:
    """The answers of one server; large ones are files of a folder while they are sent."""

    def __init__(self, settings: Settings, workers: Workers, metrics: Metrics) -> None:
        self._settings = settings
        self._workers = workers
        self._metrics = metrics
        self._folder = settings.data_dir / "answers"

    def open(self) -> None:
        """Make the folder of large answers, and remove the files of servers that were killed."""
        with suppress(OSError):  # a worker names the error when it writes
            make_private(self._folder)
            for path in self._folder.iterdir():
                if time.time() - path.stat().st_mtime > _OLD_S:
                    path.unlink(missing_ok=True)

    async def check(self, model: type[BudgetedRequest], body: bytes) -> None:
        """Raise InvalidRequest with all faults of a body, which a worker finds."""
        settings = self._settings
        await self._workers.run(check, model, body, settings, budget_s=settings.max_budget_s)

    async def answer(self, kind: str, asked: BudgetedRequest, request: Request) -> Response:
        """Return the answer to a request: of a trajectory in the format that the client accepts, of
        another kind in JSON. Raises Refused, and what the engines raise.
        """
        formats = FORMATS.values() if kind == "trajectory" else [JSON]
        offered = {entry.media_type: entry for entry in formats}
        form = offered[negotiate_type(request.headers, list(offered))]
        body = await request.body()
        path = self._folder / uuid.uuid4().hex
        budget_s = min(asked.budget_s, self._settings.max_budget_s)

        async def work() -> Rendering:
            with self._metrics.work(kind, _system(kind, asked), _engine(asked)) as facts:
                rendering = await self._workers.run(
                    render, kind, body, form.name, path, self._settings, budget_s=budget_s
                )
                if rendering.provenance is not None:
                    facts["engine"] = rendering.provenance["engine"]
            return rendering

        try:
            return _response(kind, form, await _while_connected(request, work()), path)
        except BaseException:
            path.unlink(missing_ok=True)
            raise


def _system(kind: str, asked: BudgetedRequest) -> str:
    """Return what a request is about, in a word."""
    return str(getattr(getattr(asked, "problem", asked), "system", kind))


def _engine(asked: BudgetedRequest) -> str:
    """Return the engine asked for, or the first of the system."""
    if type(asked) is ComparisonRequest:
        return "both"
    engines = asked.problem.problem_class.engines if isinstance(asked, TorusRequest) else ()
    return getattr(asked, "engine", None) or next(iter(engines), "analytic")


def _response(kind: str, form: Format, rendering: Rendering, path: Path) -> Response:
    headers = {"Content-Type": form.media_type}
    if rendering.provenance is not None:
        headers |= {"Vary": "Accept", PROVENANCE: json.dumps(rendering.provenance)}
    if form.name != "json":
        headers["Content-Disposition"] = f'attachment; filename="{kind}.{form.name}"'
    if rendering.body is None:
        return FileResponse(path, headers=headers, background=BackgroundTask(path.unlink))
    return Response(rendering.body, headers=headers)


async def _while_connected(request: Request, work: Coroutine[Any, Any, T]) -> T:
    """Return the result of the work; cancel it and raise Refused when the client disconnects or the
    server shuts down.
    """
    working = asyncio.create_task(work)
    leaving = asyncio.create_task(_wait_gone(request))
    try:
        await asyncio.wait((working, leaving), return_when=asyncio.FIRST_COMPLETED)
        if working.done():
            return working.result()
        working.cancel()
        await asyncio.wait((working,))
        raise Refused("client-gone", "The client closed the connection, and the work was stopped.")
    except asyncio.CancelledError:
        # The grace after SIGTERM has run out. The client is owed an answer all the same.
        detail = "The server is shutting down and stopped this work."
        raise Refused("shutting-down", detail, retry_after=5) from None
    finally:
        working.cancel()
        leaving.cancel()


async def _wait_gone(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass


#: Doubles from which an answer is written to a file.
_LARGE = 100_000

_Model = TypeVar("_Model", bound=BudgetedRequest)


@dataclass(frozen=True)
class Rendering:
    """The bytes of an answer, None where they are in the file; the provenance of a trajectory."""

    body: bytes | None
    provenance: dict[str, Any] | None = None


def read_body(model: type[_Model], body: bytes, settings: Settings) -> _Model:
    """Return the request of a body; raises InvalidRequest with all of its faults, Refused for
    malformed JSON.
    """
    return read_request(model, loads(body), partial(beyond_limits, settings=settings))


def check(model: type[BudgetedRequest], body: bytes, settings: Settings) -> None:
    """Raise what ``read_body`` raises."""
    read_body(model, body, settings)


def beyond_limits(request: BudgetedRequest, settings: Settings) -> list[InvalidInput]:
    """Return the limits of a server that a request exceeds, before its numbers are validated."""
    limits = (
        (("budget_s",), request.budget_s, settings.max_budget_s, "on this server"),
        (*request.dimension_at, settings.max_dimension, "entries on this server"),
        (*request.values_at, settings.max_values, "numbers in one answer on this server"),
    )
    return [
        InvalidInput(place, f"at most {most} {unit}", show(given))
        for place, given, most, unit in limits
        if given > most
    ]


def render(kind: str, body: bytes, form: str, path: Path, settings: Settings) -> Rendering:
    """Return the answer of a kind of TASKS in one of the FORMATS, or its provenance where it is
    large and ``path`` is its file. Raises as ``read_body`` does.
    """
    model, compute = TASKS[kind]
    asked: Any = read_body(model, body, settings)
    found = compute(asked)
    provenance = found.provenance.as_dict() if isinstance(found, Trajectory) else None

    def write(stream: BinaryIO) -> None:
        if isinstance(found, Trajectory):
            FORMATS[form].write(found, stream, asked.outputs)
        else:
            write_document(found, stream)

    if asked.values_at[1] * getattr(asked, "digits", FEWEST_DIGITS) > _LARGE * FEWEST_DIGITS:
        try:
            with path.open("wb") as file:
                write(file)
        except OSError as error:
            detail = f"The answer could not be written: {error.strerror}."
            raise Refused("storage-full", detail, retry_after=60) from None
        return Rendering(None, provenance)
    stream = io.BytesIO()
    write(stream)
    return Rendering(stream.getvalue(), provenance)
