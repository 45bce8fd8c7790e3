"""Killable work: every computation runs in a worker process of bounded memory that is ended when its budget is used up."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
from typing import Any, TypeVar

import anyio
from anyio import BrokenWorkerProcess, CapacityLimiter, CapacityLimiterStatistics, to_process

from veselova.service.metrics import Metrics
from veselova.service.problem_details import Refused
from veselova.service.settings import MEGABYTE, Settings
from veselova.service.tasks import warm_up

__all__ = ["Workers"]

T = TypeVar("T")


class Workers:
    """The worker processes of one server. Threads, and pools of the standard library, go on burning after a timeout."""

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self._metrics = metrics
        self._limiter = CapacityLimiter(settings.workers)
        self._max_waiting = settings.max_waiting
        self._memory_mb = settings.worker_memory_mb
        self.warm = False
        metrics.gauge("veselova_workers", "Worker processes that may run", lambda: self.load.total_tokens)
        metrics.gauge("veselova_workers_busy", "Worker processes at work", lambda: self.load.borrowed_tokens)
        metrics.gauge("veselova_queue_length", "Requests that wait for a worker", lambda: self.load.tasks_waiting)

    @property
    def load(self) -> CapacityLimiterStatistics:
        """Return how many workers there may be, how many are at work, and how many requests wait for one."""
        return self._limiter.statistics()

    async def start(self) -> None:
        """Start one worker with both engines loaded."""
        await self.run(warm_up, budget_s=math.inf)
        self.warm = True

    async def run(self, task: Callable[..., T], *arguments: Any, budget_s: float) -> T:
        """Return what a task gives within the budget, waiting for a worker included.

        Raises Refused: ``overloaded`` when too many requests wait, ``over-budget`` when time is up (the process is killed),
        ``worker-memory`` when the task needs more of it, ``worker-lost`` when the process died. What the engines raise comes
        through.
        """
        load = self.load
        if load.borrowed_tokens >= load.total_tokens and load.tasks_waiting >= self._max_waiting:
            raise Refused("overloaded", f"{self._max_waiting} requests are waiting for a worker; try again later.", retry_after=2)
        work: tuple[Any, ...] = (_within_memory, self._memory_mb, task, *arguments)
        try:
            with anyio.fail_after(budget_s):
                return await to_process.run_sync(*work, cancellable=True, limiter=self._limiter)
        except TimeoutError:
            raise Refused("over-budget", f"The work was stopped after its budget of {budget_s:g} s.") from None
        except (BrokenWorkerProcess, KeyboardInterrupt):  # interrupted: only where another command serves
            raise Refused("worker-lost", "The worker process ended before it answered; try again.", retry_after=1) from None


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
