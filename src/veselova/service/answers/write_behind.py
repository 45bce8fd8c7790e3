"""Entries of the cache on their way to the disk: in memory from before their answers leave until
they are written.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import anyio
from anyio import to_thread

from veselova.service.answers.cache import Cache

__all__ = ["WriteBehind"]

#: Bytes that may be on their way together.
_MOST = 8_000_000

#: Seconds for which an entry waits: whoever asks again at once is heard first, and entries that
#: come meanwhile go along.
_PAUSE_S = 0.005


class WriteBehind:
    """What is kept and not written yet. Writing follows the answers as long as it works and keeps
    up with them.

    An entry is written before its answer leaves where the last one could not be written, where none
    has been yet, and where
    ``most`` bytes are on their way. One that fails after its answer has left stays here, at its
    address, until the disk takes entries again.
    """

    def __init__(self, cache: Cache, most: int = _MOST) -> None:
        self._cache = cache
        self._most = most
        self._contents: dict[str, bytes] = {}
        self._size = 0
        self._open = self._works = False
        self._due = anyio.Event()

    def find(self, name: str) -> bytes | None:
        """Return the content of an entry that is not written yet, or None."""
        return self._contents.get(name)

    async def keep(self, name: str, content: bytes) -> bool:
        """Keep an entry; return whether it can be had from now on."""
        if not (self._open and self._works) or self._size + len(content) > self._most:
            return await self._write({name: content})
        if name not in self._contents:
            self._contents[name] = content
            self._size += len(content)
            self._due.set()
        return True

    @asynccontextmanager
    async def writing(self) -> AsyncIterator[None]:
        """Write entries inside the block, and those that are left at its end."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._write_what_is_due)
            self._open = True
            yield
            self._open = False
            tasks.cancel_scope.cancel()
        await self._write(self._contents)

    async def _write_what_is_due(self) -> None:
        while True:
            await self._due.wait()
            await anyio.sleep(_PAUSE_S)
            self._due = anyio.Event()
            await self._write(self._contents)

    async def _write(self, contents: dict[str, bytes]) -> bool:
        """Write entries until one fails, and make room where they fill the cache; return whether
        all are on the disk.
        """
        contents = dict(contents)  # those that arrive meanwhile are left to the next time
        written = await to_thread.run_sync(self._cache.write, contents)
        for name in written:
            self._size -= len(self._contents.pop(name, b""))
        worked = self._works
        self._works = len(written) == len(contents)
        if self._works and not worked and self._contents:
            self._due.set()
        if written and self._cache.is_full(sum(written.values())):
            await to_thread.run_sync(self._cache.make_room)
        return self._works
