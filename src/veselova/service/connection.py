"""Work for a client that may leave before it is done."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TypeVar

import anyio
from starlette.requests import Request

from veselova.service.problem_details import Refused

__all__ = ["while_connected"]

T = TypeVar("T")


async def while_connected(request: Request, work: Callable[[], Awaitable[T]]) -> T:
    """Return what the work gives; end it when the client has gone, or the server shuts down: raises Refused then."""
    answers: list[T] = []
    failures: list[Exception] = []

    async def watch() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass
        tasks.cancel_scope.cancel()

    try:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(watch)
            try:
                answers.append(await work())
            except Exception as error:
                failures.append(error)
            tasks.cancel_scope.cancel()
    except anyio.get_cancelled_exc_class():
        # The grace after SIGTERM has run out. The worker is dead by now; the client is owed an answer all the same.
        raise Refused("shutting-down", "The server is shutting down and stopped this work.", retry_after=5) from None
    if failures:
        raise failures[0]
    if not answers:
        raise Refused("client-gone", "The client closed the connection, and the work was stopped.")
    return answers[0]
