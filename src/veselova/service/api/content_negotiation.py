"""Which of the offered media types, and which content coding, a request's headers prefer (RFC 9110,
12.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from veselova.service.api.problem_details import Refused

if TYPE_CHECKING:
    from starlette.datastructures import Headers

__all__ = ["CODINGS", "joined_field", "negotiate_coding", "negotiate_type"]

#: Content codings on offer; of two that a client likes equally, the first is taken.
CODINGS = ("zstd", "gzip")


def joined_field(headers: Headers, name: str) -> str | None:
    """Return a header field that is a list, its lines joined (RFC 9110, 5.3), or None where it is
    absent.
    """
    return ", ".join(headers.getlist(name)) or None


def negotiate_type(accept: str | None, offered: Sequence[str]) -> str:
    """Return the offered media type of the highest quality, the first of equals; raises Refused
    where none is acceptable.
    """
    if not accept:
        return offered[0]
    qualities = _qualities(accept)

    def quality(media_type: str) -> float:
        # The most specific range decides.
        ranges = (media_type, f"{media_type.split('/')[0]}/*", "*/*")
        return next((qualities[name] for name in ranges if name in qualities), 0.0)

    best = max(offered, key=quality)
    if quality(best) > 0:
        return best
    raise Refused(
        "not-acceptable", f"Accept: required one of {', '.join(offered)}; given {accept[:100]}."
    )


def negotiate_coding(accept_encoding: str | None, offered: Sequence[str] = CODINGS) -> str:
    """Return the offered content coding that a client prefers, or ``identity``, which is never
    refused.
    """
    qualities = _qualities(accept_encoding or "")
    plain = qualities.get("identity", 0.0)
    best = max(offered, key=lambda name: qualities.get(name, qualities.get("*", 0.0)))
    quality = qualities.get(best, qualities.get("*", 0.0))
    return best if quality > 0 and quality >= plain else "identity"


def _qualities(header: str) -> dict[str, float]:
    """Return the quality of every name in a header, without its other parameters."""
    found = {}
    for part in header.split(","):
        name, *parameters = (piece.strip().lower() for piece in part.split(";"))
        weights = [parameter[2:].strip() for parameter in parameters if parameter.startswith("q=")]
        if name:
            found[name] = _quality(weights[0]) if weights else 1.0
    return found


def _quality(text: str) -> float:
    """Return a quality; what is none counts as 1, since the name before it was written for a
    reason.
    """
    try:
        value = float(text)
    except ValueError:
        return 1.0
    return value if 0 <= value <= 1 else 1.0
