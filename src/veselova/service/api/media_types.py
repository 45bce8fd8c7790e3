"""The formats of a trajectory, as a worker writes them: block by block, to memory or to a file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import BinaryIO, TypeAlias

from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import trajectory_document, write_document

__all__ = ["FORMATS", "JSON", "MEDIA_TYPES", "Format", "format_of"]

Outputs: TypeAlias = "Iterable[str] | None"


def _write_json(trajectory: Trajectory, stream: BinaryIO, outputs: Outputs) -> None:
    write_document(trajectory_document(trajectory, outputs), stream)


@dataclass(frozen=True)
class Format:
    """One representation of a trajectory. ``compressed``: it is already, so that no content coding
    is put on top.
    """

    name: str
    media_type: str
    write: Callable[[Trajectory, BinaryIO, Outputs], None]
    compressed: bool = False


JSON = Format("json", "application/json", _write_json)

#: The formats by name, in the order of preference.
FORMATS: Mapping[str, Format] = {
    entry.name: entry
    for entry in (
        JSON,
        Format("csv", "text/csv", Trajectory.to_csv),
        Format("npz", "application/x-npz", Trajectory.to_npz, compressed=True),
        Format("arrow", "application/vnd.apache.arrow.stream", Trajectory.to_arrow),
        Format("parquet", "application/vnd.apache.parquet", Trajectory.to_parquet, compressed=True),
    )
}


#: Media types by name.
MEDIA_TYPES = {entry.name: entry.media_type for entry in FORMATS.values()}


def format_of(media_type: str) -> Format:
    """Return the format of a media type that is offered."""
    return next(entry for entry in FORMATS.values() if entry.media_type == media_type)
