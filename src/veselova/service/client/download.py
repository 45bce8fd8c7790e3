"""What a download is: one call of the client whose answer goes to a file as it comes, in a format
of the server.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import orjson

from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.folders import expand_home
from veselova.mechanics.core.names import require_name
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.table import Target
from veselova.service.api.atomic_file import atomic_file, part_of

__all__ = ["MEDIA_TYPES", "DownloadTarget", "media_type_of", "provenance_of", "sink_of"]

#: Format → media type; a test holds it against the formats of the server.
MEDIA_TYPES: Mapping[str, str] = {
    "json": "application/json",
    "csv": "text/csv",
    "npz": "application/x-npz",
    "arrow": "application/vnd.apache.arrow.stream",
    "parquet": "application/vnd.apache.parquet",
}


def media_type_of(name: Any) -> str:
    """Return the media type of a format; raises InvalidInput for another name."""
    return MEDIA_TYPES[require_name(name, ("format",), list(MEDIA_TYPES))]


def provenance_of(headers: Mapping[str, str]) -> Provenance:
    """Return the provenance that the header of an answer states; raises KeyError or ValueError
    where it states none.
    """
    return Provenance(**orjson.loads(headers["veselova-provenance"]))


@dataclass
class DownloadTarget:
    """Where a download goes: a file that takes its name when it is whole, or an open stream, which
    can be written to once.
    """

    path: Path | None
    stream: BinaryIO | None
    #: Whether nothing was written yet that cannot be taken back.
    untouched: bool = True

    @contextmanager
    def open(self) -> Iterator[Callable[[bytes], Any]]:
        """Give what takes the chunks; the file appears, or replaces another, at the end of the
        block and not before.
        """
        if self.stream is not None:
            self.untouched = False
            yield self.stream.write
            return
        assert self.path is not None
        with atomic_file(self.path) as part, part.open("xb") as file:
            yield file.write


def sink_of(target: Target) -> DownloadTarget:
    """Return the sink of a path or of a binary stream; raises InvalidInput for anything else, and
    where nothing can be written: both are tried out, without a byte.
    """
    if isinstance(target, (str, Path)):
        path = expand_home(target, "target")
        try:
            is_file = path.parent.is_dir() and not path.is_dir()
            if is_file:
                part = part_of(path)
                part.touch(exist_ok=False)
                part.unlink()
        except (OSError, ValueError):  # a name that is too long, say, or a folder of others
            is_file = False
        if not is_file:
            required = "a file that can be written in an existing folder"
            raise InvalidInput(("target",), required, show(str(target)))
        return DownloadTarget(path, None)
    try:
        target.write(b"")
    except Exception:  # whatever an object without such a method, or a closed stream, raises
        required = "a path, or a binary stream that is open for writing"
        raise InvalidInput(("target",), required, show(target)) from None
    return DownloadTarget(None, target)
