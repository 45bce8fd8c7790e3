"""The queue of requests before the worker processes."""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import AsyncIterator, Callable
from concurrent.futures import BrokenExecutor, Future
from contextlib import asynccontextmanager
from typing import Any, TypeVar

from pebble import ProcessExpired

from veselova.mechanics.core.errors import OverBudget
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.observability.metrics import Metrics
from veselova.service.workers.processes import Processes

_LOG = logging.getLogger("veselova.service")

T = TypeVar("T")


class Workers:
    """The worker processes of one server, and the bounded queue of requests for them."""

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self._processes = Processes(settings.workers, settings.worker_memory_mb)
        self._memory_mb = settings.worker_memory_mb
        self._free = asyncio.Semaphore(settings.workers)
        self._busy = 0
        self._waiting = 0
        self._max_waiting = settings.max_waiting
        self._warming: Future[int] | None = None
        metrics.gauge("veselova_workers_busy", "Worker processes at work", lambda: self._busy)
        metrics.gauge(
            "veselova_queue_length", "Requests that wait for a worker", lambda: self._waiting
        )

    def ready(self) -> bool:
        """Return whether a worker is warm; a pool that broke is started again."""
        if self._warming is None:
            return False
        if not self._processes.active:
            self._warming = self._processes.submit(os.getpid)
        return self._warming.done() and self._warming.exception() is None

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Start the workers, and kill them at the end of the context."""
        self._warming = self._processes.submit(os.getpid)
        try:
            yield
        finally:
            self._warming = None
            await asyncio.to_thread(self._processes.close().join)

    async def run(self, task: Callable[..., T], *arguments: Any, budget_s: float) -> T:
        """Return the result of a task within its budget, in seconds; waiting does not count.
        Cancelling the call kills its process.

        Raises Refused: ``overloaded`` when the queue is full, ``over-budget`` after the budget,
        ``worker-memory`` when the task needs more of it, ``worker-lost`` when its process died.
        Exceptions of the engines pass.
        """
        if self._free.locked() and self._waiting >= self._max_waiting:
            detail = f"{self._max_waiting} requests are waiting for a worker; try again later."
            raise Refused("overloaded", detail, retry_after=2)
        self._waiting += 1
        try:
            await self._free.acquire()
        finally:
            self._waiting -= 1
        self._busy += 1
        try:
            return await asyncio.wrap_future(
                self._processes.submit(task, *arguments, budget_s=budget_s)
            )
        except OverBudget:
            raise
        except TimeoutError:
            detail = f"The work was stopped after its budget of {budget_s:g} s."
            raise Refused("over-budget", detail) from None
        except (ProcessExpired, BrokenExecutor) as error:
            _LOG.warning("a worker process was lost: %s", error)
            detail = "The worker process ended before it answered; try again."
            raise Refused("worker-lost", detail) from None
        except MemoryError:
            detail = f"The work needs more than the {self._memory_mb} MB of a worker of this server"
            raise Refused("worker-memory", f"{detail}; ask for fewer times.") from None
        finally:
            self._busy -= 1
            self._free.release()
