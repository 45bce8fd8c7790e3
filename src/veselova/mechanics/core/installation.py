"""How the package was installed, and so what installs an extra of it."""

from __future__ import annotations

import json
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

__all__ = ["install_extra"]

_NAME = "veselova"


def install_extra(extra: str) -> str:
    """Return the command that installs an extra, from where the package came: the folder of its
    source, the file or the address that it was installed from (PEP 610), or an index.
    """
    source = Path(__file__).resolve().parents[4]
    if (source / "pyproject.toml").is_file():
        return f"pip install '{source}[{extra}]'"
    try:
        found = distribution(_NAME)
    except PackageNotFoundError:
        return f"pip install '.[{extra}]' in the folder of its source"
    return f"pip install '{_requirement(found, extra)}'"


def _requirement(found: Distribution, extra: str) -> str:
    """Return what stands for the package with an extra behind ``pip install``."""
    try:
        origin = json.loads(found.read_text("direct_url.json") or "{}")
        url = str(origin.get("url", ""))
    except ValueError:
        url = ""
    if not url:
        return f"{_NAME}[{extra}]=={found.version}"
    parts = urlsplit(url)
    path = Path(url2pathname(parts.path))
    if parts.scheme == "file" and path.exists():
        return f"{path}[{extra}]"
    # A file that is gone would not install; the name and the version are what is left.
    if parts.scheme == "file":
        return f"{_NAME}[{extra}]=={found.version}"
    control = origin.get("vcs_info", {}).get("vcs")
    return f"{_NAME}[{extra}] @ {control + '+' if control else ''}{url}"
