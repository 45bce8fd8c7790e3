"""The JSON of a request for the motions of many starts, in arrays."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from veselova.ensemble_starts import Starts
from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    missing_fields,
    show,
    unknown_fields,
)
from veselova.mechanics.core.exact_input import double_array
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.ensemble import chosen_outputs
from veselova.mechanics.systems.veselova import Veselova
from veselova.service.api.examples import ENSEMBLE
from veselova.service.api.problem_fields import Given, Request, Times, from_null
from veselova.service.api.request_models import BudgetedRequest, Outputs, stated_count, time_grid

_ARRAY = "lists of numbers, rows of one length"

_Rows = Annotated[list[Annotated[list[float | None], Field(min_length=2)]], Field(min_length=1)]


class StartRows(Request):
    """The states of many starts, a row each."""

    q: _Rows
    q_dot: _Rows


class EnsembleRequest(BudgetedRequest):
    """The motions of many Veselova problems at the same times."""

    model_config = ConfigDict(json_schema_extra={"examples": [ENSEMBLE]})

    system: Literal["veselova"] = "veselova"
    A: Given[Annotated[list[float], Field(min_length=2)] | _Rows | list[_Rows]] = Field(
        description="n positive numbers, or a row of them for each start, or matrices: one for "
        "all, or one for each start"
    )
    starts: Given[StartRows] = Field(
        description="rows of n numbers each; a row that is no start is named in the answer"
    )
    normalize: Annotated[
        bool, Field(description="whether every q is scaled, and every q_dot projected, first")
    ] = False
    times: Times
    outputs: Outputs = None

    @property
    def dimension_at(self) -> tuple[tuple[str, ...], int]:
        """Return the rows of q, and n as the first of them says."""
        rows = self._rows
        return ("starts", "q"), len(rows[0]) if rows and isinstance(rows[0], list) else 0

    @property
    def values_at(self) -> tuple[tuple[str, ...], int]:
        """Return the starts, and how many entries of frames there are at all times of all."""
        count = len(self._rows) * stated_count(self.times)
        return ("starts",), count * max(1, self.dimension_at[1]) ** 2

    @property
    def _rows(self) -> list[Any]:
        q = self.starts.get("q") if isinstance(self.starts, dict) else None
        return q if isinstance(q, list) else []

    def faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields."""
        faults = Faults()
        faults.attempt(chosen_outputs, Veselova, self.outputs)
        faults.attempt(lambda: self.parsed)
        faults.attempt(lambda: self.time_grid)
        return faults.found

    @cached_property
    def time_grid(self) -> TimeGrid:
        """Return the times asked for; raises InvalidInput located at ``times``."""
        return time_grid(self.times)

    @cached_property
    def parsed(self) -> Starts:
        """Return the problems; raises InvalidInput where they are no arrays of one length."""
        faults = Faults()
        place = ("starts",)
        A = faults.attempt(double_array, from_null(self.A), ("A",), _ARRAY)
        starts: Any = self.starts
        if isinstance(starts, dict):
            faults.found += unknown_fields(place, starts, ("q", "q_dot"))
            faults.found += missing_fields(place, starts, ("q", "q_dot"))
        else:
            faults.add(place, "a JSON object with q and q_dot", show(starts))
            starts = {}
        q, q_dot = (
            faults.attempt(double_array, from_null(starts.get(name)), (*place, name), _ARRAY)
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
