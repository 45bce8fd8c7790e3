"""Places that several callers share, whoever asks most: free ones go to the caller who has fewest,
then to who waits longest.
"""

from __future__ import annotations

from collections import Counter, OrderedDict, deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import anyio

__all__ = ["Shares"]


class Shares:
    """So many places, of which one caller may hold ``most_each``; a caller who holds none may
    exceed them with ``first_free``.
    """

    def __init__(self, places: int, most_each: int, first_free: bool = False) -> None:
        self.places = places
        self._most_each = most_each
        self._first_free = first_free
        self._held: Counter[str] = Counter()
        #: Who waits, those served longest ago first, each with what tells its requests that they
        #: have a place.
        self._queues: OrderedDict[str, deque[anyio.Event]] = OrderedDict()

    @property
    def held(self) -> int:
        """Return how many places are taken."""
        return self._held.total()

    @property
    def waiting(self) -> int:
        """Return how many requests wait for a place."""
        return sum(map(len, self._queues.values()))

    def held_by(self, caller: str) -> int:
        """Return how many places a caller has."""
        return self._held[caller]

    def waiting_of(self, caller: str) -> int:
        """Return how many requests of a caller wait for a place."""
        return len(self._queues.get(caller, ()))

    def has_place_for(self, caller: str) -> bool:
        """Return whether a caller would get a place at once."""
        if self._first_free and not self._held[caller]:
            return True
        return self.held < self.places and self._held[caller] < self._most_each

    async def acquire(self, caller: str) -> None:
        """Take a place, and wait for one where that has to be; with a place to be had, without
        giving way to other tasks.
        """
        if self.has_place_for(caller):
            self._held[caller] += 1
            return
        granted = anyio.Event()
        self._queues.setdefault(caller, deque()).append(granted)
        try:
            await granted.wait()
        except BaseException:
            if granted.is_set():
                self.release(caller)
            else:
                self._queues[caller].remove(granted)
                self._forget(caller)
            raise

    def release(self, caller: str) -> None:
        """Give a place back; whoever is next has it from now on."""
        self._held[caller] -= 1
        self._held += Counter()  # forgets those who have none
        while ready := [waiting for waiting in self._queues if self.has_place_for(waiting)]:
            following = min(ready, key=self._held.__getitem__)
            self._held[following] += 1
            self._queues[following].popleft().set()
            self._queues.move_to_end(following)
            self._forget(following)

    @asynccontextmanager
    async def place(self, caller: str) -> AsyncIterator[None]:
        """Hold a place inside the block."""
        await self.acquire(caller)
        try:
            yield
        finally:
            self.release(caller)

    def _forget(self, caller: str) -> None:
        if not self._queues[caller]:
            del self._queues[caller]
