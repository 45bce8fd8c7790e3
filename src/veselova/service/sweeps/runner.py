"""The running of jobs: chunks go to an executor, and what comes back is stored at once and never
computed again.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import math
import time
from collections.abc import Callable
from contextlib import AsyncExitStack, suppress
from datetime import UTC, datetime
from typing import Any, TypeVar

import anyio
from sqlalchemy.exc import SQLAlchemyError

from veselova.mechanics.core.errors import BackendMissing
from veselova.service.access.database import is_outage, public_reason, reason_of
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.sweeps.chunk import OtherVersion
from veselova.service.sweeps.executors import ChunkFailed, answers, open_executor
from veselova.service.sweeps.job_store import Job, JobEnded, Jobs
from veselova.service.sweeps.progress import Progress
from veselova.service.sweeps.result_files import Result

__all__ = ["Progress", "Sweeps"]

_LOG = logging.getLogger("veselova.sweeps")

#: Seconds before a job that met with an outage goes on: doubled from the first to the last.
_FIRST_PAUSE_S = 0.5
_LONGEST_PAUSE_S = 30.0

#: Seconds between two polls for jobs that no server runs, and two renewals of a claim to a job.
_WATCH_S = 2.0

#: Calls of the store at a time. Where it does not answer, threads of others than these are free.
_THREADS = 40

#: Seconds between two removals of old jobs.
_TIDY_S = 3600.0

#: Jobs that share the workers; others wait.
_MOST_RUNNING = 4

T = TypeVar("T")


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
        """``tries``: attempts at a job whose workers are lost; any number when left out."""
        self.jobs = jobs
        self._niceness = niceness
        self._tries = tries or math.inf
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
        self._executor: Any = None
        self._free = asyncio.Semaphore()
        self._closing = False

    async def close(self) -> None:
        """Stop what runs; what is unfinished stays so, to be resumed."""
        self._closing = True
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self._close_executor(self._executor)

    async def resume(self) -> None:
        """Begin every job that another process left unfinished."""
        for job_id in await self._call(self.jobs.unfinished):
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
                    if removed := await self._call(self.jobs.remove_old, datetime.now(UTC)):
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
        await self._call(self.jobs.advance, job_id, "cancelled")
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
                for attempt in itertools.count(1):
                    try:
                        if holding is None:
                            if not await self._call(self.jobs.claim, job_id):
                                return None
                            holding = asyncio.create_task(self._hold(job_id))
                        return await self._attempt(job_id)
                    except (OSError, SQLAlchemyError) as error:
                        given_up = attempt >= self._tries and isinstance(error, ConnectionError)
                        if given_up or not is_outage(error):
                            raise
                        await self._pause(job_id, error, attempt)
        except (JobEnded, Refused) as error:  # another has removed it
            _LOG.info("job %s is given up: %s", job_id, error)
        except Exception as error:
            await self._fail(job_id, error)
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
            await asyncio.sleep(_WATCH_S)
            with suppress(OSError, SQLAlchemyError):
                held = await anyio.to_thread.run_sync(
                    self.jobs.claim, job_id, limiter=self._threads
                )
        _LOG.info("job %s has ended, or runs in another process", job_id)
        self._tasks[job_id].cancel()

    async def _pause(self, job_id: str, error: Exception, attempt: int) -> None:
        """Wait for the storage or the workers, and say so; what is stored is not computed again."""
        awaited = "its workers" if isinstance(error, ConnectionError) else "its storage"
        _LOG.warning("job %s waits for %s: %s", job_id, awaited, reason_of(error))
        if progress := self._progress.get(job_id):
            progress.waits_for = f"{awaited} ({public_reason(error)})"
        await self._tell()
        await asyncio.sleep(min(_FIRST_PAUSE_S * 2 ** min(attempt - 1, 10), _LONGEST_PAUSE_S))

    async def _fail(self, job_id: str, error: Exception) -> None:
        detail = "an unexpected error; it has been logged"
        if isinstance(error, (ConnectionError, ChunkFailed, OtherVersion, BackendMissing)):
            detail = str(error)
        else:
            _LOG.error("job %s failed", job_id, exc_info=error)
        try:
            await self._call(self.jobs.advance, job_id, "failed", detail)
        except (OSError, SQLAlchemyError) as outage:
            _LOG.warning("job %s could not be ended: %s", job_id, reason_of(outage))

    async def _attempt(self, job_id: str) -> None:
        """Run a claimed job to its end. Raises ConnectionError when its workers are lost, and what
        the store and ``answers`` raise.
        """
        job = await self._call(self.jobs.get, job_id)
        missing = await self._call(self.jobs.missing, job)
        done = job.total - sum(stop - start for start, stop in map(job.rows, missing))
        self._progress[job_id] = Progress(time.monotonic(), done, done)
        if not await self._call(self.jobs.advance, job_id, "running"):
            return
        result = Result(self.jobs, job)
        if missing:
            executor = await self._open_executor()
            try:
                await self._compute(executor, job, result, missing)
            except ConnectionError:
                await self._close_executor(executor)
                raise
        await self._call(result.finish)
        await self._call(self.jobs.advance, job_id, "finished")

    async def _compute(self, executor: Any, job: Job, result: Result, missing: list[int]) -> None:
        """Compute and store the missing chunks, few of all jobs at a time."""
        free = self._free

        async def compute(position: int) -> None:
            start, stop = job.rows(position)
            parts = await answers(executor, job, start, stop)
            await self._call(result.store, position, parts)
            self._progress[job.id].done += stop - start
            await self._tell()

        try:
            async with asyncio.TaskGroup() as group:
                for position in missing:
                    await free.acquire()
                    task = group.create_task(compute(position))
                    task.add_done_callback(lambda _: free.release())
        except ExceptionGroup as failures:
            raise failures.exceptions[0] from None

    async def _open_executor(self) -> Any:
        async with self._opening:
            if self._executor is None:
                opening = open_executor(self._settings, self._processes, self._niceness)
                self._executor, chunks = await self._stack.enter_async_context(opening)
                self._free = asyncio.Semaphore(chunks)
            return self._executor

    async def _close_executor(self, lost: Any) -> None:
        """Close the executor, unless another job has replaced the lost one already."""
        async with self._opening:
            if self._executor is lost:
                self._executor = None
                await self._stack.aclose()

    async def _call(self, call: Callable[..., T], *arguments: Any) -> T:
        """Return the result of a call of the store, in a thread, which a cancellation waits for."""
        calling = asyncio.ensure_future(
            anyio.to_thread.run_sync(call, *arguments, limiter=self._threads)
        )
        try:
            return await asyncio.shield(calling)
        except asyncio.CancelledError:
            await asyncio.gather(calling, return_exceptions=True)
            raise
