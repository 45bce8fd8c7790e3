"""Worked examples: the body of the first run, of ``veselova demo`` and of the OpenAPI document."""

from __future__ import annotations

from typing import Any

__all__ = ["BODY4", "BODY4_PROBLEM"]

#: A four-dimensional body with distinct A's, thrown so that no phase is slow (examples/body4.json is this document).
BODY4_PROBLEM: dict[str, Any] = {
    "system": "veselova",
    "A": [3, 2, "1.5", 1],
    "q": ["0.5", "0.5", "0.5", "0.5"],
    "q_dot": ["1.1", "-0.7", "0.3", "-0.7"],
}

BODY4: dict[str, Any] = {"problem": BODY4_PROBLEM, "times": {"start": 0, "stop": 60, "count": 601}}
