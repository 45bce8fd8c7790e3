"""The cache of answers: a folder of bounded size, shared by several servers. It may fail, and then
there is none.
"""

from __future__ import annotations

import logging
import os
import time
import uuid
from pathlib import Path

from veselova.service.answers.cache_entry import Entry

__all__ = ["Cache"]

_LOG = logging.getLogger("veselova.service")

#: What is left after entries had to go, as a part of what may be; and what may be added before the
#: folder is searched again, which takes time in proportion to the entries. Servers that share it
#: may exceed its size by as much each.
_KEPT = 0.9
_UNSEEN = 0.1

#: The end of the name of an entry, and of one on its way into the cache; the nanoseconds after
#: which it will not arrive any more.
_WHOLE = ".kept"
_PART = ".part"
_ARRIVAL_NS = 600 * 10**9


class Cache:
    """Files by name. An entry appears whole or not at all (it is renamed into place), and the least
    recently used go first.

    ``size`` is what the entries may take together, in bytes; 0 is no cache. A folder that cannot be
    read or written, and a disk that is full, are reported once, and leave every question unanswered
    until they work again.
    """

    def __init__(self, folder: Path, size: int) -> None:
        self._folder = folder
        self._size = size
        self._failing = False
        self._room = 0

    def find(self, name: str) -> str | None:
        """Return the file of an entry, which is now the one used last, or None."""
        if not self._size:
            return None
        path = str(self._path(name))
        try:
            os.utime(path)
        except FileNotFoundError:
            return None
        except OSError as error:
            self._report(error)
            return None
        return path

    def entry(self, name: str) -> Entry | None:
        """Return where an entry is, or is to be, kept; None where nothing is kept."""
        if not self._size:
            return None
        return Entry(
            f"{self._folder}/{name}{_WHOLE}",
            f"{self._folder}/.{uuid.uuid4().hex}{_PART}",
            self._size,
        )

    def is_full(self, size: int) -> bool:
        """Count an entry of so many bytes, which was written; return whether room has
        to be made.
        """
        self._failing = False
        self._room -= size
        return self._room < 0

    def make_room(self) -> None:
        """Remove the entries used longest ago where all together are too large, and see how many
        bytes may be added.
        """
        try:
            self._room = self._evict()
        except OSError as error:
            self._report(error)

    def discard(self, name: str, remove: bool = True) -> None:
        """Say that an entry turned out to be damaged, and remove it."""
        _LOG.warning("the cached answer %s is damaged and was removed", name)
        try:
            if remove:
                self._path(name).unlink(missing_ok=True)
        except OSError as error:
            self._report(error)

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}{_WHOLE}"

    def _evict(self) -> int:
        """Remove entries until the others fit, and return how many bytes may be added before the
        next search.

        The newest stays: it fits by itself. What another server removes meanwhile is gone as well.
        """
        entries = []
        with os.scandir(self._folder) as found:
            for entry in found:
                try:
                    state = entry.stat()
                except FileNotFoundError:
                    continue
                entries.append((state.st_mtime_ns, state.st_size, entry.path))
        total = sum(held for _, held, _ in entries)
        if total > self._size:
            arriving = time.time_ns() - _ARRIVAL_NS
            for used, held, path in sorted(entries)[:-1]:
                if path.endswith(_PART) and used > arriving:
                    continue
                Path(path).unlink(missing_ok=True)
                total -= held
                if total <= _KEPT * self._size:
                    break
        return min(max(0, self._size - total), int(_UNSEEN * self._size))

    def report(self, reason: str) -> None:
        """Say why answers are not cached, once until one is again."""
        if not self._failing:
            self._failing = True
            _LOG.warning("answers are not cached: %s", reason)

    def _report(self, error: OSError) -> None:
        self.report(f"{error.filename or self._folder}: {error.strerror or error}")
