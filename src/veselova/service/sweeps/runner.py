"""The running of jobs: chunks go to an executor, and what comes back is stored at once and never
computed again.
"""

from __future__ import annotations

import itertools
import logging
import math
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from queue import SimpleQueue
from threading import Event, Lock, Thread
from typing import Any

from sqlalchemy.exc import SQLAlchemyError

from veselova.mechanics.core.errors import BackendMissing
from veselova.service.access.database import is_outage, public_reason, reason_of
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.sweeps.chunk import Chunk, OtherVersion, lost_chunk
from veselova.service.sweeps.executors import ChunkFailed, answer, open_executor, submit
from veselova.service.sweeps.job_store import Job, JobEnded, Jobs
from veselova.service.sweeps.result_files import Result

__all__ = ["Progress", "Sweeps"]

_LOG = logging.getLogger("veselova.sweeps")

#: Seconds before a job that met with an outage goes on: doubled from the first to the last.
_FIRST_PAUSE_S = 0.5
_LONGEST_PAUSE_S = 30.0

#: Seconds between two polls for jobs that no server runs, and two renewals of the claims to jobs.
_WATCH_S = 2.0

#: Seconds between two removals of old jobs.
_TIDY_S = 3600.0

#: Jobs that share the workers; others wait.
_MOST_RUNNING = 4

#: Attempts at a job whose workers are lost. A server goes on asking for them; elsewhere somebody
#: waits.
_TRIES = 3

#: Failures of a job that say themselves what is wrong.
_NAMED = (ConnectionError, ChunkFailed, OtherVersion, BackendMissing)

#: Deaths of workers over one chunk before its problems are tried one by one.
_DEATHS = 2


@dataclass
class Progress:
    """How far a job is that this process runs: problems done before the process took it, and since;
    what it waits for, if anything. ``events`` are answers, and None where the job is to stop.
    """

    job_id: str
    report: Callable[[int, int], object] | None = None
    began: float | None = None
    before: int = 0
    done: int = 0
    waits_for: str = ""
    claimed: bool = False
    events: SimpleQueue[Future[Chunk] | None] = field(default_factory=SimpleQueue)
    stopping: Event = field(default_factory=Event)
    ended: Event = field(default_factory=Event)

    @property
    def rate(self) -> float:
        """Return problems per second since this process took the job."""
        passed = 0.0 if self.began is None else time.monotonic() - self.began
        return (self.done - self.before) / passed if passed > 0 else 0.0

    def stop(self) -> None:
        """Ask the thread of the job to leave it."""
        self.stopping.set()
        self.events.put(None)


class Sweeps:
    """Runs the jobs of a store, each in a thread and under a claim that its process renews."""

    def __init__(
        self,
        settings: Settings,
        jobs: Jobs,
        processes: bool = True,
        niceness: int = 0,
        serving: bool = True,
    ) -> None:
        """``serving``: whether jobs that another process left unfinished are taken up, old ones
        removed, and lost workers waited for without end.
        """
        self.jobs = jobs
        self._settings = settings
        self._options = (processes, niceness)
        self._serving = serving
        self._running: dict[str, Progress] = {}
        self._threads = ThreadPoolExecutor(_MOST_RUNNING, "job")
        self._opening = Lock()
        self._stack = ExitStack()
        self._executor: Any = None
        self._room = 1
        self._closing = Event()
        self._watching = Thread(target=self._watch, daemon=True)
        self._watching.start()

    def close(self) -> None:
        """Stop what runs; what is unfinished stays so, to be resumed."""
        self._closing.set()
        self._watching.join()
        for progress in list(self._running.values()):
            progress.stop()
        self._threads.shutdown()
        self._close_executor(self._executor)

    def begin(self, job_id: str) -> None:
        """Run a job in a thread, unless this process runs it already."""
        progress = Progress(job_id)
        if self._running.setdefault(job_id, progress) is progress:
            self._threads.submit(self._run, progress)

    def run(self, job_id: str, report: Callable[[int, int], object]) -> None:
        """Run a job in this thread, unless another process has it; ``report`` is told the numbers
        of problems done and in all.
        """
        self._running[job_id] = Progress(job_id, report)
        self._run(self._running[job_id])

    def cancel(self, job_id: str) -> None:
        """Stop a job, and return when nothing runs for it any more; its finished chunks stay."""
        self.jobs.advance(job_id, "cancelled")
        if progress := self._running.get(job_id):
            progress.stop()
            if progress.claimed:  # another waits for its turn
                progress.ended.wait()

    def progress(self, job_id: str) -> Progress | None:
        """Return how far a job is that runs in this process."""
        found = self._running.get(job_id)
        return found if found and found.began is not None else None

    def _watch(self) -> None:
        """Renew the claims to jobs, and stop those that other processes have ended; take up what
        others leave unfinished, and forget what ended long ago.
        """
        tidied = -math.inf
        while not self._closing.is_set():
            try:
                for progress in list(self._running.values()):
                    if progress.claimed and not self.jobs.claim(progress.job_id):
                        progress.stop()
                if self._serving:
                    for job_id in self.jobs.unfinished():
                        self.begin(job_id)
                    if time.monotonic() - tidied > _TIDY_S:
                        tidied = time.monotonic()
                        if removed := self.jobs.remove_old(datetime.now(UTC)):
                            _LOG.info("%d jobs that ended long ago were removed", removed)
            except (OSError, SQLAlchemyError) as error:
                _LOG.warning("the jobs could not be read: %s", reason_of(error))
            self._closing.wait(_WATCH_S)

    def _run(self, progress: Progress) -> None:
        job_id = progress.job_id
        try:
            for attempt in itertools.count(1):
                try:
                    if progress.stopping.is_set() or not self.jobs.claim(job_id):
                        return
                    progress.claimed = True
                    self._attempt(progress)
                    return
                except (OSError, SQLAlchemyError) as error:
                    lost = isinstance(error, ConnectionError)
                    given_up = lost and not self._serving and attempt >= _TRIES
                    if given_up or not is_outage(error):
                        raise
                    self._pause(progress, error, attempt)
        except (JobEnded, Refused) as error:  # another has removed it
            _LOG.info("job %s is given up: %s", job_id, error)
        except _NAMED as error:
            self._fail(job_id, str(error))
        except Exception as error:
            # whoever waits for the job sees it; ``report`` may have raised it
            if not self._serving:
                raise
            _LOG.error("job %s failed", job_id, exc_info=error)
            self._fail(job_id, "an unexpected error; it has been logged")
        finally:
            claimed, progress.claimed = progress.claimed, False
            if claimed:
                with suppress(OSError, SQLAlchemyError):  # the claim ends by itself
                    self.jobs.release(job_id)
            del self._running[job_id]
            progress.ended.set()

    def _pause(self, progress: Progress, error: Exception, attempt: int) -> None:
        """Wait for the storage or the workers, and say so; what is stored is not computed again."""
        awaited = "its workers" if isinstance(error, ConnectionError) else "its storage"
        _LOG.warning("job %s waits for %s: %s", progress.job_id, awaited, reason_of(error))
        progress.waits_for = f"{awaited} ({public_reason(error)})"
        pause = min(_FIRST_PAUSE_S * 2 ** min(attempt - 1, 10), _LONGEST_PAUSE_S)
        progress.stopping.wait(pause)

    def _fail(self, job_id: str, detail: str) -> None:
        try:
            self.jobs.advance(job_id, "failed", detail)
        except (OSError, SQLAlchemyError) as outage:
            _LOG.warning("job %s could not be ended: %s", job_id, reason_of(outage))

    def _attempt(self, progress: Progress) -> None:
        """Run a claimed job to its end. Raises ConnectionError when its workers are lost, and what
        the store and ``answer`` raise.
        """
        job = self.jobs.get(progress.job_id)
        missing = self.jobs.missing(job)
        progress.done = job.total - sum(stop - start for start, stop in map(job.rows, missing))
        progress.began, progress.before, progress.waits_for = time.monotonic(), progress.done, ""
        if not self.jobs.advance(job.id, "running"):
            return
        result = Result(self.jobs, job)
        if missing:
            executor = self._open_executor()
            try:
                self._compute(executor, progress, job, result, missing)
            except ConnectionError:
                self._close_executor(executor)
                raise
        result.finish()
        self.jobs.advance(job.id, "finished")

    def _compute(
        self, executor: Any, progress: Progress, job: Job, result: Result, missing: Iterable[int]
    ) -> None:
        """Compute and store the missing chunks. One over which workers die is computed problem by
        problem, to find out over which. Raises JobEnded where the job is to stop.
        """
        todo = deque((*job.rows(position), 0) for position in missing)
        waiting: dict[Future[Chunk], tuple[int, int, int]] = {}
        parts = defaultdict[int, dict[int, Chunk]](dict)
        try:
            while todo or waiting:
                while todo and len(waiting) < self._room:
                    start, stop, deaths = todo.popleft()
                    with self._opening:  # the pool of processes is not for several threads
                        future = submit(executor, job.request, start, stop)
                    waiting[future] = (start, stop, deaths)
                    future.add_done_callback(progress.events.put)
                if (done := progress.events.get()) is None:
                    raise JobEnded("it is to stop")
                if done not in waiting:  # it was cancelled by an earlier attempt
                    continue
                start, stop, deaths = waiting.pop(done)
                chunk = answer(done, start, stop)
                if chunk is None and deaths + 1 < _DEATHS:
                    todo.appendleft((start, stop, deaths + 1))
                    continue
                if chunk is None and stop - start > 1:
                    todo.extendleft((row, row + 1, 0) for row in reversed(range(start, stop)))
                    continue
                position = start // job.chunk_rows
                found = parts[position]
                found[start] = chunk or lost_chunk(job.sweep, start)
                first, last = job.rows(position)
                if sum(part.rows for part in found.values()) == last - first:
                    result.store(position, [found[row] for row in sorted(found)])
                    del parts[position]
                    progress.done += last - first
                    if progress.report:
                        progress.report(progress.done, job.total)
        finally:
            for future in waiting:
                future.cancel()

    def _open_executor(self) -> Any:
        with self._opening:
            if self._executor is None:
                opening = open_executor(self._settings, *self._options)
                self._executor, self._room = self._stack.enter_context(opening)
            return self._executor

    def _close_executor(self, lost: Any) -> None:
        """Close the executor, unless another job has replaced the lost one already."""
        with self._opening:
            if self._executor is lost:
                self._executor = None
                self._stack.close()
