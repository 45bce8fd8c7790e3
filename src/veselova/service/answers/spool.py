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
from weakref import WeakSet

from anyio import to_thread
from filelock import FileLock
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.api.private_folder import own_folder
from veselova.service.api.problem_details import Refused

__all__ = ["Place", "Spool", "SpooledResponse"]

_LOG = logging.getLogger("veselova.service")

#: Bytes that are in memory at a time for each client.
_CHUNK = 1 << 18


#: How the folder of a server begins, and the seconds that a new one has to be locked by its server.
_PREFIX = "veselova-spool-"
_NEW_S = 60.0


class Place:
    """A file to be, whose bytes are counted for as long as anyone has it: first those that were
    promised to it, then its own.
    """

    def __init__(self, path: str, caller: str, promised: int) -> None:
        self.path = path
        self.caller = caller
        self.bytes = promised

    def let_go(self) -> None:
        """Count nothing any more, and remove the file where it is still there."""
        self.bytes = 0
        with suppress(OSError):
            Path(self.path).unlink(missing_ok=True)


class Spool:
    """A folder of this server alone, whose files take ``most`` bytes together, and those of one
    caller ``most_each``. A file has no name any more when it is sent: nothing stays behind of it.
    """

    def __init__(self, parent: Path, most: int, most_each: int) -> None:
        self._parent = parent
        self._most = most
        self._most_each = min(most_each, most)
        self._places = WeakSet[Place]()
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

    def place(self, caller: str, promised: int) -> Place | None:
        """Return the place of a file that may take so many bytes, or None where no folder could be
        made. Raises Refused (``storage-full``) where others, which clients are still reading, leave
        it no room. One that may take more than its caller has is counted with all that.
        """
        if self._folder is None:
            return None
        promised = min(promised, self._most_each)
        held = [place for place in self._places if place.bytes]
        own = [place for place in held if place.caller == caller]
        for places, most, whose in ((held, self._most, ""), (own, self._most_each, " of yours")):
            taken = sum(place.bytes for place in places)
            if taken + promised > most:
                detail = (
                    f"Answers{whose} that are computed or being read take {taken} bytes, and this "
                    f"one may take {promised}: at most {most} in all. Read them, or try again "
                    "later."
                )
                raise Refused("storage-full", detail, retry_after=5)
        place = Place(str(self._folder / uuid.uuid4().hex), caller, promised)
        self._places.add(place)
        return place


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

    def __init__(self, place: Place, headers: Mapping[str, str]) -> None:
        path = Path(place.path)
        self._file: BinaryIO = path.open("rb")  # closed when the response ends
        path.unlink()
        self._place = place
        place.bytes = os.fstat(self._file.fileno()).st_size
        super().__init__(self._chunks(), headers={**headers, "Content-Length": str(place.bytes)})

    async def _chunks(self) -> AsyncIterator[bytes]:
        while chunk := await to_thread.run_sync(self._file.read, _CHUNK):
            yield chunk

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._file.close()
            self._place.let_go()
