"""The JSON schema of how a rolling ball moves on in the mean."""

from __future__ import annotations

from typing import Any

__all__ = ["DRIFT"]

DRIFT: dict[str, Any] = {
    "type": "object",
    "description": "the mean velocity of the contact point along e_2 … e_n; given for a ball with "
    "up to three phases, and not on a separatrix",
    "properties": {
        "velocity": {"type": "array", "items": {"type": "number"}},
        "resonance": {
            "anyOf": [{"type": "array", "items": {"type": "integer"}}, {"type": "null"}],
            "description": "whole numbers M with M·f = 0 by which a ball also drifts across; null "
            "where there are none",
        },
    },
    "required": ["velocity", "resonance"],
}
