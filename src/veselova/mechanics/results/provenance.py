"""The provenance of a result: engine, method, version, digits and seconds."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.version import __version__

__all__ = ["Provenance"]


@dataclass(frozen=True)
class Provenance:
    """How a trajectory was computed. ``details`` are figures of the method: nodes,
    modes, steps …
    """

    engine: str
    method: str
    digits: int
    version: str
    seconds: float
    details: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def since(
        cls, began: float, engine: str, method: str, details: Mapping[str, Any]
    ) -> Provenance:
        """Return the provenance of an answer in double precision that was begun at a reading of
        ``time.perf_counter``.
        """
        return cls(engine, method, FEWEST_DIGITS, __version__, time.perf_counter() - began, details)

    def as_dict(self) -> dict[str, Any]:
        """Return the provenance as a JSON-ready dictionary."""
        return {**vars(self), "details": dict(self.details)}
