"""One look for all who ask at once."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from copy import copy
from typing import Generic, TypeVar

import anyio

from veselova.service.api.problem_details import Refused

__all__ = ["SharedLook"]

T = TypeVar("T")


class SharedLook(Generic[T]):
    """What a look finds, which takes others than those who ask: however many these are, looks begin
    ``pause_s`` seconds apart.
    """

    def __init__(self, look: Callable[[], Awaitable[T]], pause_s: float) -> None:
        self._look = look
        self._pause_s = pause_s
        self._turn = anyio.Lock()
        self._looked_at = -pause_s
        self._found: T | Refused = Refused("not-ready", "")

    async def __call__(self) -> T:
        """Return what is found, or raise what is Refused, by a look that begins after this was
        asked.
        """
        asked_at = time.monotonic()
        async with self._turn:
            if self._looked_at < asked_at:
                await anyio.sleep(max(0.0, self._looked_at + self._pause_s - time.monotonic()))
                begun = time.monotonic()
                try:
                    self._found = await self._look()
                except Refused as error:
                    self._found = error
                self._looked_at = begun
        if isinstance(self._found, Refused):
            raise copy(self._found)
        return self._found
