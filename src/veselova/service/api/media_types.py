"""The formats of a trajectory, as a worker writes them: block by block, to memory or to a file; and
which of them a request prefers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, BinaryIO, TypeAlias

from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import trajectory_document, write_document
from veselova.service.api.problem_details import Refused

if TYPE_CHECKING:
    from starlette.datastructures import Headers

Outputs: TypeAlias = "Iterable[str] | None"


def _write_json(trajectory: Trajectory, stream: BinaryIO, outputs: Outputs) -> None:
    write_document(trajectory_document(trajectory, outputs), stream)


@dataclass(frozen=True)
class Format:
    """One representation of a trajectory."""

    name: str
    media_type: str
    write: Callable[[Trajectory, BinaryIO, Outputs], None]


JSON = Format("json", "application/json", _write_json)

#: The formats by name, in the order of preference.
FORMATS: Mapping[str, Format] = {
    entry.name: entry
    for entry in (
        JSON,
        Format("csv", "text/csv", Trajectory.to_csv),
        Format("npz", "application/x-npz", Trajectory.to_npz),
        Format("arrow", "application/vnd.apache.arrow.stream", Trajectory.to_arrow),
        Format("parquet", "application/vnd.apache.parquet", Trajectory.to_parquet),
    )
}


#: Media types by name.
MEDIA_TYPES = {entry.name: entry.media_type for entry in FORMATS.values()}


def negotiate_type(headers: Headers, offered: Sequence[str]) -> str:
    """Return the offered media type of the highest quality, the first of equals; raises Refused
    where none is acceptable. A quality that is no number counts as 1 (RFC 9110, 12.5).
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
