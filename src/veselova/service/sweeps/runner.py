"""The running of jobs: chunks go to the cluster, and what comes back is stored at once and never
computed again.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Callable
from contextlib import AsyncExitStack, suppress
from datetime import UTC, datetime
from typing import Any, TypeVar

import anyio
from sqlalchemy.exc import SQLAlchemyError

from veselova.service.access.database import is_outage, public_reason, reason_of
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.sweeps.chunk import OtherVersion
from veselova.service.sweeps.chunk_dispatch import ChunkFailed, answers
from veselova.service.sweeps.cluster import open_cluster
from veselova.service.sweeps.job_store import Job, JobEnded, Jobs
from veselova.service.sweeps.progress import Progress
from veselova.service.sweeps.result_files import Result

__all__ = ["Progress", "Sweeps"]

_LOG = logging.getLogger("veselova.sweeps")

#: Chunks of one job that are with the cluster at a time, per worker: one at work and one at hand.
_AHEAD = 2

#: Seconds between two tries to store, or to reach the cluster: doubled from the first to the last.
_FIRST_PAUSE_S = 0.5
_LONGEST_PAUSE_S = 30.0

#: Seconds between two polls of the cluster for its workers, and two renewals of a claim to a job.
_LOOK_S = 2.0

#: What a job waits for while the cluster has none.
_NO_WORKER = "a worker of the cluster"

#: Seconds between two polls for jobs that no server runs.
_WATCH_S = 2.0

#: Calls of the store at a time. Where it does not answer, threads of others than these are free.
_THREADS = 40

#: Seconds between two removals of old jobs.
_TIDY_S = 3600.0

T = TypeVar("T")


#: Jobs that share the workers; others wait.
_MOST_RUNNING = 4


class _NoCluster(Exception):
    """No cluster could be opened, or kept, as often as was to be tried."""


class Sweeps:
    """Runs the jobs of a store, each under a claim that its process renews."""

    def __init__(
        self,
        settings: Settings,
        jobs: Jobs,
        processes: bool = True,
        niceness: int = 0,
        tries: int | None = None,
    ) -> None:
        """``tries``: how often a job asks for a cluster before it fails; for ever when left out."""
        self.jobs = jobs
        self._niceness = niceness
        self._tries = tries
        self._settings = settings
        self._processes = processes
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._again: set[str] = set()
        self._progress: dict[str, Progress] = {}
        self._changed = asyncio.Condition()
        self._threads = anyio.CapacityLimiter(_THREADS)
        self._turns = asyncio.Semaphore(_MOST_RUNNING)
        self._opening = asyncio.Lock()
        self._stack = AsyncExitStack()
        self._cluster: Any = None
        self._closing = False

    async def close(self) -> None:
        """Stop what runs; what is unfinished stays so, to be resumed."""
        self._closing = True
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self._close_cluster(self._cluster)

    async def resume(self) -> None:
        """Begin every job that another process left unfinished."""
        for job_id in await anyio.to_thread.run_sync(self.jobs.unfinished):
            if job_id not in self._tasks:
                self.begin(job_id)

    async def watch(self) -> None:
        """Take up, for ever, what another server begins or leaves unfinished, and forget what ended
        long ago.
        """
        tidied = -math.inf
        while True:
            try:
                await self.resume()
                if time.monotonic() - tidied > _TIDY_S:
                    tidied = time.monotonic()
                    if removed := await anyio.to_thread.run_sync(
                        self.jobs.remove_old, datetime.now(UTC)
                    ):
                        _LOG.info("%d jobs that ended long ago were removed", removed)
            except (OSError, SQLAlchemyError) as error:
                _LOG.warning("the jobs could not be read: %s", reason_of(error))
            await asyncio.sleep(_WATCH_S)

    def begin(self, job_id: str) -> None:
        """Run a job; one that runs already is looked at again at its end, for it may be stopping
        just now.
        """
        if job_id in self._tasks:
            self._again.add(job_id)
            return
        task = self._tasks[job_id] = asyncio.create_task(self._run(job_id), name=f"job {job_id}")
        task.add_done_callback(lambda _: self._left(job_id))

    def _left(self, job_id: str) -> None:
        del self._tasks[job_id]
        if job_id in self._again and not self._closing:
            self._again.remove(job_id)
            self.begin(job_id)

    async def cancel(self, job_id: str) -> None:
        """Stop a job; its finished chunks stay."""
        await anyio.to_thread.run_sync(
            self.jobs.advance, job_id, "cancelled", limiter=self._threads
        )
        if task := self._tasks.get(job_id):
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        await self._tell()

    async def wait_ended(self, job_id: str) -> None:
        """Return when nothing runs for a job any more."""
        if task := self._tasks.get(job_id):
            await asyncio.gather(task, return_exceptions=True)

    def progress(self, job_id: str) -> Progress | None:
        """Return how far a job is that runs in this process."""
        return self._progress.get(job_id)

    async def wait_changed(self, timeout: float) -> None:
        """Return when any job has moved on, or after so many seconds."""
        try:
            async with asyncio.timeout(timeout), self._changed:
                await self._changed.wait()
        except TimeoutError:
            return

    async def _tell(self) -> None:
        async with self._changed:
            self._changed.notify_all()

    async def _run(self, job_id: str) -> None:
        holding = None
        try:
            async with self._turns:
                if not await self._persist(job_id, self.jobs.claim, job_id):
                    return
                holding = asyncio.create_task(self._hold(job_id))
                await self._run_claimed(job_id)
        except asyncio.CancelledError:
            raise
        except (_NoCluster, ChunkFailed, OtherVersion) as error:
            await self._persist(job_id, self.jobs.advance, job_id, "failed", str(error))
        except (JobEnded, Refused) as error:  # another has removed it
            _LOG.info("job %s is given up: %s", job_id, error)
        except Exception:
            _LOG.exception("job %s failed", job_id)
            await self._persist(
                job_id,
                self.jobs.advance,
                job_id,
                "failed",
                "an unexpected error; it has been logged",
            )
        finally:
            self._progress.pop(job_id, None)
            if holding is not None:
                holding.cancel()
                await asyncio.gather(holding, return_exceptions=True)
                with suppress(OSError, SQLAlchemyError):  # the claim ends by itself
                    await anyio.to_thread.run_sync(self.jobs.release, job_id)
            await self._tell()

    async def _hold(self, job_id: str) -> None:
        """Renew the claim to a job; stop the job where another process has ended it, or runs it."""
        held = True
        while held:
            await asyncio.sleep(_LOOK_S)
            with suppress(OSError, SQLAlchemyError):
                held = await anyio.to_thread.run_sync(
                    self.jobs.claim, job_id, limiter=self._threads
                )
        _LOG.info("job %s has ended, or runs in another process", job_id)
        self._tasks[job_id].cancel()

    async def _run_claimed(self, job_id: str) -> None:
        job = await self._persist(job_id, self.jobs.get, job_id)
        missing = await self._persist(job_id, self.jobs.missing, job)
        done = job.total - sum(stop - start for start, stop in map(job.rows, missing))
        self._progress[job_id] = Progress(time.monotonic(), done, done)
        if not await self._persist(job_id, self.jobs.advance, job_id, "running"):
            return
        result = Result(self.jobs, job)
        pause = _FIRST_PAUSE_S
        tries = 0
        while missing:
            client = None
            tries = tries + 1
            try:
                client = await self._open_cluster()
                await self._compute(client, job, result, missing)
            except (OSError, TimeoutError) as error:
                # The scheduler cannot be reached, or was lost with what it had.
                self._progress[job_id].waits_for = f"the cluster ({public_reason(error)})"
                _LOG.warning("job %s waits for the cluster: %s", job_id, error)
                await self._close_cluster(client)
                if tries == self._tries:
                    raise _NoCluster(str(error)) from None
                await asyncio.sleep(pause)
                pause = min(2 * pause, _LONGEST_PAUSE_S)
            missing = await self._persist(job_id, self.jobs.missing, job)
        await self._persist(job_id, result.finish)
        await self._persist(job_id, self.jobs.advance, job_id, "finished")

    async def _compute(self, client: Any, job: Job, result: Result, missing: list[int]) -> None:
        """Send the missing chunks to the cluster, a few ahead, and store what comes back. Raises
        OSError when it is lost.
        """
        waiting = list(reversed(missing))
        at_work = set[asyncio.Task[None]]()
        try:
            while waiting or at_work:
                # A worker that died is missing for a moment; the others, or its successor, go on.
                workers = len(await client.nthreads())
                progress = self._progress[job.id]
                if not workers or progress.waits_for == _NO_WORKER:
                    progress.waits_for = "" if workers else _NO_WORKER
                room = _AHEAD * max(1, workers) - len(at_work)
                for _ in range(min(room, len(waiting))):
                    at_work.add(
                        asyncio.create_task(self._chunk(client, job, result, waiting.pop()))
                    )
                finished, at_work = await asyncio.wait(
                    at_work, timeout=_LOOK_S, return_when=asyncio.FIRST_COMPLETED
                )
                if failures := [error for task in finished if (error := task.exception())]:
                    raise failures[0]
        finally:
            for task in at_work:
                task.cancel()
            await asyncio.gather(*at_work, return_exceptions=True)

    async def _chunk(self, client: Any, job: Job, result: Result, position: int) -> None:
        start, stop = job.rows(position)
        parts = await answers(client, job, start, stop, lambda: self._closing)
        await self._persist(job.id, result.store, position, parts)
        progress = self._progress[job.id]
        progress.done += stop - start
        await self._tell()

    async def _open_cluster(self) -> Any:
        async with self._opening:
            if self._cluster is None:
                self._cluster = await self._stack.enter_async_context(
                    open_cluster(self._settings, self._processes, self._niceness)
                )
            return self._cluster

    async def _close_cluster(self, lost: Any) -> None:
        """Close the cluster, unless another job has replaced the lost one already."""
        async with self._opening:
            if self._cluster is not lost:
                return
            self._cluster = None
            try:
                await self._stack.aclose()
            except (OSError, TimeoutError, RuntimeError):
                _LOG.warning("the cluster did not close in order", exc_info=True)

    async def _persist(self, job_id: str, call: Callable[..., T], *arguments: Any) -> T:
        """Return what a call that stores or reads gives, trying again for as long as the disk or
        the database refuse.

        A cancellation waits for the call, whose thread would go on behind it.
        """
        pause = _FIRST_PAUSE_S
        while True:
            calling = asyncio.ensure_future(
                anyio.to_thread.run_sync(call, *arguments, limiter=self._threads)
            )
            try:
                answer = await asyncio.shield(calling)
            except asyncio.CancelledError:
                await asyncio.gather(calling, return_exceptions=True)
                raise
            except (OSError, SQLAlchemyError) as error:
                if not is_outage(error):
                    raise
                reason = reason_of(error)
                _LOG.warning("job %s waits for its storage: %s", job_id, reason)
                if progress := self._progress.get(job_id):
                    progress.waits_for = f"its storage ({public_reason(error)})"
                await self._tell()
                await asyncio.sleep(pause)
                pause = min(2 * pause, _LONGEST_PAUSE_S)
            else:
                if progress := self._progress.get(job_id):
                    progress.waits_for = ""
                return answer
