"""One line in the log for each request."""

from __future__ import annotations

import logging
import time
from contextvars import ContextVar
from typing import Any
from urllib.parse import quote

from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: What a line may say of a request. Headers, bodies and queries are not among it, so no secret can
#: be.
FIELDS = frozenset(
    {"method", "route", "path", "status", "seconds", "client", "key", "system", "engine", "outcome"}
)

_LOG = logging.getLogger("veselova.service.requests")

#: What is known of the request at hand; tasks that work for it share it.
_FACTS: ContextVar[dict[str, Any] | None] = ContextVar("facts", default=None)

#: Most characters of a path that no route has.
_LONGEST_PATH = 100


def note(**facts: Any) -> None:
    """Add facts (named in FIELDS) to the line of the request at hand; outside of a request nothing
    happens.
    """
    known = _FACTS.get()
    if known is not None:
        known.update(facts)


class RequestLog:
    """ASGI middleware: logs route, status, seconds, client and the facts of ``note``; ``quiet``
    paths at debug level.
    """

    def __init__(self, app: ASGIApp, quiet: frozenset[str] = frozenset()) -> None:
        self._app = app
        self._quiet = quiet

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on and log it when its answer is complete, or has failed."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        facts: dict[str, Any] = {}
        _FACTS.set(facts)
        status = None

        async def watch(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        began = time.perf_counter()
        try:
            await self._app(scope, receive, watch)
        finally:
            facts.setdefault(
                "outcome",
                "answered" if status and status < 400 else "refused" if status else "no-answer",
            )
            level = logging.DEBUG if scope["path"] in self._quiet else logging.INFO
            line = {
                **_subject(scope),
                "status": status,
                "seconds": round(time.perf_counter() - began, 6),
                **facts,
            }
            _LOG.log(level, "request", extra=line)


def _subject(scope: Scope) -> dict[str, Any]:
    """Return what was asked: the route, or the path where no route has it, in characters that are
    safe to print.
    """
    client = (scope.get("client") or (None,))[0]
    route = getattr(scope.get("route"), "path", None)
    place = {"path": quote(scope["path"])[:_LONGEST_PATH]} if route is None else {"route": route}
    return {"method": scope["method"][:20], **place, "client": client}
