"""The files that the command line reads and writes."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.folders import expand_home

__all__ = ["check_file", "read_document"]


def read_document(file: str) -> Any:
    """Return the decoded JSON of a file, or of standard input for ``-``; raises InvalidInput."""
    from veselova.service.api.problem_details import loads

    if file == "-" and sys.stdin is None:
        raise InvalidInput(("FILE",), "an open standard input", "a closed one")
    path = expand_home(file, "FILE")
    try:
        text = sys.stdin.buffer.read() if file == "-" else path.read_bytes()
    except OSError as error:
        raise InvalidInput(("FILE",), "a readable file", f"{file} ({error.strerror})") from None
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
