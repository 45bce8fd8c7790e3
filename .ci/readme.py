"""README.md as an index of packages shows it: no link is relative.

Hatchling's hook. ``VESELOVA_REPOSITORY`` is the address of the repository on a host that has files
at ``/blob/TAG/`` and their bytes at ``/raw/TAG/``. Links lead there, to the tag of this version.
Without it links become their texts, and pictures are left out.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

try:
    from hatchling.metadata.plugin.interface import MetadataHookInterface
except ImportError:  # read by itself
    MetadataHookInterface = object

#: A picture or a link whose target is a file of this repository.
_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?![a-z]+:|#)([^)\s]+)\)")


def standalone(text: str, repository: str, version: str) -> str:
    """Return Markdown whose links to files are absolute, or are their texts without a
    repository.
    """

    def replace(link: re.Match[str]) -> str:
        picture, label, target = link.groups()
        if not repository:
            return "" if picture else label
        kind = "raw" if picture else "blob"
        return f"{picture}[{label}]({repository.rstrip('/')}/{kind}/v{version}/{target})"

    return _LINK.sub(replace, text)


class CustomMetadataHook(MetadataHookInterface):
    """Puts the README into the metadata of a package."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the field ``readme``."""
        root = Path(self.root)
        source = (root / "src" / "veselova" / "version.py").read_text(encoding="utf-8")
        found = re.search(r'__version__ = "([^"]+)"', source)
        assert found, "version.py states no version"
        text = (root / "README.md").read_text(encoding="utf-8")
        repository = os.environ.get("VESELOVA_REPOSITORY", "")
        metadata["readme"] = {
            "content-type": "text/markdown",
            "text": standalone(text, repository, found[1]),
        }
