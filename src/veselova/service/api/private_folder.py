"""Folders that belong to this account alone: where they are made, and which are refused."""

from __future__ import annotations

import os
import stat
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
    # elsewhere than on POSIX access is a matter of lists, which the folder inherits
    if not hasattr(os, "geteuid") or not path.is_dir():
        return
    found = path.stat()
    mode = stat.S_IMODE(found.st_mode)
    if found.st_uid != os.geteuid() or mode & (stat.S_IWGRP | stat.S_IWOTH):
        required = f"a folder of state that this account owns and nobody else may write: {path}"
        given = f"one of account {found.st_uid} and mode {mode:04o}"
        raise InvalidInput(("VESELOVA_DATA_DIR",), required, given)
