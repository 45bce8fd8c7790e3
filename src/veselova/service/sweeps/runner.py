"""Running jobs: chunks go to an executor (processes of this machine, a Dask cluster, or this
process), and their answers are stored at once."""

from __future__ import annotations

import itertools
import logging
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from queue import SimpleQueue
from threading import Event, Lock, Thread
from typing import Any

from pebble import ProcessExpired

from veselova.mechanics.core.errors import BackendMissing, install_extra, needs
from veselova.service.access.database import OUTAGES, public_reason, reason_of
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.sweeps.chunk import OtherVersion, compute_chunk, lost_chunk
from veselova.service.sweeps.job_store import Job, JobEnded, Jobs
from veselova.service.sweeps.result_files import finish
from veselova.service.workers.processes import Processes
from veselova.version import __version__

_LOG = logging.getLogger("veselova.sweeps")

#: Seconds before a job that met with an outage goes on: doubled from the first to the last.
_FIRST_PAUSE_S = 0.5
_LONGEST_PAUSE_S = 30.0

#: Seconds between two polls for jobs that no server runs, and two renewals of the claims to jobs.
_WATCH_S = 2.0

#: Jobs that share the workers; others wait.
_MOST_RUNNING = 4

#: Interactive requests go before the sweeps of a server where both want the processors: three times
#: as much of them.
_NICENESS = 5

#: Failures of a job that say themselves what is wrong.
_NAMED = (ConnectionError, OtherVersion, BackendMissing)


@dataclass
class Progress:
    """The progress of a job in this process: problems done before and since it took the job, and
    what it waits for, if anything. ``events`` are answers, or None to stop the job.
    """

    job_id: str
    report: Callable[[int, int], object] | None = None
    began: float | None = None
    before: int = 0
    done: int = 0
    waits_for: str = ""
    claimed: bool = False
    events: SimpleQueue[Future[bytes] | None] = field(default_factory=SimpleQueue)
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
        self, settings: Settings, jobs: Jobs, processes: bool = True, serving: bool = True
    ) -> None:
        """``processes``: whether others than this compute. ``serving``: whether jobs that another
        process left unfinished are taken up, old ones removed, and lost workers waited for.
        """
        self.jobs = jobs
        self._settings = settings
        self._serving = serving
        self._running: dict[str, Progress] = {}
        self._threads = ThreadPoolExecutor(_MOST_RUNNING, "job")
        sizes = settings.sweep_workers, settings.worker_memory_mb, _NICENESS * serving
        self._pool = Processes(*sizes) if processes else None
        self._submitting = Lock()
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
        if self._pool is not None:
            self._pool.close().join()

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
        """Return the progress of a job that runs in this process."""
        found = self._running.get(job_id)
        return found if found and found.began is not None else None

    def _watch(self) -> None:
        """Renew the claims to jobs, and stop those that other processes have ended; take up what
        others leave unfinished, and forget what ended long ago.
        """
        while not self._closing.is_set():
            try:
                for progress in list(self._running.values()):
                    if progress.claimed and not self.jobs.claim(progress.job_id):
                        progress.stop()
                if self._serving:
                    for job_id in self.jobs.unfinished():
                        self.begin(job_id)
                    self.jobs.remove_old()
            except OUTAGES as error:
                _LOG.warning("the jobs could not be read: %s", reason_of(error))
            self._closing.wait(_WATCH_S)

    def _run(self, progress: Progress) -> None:
        job_id = progress.job_id
        try:
            for attempt in itertools.count():
                try:
                    if not progress.stopping.is_set() and self.jobs.claim(job_id):
                        progress.claimed = True
                        self._attempt(progress)
                    return
                except OUTAGES as error:
                    if isinstance(error, ConnectionError) and not self._serving:
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
                with suppress(*OUTAGES):  # the claim ends by itself
                    self.jobs.release(job_id)
            del self._running[job_id]
            progress.ended.set()

    def _pause(self, progress: Progress, error: Exception, attempt: int) -> None:
        """Wait for the storage or the workers, and say so; what is stored is not computed again."""
        awaited = "its workers" if isinstance(error, ConnectionError) else "its storage"
        _LOG.warning("job %s waits for %s: %s", progress.job_id, awaited, reason_of(error))
        progress.waits_for = f"{awaited} ({public_reason(error)})"
        pause = min(_FIRST_PAUSE_S * 2 ** min(attempt, 10), _LONGEST_PAUSE_S)
        progress.stopping.wait(pause)

    def _fail(self, job_id: str, detail: str) -> None:
        try:
            self.jobs.advance(job_id, "failed", detail)
        except OUTAGES as outage:
            _LOG.warning("job %s could not be ended: %s", job_id, reason_of(outage))

    def _attempt(self, progress: Progress) -> None:
        """Run a claimed job to its end. Raises ConnectionError when its workers are lost, and what
        the store and ``answer`` raise.
        """
        job = self.jobs.get(progress.job_id)
        missing = self.jobs.missing(job)
        progress.done = job.total - sum(stop - start for start, stop in missing)
        progress.began, progress.before, progress.waits_for = time.monotonic(), progress.done, ""
        if not self.jobs.advance(job.id, "running"):
            return
        if missing:
            self._compute(progress, job, deque(missing))
        finish(self.jobs, job)
        self.jobs.advance(job.id, "finished")

    def _compute(self, progress: Progress, job: Job, todo: deque[tuple[int, int]]) -> None:
        """Compute and store problems (start, stop). Those over which a worker dies are computed one
        by one, to find out over which. Raises JobEnded where the job is to stop.
        """
        waiting: dict[Future[bytes], tuple[int, int]] = {}
        with open_executor(self._settings, self._pool) as (executor, room):
            try:
                while todo or waiting:
                    while todo and len(waiting) < room:
                        rows = todo.popleft()
                        with self._submitting:  # the pool of processes is not for several threads
                            future = executor.submit(compute_chunk, job.request, *rows, __version__)
                        waiting[future] = rows
                        future.add_done_callback(progress.events.put)
                    if (done := progress.events.get()) is None:
                        raise JobEnded("it is to stop")
                    if done not in waiting:  # it was cancelled by an earlier attempt
                        continue
                    start, stop = waiting.pop(done)
                    table = answer(done)
                    if table is None and stop - start > 1:
                        todo.extendleft((row, row + 1) for row in reversed(range(start, stop)))
                        continue
                    self.jobs.store(job, start, stop, table or lost_chunk(job.sweep, start))
                    progress.done += stop - start
                    if progress.report:
                        progress.report(progress.done, job.total)
            finally:
                for future in waiting:
                    future.cancel()


#: Seconds for a connection to the scheduler.
_CONNECT_S = 30


@contextmanager
def open_executor(settings: Settings, pool: Processes | None) -> Iterator[tuple[Any, int]]:
    """Give an executor, and how many chunks of a job it is to have at a time: a Dask cluster where
    the settings name its scheduler, else the processes of a pool, or this process alone.

    Raises ConnectionError where the scheduler cannot be reached, BackendMissing without Dask.
    """
    if settings.dask_scheduler:
        with _connect(settings.dask_scheduler) as client:
            chunks = 2 * max(sum(client.nthreads().values()), settings.sweep_workers)
            yield client.get_executor(pure=False), chunks
    elif pool is not None:
        yield pool, settings.sweep_workers + 1
    else:
        yield _ThisProcess(), 1


def _connect(address: str) -> Any:
    """Return a client of a scheduler, with the certificates that Dask's own settings name."""
    with needs("distributed", "A cluster", install_extra("sweeps")):
        from distributed import Client
    # What goes wrong comes back as an exception.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, TypeError) as error:  # the latter for tls:// without certificates
        raise ConnectionError(f"the scheduler cannot be reached: {error}") from error


class _ThisProcess:
    """Computes in the thread that asks, so that an interrupt ends the computation too."""

    def submit(self, task: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Return the future of a task, which is done."""
        future: Future[Any] = Future()
        try:
            future.set_result(task(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future


def answer(future: Future[bytes]) -> bytes | None:
    """Return the table of a future that is done, None where the worker died over it.

    Raises ConnectionError where the executor is lost, and what ``compute_chunk`` raises.
    """
    killed = getattr(sys.modules.get("distributed.scheduler"), "KilledWorker", ProcessExpired)
    try:
        return future.result()
    except (ProcessExpired, killed, MemoryError):
        return None
    except (BrokenExecutor, CancelledError, OSError) as error:
        raise ConnectionError(f"the workers are lost: {error!r}") from error
