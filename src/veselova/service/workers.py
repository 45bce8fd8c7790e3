"""Killable work: every computation runs in a worker process that is ended when its budget is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import anyio
from anyio import BrokenWorkerProcess, CapacityLimiter, to_process

from veselova.service.problem_details import Refused
from veselova.service.settings import Settings
from veselova.service.tasks import answer, warm_up

__all__ = ["Workers"]


class Workers:
    """The worker processes of one server. Threads, and pools of the standard library, go on burning after a timeout."""

    def __init__(self, settings: Settings) -> None:
        self._limiter = CapacityLimiter(settings.workers)
        self._max_waiting = settings.max_waiting
        self.warm = False

    async def start(self) -> None:
        """Start one worker with both engines loaded."""
        await to_process.run_sync(warm_up, cancellable=True, limiter=self._limiter)
        self.warm = True

    async def run(self, kind: str, request: Mapping[str, Any], budget_s: float) -> bytes:
        """Return the JSON of an answer within the budget, waiting for a worker included.

        Raises Refused: ``overloaded`` when too many requests wait, ``over-budget`` when time is up (the process is killed),
        ``worker-lost`` when the process died. What the engines raise comes through.
        """
        load = self._limiter.statistics()
        if load.borrowed_tokens >= load.total_tokens and load.tasks_waiting >= self._max_waiting:
            raise Refused("overloaded", f"{self._max_waiting} requests are waiting for a worker; try again later.", retry_after=2)
        try:
            with anyio.fail_after(budget_s):
                return await to_process.run_sync(answer, kind, request, cancellable=True, limiter=self._limiter)
        except TimeoutError:
            raise Refused("over-budget", f"The work was stopped after its budget of {budget_s:g} s.") from None
        except BrokenWorkerProcess:
            raise Refused("worker-lost", "The worker process ended before it answered; try again.", retry_after=1) from None
