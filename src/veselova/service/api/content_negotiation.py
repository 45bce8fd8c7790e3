"""Which of the offered media types a request's headers prefer (RFC 9110, 12.5)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from veselova.service.api.problem_details import Refused

if TYPE_CHECKING:
    from starlette.datastructures import Headers

__all__ = ["negotiate_type"]


def negotiate_type(headers: Headers, offered: Sequence[str]) -> str:
    """Return the offered media type of the highest quality, the first of equals; raises Refused
    where none is acceptable. A quality that is no number counts as 1.
    """
    accept = ", ".join(headers.getlist("accept")) or "*/*"
    qualities = {}
    for part in accept.lower().split(","):
        name, *parameters = (piece.strip() for piece in part.split(";"))
        stated = next((text[2:] for text in parameters if text.startswith("q=")), "1")
        qualities[name] = float(stated) if re.fullmatch(r"[01](\.\d*)?", stated) else 1.0

    def quality(media_type: str) -> float:
        # the most specific range decides
        ranges = (media_type, f"{media_type.split('/')[0]}/*", "*/*")
        return next((qualities[name] for name in ranges if name in qualities), 0.0)

    best = max(offered, key=quality)
    if quality(best) > 0:
        return best
    detail = f"Accept: required one of {', '.join(offered)}; given {accept[:100]}."
    raise Refused("not-acceptable", detail)
