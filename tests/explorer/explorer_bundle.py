"""The build of the explorer, for its tests."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

EXPLORER = Path(__file__).parent.parent.parent / "explorer"


def load_build() -> ModuleType:
    """Return the module ``explorer/build.py``, which is part of no package."""
    spec = importlib.util.spec_from_file_location("explorer_build", EXPLORER / "build.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


BUILD = load_build()


def npm_or_skip() -> list[str]:
    """Return the command of npm; skips the test where there is no Node."""
    npm = BUILD.find_node()
    if npm is None:
        pytest.skip(f"needs Node {BUILD.OLDEST_NODE} or newer")
    return list(npm)


def build_or_skip() -> Path:
    """Return the folder of the bundle as the sources are now; skips the test where it cannot be
    built.
    """
    npm_or_skip()
    if reason := BUILD.build():
        pytest.skip(reason)
    return Path(BUILD.BUNDLE)
