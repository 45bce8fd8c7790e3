"""Answers to requests for motions, tori, curves and theta functions: negotiated, computed in a
worker, in memory or in a file.
"""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from anyio import to_thread
from starlette.requests import Request
from starlette.responses import Response

from veselova.service.answers.disconnect import while_connected
from veselova.service.answers.large_answers import answer_path, open_folder, stream_file
from veselova.service.answers.rendering import Rendering, Representation, render
from veselova.service.answers.request_reading import Reader
from veselova.service.api.content_negotiation import joined_field, negotiate_coding, negotiate_type
from veselova.service.api.media_types import FORMATS, Format, format_of
from veselova.service.api.settings import Settings
from veselova.service.observability.metrics import Metrics
from veselova.service.workers.pool import Workers
from veselova.service.workers.tasks import TASKS

__all__ = ["PROVENANCE", "Answers"]

#: The header field that has the provenance of a trajectory, whatever its format, as JSON.
PROVENANCE = "Veselova-Provenance"


class Answers:
    """The answers of one server."""

    def __init__(
        self, settings: Settings, workers: Workers, reader: Reader, metrics: Metrics
    ) -> None:
        self._settings = settings
        self._workers = workers
        self._reader = reader
        self._metrics = metrics
        self._folder = settings.data_dir / "answers"

    @asynccontextmanager
    async def serving(self) -> AsyncIterator[None]:
        """Open the folder of large answers for the life of the server."""
        await to_thread.run_sync(open_folder, self._folder)
        yield

    async def answer(self, kind: str, request: Request) -> Response:
        """Return the answer to a POST: of a trajectory in the format that the client accepts, of
        another kind in JSON.
        """
        form = _negotiate_format(kind, request)
        asked = await self._reader.parse_body(TASKS[kind][0], request)
        path = answer_path(self._folder) if asked.is_large else None
        coding = negotiate_coding(joined_field(request.headers, "accept-encoding"))
        budget_s = min(asked.budget_s, self._settings.max_budget_s)
        wanted = Representation(form.name, coding, path)

        async def work() -> Response:
            with self._metrics.work(kind, asked.system, asked.engine) as facts:
                rendering = await self._workers.run(
                    render, kind, asked.content, wanted, self._settings, budget_s=budget_s
                )
                if rendering.provenance is not None:
                    facts["engine"] = rendering.provenance["engine"]
            return _response(kind, form, rendering, path)

        try:
            return await while_connected(request, work)
        except BaseException:
            if path is not None:
                path.unlink(missing_ok=True)
            raise


def _negotiate_format(kind: str, request: Request) -> Format:
    offered = [entry.media_type for entry in FORMATS.values()]
    if kind != "trajectory":
        offered = [FORMATS["json"].media_type]
    return format_of(negotiate_type(joined_field(request.headers, "accept"), offered))


def _response(kind: str, form: Format, rendering: Rendering, path: Path | None) -> Response:
    headers = {"Content-Type": form.media_type, "Vary": "Accept-Encoding"}
    if kind == "trajectory":
        headers["Vary"] = "Accept, Accept-Encoding"
        headers[PROVENANCE] = json.dumps(rendering.provenance)
    if form.name != "json":
        headers["Content-Disposition"] = f'attachment; filename="{kind}.{form.name}"'
    if rendering.coding != "identity":
        headers["Content-Encoding"] = rendering.coding
    if path is not None:
        return stream_file(path, headers)
    return Response(rendering.body, headers=headers)
