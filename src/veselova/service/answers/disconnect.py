"""Work for a client that may leave before it is done."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

from starlette.requests import Request

from veselova.service.api.problem_details import Refused

__all__ = ["while_connected"]

T = TypeVar("T")


async def while_connected(request: Request, work: Coroutine[Any, Any, T]) -> T:
    """Return what the work gives; end it when the client has gone, or the server shuts down: raises
    Refused then.
    """
    working = asyncio.create_task(work)
    leaving = asyncio.create_task(_wait_gone(request))
    try:
        await asyncio.wait((working, leaving), return_when=asyncio.FIRST_COMPLETED)
        if working.done():
            return working.result()
        working.cancel()
        await asyncio.wait((working,))
        detail = "The client closed the connection, and the work was stopped."
        raise Refused("client-gone", detail)
    except asyncio.CancelledError:
        # The grace after SIGTERM has run out. The client is owed an answer all the same.
        detail = "The server is shutting down and stopped this work."
        raise Refused("shutting-down", detail, retry_after=5) from None
    finally:
        working.cancel()
        leaving.cancel()


async def _wait_gone(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass
