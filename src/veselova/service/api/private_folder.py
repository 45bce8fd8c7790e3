"""Folders that belong to this account alone: where they are made, and which are refused."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from veselova.mechanics.core.errors import InvalidInput

__all__ = ["make_private", "own_folder", "require_own"]

#: Permissions to write that a folder of state may not give to its group and to others.
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def make_private(path: Path) -> None:
    """Make a folder, and those above it that are missing, for this account alone; one that is there
    stays as it is.
    """
    missing = []
    for folder in (path, *path.parents):
        if os.path.lexists(folder):
            break
        missing.append(folder)
    for folder in reversed(missing):
        folder.mkdir(mode=0o700, exist_ok=True)


def own_folder(path: Path) -> None:
    """Make a folder, and those above it that are missing, readable and writable by this account
    alone.

    Raises InvalidInput for a folder that is there and is not this account's own, OSError where it
    cannot be made.
    """
    make_private(path)
    require_own(path)
    if _is_shared(path.parent) and path.is_dir():
        path.chmod(0o700)


def require_own(path: Path) -> None:
    """Raise InvalidInput where a folder is not this account's, where others may write into it, or
    where another's link leads.

    Where everybody may make names, as in the folder of temporary files, no link is followed.
    What is no folder, or is not there, is left to whoever opens it.
    """
    # not a POSIX system: access is a matter of lists, which the folder inherits
    if not hasattr(os, "geteuid"):
        return
    try:
        link = path.lstat()
        folder = path.stat()
    except OSError:
        return
    if not stat.S_ISDIR(folder.st_mode):
        return
    account = os.geteuid()
    if stat.S_ISLNK(link.st_mode) and (link.st_uid not in (account, 0) or _is_shared(path.parent)):
        raise _refusal(path, f"a link of account {link.st_uid} to another place")
    if folder.st_uid != account:
        raise _refusal(path, f"one of account {folder.st_uid}, while this is account {account}")
    if folder.st_mode & _OTHERS_WRITE:
        raise _refusal(
            path, f"one of mode {stat.S_IMODE(folder.st_mode):04o} (chmod go-w '{path}')"
        )


def _is_shared(folder: Path) -> bool:
    """Return whether others may make names in a folder."""
    try:
        return bool(folder.stat().st_mode & _OTHERS_WRITE)
    except OSError:
        return False


def _refusal(path: Path, given: str) -> InvalidInput:
    required = (
        f"a folder of state that this account owns and nobody else may write, in place of {path}"
    )
    return InvalidInput(("VESELOVA_DATA_DIR",), required, given)
