"""Killable work: every computation runs in a worker process of bounded memory that is ended when
its budget is used up.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, TypeVar

import anyio
from anyio.abc import TaskGroup

from veselova.mechanics.core.errors import OverBudget
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import MEGABYTE, Settings
from veselova.service.observability.metrics import Metrics
from veselova.service.workers.tasks import warm_up
from veselova.service.workers.worker import Worker, WorkerLost
from veselova.service.workers.worker_process import message

__all__ = ["Workers"]

_LOG = logging.getLogger("veselova.service")

#: Seconds before a killed worker is replaced: a server that ends kills all of them at once, and
#: nothing is to start then.
_SETTLED_S = 0.1

#: Seconds between two tries to start a worker: doubled from the first to the last.
_FIRST_PAUSE_S = 1.0
_LONGEST_PAUSE_S = 30.0

#: Seconds after which a worker that nobody needed is ended when another one is called.
_LONGEST_REST_S = 300.0

T = TypeVar("T")


class Workers:
    """The worker processes of one server. Threads, and pools of the standard library, go on burning
    after a timeout.
    """

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self._number = settings.workers
        self._places = asyncio.Semaphore(settings.workers)
        self._held = 0
        self._waiting = 0
        self._max_waiting = settings.max_waiting
        self._memory_mb = settings.worker_memory_mb
        self._warm: set[Worker] = set()
        self._resting: deque[tuple[Worker, float]] = deque()
        self._tasks: TaskGroup | None = None
        self._starting = False
        metrics.gauge("veselova_workers", "Worker processes that may run", lambda: self._number)
        metrics.gauge("veselova_workers_busy", "Worker processes at work", self._busy)
        metrics.gauge(
            "veselova_queue_length", "Requests that wait for a worker", lambda: self._waiting
        )

    def _busy(self) -> int:
        """Return how many workers are at work for requests: one that is being started is not."""
        return max(0, self._held - self._starting)

    @property
    def warm(self) -> list[int]:
        """Return the ids of the processes that have answered before and live."""
        self._warm = {worker for worker in self._warm if worker.lives}
        return [worker.process_id for worker in self._warm]

    def ready(self) -> bool:
        """Return whether there is a warm worker, one that has answered before; where there is none,
        one is started.
        """
        ready = bool(self.warm)
        if not ready:
            self._replace()
        return ready

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Start a worker with both engines loaded, and another whenever none is left for the next
        request, within the context.

        At its end no worker is left.
        """
        try:
            async with anyio.create_task_group() as tasks:
                self._tasks = tasks
                self._replace(0)
                try:
                    yield
                finally:
                    self._tasks = None
                    tasks.cancel_scope.cancel()
        finally:
            while self._resting:
                await self._resting.popleft()[0].end()

    async def run(self, task: Callable[..., T], *arguments: Any, budget_s: float) -> T:
        """Return what a task gives within the budget, waiting for a worker included.

        Raises Refused: ``overloaded`` when too many requests wait, ``over-budget`` when time is up
        (the process is killed), ``worker-memory`` when the task needs more of it, ``worker-lost``
        when the process died. What the engines raise comes through.
        """
        # A request may wait for the worker that is just being started besides.
        if self._places.locked() and self._waiting >= self._max_waiting + self._starting:
            detail = f"{self._max_waiting} requests are waiting for a worker; try again later."
            raise Refused("overloaded", detail, retry_after=2)
        try:
            return await self._answer(task, *arguments, budget_s=budget_s)
        except (
            BaseException
        ):  # among them the cancellation of a request whose client has gone, which kills its worker
            self._replace()
            raise

    @asynccontextmanager
    async def _place(self) -> AsyncIterator[None]:
        """Hold the place of one worker inside the block."""
        self._waiting += 1
        try:
            await self._places.acquire()
        finally:
            self._waiting -= 1
        self._held += 1
        try:
            yield
        finally:
            self._held -= 1
            self._places.release()

    async def _answer(self, task: Callable[..., T], *arguments: Any, budget_s: float) -> T:
        call = message((task, arguments, budget_s))
        try:
            with anyio.fail_after(budget_s):
                async with self._place():
                    answer: T = await self._ask(call)
                    return answer
        except OverBudget:  # the worker knows, and lives on
            raise
        except TimeoutError:
            raise Refused(
                "over-budget", f"The work was stopped after its budget of {budget_s:g} s."
            ) from None
        except WorkerLost:
            raise Refused(
                "worker-lost",
                "The worker process ended before it answered; try again.",
                retry_after=1,
            ) from None
        except MemoryError:
            detail = (
                f"The work needs more than the {self._memory_mb} MB of memory that a worker "
                "of this server has"
            )
            raise Refused("worker-memory", f"{detail}; ask for fewer times.") from None

    async def _ask(self, call: bytes) -> Any:
        """Return what a worker answers: the one that rests since the shortest time,
        or a new one.
        """
        while self._resting:
            worker, _ = self._resting.pop()
            if worker.lives:
                break
        else:
            worker = await Worker.start(self._memory_mb * MEGABYTE)
        try:
            while self._resting and anyio.current_time() - self._resting[0][1] > _LONGEST_REST_S:
                await self._resting.popleft()[0].end()
            answer = await worker.ask(call)
            self._warm.add(worker)
        finally:
            if worker.lives:
                self._resting.append((worker, anyio.current_time()))
        return answer

    def _replace(self, pause_s: float = _SETTLED_S) -> None:
        """Start a worker in the background, unless one is idle, or all are at work, or requests
        wait, which start their own.
        """
        held = self._held
        room = held < self._number and not self._waiting
        if self._tasks is not None and room and not self._starting and len(self.warm) <= held:
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
