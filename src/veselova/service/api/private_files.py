"""Folders and files of this account alone: where they are made, and which are refused."""

from __future__ import annotations

import os
import stat
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from veselova.mechanics.core.errors import InvalidInput


def make_private(path: Path) -> None:
    """Make a folder, and those above it that are missing, for this account alone; one that is there
    stays as it is.
    """
    for folder in (*reversed(path.parents), path):
        folder.mkdir(mode=0o700, exist_ok=True)


def own_folder(path: Path) -> None:
    """Make a folder, and those above it that are missing, for this account alone.

    Raises InvalidInput for a folder that is there and is not this account's own, OSError where it
    cannot be made.
    """
    make_private(path)
    require_own(path)


def require_own(path: Path) -> None:
    """Raise InvalidInput where a folder is another account's, or where others may write into it:
    its names may be anybody's. What is not there is left to whoever opens it.
    """
    if not path.is_dir():
        return
    found = path.stat()
    mode = stat.S_IMODE(found.st_mode)
    if found.st_uid != os.geteuid() or mode & (stat.S_IWGRP | stat.S_IWOTH):
        required = f"a folder of state that this account owns and nobody else may write: {path}"
        given = f"one of account {found.st_uid} and mode {mode:04o}"
        raise InvalidInput(("VESELOVA_DATA_DIR",), required, given)


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Give the name of a part beside a file, to write it; at the end of the block it is on the disk
    and becomes the file, or is gone.

    A death of the process leaves the part, whose name ends in ``.part``.
    """
    part = path.with_name(f".{path.name}.{uuid.uuid4().hex}.part")
    try:
        yield part
        part.chmod(0o600)
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise
