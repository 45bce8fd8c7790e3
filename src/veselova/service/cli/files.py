"""The files that the command line reads and writes."""

from __future__ import annotations

import os
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.folders import expand_home

__all__ = ["MOST_BYTES", "check_file", "read_document"]


#: Budget: bytes of the file of a request, four million numbers of an ensemble.
MOST_BYTES = 100_000_000


def read_document(file: str) -> Any:
    """Return the decoded JSON of a file, or of standard input for ``-``; raises InvalidInput, for
    more than ``MOST_BYTES`` too.
    """
    from veselova.service.api.problem_details import loads

    if file == "-" and sys.stdin is None:
        raise InvalidInput(("FILE",), "an open standard input", "a closed one")
    path = expand_home(file, "FILE")
    try:
        with nullcontext(sys.stdin.buffer) if file == "-" else path.open("rb") as stream:
            text = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise InvalidInput(("FILE",), "a readable file", f"{file} ({error.strerror})") from None
    if len(text) > MOST_BYTES:
        required = f"a file of at most {MOST_BYTES / 1e6:g} MB"
        raise InvalidInput(("FILE",), required, f"{file}, larger")
    return loads(text, "standard input" if file == "-" else file)


def check_file(option: str, path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Raise InvalidInput unless an option names no file, or one that can be written."""
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        raise InvalidInput((option,), f"a file name ending in {', '.join(suffixes)}", str(path))
    is_folder = path.is_dir() and path.suffix.lower() != ".zarr"
    if is_folder or not os.access(path if path.exists() else path.parent, os.W_OK):
        required = "a file that can be written, in an existing folder"
        raise InvalidInput((option,), required, str(path))
