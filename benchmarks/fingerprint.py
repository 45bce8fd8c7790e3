"""Make the fingerprint of the results anew: motions of every system with a closed form, with their
errors, by version.

    python benchmarks/fingerprint.py

Cached answers and sweeps are trusted as long as the version stays.
``tests/agreement/test_fingerprint.py`` compares the results of this checkout with
``tests/reference/fingerprint.json`` and fails when a value differs by more than the two errors
together. Bump ``src/veselova/version.py`` first, and then run this command.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from stored_results import FILE, text

if __name__ == "__main__":
    FILE.write_text(text())
