"""Worked examples (``examples.json``): the body of the first run, of ``veselova demo``, of
``veselova example`` and of the OpenAPI document.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import orjson

from veselova.mechanics.core.arguments import require_name

_STATED = orjson.loads(Path(__file__).with_suffix(".json").read_bytes())

#: System → its problem.
PROBLEMS: dict[str, dict[str, Any]] = {
    system: {"system": system, **fields} for system, fields in _STATED["problems"].items()
}

#: A four-dimensional body with distinct A's, thrown so that no phase is slow (examples/body4.json
#: is this document).
BODY4_PROBLEM = PROBLEMS["veselova"]
BODY4: dict[str, Any] = {"problem": BODY4_PROBLEM, "times": _STATED["times"]}

#: A curve of genus 2 with one point over a cut and one in a gap, theta functions of its matrix, two
#: starts of one body, and the shortest way between two points of a dwarf planet.
CURVE, THETA, ENSEMBLE, GEODESIC = map(_STATED.get, ("curve", "theta", "ensemble", "geodesic"))


def example_request(system: str) -> dict[str, Any]:
    """Return a request of a system for ``veselova solve``; raises InvalidInput for another name."""
    require_name(system, ("SYSTEM",), list(PROBLEMS))
    return {"problem": PROBLEMS[system], "times": {"start": 0, "stop": 20, "count": 201}}
