"""What a server answers, read and checked for both clients: whatever is no result becomes an
exception with a name.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import httpx2 as httpx
import orjson

from veselova.mechanics.core.errors import ProblemResponse, ServiceError, show
from veselova.service.client.requests import Call

__all__ = ["OWN_ID", "REQUEST_ID", "Retry", "read_answer", "reading", "require_own_answer"]

T = TypeVar("T")

#: Statuses that may pass if the same request is sent again: too many requests, overload or a lost
#: worker.
_RETRIED_STATUSES = frozenset({429, 503})

#: The header by which a server says what it answers, and how the ids of these clients begin: a
#: proxy may put an id of its own in place of one.
REQUEST_ID = "x-request-id"
OWN_ID = "veselova-client-"


class Retry(Exception):
    """A failure that may pass; ``cause`` is raised when the attempts are used up. The server may
    ask for a pause in seconds.
    """

    def __init__(self, cause: Exception, pause: float | None = None) -> None:
        self.cause = cause
        self.pause = pause


@contextmanager
def reading(source: str) -> Iterator[None]:
    """Raise ServiceError for whatever goes wrong inside the block, which reads what a server sent:
    the server may be a foreign one. A library that is not installed here stays an ImportError.
    """
    try:
        yield
    except ImportError:
        raise
    except Exception as error:
        reason = show(f"{type(error).__name__}: {error}")
        raise ServiceError(
            f"{source} answered with something else than a result ({reason})"
        ) from error


def require_own_answer(response: httpx.Response) -> None:
    """Raise ServiceError for the answer to a request of another client, before its body is read:
    the connection is closed then.
    """
    asked = response.request.headers[REQUEST_ID]
    answered = response.headers.get(REQUEST_ID, asked)
    if answered != asked and answered.startswith(OWN_ID):
        raise ServiceError(
            f"{response.request.url} answered the request {show(answered)} of another client "
            f"instead of {asked}"
        )


def read_answer(call: Call[T], response: httpx.Response, address: str) -> T:
    """Return the result of an answer; raises ServiceError for another status or media type than
    those of the call, Retry for a refusal that may pass, ProblemResponse for any other.

    The body of a download is not read yet: its header alone says whether it is one.
    """
    if not response.is_success:
        raise _refusal(response)
    with reading(address):
        _require_kind(call, response)
        if call.sink is not None:
            return call.result(response.headers)
        return call.result(orjson.loads(response.content or b"null"))


def _require_kind(call: Call[Any], response: httpx.Response) -> None:
    """Raise ValueError unless an answer has the status and the media type of a result."""
    if response.status_code != call.status:
        raise ValueError(f"status {response.status_code}, not {call.status}")
    media_type = response.headers.get("content-type", "").partition(";")[0].strip().lower()
    if call.status != httpx.codes.NO_CONTENT and media_type != call.accept:
        raise ValueError(f"{media_type or 'no media type'}, not {call.accept}")


def _refusal(response: httpx.Response) -> Exception:
    """Return the exception of an answer that is no success: a problem document, or the beginning
    of its text where it has none.
    """
    try:
        document = orjson.loads(response.content)
    except orjson.JSONDecodeError:
        document = None
    if not isinstance(document, dict):
        document = {
            "title": response.reason_phrase,
            "status": response.status_code,
            # a foreign server can name a charset that is none of texts
            "detail": show(response.content.decode("utf-8", "replace")),
        }
        if response.has_redirect_location:
            target = show(response.headers["location"])
            document["detail"] = f"a redirect to {target}, which is not followed"
    failure = ProblemResponse(response.status_code, document)
    if response.status_code not in _RETRIED_STATUSES:
        return failure
    pause = response.headers.get("retry-after", "")
    seconds = float(pause) if pause.isascii() and pause.isdecimal() else None
    return Retry(failure, seconds)
