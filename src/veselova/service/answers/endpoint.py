"""Answers to requests for motions, tori, curves and theta functions: computed in a worker, in
memory or in a file.
"""

from __future__ import annotations

import json
import time
import uuid
from contextlib import suppress
from pathlib import Path

from fastapi import Request, Response
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from veselova.service.answers.disconnect import while_connected
from veselova.service.answers.rendering import Rendering, render
from veselova.service.api.content_negotiation import negotiate_type
from veselova.service.api.media_types import FORMATS, Format, format_of
from veselova.service.api.private_folder import make_private
from veselova.service.api.request_models import BudgetedRequest
from veselova.service.api.settings import Settings
from veselova.service.observability.metrics import Metrics
from veselova.service.workers.pool import Workers

__all__ = ["PROVENANCE", "Answers"]

#: The header field that has the provenance of a trajectory, whatever its format, as JSON.
PROVENANCE = "Veselova-Provenance"

#: Seconds after which a file belongs to no request of a running server.
_OLD_S = 3600.0


class Answers:
    """The answers of one server, the large ones on their way in a folder."""

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

    async def answer(self, kind: str, asked: BudgetedRequest, request: Request) -> Response:
        """Return the answer to a request: of a trajectory in the format that the client accepts, of
        another kind in JSON. Raises Refused, and what the engines raise.
        """
        offered = list(FORMATS.values()) if kind == "trajectory" else [FORMATS["json"]]
        form = format_of(negotiate_type(request.headers, [entry.media_type for entry in offered]))
        body = await request.body()
        path = self._folder / uuid.uuid4().hex
        budget_s = min(asked.budget_s, self._settings.max_budget_s)

        async def work() -> Rendering:
            with self._metrics.work(kind, asked.subject, asked.engine_named) as facts:
                rendering = await self._workers.run(
                    render, kind, body, form.name, path, self._settings, budget_s=budget_s
                )
                if rendering.provenance is not None:
                    facts["engine"] = rendering.provenance["engine"]
            return rendering

        try:
            return _response(kind, form, await while_connected(request, work()), path)
        except BaseException:
            path.unlink(missing_ok=True)
            raise


def _response(kind: str, form: Format, rendering: Rendering, path: Path) -> Response:
    headers = {"Content-Type": form.media_type}
    if rendering.provenance is not None:
        headers |= {"Vary": "Accept", PROVENANCE: json.dumps(rendering.provenance)}
    if form.name != "json":
        headers["Content-Disposition"] = f'attachment; filename="{kind}.{form.name}"'
    if rendering.body is None:
        return FileResponse(path, headers=headers, background=BackgroundTask(path.unlink))
    return Response(rendering.body, headers=headers)
