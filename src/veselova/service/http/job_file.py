"""The files of jobs, whole, in parts, or in another format. Each is opened before its response
begins: the job may be removed while it is sent.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from email.utils import formatdate, mktime_tz, parsedate_tz
from pathlib import Path
from typing import BinaryIO

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse
from starlette.types import Message, Receive, Scope, Send

from veselova.service.api.content_negotiation import joined_field
from veselova.service.api.problem_details import Refused, problem_response
from veselova.service.observability.request_log import note

__all__ = ["JobFile", "file_response"]


def file_response(
    request: Request,
    file: BinaryIO,
    media_type: str,
    filename: str,
    content: Iterator[bytes] | None = None,
    vary: str | None = None,
) -> Response:
    """Return the answer to a GET or HEAD of an open file, 304 where the client has it.

    ``content`` is what is made of the file in another format; ``vary`` names the fields of the
    request that chose the format.
    """
    state = os.fstat(file.fileno())
    tag = f"{state.st_mtime_ns:x}-{state.st_size:x}"
    headers = {
        "ETag": f'"{tag}"' if content is None else f'W/"{tag}{Path(filename).suffix}"',
        "Last-Modified": formatdate(state.st_mtime, usegmt=True),
    }
    if vary is not None:
        headers["Vary"] = vary
    if _is_current(request.headers, headers["ETag"], int(state.st_mtime)):
        file.close()
        return Response(status_code=304, headers=headers)
    if content is None:
        return JobFile(file, media_type, filename, headers)
    return _JobStream(file, content, media_type, filename, headers)


def _is_current(headers: Headers, tag: str, modified: int) -> bool:
    """Return whether the client has a file already (RFC 9110, 13.2.2: a tag goes before a date,
    and what is no date is left aside).
    """
    stated = joined_field(headers, "if-none-match")
    if stated is not None:
        return matches(stated, tag)
    date = parsedate_tz(headers.get("if-modified-since", ""))
    try:
        return date is not None and modified <= mktime_tz(date)
    except (ValueError, OverflowError):  # of no calendar
        return False


def matches(if_none_match: str, tag: str) -> bool:
    """Return whether an If-None-Match header names the tag of a file, in weak comparison, or any
    by ``*``.
    """
    names = [part.strip().removeprefix("W/") for part in if_none_match.split(",")]
    return tag.removeprefix("W/") in names or names == ["*"]


class JobFile(FileResponse):
    """An open file, or what its client asks of it (Range), closed when it is sent. What is no range
    is left aside, as RFC 9110, 14.2 has it; one beyond the end is refused with a problem document.
    """

    def __init__(
        self, file: BinaryIO, media_type: str, filename: str, headers: Mapping[str, str]
    ) -> None:
        super().__init__(
            _path(file),
            headers=headers,
            media_type=media_type,
            filename=filename,
            stat_result=os.fstat(file.fileno()),
        )
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file, a part of it, or a refusal. No part of it is asked for by HEAD."""
        with self._file:
            await self._send(
                scope if scope["method"] == "GET" else _without_range(scope), receive, send
            )

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
            await super().__call__(_without_range(scope), receive, send)
            return
        error = Refused(
            "range-not-satisfiable", "Range: required a part of the file; given one beyond its end."
        )
        note(outcome=error.code)
        response = problem_response(error)
        response.headers["Content-Range"] = stated["content-range"]
        await response(scope, receive, send)


class _JobStream(StreamingResponse):
    """What is made of an open file while it is sent; the file is closed at the end."""

    def __init__(
        self,
        file: BinaryIO,
        content: Iterator[bytes],
        media_type: str,
        filename: str,
        headers: Mapping[str, str],
    ) -> None:
        named = {"Content-Disposition": f'attachment; filename="{filename}"', **headers}
        super().__init__(content, headers=named, media_type=media_type)
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the content, of which nothing is made for HEAD."""
        with self._file:
            if scope["method"] == "GET":
                await super().__call__(scope, receive, send)
                return
            start = {"status": self.status_code, "headers": self.raw_headers}
            await send({"type": "http.response.start", **start})
            await send({"type": "http.response.body"})


def _without_range(scope: Scope) -> Scope:
    others = [field for field in scope["headers"] if field[0] != b"range"]
    return {**scope, "headers": others}


def _path(file: BinaryIO) -> str:
    """Return a name of an open file, where the system has such, by which it is opened though its
    own has gone.
    """
    opened = Path("/dev/fd", str(file.fileno()))
    return str(opened) if opened.exists() else file.name
