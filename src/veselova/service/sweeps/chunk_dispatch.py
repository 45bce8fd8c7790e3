"""One chunk of a sweep on the cluster: sent, waited for, stopped when nobody waits, taken apart
when it ends its worker.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import CancelledError as FutureCancelled
from contextlib import suppress
from typing import Any
from uuid import uuid4

from veselova.service.access.database import public_reason
from veselova.service.sweeps.chunk import Chunk, compute_chunk, lost_chunk
from veselova.service.sweeps.in_process_cluster import ThisProcess
from veselova.service.sweeps.job_store import Job
from veselova.version import __version__

__all__ = ["ChunkFailed", "answers"]

#: Seconds between two looks at a worker that has not heard yet that work was cancelled.
_LOOK_AGAIN_S = 0.02

#: Seconds after which workers that held cancelled work are ended, whatever they say of it, and then
#: are waited for no more.
_PATIENCE_S = 10

#: Seconds that Dask gives a worker to end by itself, which one at work never does, before it kills
#: it.
_GRACE_S = 0.5


class ChunkFailed(Exception):
    """A worker could not give the answers to some problems, for a reason of its machine: no room on
    its disk, say.
    """


async def answers(
    client: Any, job: Job, start: int, stop: int, closing: Callable[[], bool]
) -> list[Chunk]:
    """Return the answers to some problems; where their worker dies over them, one by one, to find
    out over which.

    ``closing`` says, when the wait is cancelled, whether the workers end with their cluster anyway.
    Raises OSError where the cluster is lost, ChunkFailed where its worker met with one,
    OtherVersion where it is not of the same version.
    """
    if isinstance(client, ThisProcess):
        return await client.compute(job, start, stop)
    from distributed.scheduler import KilledWorker

    key = f"computed_chunk-{job.id}-{uuid4().hex}"
    future = client.submit(compute_chunk, job.request, start, stop, __version__, key=key)
    try:
        return [await future]
    except KilledWorker:
        if stop - start == 1:
            return [lost_chunk(job.sweep, start)]
        return [
            part
            for row in range(start, stop)
            for part in await answers(client, job, row, row + 1, closing)
        ]
    except FutureCancelled as error:
        raise ConnectionError(f"the cluster dropped the work: {error}") from None
    except OSError as error:
        if future.status != "error":  # it is the way to the scheduler that failed
            raise
        raise ChunkFailed(
            f"a worker could not compute the problems {start} to {stop - 1}: {public_reason(error)}"
        ) from error
    except asyncio.CancelledError:
        if not closing():
            await _stop(client, job, future)
        raise
    finally:
        future.release()


async def _stop(client: Any, job: Job, future: Any) -> None:
    """End work that nobody waits for: a worker that is in the midst of it is ended, for a thread
    cannot be stopped.
    """
    processing = {
        worker: [str(key) for key in keys] for worker, keys in (await client.processing()).items()
    }
    held = [worker for worker, keys in processing.items() if future.key in keys]
    await future.cancel(force=True)
    # All work of a job ends at once. A worker that has no other need not be asked, which takes
    # seconds where it is busy.
    shared = [worker for worker in held if any(job.id not in key for key in processing[worker])]
    running = [worker for worker in held if worker not in shared]
    try:
        async with asyncio.timeout(_PATIENCE_S):
            running += await _at_work(client, future.key, shared)
    except TimeoutError:  # some worker does not say how far it is
        running = held
    await asyncio.gather(*(_end(client, worker) for worker in running))


async def _end(client: Any, worker: str) -> None:
    """End the process of a worker; its nanny starts another, for which nobody waits. What has ended
    already is left alone.
    """
    with suppress(KeyError, TimeoutError):  # it has ended by itself; its nanny does not answer
        async with asyncio.timeout(_PATIENCE_S):
            await client.run(_kill, _GRACE_S, workers=[worker], nanny=True, on_error="ignore")


async def _kill(grace_s: float, dask_worker: Any) -> None:
    """End the worker of a nanny, as Dask calls it on the nanny."""
    await dask_worker.kill(timeout=grace_s)


async def _at_work(client: Any, key: Any, workers: list[str]) -> list[str]:
    """Return which of the workers are in the midst of cancelled work; those that only have it in
    their queue let go of it.
    """
    running: list[str] = []
    while workers:
        stages = await client.run(_stage, key, workers=workers, on_error="ignore")
        running += [worker for worker, stage in stages.items() if stage == "running"]
        workers = [worker for worker, stage in stages.items() if stage == "waiting"]
        if workers:  # the word that the work was cancelled is on its way
            await asyncio.sleep(_LOOK_AGAIN_S)
    return running


def _stage(key: Any, dask_worker: Any) -> str:
    """Return how far a worker is with some work, as Dask calls it on the worker."""
    if key in dask_worker.active_keys:
        return "running"
    return "waiting" if key in dask_worker.state.tasks else "gone"
