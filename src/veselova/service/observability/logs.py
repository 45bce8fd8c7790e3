"""The log: one formatter for all loggers, JSON or text, with the id of the request and without
keys.
"""

from __future__ import annotations

import logging
import logging.config
import re
import sys
from collections.abc import MutableMapping
from typing import Any

import structlog
from asgi_correlation_id import correlation_id
from opentelemetry.trace import get_current_span

from veselova.service.api.settings import Settings
from veselova.service.observability.request_log import FIELDS

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
