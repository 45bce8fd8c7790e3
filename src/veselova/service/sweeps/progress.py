"""How far a running job is, as the process that runs it knows."""

from __future__ import annotations

import time
from dataclasses import dataclass

__all__ = ["Progress"]


@dataclass
class Progress:
    """How far a running job is: problems done before this process took it, and since; what it waits
    for, if anything.
    """

    began: float
    before: int
    done: int
    waits_for: str = ""

    @property
    def rate(self) -> float:
        """Return problems per second since this process took the job."""
        passed = time.monotonic() - self.began
        return (self.done - self.before) / passed if passed > 0 else 0.0
