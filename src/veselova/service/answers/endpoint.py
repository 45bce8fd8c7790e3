"""Answers to requests for motions, tori, curves and theta functions: computed in a worker, in
memory or in a file.
"""

from __future__ import annotations

import asyncio
import json
import time
import uuid
from collections.abc import Coroutine
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from fastapi import Request, Response
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from veselova.service.answers.rendering import Rendering, check, render
from veselova.service.api.media_types import FORMATS, JSON, Format, negotiate_type
from veselova.service.api.private_files import make_private
from veselova.service.api.problem_details import Refused
from veselova.service.api.request_models import BudgetedRequest, ComparisonRequest, TorusRequest
from veselova.service.api.settings import Settings
from veselova.service.observability.metrics import Metrics
from veselova.service.workers.pool import Workers

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
        detail = "The client closed the connection, and the work was stopped."
        raise Refused("client-gone", detail)
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
