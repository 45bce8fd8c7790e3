"""Work for a client that may leave before it is done."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import TypeVar

import anyio
from starlette.requests import Request

from veselova.service.api.problem_details import Refused

__all__ = ["while_connected"]

T = TypeVar("T")

#: Seconds before anyone looks whether the client is there: most work is done by then, and looking
#: takes a task of its own.
_UNWATCHED_S = 0.05


async def while_connected(request: Request, work: Callable[[], Awaitable[T]]) -> T:
    """Return what the work gives; end it when the client has gone, or the server shuts down: raises
    Refused then.
    """
    try:
        with anyio.CancelScope() as scope:
            watcher: asyncio.Task[None] | None = None

            def watch() -> None:
                nonlocal watcher
                # No task group: nothing is to wait for the end of the watcher, which holds nothing.
                watcher = asyncio.create_task(_cancel_when_gone(request, scope))

            due = asyncio.get_running_loop().call_later(_UNWATCHED_S, watch)
            try:
                return await work()
            finally:
                due.cancel()
                if watcher is not None:
                    watcher.cancel()
    except anyio.get_cancelled_exc_class():
        # The grace after SIGTERM has run out. The worker is dead by now; the client is owed an
        # answer all the same.
        raise Refused(
            "shutting-down", "The server is shutting down and stopped this work.", retry_after=5
        ) from None
    raise Refused("client-gone", "The client closed the connection, and the work was stopped.")


async def _cancel_when_gone(request: Request, scope: anyio.CancelScope) -> None:
    with suppress(Exception):  # a connection that cannot be read is gone as well
        while (await request.receive())["type"] != "http.disconnect":
            pass
    scope.cancel()
