"""The progress of a long computation as a line on standard error."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from typing import Any, TypeAlias

__all__ = ["ProgressLine", "Report", "has_reader"]

#: Called with the name of a step, what is done of it, and the whole of it.
Report: TypeAlias = Callable[[str, float, float], object]

#: Seconds of work before the line appears.
_PATIENCE_S = 1.0

#: Characters of the bar.
_WIDTH = 24


def has_reader() -> bool:
    """Return whether a person reads standard error: terminal or notebook, main thread."""
    stream = sys.stderr
    if stream is None or threading.current_thread() is not threading.main_thread():
        return False
    if type(stream).__module__.startswith("ipykernel."):
        return True
    try:
        return stream.isatty()
    except ValueError:  # a closed stream
        return False


class ProgressLine:
    """One line on standard error, which appears after a second of work and is removed at the end.

    It is written again from a carriage return on, which terminals and notebooks both understand.
    """

    def __init__(self) -> None:
        self._stream: Any = sys.stderr
        self._began, self._length = time.monotonic(), 0

    def __call__(self, step: str, done: float, total: float) -> None:
        """Show how much of a step is done."""
        passed = time.monotonic() - self._began
        if passed < _PATIENCE_S or self._stream is None:
            return
        part = min(max(done / total, 0.0), 1.0)
        bar = ("#" * round(_WIDTH * part)).ljust(_WIDTH, ".")
        self._write(f"veselova: {step or 'work'} [{bar}] {100 * part:3.0f} %, {passed:.0f} s")

    def close(self) -> None:
        """Remove the line."""
        if self._length:
            self._write("")
            self._length = 0

    def _write(self, text: str) -> None:
        """Write a text over the line; a stream that is gone has no line any more."""
        try:
            self._stream.write("\r" + text.ljust(self._length) + "\r" * (not text))
            self._stream.flush()
        except (OSError, ValueError):
            self._stream = None
        self._length = len(text)
