"""The site of the guide, for its tests."""

from __future__ import annotations

import fcntl
import subprocess
from pathlib import Path

import pytest

from loading import load_file

ROOT = Path(__file__).parent.parent.parent

#: Seconds that the build may take, its environment included.
PATIENCE_S = 900.0


SITE = load_file(ROOT / "docs" / "site.py")


def build_or_skip() -> Path:
    """Return the folder of the site as its sources are now.

    Skips the test where its environment cannot be made, for want of a network; fails for a warning
    of Sphinx.
    """
    (ROOT / "build").mkdir(exist_ok=True)
    with (ROOT / "build" / "guide.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not SITE.is_built():
            answer = subprocess.run(
                [ROOT / "docs" / "build"], capture_output=True, text=True, timeout=PATIENCE_S
            )
            if not (ROOT / ".venv-docs" / "made-from").exists():
                pytest.skip(f"the environment of the guide cannot be made: {answer.stderr[-300:]}")
            assert answer.returncode == 0, answer.stdout + answer.stderr
    return Path(SITE.BUNDLE)
