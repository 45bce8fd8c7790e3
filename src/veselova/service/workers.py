"""Killable work: every computation runs in a worker process of bounded memory that is ended when its budget is used up."""

from __future__ import annotations

import logging
import math
import os
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, TypeVar

import anyio
from anyio import BrokenWorkerProcess, CapacityLimiter, CapacityLimiterStatistics, to_process
from anyio.abc import TaskGroup

from veselova.service.metrics import Metrics
from veselova.service.problem_details import Refused
from veselova.service.settings import MEGABYTE, Settings
from veselova.service.tasks import warm_up

__all__ = ["Workers"]

_LOG = logging.getLogger("veselova.service")

#: Seconds before a killed worker is replaced: a server that ends kills all of them at once, and nothing is to start then.
_SETTLED_S = 0.1

#: Seconds between two tries to start a worker: doubled from the first to the last.
_FIRST_PAUSE_S = 1.0
_LONGEST_PAUSE_S = 30.0

T = TypeVar("T")


class Workers:
    """The worker processes of one server. Threads, and pools of the standard library, go on burning after a timeout."""

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self._metrics = metrics
        self._limiter = CapacityLimiter(settings.workers)
        self._max_waiting = settings.max_waiting
        self._memory_mb = settings.worker_memory_mb
        self._processes: set[int] = set()
        self._tasks: TaskGroup | None = None
        self._starting = False
        metrics.gauge("veselova_workers", "Worker processes that may run", lambda: self.load.total_tokens)
        metrics.gauge("veselova_workers_busy", "Worker processes at work", self._busy)
        metrics.gauge("veselova_queue_length", "Requests that wait for a worker", lambda: self.load.tasks_waiting)

    @property
    def load(self) -> CapacityLimiterStatistics:
        """Return how many workers there may be, how many are at work, and how many requests wait for one."""
        return self._limiter.statistics()

    def _busy(self) -> int:
        """Return how many workers are at work for requests: one that is being started is not."""
        return max(0, self.load.borrowed_tokens - self._starting)

    def ready(self) -> bool:
        """Return whether there is a warm worker, one that has answered before; where there is none, one is started."""
        warm = self._warm() > 0
        if not warm:
            self._replace()
        return warm

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Start a worker with both engines loaded, and another whenever none is left for the next request, within the context."""
        async with anyio.create_task_group() as tasks:
            self._tasks = tasks
            self._replace(0)
            try:
                yield
            finally:
                self._tasks = None
                tasks.cancel_scope.cancel()

    async def run(self, task: Callable[..., T], *arguments: Any, budget_s: float) -> T:
        """Return what a task gives within the budget, waiting for a worker included.

        Raises Refused: ``overloaded`` when too many requests wait, ``over-budget`` when time is up (the process is killed),
        ``worker-memory`` when the task needs more of it, ``worker-lost`` when the process died. What the engines raise comes
        through.
        """
        load = self.load
        # A request may wait for the worker that is just being started besides.
        if load.borrowed_tokens >= load.total_tokens and load.tasks_waiting >= self._max_waiting + self._starting:
            raise Refused("overloaded", f"{self._max_waiting} requests are waiting for a worker; try again later.", retry_after=2)
        try:
            return await self._answer(task, *arguments, budget_s=budget_s)
        except BaseException:  # among them the cancellation of a request whose client has gone, which kills its worker
            self._replace()
            raise

    async def _answer(self, task: Callable[..., T], *arguments: Any, budget_s: float) -> T:
        work: tuple[Any, ...] = (_with_process, self._memory_mb, task, *arguments)
        answer: T
        try:
            with anyio.fail_after(budget_s):
                process, answer = await to_process.run_sync(*work, cancellable=True, limiter=self._limiter)
        except TimeoutError:
            raise Refused("over-budget", f"The work was stopped after its budget of {budget_s:g} s.") from None
        except (BrokenWorkerProcess, KeyboardInterrupt):  # interrupted: only where another command serves
            raise Refused("worker-lost", "The worker process ended before it answered; try again.", retry_after=1) from None
        self._processes.add(process)
        return answer

    def _warm(self) -> int:
        """Return how many workers have answered before and live."""
        self._processes = set(filter(_lives, self._processes))
        return len(self._processes)

    def _replace(self, pause_s: float = _SETTLED_S) -> None:
        """Start a worker in the background, unless one is idle, or all are at work, or requests wait, which start their own."""
        load = self.load
        room = load.borrowed_tokens < load.total_tokens and not load.tasks_waiting
        if self._tasks is not None and room and not self._starting and self._warm() <= load.borrowed_tokens:
            self._starting = True
            self._tasks.start_soon(self._start, pause_s)

    async def _start(self, pause_s: float) -> None:
        """Load both engines in a worker, trying for as long as it takes."""
        try:
            while True:
                await anyio.sleep(pause_s)
                try:
                    return await self._answer(warm_up, budget_s=math.inf)
                except Refused as error:
                    _LOG.error("a worker could not be started: %s", error)
                except Exception:
                    _LOG.exception("a worker could not be started")
                pause_s = min(max(2 * pause_s, _FIRST_PAUSE_S), _LONGEST_PAUSE_S)
        finally:
            self._starting = False


def _lives(process: int) -> bool:
    """Return whether a process that this one has started lives still."""
    if os.name != "posix":  # asking would end it
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def _with_process(megabytes: int, task: Callable[..., T], *arguments: Any) -> tuple[int, T]:
    """Return this process and what a task gives in it."""
    return os.getpid(), _within_memory(megabytes, task, *arguments)


def _within_memory(megabytes: int, task: Callable[..., T], *arguments: Any) -> T:
    """Return what a task gives in this process, whose memory is limited; raises Refused where it does not suffice."""
    try:
        import resource
    except ImportError:  # not a POSIX system: the limit of its container is what there is
        return task(*arguments)
    # Arrow's own allocator reserves a gigabyte, used or not, which would count.
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
    # On Linux RLIMIT_DATA counts what a process writes to, and not the libraries that it maps, as RLIMIT_AS would.
    kind = resource.RLIMIT_DATA if sys.platform == "linux" else resource.RLIMIT_AS
    hard = resource.getrlimit(kind)[1]
    limit = megabytes * MEGABYTE
    resource.setrlimit(kind, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))
    try:
        return task(*arguments)
    except MemoryError:
        detail = f"The work needs more than the {megabytes} MB of memory that a worker of this server has; ask for fewer times."
        raise Refused("worker-memory", detail) from None
