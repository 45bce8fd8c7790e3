"""The JSON of requests: which fields there are, and every fault of a body at once. Fields that hold
numbers are taken as they come, and validated where problem and times are built.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Annotated, Any, Literal, TypeVar

from pydantic import ConfigDict, Field, ValidationError

from veselova.engines import require_comparison, require_options
from veselova.ensemble_starts import Starts
from veselova.mechanics.core.arguments import FEWEST_DIGITS, MOST_DIGITS, beyond_double
from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    InvalidRequest,
    did_you_mean,
    field_faults,
    select_faults,
    show,
    unknown_name,
)
from veselova.mechanics.core.exact_input import double_array
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.ensemble import chosen_outputs
from veselova.mechanics.systems.veselova import Veselova
from veselova.service.api.examples import BODY4_PROBLEM, ENSEMBLE
from veselova.service.api.problem_models import (
    SYSTEMS,
    Given,
    ProblemModel,
    Request,
    Times,
    from_null,
)

#: Most series that a request may name: no system has as many.
_MOST_OUTPUTS = 20

#: No request nests deeper than request, problem, matrix, row; twice that leaves wrong nesting to
#: the field's own message.
_DEEPEST = 8

#: Faults of shape that are named; further ones, such as fields of no request, are counted.
_NAMED = 20

#: Problems up to here are looked at for further faults where a limit of the server is exceeded.
_SMALL_DIMENSION = 16

#: Fields whose faults depend on no system.
_OF_ANY_SYSTEM = ("times", "budget_s", "digits", "accuracy")


Engine = Annotated[
    Literal["analytic", "numeric"] | None,
    Field(description="analytic where the problem has a closed form, when left out"),
]
Method = Annotated[
    str | None, Field(description="analytic: theta, angles; numeric: dop853, taylor")
]
Formulation = Annotated[
    str | None, Field(description="numeric: which equations of the system are integrated")
]
Outputs = Annotated[
    list[str] | None,
    Field(
        min_length=1,
        max_length=_MOST_OUTPUTS,
        description="series of the system (GET /v1/systems); those of most use when left out",
    ),
]
Digits = Annotated[
    int,
    Field(
        ge=FEWEST_DIGITS,
        le=MOST_DIGITS,
        description=f"beyond {FEWEST_DIGITS}, answers are decimal strings with radii",
    ),
]
Certified = Annotated[
    bool, Field(description="whether every number comes with a proven bound of its error")
]


def stated_count(times: Any) -> int:
    """Return how many times a list or a grid of a request has, 0 where it is neither."""
    count = times.get("count") if isinstance(times, dict) else times
    if isinstance(count, int):
        return count
    return len(count) if isinstance(count, list) else 0


def time_grid(times: Any, exact: bool = False) -> TimeGrid:
    """Return the times that a request asks for; raises InvalidInput located at ``times``."""
    # Python takes a single number too, the schema of requests does not
    if not isinstance(times, (list, dict)):
        required = "a list of numbers, or exactly the fields start, stop, count"
        raise InvalidInput(("times",), required, show(times))
    return TimeGrid.of(times, exact)


class BudgetedRequest(Request):
    """A request whose work is stopped after its budget."""

    budget_s: Annotated[
        float,
        Field(gt=0, allow_inf_nan=False, description="seconds after which the work is stopped"),
    ] = 10.0

    @property
    def dimension_at(self) -> tuple[tuple[str, ...], int]:
        """Return the field that shows n, and n, before anything is validated."""
        return (), 0

    @property
    def values_at(self) -> tuple[tuple[str, ...], int]:
        """Return the field that says how many numbers an answer has, and that number, before
        anything is validated.
        """
        return (), 0

    def faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond the types of its fields: its numbers, and
        options that the system has not.
        """
        return []


class TorusRequest(BudgetedRequest):
    """A request for the invariant torus of a problem."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"problem": BODY4_PROBLEM}]})

    problem: ProblemModel

    def faults(self) -> list[InvalidInput]:
        """Return what is wrong with the problem."""
        faults = Faults()
        faults.attempt(lambda: self.problem.problem)
        return faults.found

    @property
    def dimension_at(self) -> tuple[tuple[str, ...], int]:
        """Return the field of the problem that shows n, and n."""
        return ("problem", self.problem.measured), self.problem.dimension


class ComparisonRequest(TorusRequest):
    """A request for a motion by both engines, or by two formulations where there is one engine."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"problem": BODY4_PROBLEM, "times": [0, 1], "outputs": ["q", "tau1"]}]
        }
    )

    times: Times
    method: Method = None
    formulation: Formulation = None
    outputs: Outputs = None

    @property
    def values_at(self) -> tuple[tuple[str, ...], int]:
        """Return the times, and how many entries of frames there are at them."""
        return ("times",), stated_count(self.times) * self.problem.dimension**2

    @cached_property
    def time_grid(self) -> TimeGrid:
        """Return the times asked for; raises InvalidInput located at ``times``."""
        return time_grid(self.times)

    def faults(self) -> list[InvalidInput]:
        """Return what is wrong with options, outputs, problem and times."""
        faults = Faults()
        self._try_options(faults)
        names = list(self.problem.outputs)
        faults.found += [
            unknown_name(("outputs", i), name, names)
            for i, name in enumerate(self.outputs or ())
            if name not in names
        ]
        faults.attempt(lambda: self.time_grid)
        return [*super().faults(), *faults.found]

    def _try_options(self, faults: Faults) -> None:
        """Collect what is wrong with the options of the engines."""
        kind = self.problem.problem_class
        faults.attempt(require_comparison, kind, self.method, self.formulation)


class TrajectoryRequest(ComparisonRequest):
    """A request for a motion by one engine."""

    engine: Engine = None
    digits: Digits = FEWEST_DIGITS
    certified: Certified = False

    def _try_options(self, faults: Faults) -> None:
        kind = self.problem.problem_class
        engine: str | None = self.engine
        exact = beyond_double(self.digits, self.certified)
        if engine is None and exact and "analytic" in kind.engines:
            engine = "analytic"
        if engine is None and kind.without_closed_form is Problem.without_closed_form:
            engine = next(iter(kind.engines))
        if engine is not None:  # else it depends on the numbers, and is refused where it solves
            options = (self.method, self.formulation, self.digits, self.certified)
            faults.attempt(require_options, kind, engine, *options)

    @cached_property
    def time_grid(self) -> TimeGrid:
        """Return the times asked for; raises InvalidInput located at ``times``."""
        return time_grid(self.times, beyond_double(self.digits, self.certified))


_Model = TypeVar("_Model", bound=BudgetedRequest)
_Part = TypeVar("_Part", bound=Request)


def read_request(
    model: type[_Model], document: Any, beyond_limits: Callable[[_Model], Any] = lambda _: []
) -> _Model:
    """Return the request that a decoded JSON document states, whose problem and times are valid;
    raises InvalidRequest with every fault found, those ``beyond_limits`` of a server among them.
    """
    _require_shallow(document)
    found: list[InvalidInput] = []
    further = 0
    try:
        request = model.model_validate(document)
    except ValidationError as error:
        items = error.errors(include_url=False)
        found = [_fault(model, item) for item in items[:_NAMED]]
        further = len(items) - len(found)
        if not isinstance(document, dict):
            raise InvalidRequest(found) from None
        # what else is wrong is said of a request that has the sound fields of this one
        wrong = {item["loc"] for item in items}
        request = _sound(model, {k: x for k, x in document.items() if (k,) not in wrong})
    others = beyond_limits(request)
    if not others or request.dimension_at[1] <= _SMALL_DIMENSION:
        others += request.faults()
    reported = [fault.path for fault in found]
    if {("problem",), ("problem", "system")} & {*reported} and "problem" in model.model_fields:
        reported += [(name,) for name in model.model_fields if name not in _OF_ANY_SYSTEM]

    def is_further(fault: InvalidInput) -> bool:
        return not any(fault.path[: len(path)] == path for path in reported)

    if found := [*found, *select_faults(others, is_further)]:
        raise InvalidRequest(found, further)
    return request


def _fault(model: type[Request], item: Any) -> InvalidInput:
    """Return pydantic's finding as a fault, located as in the document."""
    error = item.get("ctx", {}).get("error")
    if isinstance(error, InvalidInput):
        return error
    path, kind, given = item["loc"], item["type"], item["input"]
    if path[:1] == ("problem",) and path[1:2] and path[1] in SYSTEMS:
        model, path = SYSTEMS[path[1]], ("problem", *path[2:])  # pydantic names what it took
    if kind == "union_tag_invalid":
        return unknown_name((*path, "system"), given["system"], list(SYSTEMS))
    if kind == "extra_forbidden":
        named = f"the field {show(str(path[-1]))}{did_you_mean(path[-1], model.model_fields)}"
        return InvalidInput(path, "no field of this name", named)
    if kind == "union_tag_not_found" and isinstance(given, dict):
        path, kind = (*path, "system"), "missing"
    if kind == "missing":
        return InvalidInput(path, "this field", "nothing")
    if kind in ("union_tag_not_found", "model_type", "model_attributes_type"):
        return InvalidInput(path, "a JSON object", show(given))
    required = item["msg"].removeprefix("Input should be ")
    return InvalidInput(path, required[:1].lower() + required[1:], show(given))


def _sound(model: type[_Part], stated: Mapping[str, Any]) -> _Part:
    """Return a request, or a part of one, with those of its fields that are stated, and None for
    others that it requires. A problem of no known system is another one.
    """
    required = [name for name, field in model.model_fields.items() if field.is_required()]
    fields = {name: value for name, value in stated.items() if name in model.model_fields}
    if "problem" in model.model_fields:
        problem = stated.get("problem")
        # a name that is a list, say, is none, and no dictionary looks for it
        if not isinstance(problem, dict) or problem.get("system") not in list(SYSTEMS):
            problem = BODY4_PROBLEM
        fields["problem"] = _sound(SYSTEMS[problem["system"]], problem)
    return model.model_construct(**{**dict.fromkeys(required), **fields})


def _require_shallow(document: Any) -> None:
    """Raise InvalidInput for a document that is nested more deeply than any request."""
    layer = [document]
    for _ in range(_DEEPEST + 1):
        inner = [value for value in layer if isinstance(value, (dict, list))]
        layer = [x for part in inner for x in (part.values() if isinstance(part, dict) else part)]
    if layer:
        raise InvalidInput((), f"at most {_DEEPEST} levels of nesting", "more")


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
            names = ("q", "q_dot")
            faults.found += field_faults(place, starts, names, names)
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
