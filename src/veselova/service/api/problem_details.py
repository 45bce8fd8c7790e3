"""RFC 9457 problem documents: the one table from exception to HTTP status and code.

The command line has it too, and no use for the framework: that is imported where a response is
made.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeGuard

import orjson

from veselova.mechanics.core.errors import (
    BackendMissing,
    InternalContradiction,
    InvalidInput,
    InvalidRequest,
    OverBudget,
    Unsolved,
    summary,
)

if TYPE_CHECKING:
    from starlette.exceptions import HTTPException
    from starlette.responses import Response

__all__ = [
    "FRAMEWORK",
    "MEDIA_TYPE",
    "REFUSALS",
    "TABLE",
    "Refused",
    "loads",
    "problem_code",
    "problem_document",
    "problem_response",
]

MEDIA_TYPE = "application/problem+json"

#: Status codes of HTTPException that the framework itself raises, with the code and title of their
#: documents.
FRAMEWORK = {
    400: ("malformed-json", "The body is not JSON"),
    404: ("not-found", "No such resource"),
    405: ("method-not-allowed", "Method not allowed"),
    413: ("body-too-large", "The body is too large"),
}

#: Exception → (status, code, title); the most specific class of an exception decides. ``type`` is
#: urn:veselova:problem:code.
TABLE: Mapping[type[Exception], tuple[int, str, str]] = {
    InvalidInput: (422, "invalid-input", "The input is not valid"),
    InvalidRequest: (422, "invalid-input", "The input is not valid"),
    Unsolved: (422, "unsolved", "The engine cannot serve this problem"),
    OverBudget: (504, "over-budget", "The time budget was used up"),
    BackendMissing: (501, "backend-missing", "An optional library is not installed on this server"),
    InternalContradiction: (500, "internal-contradiction", "Two results that must agree do not"),
    Exception: (500, "internal-error", "The server failed"),
}

#: What the service itself refuses: code → (status, title).
REFUSALS = {
    "malformed-json": (400, "The body is not JSON"),
    "no-such-job": (404, "No such job"),
    "no-such-resource": (404, "No such resource"),
    "not-acceptable": (406, "No acceptable representation"),
    "not-finished": (409, "The job has not finished"),
    "unsupported-media-type": (415, "The body must be application/json"),
    "worker-lost": (500, "The worker process was lost"),
    "unauthorized": (401, "An API key is required"),
    "insufficient-scope": (403, "The API key does not allow this"),
    # by the proxy: nginx.conf
    "rate-limited": (429, "Too many requests"),
    "unknown-method": (501, "The method is unknown"),
    "database-unavailable": (503, "The database does not answer"),
    "database-damaged": (503, "The database is damaged"),
    "database-newer": (503, "The database is of a later version"),
    "client-gone": (499, "The client closed the connection"),
    "overloaded": (503, "Too many requests are waiting"),
    "storage-unavailable": (503, "Jobs cannot be stored at present"),
    "worker-memory": (507, "The work needs more memory than a worker has"),
    "storage-full": (507, "The room for results is used up"),
    "not-ready": (503, "The server is starting"),
    "shutting-down": (503, "The server is shutting down"),
    "over-budget": (504, "The time budget was used up"),
}

#: Python's spelling of constants → that of JSON, or of those who write what JSON has not.
_JSON_CONSTANTS = {
    "None": "null",
    "True": "true",
    "False": "false",
    "nan": "NaN",
    "inf": "Infinity",
    "-inf": "-Infinity",
}


class Refused(Exception):
    """A request that the service refuses for a reason of its own, by the code of its document."""

    def __init__(
        self,
        code: str,
        detail: str,
        retry_after: int | None = None,
        authenticate: str | None = None,
    ) -> None:
        """``retry_after`` and ``authenticate`` are the fields Retry-After and WWW-Authenticate."""
        self.code = code
        self.detail = detail
        self.retry_after = retry_after
        self.authenticate = authenticate
        super().__init__(detail)

    def __reduce__(self) -> tuple[Any, ...]:  # from a worker to the server
        return type(self), (self.code, self.detail, self.retry_after)


def loads(text: bytes, name: str = "The body") -> Any:
    """Return the document that a text states; raises Refused where it is no JSON. Of two fields of
    one name the last is taken; NaN, Infinity and 1e999 are left to the fields, which refuse them.
    """
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        reason = reason if text.strip() else "given nothing"
        detail = f"{name}: required one JSON document; {reason}."
        raise Refused("malformed-json", detail) from None


def problem_document(error: Exception) -> dict[str, Any]:
    """Return the problem document of an exception; what is not ours is reported without its
    message.
    """
    if isinstance(error, Refused):
        status, title = REFUSALS[error.code]
        return _document(status, error.code, title, error.detail)
    if _is_of_framework(error):
        code, title = FRAMEWORK.get(error.status_code, ("http-error", "The request was refused"))
        return _document(error.status_code, code, title, str(error.detail))
    status, code, title = next(TABLE[kind] for kind in type(error).__mro__ if kind in TABLE)
    detail = str(error) if code != "internal-error" else "An unexpected error; it has been logged."
    document = _document(status, code, title, detail)
    if isinstance(error, InvalidInput):
        faults = [_in_json(fault) for fault in error.faults]
        further = error.further
        document["detail"] = summary(faults, further)
        document["errors"] = [
            {"pointer": _pointer(fault.path), "detail": str(fault)} for fault in faults
        ]
        if further:
            document["further_errors"] = further
    if isinstance(error, Unsolved):
        document["outcome"] = error.outcome
    return document


def problem_code(error: Exception) -> str:
    """Return the name of what went wrong: the outcome of an engine, or the code of the problem
    document.
    """
    document = problem_document(error)
    return str(document.get("outcome") or document["type"].rpartition(":")[2])


def problem_response(error: Exception) -> Response:
    """Return the HTTP response that carries the problem document of an exception."""
    from starlette.responses import Response

    document = problem_document(error)
    headers = dict(error.headers or {}) if _is_of_framework(error) else {}
    if isinstance(error, Refused) and error.retry_after is not None:
        headers["Retry-After"] = str(error.retry_after)
    if isinstance(error, Refused) and error.authenticate is not None:
        headers["WWW-Authenticate"] = error.authenticate
    return Response(orjson.dumps(document), document["status"], headers, MEDIA_TYPE)


def _is_of_framework(error: Exception) -> TypeGuard[HTTPException]:
    """Return whether an exception is an HTTPException; a framework that is not loaded has raised
    none.
    """
    framework = sys.modules.get("starlette.exceptions")
    return framework is not None and isinstance(error, framework.HTTPException)


def _document(status: int, code: str, title: str, detail: str) -> dict[str, Any]:
    return {
        "type": f"urn:veselova:problem:{code}",
        "title": title,
        "status": status,
        "detail": detail,
    }


def _in_json(fault: InvalidInput) -> InvalidInput:
    """Return the fault with a constant that was given spelt as JSON spells it."""
    return InvalidInput(fault.path, fault.required, _JSON_CONSTANTS.get(fault.given, fault.given))


def _pointer(path: tuple[str | int, ...]) -> str:
    """Return the RFC 6901 pointer of a path."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in path)
