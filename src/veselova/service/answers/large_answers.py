"""Large answers: a worker writes each to a file, which is unlinked when it is sent."""

from __future__ import annotations

import time
import uuid
from collections.abc import AsyncIterator, Mapping
from contextlib import suppress
from pathlib import Path

import anyio
from starlette.responses import StreamingResponse

from veselova.service.api.private_folder import own_folder

__all__ = ["answer_path", "open_folder", "stream_file"]

#: Bytes that are in memory at a time for each client.
_CHUNK = 1 << 18

#: Seconds after which a file belongs to no request of a running server.
_OLD_S = 3600.0


def open_folder(folder: Path) -> None:
    """Make the folder of large answers, and remove the files of servers that were killed."""
    with suppress(OSError):  # a worker names the error when it writes
        own_folder(folder)
        for path in folder.iterdir():
            if time.time() - path.stat().st_mtime > _OLD_S:
                path.unlink(missing_ok=True)


def answer_path(folder: Path) -> Path:
    """Return the path of a new answer."""
    return folder / uuid.uuid4().hex


def stream_file(path: Path, headers: Mapping[str, str]) -> StreamingResponse:
    """Return a response that unlinks a file and sends its content."""

    async def chunks() -> AsyncIterator[bytes]:
        async with await anyio.open_file(path, "rb") as file:
            path.unlink()
            while chunk := await file.read(_CHUNK):
                yield chunk

    size = str(path.stat().st_size)
    return StreamingResponse(chunks(), headers={**headers, "Content-Length": size})
