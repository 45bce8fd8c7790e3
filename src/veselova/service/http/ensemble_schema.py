"""The JSON schema of the motions of many starts."""

from __future__ import annotations

from typing import Any

from veselova.service.api.problem_models import SYSTEMS

__all__ = ["ensemble_schema"]


def _list_of(kind: str, description: str) -> dict[str, Any]:
    return {"type": "array", "items": {"type": kind}, "description": description}


def ensemble_schema(provenance: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of the answer; ``provenance`` is that of its last field."""
    error = (
        "bounds the true error of every component of the bounded series at each time: "
        "true ≤ error; bounded are q and frame; by rows, times"
    )
    properties = {
        "times": _list_of("number", "the doubles nearest to the times asked for"),
        "outcome": _list_of("string", "of each start: solved, or the reason's name"),
        "detail": _list_of("string", "of each start: the reason in a sentence"),
        "together": _list_of("boolean", "which starts were computed side by side"),
        "rows": _list_of("integer", "starts that were solved, from 0: first axis of the series"),
        "series": {"type": "object", "properties": _series()},
        "error": {"type": "array", "items": _list_of("number", "by times"), "description": error},
        "provenance": provenance,
    }
    return {"type": "object", "properties": properties, "required": list(properties)}


def _series() -> dict[str, Any]:
    schemas = {}
    for name, axes in SYSTEMS["veselova"].problem_class.outputs.items():
        schema: dict[str, Any] = {"type": "number"}
        for _ in range(len(axes) + 2):
            schema = {"type": "array", "items": schema}
        schemas[name] = {**schema, "description": "by rows, times and components"}
    return schemas
