"""RFC 9457 problem documents: the one table from exception to HTTP status and code.

The command line has it too, and no use for the framework: that is imported where a response is
made.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import orjson

from veselova.mechanics.core.errors import (
    BackendMissing,
    InternalContradiction,
    InvalidInput,
    OverBudget,
    Unsolved,
    VeselovaError,
)

if TYPE_CHECKING:
    from starlette.responses import Response

MEDIA_TYPE = "application/problem+json"

#: Exception → code; the most specific class of an exception decides.
TABLE: Mapping[type[Exception], str] = {
    InvalidInput: "invalid-input",
    Unsolved: "unsolved",
    OverBudget: "over-budget",
    BackendMissing: "backend-missing",
    InternalContradiction: "internal-contradiction",
    Exception: "internal-error",
}

#: Code → (status, title); ``type`` is urn:veselova:problem:code.
REFUSALS = {
    "malformed-json": (400, "The body is not JSON"),
    "not-found": (404, "No such resource"),
    "no-such-job": (404, "No such job"),
    "no-such-resource": (404, "No such resource"),
    "method-not-allowed": (405, "Method not allowed"),
    "not-acceptable": (406, "No acceptable representation"),
    "not-finished": (409, "The job has not finished"),
    "body-too-large": (413, "The body is too large"),
    "unsupported-media-type": (415, "The body must be application/json"),
    "worker-lost": (500, "The worker process was lost"),
    "invalid-input": (422, "The input is not valid"),
    "unsolved": (422, "The engine cannot serve this problem"),
    "backend-missing": (501, "An optional library is not installed on this server"),
    "internal-contradiction": (500, "Two results that must agree do not"),
    "internal-error": (500, "The server failed"),
    "unauthorized": (401, "An API key is required"),
    "insufficient-scope": (403, "The API key does not allow this"),
    # by the proxy: nginx.conf
    "rate-limited": (429, "Too many requests"),
    "database-unavailable": (503, "The database does not answer"),
    "database-damaged": (503, "The database is damaged"),
    "database-newer": (503, "The database is of another version"),
    "client-gone": (499, "The client closed the connection"),
    "overloaded": (503, "Too many requests are waiting"),
    "storage-unavailable": (503, "Jobs cannot be stored at present"),
    "worker-memory": (507, "The work needs more memory than a worker has"),
    "storage-full": (507, "The room for results is used up"),
    "not-ready": (503, "The server is starting"),
    "shutting-down": (503, "The server is shutting down"),
    "over-budget": (504, "The time budget was used up"),
}


class Refused(VeselovaError):
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
    """Return the problem document of an exception; those of other libraries are reported without
    their message.
    """
    if isinstance(error, Refused):
        code = error.code
    else:
        code = next(TABLE[kind] for kind in type(error).__mro__ if kind in TABLE)
    status, title = REFUSALS[code]
    document: dict[str, Any] = {
        "type": f"urn:veselova:problem:{code}",
        "title": title,
        "status": status,
        "detail": str(error),
    }
    if code == "internal-error":
        document["detail"] = "An unexpected error; it has been logged."
    if isinstance(error, InvalidInput):
        document["errors"] = [
            {"pointer": _pointer(fault.path), "detail": str(fault)} for fault in error.faults
        ]
        if error.further:
            document["further_errors"] = error.further
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
    headers = {}
    if isinstance(error, Refused) and error.retry_after is not None:
        headers["Retry-After"] = str(error.retry_after)
    if isinstance(error, Refused) and error.authenticate is not None:
        headers["WWW-Authenticate"] = error.authenticate
    return Response(orjson.dumps(document), document["status"], headers, MEDIA_TYPE)


def _pointer(path: tuple[str | int, ...]) -> str:
    """Return the RFC 6901 pointer of a path."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in path)
