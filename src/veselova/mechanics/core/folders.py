"""Paths that users and the environment state, with ``~`` for a home folder."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from veselova.mechanics.core.errors import InvalidInput

__all__ = ["account_folder", "expand_home"]


def expand_home(path: str | os.PathLike[str], field: str = "folder") -> Path:
    """Return a path, with ``~`` and ``~NAME`` at its start replaced by the home folder.

    Raises InvalidInput for a ``~`` where there is no home: it would become a folder of that name.
    """
    try:
        return Path(path).expanduser()
    except RuntimeError:
        required = "a path without ~, for this account has no home folder"
        raise InvalidInput((field,), required, str(path)) from None


def account_folder(variable: str, default: str) -> Path:
    """Return the folder ``veselova`` below the one that an XDG variable names, or else below
    ``default`` in the home folder; without a home, one of this account among temporary files.
    """
    try:
        return expand_home(os.environ.get(variable) or f"~/{default}", variable) / "veselova"
    except InvalidInput:
        # which is refused where another account made it
        return Path(tempfile.gettempdir()) / f"veselova-{os.getuid()}"
