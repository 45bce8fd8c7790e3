"""What a server answers, read and checked for both clients: whatever is no result becomes an
exception with a name.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import SpooledTemporaryFile
from typing import IO, Any, BinaryIO, TypeVar

import httpx2 as httpx
import orjson

from veselova.mechanics.core.errors import ProblemResponse, ServiceError, show
from veselova.service.api.atomic_file import atomic_file
from veselova.service.client.requests import Call

__all__ = ["atomic_target", "read_answer", "reading"]

T = TypeVar("T")

#: Bytes of a download to a stream that are held in memory until it is whole.
_IN_MEMORY = 10_000_000


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


@contextmanager
def atomic_target(target: Path | BinaryIO) -> Iterator[IO[bytes]]:
    """Give the file to write; at the end of the block, and not before, it is the target, or is
    copied to that stream.
    """
    if isinstance(target, Path):
        with atomic_file(target) as part, part.open("xb") as file:
            yield file
        return
    with SpooledTemporaryFile(_IN_MEMORY) as copied:
        yield copied
        copied.seek(0)
        shutil.copyfileobj(copied, target)


def read_answer(call: Call[T], response: httpx.Response) -> T:
    """Return the result of an answer; raises ServiceError for another media type than that of the
    call, ProblemResponse for a refusal.

    The body of a download is not read yet: its header alone says whether it is one.
    """
    if not response.is_success:
        raise _refusal(response)
    with reading(str(response.url)):
        media_type = response.headers.get("content-type", "").partition(";")[0].strip().lower()
        if call.accept != media_type:
            raise ValueError(f"{media_type or 'no media type'}, not {call.accept}")
        return call.result(
            orjson.loads(response.content or b"null") if call.target is None else response.headers
        )


def _refusal(response: httpx.Response) -> ProblemResponse:
    """Return the exception of an answer that is no success: a problem document, or the beginning
    of its text where it has none.
    """
    document: Any = None
    with suppress(orjson.JSONDecodeError):
        document = orjson.loads(response.content)
    if not isinstance(document, dict):
        # a foreign server can name a charset that is none of texts
        text = response.content.decode("utf-8", "replace")
        if "location" in response.headers:
            text = f"a redirect to {response.headers['location']}, which is not followed"
        title = response.reason_phrase
        document = {"title": title, "status": response.status_code, "detail": show(text)}
    pause = response.headers.get("retry-after", "")
    seconds = float(pause) if pause.isascii() and pause.isdecimal() else None
    return ProblemResponse(response.status_code, document, seconds)
