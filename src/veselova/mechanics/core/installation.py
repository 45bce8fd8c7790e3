"""The command that installs an extra of the package."""

from __future__ import annotations

from pathlib import Path

__all__ = ["install_extra"]


def install_extra(extra: str) -> str:
    """Return the command that installs an extra: from the folder of the source where that is what
    runs, else by the name of the package.
    """
    source = Path(__file__).resolve().parents[4]
    package = source if (source / "pyproject.toml").is_file() else "veselova"
    return f"pip install '{package}[{extra}]'"
