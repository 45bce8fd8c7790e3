"""Large answers on their way: files that a worker writes and the server streams, in a folder that
ends with the server.
"""

from __future__ import annotations

import logging
import os
import shutil
import stat
import tempfile
import time
import uuid
from collections.abc import AsyncIterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from anyio import to_thread
from filelock import FileLock
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.api.private_folder import own_folder

__all__ = ["Spool", "SpooledResponse"]

_LOG = logging.getLogger("veselova.service")

#: Bytes that are in memory at a time for each client.
_CHUNK = 1 << 18


#: How the folder of a server begins, and the seconds that a new one has to be locked by its server.
_PREFIX = "veselova-spool-"
_NEW_S = 60.0


class Spool:
    """A folder of this server alone. A file has no name any more when it is sent, so nothing stays
    behind of it.
    """

    def __init__(self, parent: Path) -> None:
        self._parent = parent
        self._folder: Path | None = None
        self._lock: FileLock | None = None

    def open(self) -> None:
        """Make the folder below its parent, or below the system's temporary folder where that
        cannot be written.
        """
        for parent in (self._parent, Path(tempfile.gettempdir())):
            try:
                if parent == self._parent:
                    own_folder(parent)
                _remove_orphans(parent)
                self._folder = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=parent))
                self._lock = _lock(self._folder)
            except (OSError, InvalidInput) as error:
                _LOG.warning(
                    "%s cannot hold large answers on their way: %s",
                    parent,
                    getattr(error, "strerror", None) or error,
                )
            else:
                return

    def close(self) -> None:
        """Remove the folder with all that is in it."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
        if self._lock is not None:
            self._lock.release()

    def place(self) -> str | None:
        """Return the path of a file to be, or None where no folder could be made."""
        return None if self._folder is None else str(self._folder / uuid.uuid4().hex)


def _remove_orphans(parent: Path) -> None:
    """Remove the folders of servers of this account that were killed: their locks
    went with them.
    """
    for folder in parent.glob(f"{_PREFIX}*"):
        with suppress(OSError):
            state = folder.lstat()
            if not stat.S_ISDIR(state.st_mode) or (
                hasattr(os, "geteuid") and state.st_uid != os.geteuid()
            ):
                continue
            if abs(time.time() - state.st_mtime) > _NEW_S:  # the clock may have been set back
                lock = _lock(folder)
                shutil.rmtree(folder, ignore_errors=True)
                lock.release()


def _lock(folder: Path) -> FileLock:
    """Return the lock of a folder, which ends with this process; raises Timeout, an OSError, where
    another process has it.
    """
    lock = FileLock(folder / "lock", timeout=0, thread_local=False)
    lock.acquire()
    return lock


class SpooledResponse(StreamingResponse):
    """A file, sent chunk by chunk, and closed when it is sent or its client has gone."""

    def __init__(self, path: str, headers: Mapping[str, str]) -> None:
        self._file: BinaryIO = Path(path).open("rb")  # noqa: SIM115  closed when the response ends
        Path(path).unlink()
        size = os.fstat(self._file.fileno()).st_size
        super().__init__(self._chunks(), headers={**headers, "Content-Length": str(size)})

    async def _chunks(self) -> AsyncIterator[bytes]:
        while chunk := await to_thread.run_sync(self._file.read, _CHUNK):
            yield chunk

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._file.close()
