"""The files of jobs, whole, in parts, or in another format. Each is opened before its response
begins: the job may be removed while it is sent.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from starlette.datastructures import Headers
from starlette.responses import FileResponse, StreamingResponse
from starlette.types import Message, Receive, Scope, Send

from veselova.service.api.problem_details import Refused, problem_response
from veselova.service.observability.request_log import note

__all__ = ["JobFile", "JobStream"]


class JobFile(FileResponse):
    """An open file, or what its client asks of it (Range), closed when it is sent. What is no range
    is left aside, as RFC 9110, 14.2 has it; one beyond the end is refused with a problem document.
    """

    def __init__(self, file: BinaryIO, media_type: str, filename: str) -> None:
        super().__init__(
            _path(file),
            stat_result=os.fstat(file.fileno()),
            media_type=media_type,
            filename=filename,
        )
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file, a part of it, or a refusal."""
        with self._file:
            await self._send(scope, receive, send)

    async def _send(self, scope: Scope, receive: Receive, send: Send) -> None:
        refused: Message | None = None

        async def watch(message: Message) -> None:
            nonlocal refused
            if message["type"] == "http.response.start" and message["status"] >= 400:
                refused = message
            if refused is None:
                await send(message)

        await super().__call__(scope, receive, watch)
        if refused is None:
            return
        stated = Headers(raw=list(refused["headers"]))
        if "content-range" not in stated:
            others = [field for field in scope["headers"] if field[0] != b"range"]
            await super().__call__({**scope, "headers": others}, receive, send)
            return
        error = Refused(
            "range-not-satisfiable", "Range: required a part of the file; given one beyond its end."
        )
        note(outcome=error.code)
        response = problem_response(error)
        response.headers["Content-Range"] = stated["content-range"]
        await response(scope, receive, send)


class JobStream(StreamingResponse):
    """What is made of an open file while it is sent; the file is closed at the end."""

    def __init__(
        self, file: BinaryIO, content: Iterator[bytes], media_type: str, filename: str
    ) -> None:
        headers = {"Content-Disposition": f'attachment; filename="{filename}"'}
        super().__init__(content, media_type=media_type, headers=headers)
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the content."""
        with self._file:
            await super().__call__(scope, receive, send)


def _path(file: BinaryIO) -> str:
    """Return a name of an open file, where the system has such, by which it is opened though its
    own has gone.
    """
    opened = Path("/dev/fd", str(file.fileno()))
    return str(opened) if opened.exists() else file.name
