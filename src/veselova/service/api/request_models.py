"""The JSON of requests: which fields there are. What numbers may be is said once, by
mechanics.exact.

The numerical fields are taken as they come (their JSON schema is stated for the OpenAPI document)
and validated where the problem is built, so that Python, command line and HTTP refuse the same
input with the same sentence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import islice
from typing import Annotated, Any, Literal, TypeVar

from pydantic import ConfigDict, Field, ValidationError, model_validator

from veselova.engines import require_comparison, require_options
from veselova.mechanics.core.decimals import FEWEST_DIGITS, MOST_DIGITS, beyond_double
from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    InvalidRequest,
    VeselovaError,
    select_faults,
    unknown_name,
)
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.times import TimeGrid
from veselova.service.api.examples import BODY4, BODY4_PROBLEM
from veselova.service.api.field_faults import MOST_OUTPUTS, field_fault
from veselova.service.api.problem_models import SYSTEMS, ProblemModel, Request, Times
from veselova.service.api.request_times import stated_count, time_faults, time_grid

__all__ = [
    "MOST_OUTPUTS",
    "BudgetedRequest",
    "ComparisonRequest",
    "TorusRequest",
    "TrajectoryRequest",
    "read_request",
    "require_valid",
]

#: No request nests deeper than request, problem, matrix, row; twice that leaves wrong nesting to
#: the field's own message.
_DEEPEST = 8

#: A request has ten fields at most; beyond this many, unknown ones are not listed one by one.
_MOST_FIELDS = 40

#: Problems up to here are looked at for further faults before the limits of the server are.
_SMALL_DIMENSION = 16

#: Fields whose faults depend on no system.
_OF_ANY_SYSTEM = ("times", "budget_s", "digits", "accuracy")


class BudgetedRequest(Request):
    """What is asked of a server: work that ends after its budget."""

    budget_s: Annotated[
        float,
        Field(gt=0, allow_inf_nan=False, description="seconds after which the work is stopped"),
    ] = 10.0

    @model_validator(mode="before")
    @classmethod
    def _require_modest(cls, document: Any) -> Any:
        """Refuse what is too deep or too wide to be validated field by field."""
        if any(True for _ in islice(_layers(document), _DEEPEST + 1, None)):
            raise InvalidInput((), f"at most {_DEEPEST} levels of nesting", "more")
        problem = document.get("problem") if isinstance(document, dict) else None
        for path, part in (((), document), (("problem",), problem)):
            if isinstance(part, dict) and len(part) > _MOST_FIELDS:
                raise InvalidInput(path, "the fields of a request", f"{len(part)} fields")
        return document

    @property
    def subject(self) -> str:
        """Return what the request is about, in a word."""
        raise NotImplementedError

    @property
    def depends_on_problem(self) -> bool:
        """Return whether its problem has to be built to know its options."""
        return False

    def option_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields and numbers."""
        return []

    def data_faults(self) -> list[InvalidInput]:
        """Return what is wrong with its numbers."""
        return []


class TorusRequest(BudgetedRequest):
    """A problem whose invariant torus is asked for."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"problem": BODY4_PROBLEM}]})

    problem: ProblemModel

    @property
    def subject(self) -> str:
        """Return the name of the system."""
        return self.problem.system

    def data_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the numbers of the request; those of large problems, which take
        long, are left aside.
        """
        faults = Faults()
        if self.problem.dimension <= _SMALL_DIMENSION:
            faults.attempt(self.problem.problem)
        return faults.found

    def time_count(self) -> int:
        """Return how many times are asked for, without building them."""
        return 0


class ComparisonRequest(TorusRequest):
    """A motion asked of both engines, or in two formulations of a system with one."""

    model_config = ConfigDict(json_schema_extra={"examples": [BODY4]})

    times: Annotated[
        Times,
        Field(description="finite, in any order; the start is t = 0, negative times are fine"),
    ]
    method: Annotated[
        str | None,
        Field(description="analytic: theta, angles; numeric: dop853, taylor"),
    ] = None
    formulation: Annotated[
        str | None, Field(description="numeric: which equations of the system are integrated")
    ] = None
    outputs: Annotated[
        list[str] | None,
        Field(
            min_length=1,
            max_length=MOST_OUTPUTS,
            description="series of the system (GET /v1/systems); all when left out",
        ),
    ] = None
    digits: Annotated[
        int,
        Field(
            ge=FEWEST_DIGITS,
            le=FEWEST_DIGITS,
            description="a comparison has the digits of the numeric engine",
        ),
    ] = FEWEST_DIGITS

    def time_grid(self) -> TimeGrid:
        """Return the times asked for; raises InvalidInput located at ``times``."""
        return time_grid(self.times, self._exact)

    @property
    def _exact(self) -> bool:
        """Return whether times are needed to more digits than a double has."""
        return False

    def option_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the options for the system that they are asked of."""
        faults = Faults()
        self._try_options(faults)
        names = list(self.problem.outputs)
        faults.found += [
            unknown_name(("outputs", i), name, names)
            for i, name in enumerate(self.outputs or ())
            if name not in names
        ]
        return faults.found

    def data_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the problem and the times; the numbers of large problems and
        the points of long grids, which take long, are left aside.
        """
        return [*super().data_faults(), *time_faults(self.times, self._exact)]

    def _try_options(self, faults: Faults) -> None:
        """Collect what is wrong with the options of the engines."""
        kind = SYSTEMS[self.problem.system].problem_class
        faults.attempt(require_comparison, kind, self.method, self.formulation)

    def time_count(self) -> int:
        """Return how many times are asked for, without building them (a list, or a count)."""
        return stated_count(self.times)


class TrajectoryRequest(ComparisonRequest):
    """A motion asked of one engine."""

    engine: Annotated[
        Literal["analytic", "numeric"] | None,
        Field(description="analytic where the problem has a closed form, when left out"),
    ] = None
    digits: Annotated[
        int,
        Field(
            ge=FEWEST_DIGITS,
            le=MOST_DIGITS,
            description=f"beyond {FEWEST_DIGITS}, answers are decimal strings",
        ),
    ] = FEWEST_DIGITS
    certified: Annotated[
        bool, Field(description="whether every number comes with a proven bound of its error")
    ] = False

    @property
    def depends_on_problem(self) -> bool:
        """Return whether no engine is asked for, and not all problems of the system have the same
        one.
        """
        kind = SYSTEMS[self.problem.system].problem_class
        return self.engine is None and kind.default_engine is not Problem.default_engine

    @cached_property
    def chosen_engine(self) -> str:
        """Return the engine asked for, or the one that serves the problem when none is."""
        kind = SYSTEMS[self.problem.system].problem_class
        if not self.depends_on_problem:
            return self.engine or next(iter(kind.engines))
        try:
            return self.problem.problem().default_engine
        except VeselovaError:  # a fault that is named where the problem is solved
            return next(iter(kind.engines))

    def _try_options(self, faults: Faults) -> None:
        kind = SYSTEMS[self.problem.system].problem_class
        if (self.engine, self.method, self.formulation, self._exact) == (None, None, None, False):
            return
        engine = self.engine or (
            "analytic" if self._exact and "analytic" in kind.engines else self.chosen_engine
        )
        faults.attempt(
            require_options,
            kind,
            engine,
            self.method,
            self.formulation,
            self.digits,
            self.certified,
        )

    @property
    def _exact(self) -> bool:
        return beyond_double(self.digits, self.certified)


_Model = TypeVar("_Model", bound=BudgetedRequest)


#: What is beyond the limits of a server, of a request.
Limits = Callable[[BudgetedRequest], list[InvalidInput]]


def read_request(
    model: type[_Model], document: Any, beyond_limits: Limits = lambda _: []
) -> _Model:
    """Return the request that a decoded JSON document states; raises InvalidRequest with every
    fault found, those of the limits of a server among them.
    """
    try:
        request = model.model_validate(document)
    except ValidationError as error:
        items = error.errors(include_url=False, include_context=True)
        faults = [field_fault(item, _fields(model, document, item["loc"])) for item in items]
        others = _other_faults(model, document, items, faults, beyond_limits)
        raise InvalidRequest([*faults, *others]) from None
    require_valid(request, beyond_limits)
    return request


def require_valid(request: BudgetedRequest, beyond_limits: Limits = lambda _: []) -> None:
    """Raise InvalidRequest with all faults of a request whose fields are there."""
    if faults := [*request.option_faults(), *beyond_limits(request)]:
        raise InvalidRequest(_once([*faults, *request.data_faults()]))


def _once(faults: Sequence[InvalidInput]) -> list[InvalidInput]:
    """Return faults, each once."""
    known: set[str] = set()

    def is_new(fault: InvalidInput) -> bool:
        text = str(fault)
        new = text not in known
        known.add(text)
        return new

    return select_faults(faults, is_new)


def _other_faults(
    model: type[BudgetedRequest],
    document: Any,
    items: Sequence[Any],
    faults: Sequence[InvalidInput],
    beyond_limits: Limits,
) -> list[InvalidInput]:
    """Return what else is wrong with a document than those of its fields at which pydantic found
    faults.
    """
    if not isinstance(document, dict):
        return []
    if "problem" not in model.model_fields:
        stand_in: dict[str, Any] = {}
        known = True
    else:
        problem = document.get("problem")
        # a name that is a list, say, is none, and no dictionary looks for it
        known = isinstance(problem, dict) and problem.get("system") in list(SYSTEMS)
        stand_in = {"problem": problem if known else BODY4_PROBLEM}
    try:
        request = model.model_validate(_without_faults({**document, **stand_in}, items))
    except ValidationError:
        return []
    reported = [fault.path for fault in faults]
    found = [*request.option_faults(), *beyond_limits(request), *request.data_faults()]

    def is_further(fault: InvalidInput) -> bool:
        is_reported = any(fault.path[: len(path)] == path for path in reported)
        return not is_reported and (known or any(name in _OF_ANY_SYSTEM for name in fault.path[:1]))

    return select_faults(_once(found), is_further)


def _without_faults(document: dict[str, Any], items: Sequence[Any]) -> dict[str, Any]:
    """Return a document whose fields at fault have a value in their place that pydantic takes, or
    are left out.
    """
    left = dict(document)
    if "problem" in left:
        left["problem"] = dict(left["problem"])
    for item in items:
        if not item["loc"]:  # a fault of the document as a whole, which no field can mend
            continue
        first, *rest = item["loc"]
        if first == "problem":
            place, values = rest[1:], left.get("problem", {})
        else:
            place, values = [first, *rest], left
        if not place:
            continue
        if item["type"] == "missing":
            values[place[0]] = [0.0] if place[0] == "times" else None
        elif len(place) > 1 and isinstance(values.get(place[0]), list):
            # a text in its place: what is wrong with that is said of the same entry
            values[place[0]] = [
                "" if i == place[1] else value for i, value in enumerate(values[place[0]])
            ]
        else:
            values.pop(place[0], None)
    return left


def _layers(document: Any) -> Iterator[list[Any]]:
    """Yield the values of a document level by level, without recursion."""
    layer = [document]
    while layer:
        yield layer
        inner = (value for value in layer if isinstance(value, (dict, list)))
        layer = [
            item
            for value in inner
            for item in (value.values() if isinstance(value, dict) else value)
        ]


def _fields(
    model: type[BudgetedRequest], document: Any, place: tuple[int | str, ...]
) -> Sequence[str]:
    """Return the names of the fields that there are where pydantic found a fault."""
    if len(place) == 1:
        return list(model.model_fields)
    return (
        list(SYSTEMS[document["problem"]["system"]].model_fields)
        if len(place) == 3 and place[1] in SYSTEMS
        else []
    )
