"""What a server looks at before it starts any work: media types, size, JSON, and the limits of its settings."""

from __future__ import annotations

import json
from typing import Any

import orjson
from starlette.requests import Request

from veselova.mechanics.errors import InvalidInput
from veselova.service.problem_details import Refused
from veselova.service.schemas import ComparisonRequest, TorusRequest
from veselova.service.settings import Settings

__all__ = ["admit", "decoded", "read_json", "require_acceptable"]


def require_acceptable(accept: str | None) -> None:
    """Raise Refused unless an Accept header allows application/json."""
    if accept is None:
        return
    for part in accept.split(","):
        media_range, *parameters = (piece.strip().lower() for piece in part.split(";"))
        if media_range in ("application/json", "application/*", "*/*") and not _is_zero_quality(parameters):
            return
    raise Refused("not-acceptable", f"This resource is application/json; the request accepts {accept[:100]}.")


def _is_zero_quality(parameters: list[str]) -> bool:
    return any(p.startswith("q=") and p[2:].strip("0.") == "" for p in parameters)


async def read_json(request: Request, settings: Settings) -> Any:
    """Return the decoded body; raises Refused for another media type, a body over the limit, or text that is not JSON."""
    media_type = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if media_type != "application/json" and not (media_type.startswith("application/") and media_type.endswith("+json")):
        raise Refused("unsupported-media-type", f"Content-Type: required application/json; given {media_type[:100] or 'none'}.")
    limit = settings.max_body_bytes
    too_large = Refused("body-too-large", f"The body: required at most {limit} bytes; given more.")
    declared = request.headers.get("content-length", "")
    if declared.isdigit() and int(declared[:20]) > limit:
        raise too_large
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > limit:
            raise too_large
    return decoded(bytes(body))


def decoded(text: bytes) -> Any:
    """Return the document that a text states; raises Refused when it is not JSON.

    NaN, Infinity and 1e999 are no JSON, but their sender is helped more by the name of the field: Python's own parser takes
    them, and the validation that follows refuses every number that is not finite.
    """
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError as error:
        try:
            return json.loads(text.decode("utf-8"))
        except (ValueError, RecursionError):
            raise Refused("malformed-json", f"The body: required one JSON document; {error}.") from None


def admit(request: TorusRequest, settings: Settings) -> None:
    """Raise InvalidInput where a request is beyond the limits of this server, before its numbers are looked at."""
    problem = request.problem
    n = len(problem.A) if isinstance(problem.A, list) else 0
    if n > settings.max_dimension:
        raise InvalidInput(("problem", "A"), f"at most {settings.max_dimension} entries on this server", str(n))
    if request.budget_s > settings.max_budget_s:
        raise InvalidInput(("budget_s",), f"at most {settings.max_budget_s:g} on this server", f"{request.budget_s:g}")
    if not isinstance(request, ComparisonRequest):
        return
    count = request.time_count()
    if count > settings.max_times:
        raise InvalidInput(("times",), f"at most {settings.max_times} times on this server", str(count)[:30])
    if count * n * n > settings.max_values:
        raise InvalidInput(
            ("times",), f"at most {settings.max_values} frame entries (times × n²) on this server", str(count * n * n)
        )
