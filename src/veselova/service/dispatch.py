"""One chunk of a sweep on the cluster: sent, waited for, stopped when nobody waits, taken apart when it ends its worker."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import CancelledError as FutureCancelled
from typing import Any

from veselova.service.jobs import Job
from veselova.service.summaries import Chunk, computed_chunk, lost_chunk
from veselova.version import __version__

__all__ = ["answers"]


async def answers(client: Any, job: Job, start: int, stop: int, closing: Callable[[], bool]) -> list[Chunk]:
    """Return the answers to some problems; where their worker dies over them, one by one, to find out over which.

    ``closing`` says, when the wait is cancelled, whether the workers end with their cluster anyway. Raises OSError where the
    cluster is lost, OtherVersion where it is not of the same version.
    """
    from distributed.scheduler import KilledWorker

    future = client.submit(computed_chunk, job.request, start, stop, __version__, pure=False)
    try:
        return [await future]
    except KilledWorker:
        if stop - start == 1:
            return [lost_chunk(job.sweep, start)]
        return [part for row in range(start, stop) for part in await answers(client, job, row, row + 1, closing)]
    except FutureCancelled as error:
        raise ConnectionError(f"the cluster dropped the work: {error}") from None
    except asyncio.CancelledError:
        if not closing():
            await _stop(client, future)
        raise
    finally:
        future.release()


async def _stop(client: Any, future: Any) -> None:
    """End work that nobody waits for: a worker that is in the midst of it is restarted, for a thread cannot be stopped."""
    if client.scheduler_info(n_workers=1)["address"].startswith("inproc"):
        return
    where = [worker for worker, keys in (await client.processing()).items() if str(future.key) in map(str, keys)]
    await future.cancel(force=True)
    if where:
        await client.restart_workers(where, raise_for_error=False)
