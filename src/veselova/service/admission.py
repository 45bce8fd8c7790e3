"""What a server looks at before it starts any work: media types, size, JSON, and the limits of its settings."""

from __future__ import annotations

import json
from typing import Any

from starlette.requests import Request

from veselova.mechanics.errors import InvalidInput
from veselova.service.estimates import require_hope
from veselova.service.negotiation import accepted_type
from veselova.service.problem_details import Refused
from veselova.service.schemas import ComparisonRequest, TorusRequest, layers
from veselova.service.settings import Settings

__all__ = ["admit", "decoded", "read_json", "require_acceptable"]

#: Python reads integers of 4300 digits.
_LONGEST_INTEGER = 4000


def require_acceptable(accept: str | None) -> None:
    """Raise Refused unless an Accept header allows application/json."""
    accepted_type(accept, ["application/json"])


async def read_json(request: Request, settings: Settings) -> Any:
    """Return the decoded body; raises Refused for another media type, a body over the limit, or text that is not JSON."""
    media_type = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if media_type != "application/json" and not (media_type.startswith("application/") and media_type.endswith("+json")):
        raise Refused("unsupported-media-type", f"Content-Type: required application/json; given {media_type[:100] or 'none'}.")
    if (coding := request.headers.get("content-encoding", "identity").strip().lower()) != "identity":
        raise Refused("unsupported-media-type", f"Content-Encoding: required none; given {coding[:100]}.")
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
    document = decoded(bytes(body))
    _require_modest(document, settings)
    return document


def _require_modest(document: Any, settings: Settings) -> None:
    """Raise InvalidInput where a document is deeper, or has longer texts, than the settings allow."""
    for depth, layer in enumerate(layers(document)):
        if depth > settings.max_depth:
            raise InvalidInput((), f"at most {settings.max_depth} levels of nesting", "more")
        longest = max((len(value) for value in layer if isinstance(value, str)), default=0)
        if longest > settings.max_text:
            raise InvalidInput((), f"texts of at most {settings.max_text} characters", f"one of {longest}")


def decoded(text: bytes) -> Any:
    """Return the document that a text states; raises Refused when it is not JSON.

    NaN, Infinity and 1e999 are no JSON, but their sender is helped more by the name of the field: Python's own parser takes
    them, and the validation that follows refuses every number that is not finite. Of two fields of one name neither is taken.
    """
    if not text.strip():
        raise Refused("malformed-json", "The body: required one JSON document; given nothing.")
    try:
        return _DECODER.decode(text.decode("utf-8-sig"))  # some editors put a byte order mark before it
    except InvalidInput:
        raise
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        raise Refused("malformed-json", f"The body: required one JSON document; {reason}.") from None


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        names = [name for name, _ in pairs]
        raise InvalidInput(
            (next(name for name in names if names.count(name) > 1)[:100],), "each field once", "two fields of this name"
        )
    return fields


def _integer(text: str) -> int | str:
    """Return an integer; one of more digits than Python reads stays a text, which its field then refuses."""
    return int(text) if len(text) < _LONGEST_INTEGER else text


_DECODER = json.JSONDecoder(object_pairs_hook=_once, parse_int=_integer)


def admit(request: TorusRequest, settings: Settings) -> None:
    """Raise InvalidInput where a request is beyond the limits of this server, before its numbers are looked at."""
    n = request.problem.dimension
    if n > settings.max_dimension:
        raise InvalidInput(
            ("problem", request.problem.measured), f"at most {settings.max_dimension} entries on this server", str(n)
        )
    if request.budget_s > settings.max_budget_s:
        raise InvalidInput(("budget_s",), f"at most {settings.max_budget_s:g} on this server", f"{request.budget_s:g}")
    count = request.time_count()
    if count > settings.max_times:
        raise InvalidInput(("times",), f"at most {settings.max_times} times on this server", str(count)[:30])
    if count * n * n > settings.max_values:
        raise InvalidInput(
            ("times",), f"at most {settings.max_values} frame entries (times × n²) on this server", str(count * n * n)
        )
    if isinstance(request, ComparisonRequest):
        if request.digits > settings.max_digits:
            raise InvalidInput(("digits",), f"at most {settings.max_digits} on this server", str(request.digits))
        require_hope(request, settings)
