"""The closed form of a motion as data: numbers from which any language evaluates it at any time."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, did_you_mean, show
from veselova.mechanics.core.exact_input import whole_number
from veselova.mechanics.core.number_contexts import in_own_contexts
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.closed_form_decimals import DecimalEvaluator
from veselova.mechanics.results.closed_form_evaluation import evaluate
from veselova.mechanics.results.closed_form_schema import FORMAT, require_document

__all__ = ["MOST_CLOSED_FORM_DIGITS", "ClosedForm", "ClosedFormStates", "require_accuracy"]

Array = NDArray[np.float64]

#: The coarsest accuracy that may be asked for: above it nothing is left of the motion.
_COARSEST = 1e-2

#: Digits that a document may have: accuracies are doubles.
MOST_CLOSED_FORM_DIGITS = 200


def require_accuracy(accuracy: Any, digits: int = 15) -> float:
    """Return the error that modes left out of a time map may make, 10^(3−digits) for None; raises
    InvalidInput.
    """
    if accuracy is None:
        return float(10.0 ** (3 - digits))
    finest = 10.0**-digits
    if (
        isinstance(accuracy, bool)
        or not isinstance(accuracy, (int, float))
        or not finest <= accuracy <= _COARSEST
    ):
        raise InvalidInput(
            ("accuracy",), f"a number from {finest:g} to {_COARSEST:g}", show(accuracy)
        )
    return float(accuracy)


@in_own_contexts
@dataclass(frozen=True, eq=False)
class ClosedFormStates:
    """States evaluated from a closed-form document.

    - times: (N,)
    - error: (N,) a bound on every component of q and the frame
    - series: by name, first axis the times: those of the system that follow from attitude and
      velocity. They are attributes too
    - decimals: the same series as arrays of ``decimal.Decimal``, where the document has more
      digits than a double; ``error`` is then that of these numbers
    """

    times: Array
    error: Array
    series: Mapping[str, Array]
    decimals: Mapping[str, NDArray[np.object_]] | None = None

    def __getattr__(self, name: str) -> Array:
        series = self.__dict__.get("series", {})
        if name in series:
            return np.asarray(series[name])
        raise AttributeError(
            f"these states have no {name!r}; they have "
            f"{', '.join(series)}{did_you_mean(name, series)}"
        )


@in_own_contexts
@dataclass(frozen=True, eq=False, repr=False)
class ClosedForm:
    """The motion of one problem as a document, whose fields docs/closed-form.md defines.

    ``document`` is JSON-ready. Where it was made with more digits than a double has, its numbers
    are strings. ``at`` evaluates it without the engine that made it.
    """

    document: Mapping[str, Any] = field(repr=False)

    #: The name of the format in a document, and its version; with an area constant it is another.
    format: ClassVar[str] = FORMAT

    def __post_init__(self) -> None:
        require_document(self.document)

    def __repr__(self) -> str:
        size = len(self.document["modes"])
        return (
            f"ClosedForm({self.system}, genus {self.genus}, {size} modes, "
            f"{len(self.to_json()) / 1000:.0f} kB)"
        )

    @property
    def system(self) -> str:
        """Return the name of the system."""
        return str(self.document["problem"]["system"])

    @property
    def genus(self) -> int:
        """Return g, the number of phases."""
        return int(self.document["genus"])

    @property
    def dimension(self) -> int:
        """Return n."""
        return len(self.document["directions"])

    @property
    def digits(self) -> int:
        """Return the decimal digits that the numbers of the document carry."""
        return int(self.document["digits"])

    @cached_property
    def arrays(self) -> Mapping[str, Array]:
        """Return the numeric fields in double precision, by name."""
        names = (
            "riemann_matrix",
            "phases",
            "frequencies",
            "rotation",
            "directions",
            "frozen",
            "coefficients",
            "A",
        )
        found = {name: np.array(self.document[name], dtype=np.float64) for name in names}
        modes = np.array(self.document["modes"], dtype=np.float64).reshape(-1, self.genus)
        halves = np.array(self.document["characteristics"], dtype=np.float64)
        return {**found, "modes": modes, "characteristics": halves.reshape(-1, 2, self.genus)}

    def at(self, times: Any) -> ClosedFormStates:
        """Return the states at times, in the units of the problem, from the document alone.

        Times are those of the system, t, s or τ₁, in any form and order that ``veselova.solve``
        takes. Raises InvalidInput for bad times. Accuracy: ``error`` of the states; tested for
        genus 1…4 against the engine, |t| ≤ 10⁴, and to 10¹² for documents of 30 digits, whose
        states have ``decimals``.
        """
        grid = TimeGrid.of(times, self.digits > FEWEST_DIGITS)
        error = self.document["error"]
        bound = float(error["at_start"]) + float(error["per_unit_time"]) * np.abs(grid.asked)
        if self.digits > FEWEST_DIGITS:
            decimals = self._evaluator.series([Fraction(time) for time in grid.exact])
            if grid.places is not None:
                decimals = {name: values[grid.places] for name, values in decimals.items()}
            series = {name: values.astype(np.float64) for name, values in decimals.items()}
            return ClosedFormStates(grid.asked, bound, series, decimals)
        series = evaluate(self.document, self.arrays, grid.doubles, grid.remainders)
        if grid.places is not None:
            series = {name: values[grid.places] for name, values in series.items()}
        return ClosedFormStates(grid.asked, bound, series)

    @cached_property
    def _evaluator(self) -> DecimalEvaluator:
        return DecimalEvaluator(self.document, self.arrays)

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
        """Return the closed form of a JSON text; raises InvalidInput where it is none of this
        format.
        """
        try:
            document = json.loads(text)
        except (ValueError, TypeError, RecursionError) as fault:
            raise InvalidInput(("document",), "JSON text", f"{show(text)} ({fault})") from None
        return cls(document)

    def to_latex(self, digits: int = 6) -> str:
        """Return the explicit formulas of this motion in LaTeX, its numbers to so many digits, 1
        to 15; raises InvalidInput for others.

        E has the columns e_i along the body axes, where A or the inertia is a matrix.
        """
        from veselova.mechanics.results.closed_form_formulas import latex

        return latex(self.document, self.arrays, digits)

    def to_sympy(self) -> Mapping[str, Any]:
        """Return the explicit formulas as SymPy expressions, by name; raises BackendMissing without
        sympy.

        - theta_k: the theta functions as finite sums in z_1 … z_g
        - q_i, normal_i_k, gamma_i: their quotients along the directions that move
        - time: t as a function of the Neumann time ``tau_1``
        - z_s: the phases there
        """
        from veselova.mechanics.results.closed_form_formulas import expressions

        return expressions(self.document, self.arrays)
