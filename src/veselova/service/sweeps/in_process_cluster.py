"""The cluster of a short sweep: a thread of this process, which starts no other."""

from __future__ import annotations

import math
import time
from threading import Event

import anyio
from anyio import to_thread

from veselova.service.api.sweep_request import SweepRequest
from veselova.service.sweeps.chunk import Chunk, compute_chunk
from veselova.service.sweeps.job_store import Job
from veselova.version import __version__

__all__ = ["ThisProcess", "seconds_of"]

#: Problems that are computed to see what others cost: of those that are computed together, and of
#: others.
_TOGETHER = 20
_SINGLE = 2

#: Problems between two looks at whether anybody waits, where they are computed one by one.
_PART = 4


class ThisProcess:
    """Computes chunks one after the other. What it was asked for ends with who asked."""

    def __init__(self) -> None:
        self._turn = anyio.Lock()

    async def nthreads(self) -> dict[str, int]:
        """Return how many chunks are computed at a time, by worker."""
        return {"this process": 1}

    async def compute(self, job: Job, start: int, stop: int) -> list[Chunk]:
        """Return the answers to the problems start … stop−1 of a job, in parts; ends between two
        once nobody waits.
        """
        rows = stop - start if job.sweep.tori_at_once else _PART
        stopping = Event()

        def parts() -> list[Chunk]:
            starts = range(start, stop, rows)
            return [
                compute_chunk(job.request, first, min(first + rows, stop), __version__)
                for first in starts
                if not stopping.is_set()
            ]

        async with self._turn:
            try:
                return await to_thread.run_sync(parts, abandon_on_cancel=True)
            finally:
                stopping.set()


def seconds_of(request: SweepRequest, enough: float) -> float:
    """Return about how many seconds of a processor a sweep takes, from problems spread over it;
    beyond ``enough`` any number.

    Costs what those problems cost, of which none is begun after so many seconds.
    """
    rows = min(request.total, _TOGETHER if request.tori_at_once else _SINGLE)
    # what is loaded and compiled at first is needed in any case
    compute_chunk(request.canonical, 0, 1, __version__)
    found = math.inf
    for _ in range(2):  # where memory is cleaned up meanwhile, that takes longer than the problems
        began = time.thread_time()
        for start in (0, (request.total - rows) // 2, request.total - rows):
            compute_chunk(request.canonical, start, start + rows, __version__)
            passed = time.thread_time() - began
            if passed > enough:
                return passed
        found = min(found, passed / (3 * rows) * request.total)
        if found < enough:
            break
    return found
