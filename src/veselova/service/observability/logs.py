"""The log: one formatter for all loggers, JSON or text, with the id of the request and without
keys; and one line for each request.
"""

from __future__ import annotations

import logging
import logging.config
import re
import sys
import time
from collections.abc import MutableMapping
from contextvars import ContextVar
from typing import Any
from urllib.parse import quote

import structlog
from asgi_correlation_id import correlation_id
from opentelemetry.trace import get_current_span
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from veselova.service.api.settings import Settings

#: The secret part of an API key, wherever one should stand (an exception, say, that quotes a
#: header).
_SECRET = re.compile(r"(vsl_[0-9a-f]{12}_)[A-Za-z0-9_-]+")

_Event = MutableMapping[str, Any]


def configure_logging(settings: Settings) -> None:
    """Send every line of this process to standard error, in the format of the settings."""
    terminal = sys.stderr.isatty()
    text = settings.log_format == "text" or (settings.log_format == "auto" and terminal)
    level = settings.log_level.upper()
    logging.config.dictConfig(
        {
            "version": 1,
            "disable_existing_loggers": False,
            "formatters": {"line": {"()": line_formatter, "text": text, "colours": terminal}},
            "handlers": {"stderr": {"class": "logging.StreamHandler", "formatter": "line"}},
            "root": {"handlers": ["stderr"], "level": "WARNING"},
            # Ids that clients make up are replaced without a word: they could write as many lines
            # as they like.
            "loggers": {
                "veselova": {"level": level},
                "uvicorn": {"level": level},
                "asgi_correlation_id": {"level": "ERROR"},
            },
        }
    )
    logging.captureWarnings(True)


def line_formatter(text: bool, colours: bool = False) -> logging.Formatter:
    """Return what makes a line of a record, in text or in JSON: the record, FIELDS of the request,
    its id, and no key.
    """
    last: list[Any] = [
        structlog.processors.format_exc_info,
        structlog.processors.JSONRenderer(ensure_ascii=False),
    ]
    if text:
        # Plain tracebacks: the pretty ones print the values of variables.
        last = [
            structlog.dev.ConsoleRenderer(
                colors=colours, exception_formatter=structlog.dev.plain_traceback
            )
        ]
    last.append(_without_secrets)
    return structlog.stdlib.ProcessorFormatter(
        processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *last],
        foreign_pre_chain=[
            structlog.stdlib.add_log_level,
            structlog.stdlib.add_logger_name,
            structlog.stdlib.ExtraAdder(FIELDS),
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            _add_ids,
        ],
    )


def _add_ids(_: object, __: str, event: _Event) -> _Event:
    """Add the id of the request, and that of the trace where OpenTelemetry is configured."""
    if (request_id := correlation_id.get()) is not None:
        event["request_id"] = request_id
    span = get_current_span().get_span_context()
    if span.is_valid:
        event["trace_id"] = f"{span.trace_id:032x}"
    return event


def _without_secrets(_: object, __: str, line: str) -> str:
    return _SECRET.sub(r"\1…", line)


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
            seconds = round(time.perf_counter() - began, 6)
            line = {**_subject(scope), "status": status, "seconds": seconds, **facts}
            _LOG.log(level, "request", extra=line)


def _subject(scope: Scope) -> dict[str, Any]:
    """Return what was asked: the route, or the path where no route has it, in characters that are
    safe to print.
    """
    client = (scope.get("client") or (None,))[0]
    route = getattr(scope.get("route"), "path", None)
    place = {"path": quote(scope["path"])[:_LONGEST_PATH]} if route is None else {"route": route}
    return {"method": scope["method"][:20], **place, "client": client}
