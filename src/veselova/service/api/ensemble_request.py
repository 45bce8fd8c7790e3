"""The JSON of a request for the motions of many starts, in arrays."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import ConfigDict, Field, WithJsonSchema

from veselova.ensemble_starts import Starts
from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    missing_fields,
    show,
    unknown_fields,
)
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.ensemble import chosen_outputs
from veselova.mechanics.systems.veselova import Veselova
from veselova.service.api.examples import ENSEMBLE
from veselova.service.api.problem_models import Times
from veselova.service.api.request_models import MOST_OUTPUTS
from veselova.service.api.request_times import stated_count, time_faults, time_grid
from veselova.service.api.toolkit_requests import ToolkitRequest

__all__ = ["EnsembleRequest"]

_NUMBERS = {"type": "array", "items": {"type": "number"}, "minItems": 2}
_ENTRIES = {"type": "array", "items": {"type": ["number", "null"]}, "minItems": 2}
_ROWS = {"type": "array", "items": _ENTRIES, "minItems": 1}
_STARTS = {
    "type": "object",
    "properties": {"q": _ROWS, "q_dot": _ROWS},
    "required": ["q", "q_dot"],
    "additionalProperties": False,
}


class EnsembleRequest(ToolkitRequest):
    """The motions of many Veselova problems at the same times."""

    model_config = ConfigDict(json_schema_extra={"examples": [ENSEMBLE]})
    point_fields: ClassVar[tuple[str, ...]] = ("starts",)

    system: Literal["veselova"] = "veselova"
    A: Annotated[
        Any,
        WithJsonSchema({"anyOf": [_NUMBERS, _ROWS, {"type": "array", "items": _ROWS}]}),
        Field(
            description="n positive numbers, or a row of them for each start, or matrices: one for "
            "all, or one for each start"
        ),
    ]
    starts: Annotated[
        Any,
        WithJsonSchema(_STARTS),
        Field(description="rows of n numbers each; a row that is no start is named in the answer"),
    ]
    normalize: Annotated[
        bool, Field(description="whether every q is scaled, and every q_dot projected, first")
    ] = False
    times: Annotated[Times, Field(description="the same for all starts, as of a trajectory")]
    outputs: Annotated[
        list[str] | None,
        Field(
            min_length=1,
            max_length=MOST_OUTPUTS,
            description="series of the system; q_dot, frame and tau1 when left out",
        ),
    ] = None

    @property
    def subject(self) -> str:
        """Return the name of the system."""
        return self.system

    @property
    def dimension(self) -> int:
        """Return n as the first row says, before anything is validated."""
        rows = self._rows
        return len(rows[0]) if rows and isinstance(rows[0], list) else 0

    @property
    def _rows(self) -> list[Any]:
        q = self.starts.get("q") if isinstance(self.starts, dict) else None
        return q if isinstance(q, list) else []

    def point_count(self) -> int:
        """Return how many states there are, starts times times, before anything is validated."""
        return len(self._rows) * stated_count(self.times)

    def value_count(self) -> int:
        """Return how many numbers the frames of the answer have."""
        return self.point_count() * self.dimension**2

    def option_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields."""
        faults = Faults()
        faults.attempt(chosen_outputs, Veselova, self.outputs)
        faults.attempt(lambda: self.parsed)
        return [*faults.found, *time_faults(self.times)]

    def time_grid(self) -> TimeGrid:
        """Return the times asked for; raises InvalidInput located at ``times``."""
        return time_grid(self.times)

    @cached_property
    def parsed(self) -> Starts:
        """Return the problems; raises InvalidInput where they are no arrays of one length."""
        faults = Faults()
        place = ("starts",)
        A = faults.attempt(_array, self.A, ("A",))
        starts = self.starts if isinstance(self.starts, dict) else {}
        if not isinstance(self.starts, dict):
            faults.add(place, "a JSON object with q and q_dot", show(self.starts))
        else:
            faults.found += unknown_fields(place, starts, ("q", "q_dot"))
            faults.found += missing_fields(place, starts, ("q", "q_dot"))
        q, q_dot = (
            faults.attempt(_array, starts[name], (*place, name)) if name in starts else None
            for name in ("q", "q_dot")
        )
        faults.require_none()
        try:
            return Starts.of_arrays(A, q, q_dot, self.normalize)
        except InvalidInput as error:
            for fault in error.faults:
                path = fault.path if fault.path[0] == "A" else (*place, *fault.path)
                faults.add(path, fault.required, fault.given)
            faults.require_none()
            raise


def _array(values: Any, path: tuple[str, ...]) -> Any:
    """Return lists of numbers as an array, null as no number; raises InvalidInput."""
    flat = [values]
    for _ in range(3):
        flat = [x for row in flat for x in (row if isinstance(row, list) else [row])]
    if isinstance(values, list) and all(type(x) in (int, float, type(None)) for x in flat):
        try:
            return np.array(values, dtype=np.float64)
        except (ValueError, OverflowError):
            pass
    raise InvalidInput(path, "lists of numbers, rows of one length", show(values))
