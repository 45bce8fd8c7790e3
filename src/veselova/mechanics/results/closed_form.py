"""The closed form of a motion as data: numbers from which any language evaluates it at any time."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.mechanics.core.arguments import takes_arrays, whole_number
from veselova.mechanics.core.errors import InvalidInput, did_you_mean, show
from veselova.mechanics.core.problem import html_table
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.closed_form_evaluation import evaluate, largest_speed
from veselova.mechanics.results.closed_form_schema import FORMAT, read_document

__all__ = ["ClosedForm", "ClosedFormStates", "require_accuracy"]

Array = NDArray[np.float64]

#: The finest and the coarsest accuracy that may be asked for: above the coarsest nothing is left of
#: the motion.
_FINEST, _COARSEST = 1e-15, 1e-2


def require_accuracy(accuracy: Any) -> float:
    """Return the error that modes left out of a time map may make, 1e-12 for None; raises
    InvalidInput.
    """
    found = 1e-12 if accuracy is None else accuracy
    is_number = isinstance(found, (int, float)) and not isinstance(found, bool)
    if not is_number or not _FINEST <= found <= _COARSEST:
        required = f"a number from {_FINEST:g} to {_COARSEST:g}"
        raise InvalidInput(("accuracy",), required, show(accuracy))
    return float(found)


@dataclass(frozen=True, eq=False)
class ClosedFormStates:
    """States evaluated from a closed-form document.

    - times: (N,)
    - error: (N,) a bound on every component of q and the frame
    - series: by name, first axis the times: those of the system that follow from attitude and
      velocity. They are attributes too
    """

    times: Array
    error: Array
    series: Mapping[str, Array]

    def __getattr__(self, name: str) -> Array:
        series = self.__dict__.get("series", {})
        if name in series:
            return np.asarray(series[name])
        raise AttributeError(
            f"these states have no {name!r}; they have "
            f"{', '.join(series)}{did_you_mean(name, series)}"
        )


@dataclass(frozen=True, eq=False, repr=False)
class ClosedForm:
    """The motion of one problem as a document, whose fields docs/closed-form.md defines.

    ``document`` is JSON-ready; ``fields`` are its fields by name, lists of numbers as arrays.
    ``at`` evaluates it without the engine that made it.
    """

    document: Mapping[str, Any]
    fields: Mapping[str, Any] = field(init=False)

    #: The name of the format in a document, and its version; with an area constant it is another.
    format: ClassVar[str] = FORMAT

    def __post_init__(self) -> None:
        object.__setattr__(self, "fields", read_document(self.document))

    def __repr__(self) -> str:
        size = len(self.document["modes"])
        return (
            f"ClosedForm({self.system}, genus {self.genus}, {size} modes, "
            f"{len(self.to_json()) / 1000:.0f} kB)"
        )

    def _repr_html_(self) -> str:
        error = self.fields["error"]
        rows: dict[str, object] = {name: getattr(self, name) for name in ("system", "genus")}
        rows |= {"modes": len(self.document["modes"]), "bytes": len(self.to_json().encode())}
        rows["error"] = f"{error['at_start']:.2g} + {error['per_unit_time']:.2g}·|t|"
        return html_table(rows)

    @property
    def system(self) -> str:
        """Return the name of the system."""
        return str(self.document["problem"]["system"])

    @property
    def genus(self) -> int:
        """Return g, the number of phases."""
        return int(self.document["genus"])

    def at(self, times: ArrayLike | Sequence[Any] | Mapping[str, Any]) -> ClosedFormStates:
        """Return the states at times, in the units of the problem, from the document alone.

        Times are those of the system, t, s or τ₁, in any form and order that ``veselova.solve``
        takes. Raises InvalidInput for bad times. Accuracy: ``error`` of the states; tested for
        genus 1…4 against the engine, |t| ≤ 10⁴.
        """
        grid = TimeGrid.of(times, False)
        known = self.fields["error"]
        error = known["at_start"] + known["per_unit_time"] * np.abs(grid.doubles)
        series = evaluate(self.fields, grid.doubles)
        if grid.late.any():
            error = error + grid.late * largest_speed(self.fields, series)
        if grid.places is not None:
            error = error[grid.places]
            series = {name: values[grid.places] for name, values in series.items()}
        return ClosedFormStates(grid.asked, error, series)

    @takes_arrays
    def to_json(self, indent: int | None = None) -> str:
        """Return the document as JSON text, on one line or with lines indented by so many spaces,
        0 to 100.
        """
        if indent is not None:
            whole_number(indent, ("indent",), 0, 100)
        separators = (",", ":") if indent is None else None
        return json.dumps(
            self.document, ensure_ascii=False, allow_nan=False, indent=indent, separators=separators
        )

    @classmethod
    def from_json(cls, text: str | bytes) -> ClosedForm:
        """Return the closed form of a JSON text, which may begin with a byte order mark; raises
        InvalidInput where it is none of this format.
        """
        try:
            document = json.loads(text.removeprefix("\ufeff") if isinstance(text, str) else text)
        except (ValueError, TypeError, RecursionError) as fault:
            raise InvalidInput(("document",), "JSON text", f"{show(text)} ({fault})") from None
        return cls(document)
