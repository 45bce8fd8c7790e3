"""The JSON of problems: one model for each system, told apart by ``system``. Its fields are the
arguments of the system's constructor, with their defaults and what its docstring says of them.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeVar, Union

from pydantic import BaseModel, ConfigDict, Field, PlainSerializer, WrapValidator, create_model

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.systems.ball_on_sphere import SIDES, RubberBallOnSphere
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.ellipsoid import EllipsoidGeodesic
from veselova.mechanics.systems.lr_system import LRSystem
from veselova.mechanics.systems.neumann import NeumannSystem
from veselova.mechanics.systems.rigid_body import EulerPoisson
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.separable_veselova import SeparableVeselova
from veselova.mechanics.systems.stiefel import StiefelFlow
from veselova.mechanics.systems.veselova import Veselova
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

T = TypeVar("T")

#: A field that is taken as it comes: its type is that of the schema alone.
Given = Annotated[T, WrapValidator(lambda value, _: value), PlainSerializer(lambda value: value)]

Number = Annotated[
    float | Annotated[str, Field(pattern=r"^\s*[+-]?(\d|\.\d)[\d./eE+ -]*$", max_length=2100)],
    Field(description='A finite number; as a string ("0.7", "7/10") it is taken exactly.'),
]
Numbers = Annotated[list[Number], Field(min_length=1)]
Pair = Annotated[list[Number], Field(min_length=2, max_length=2)]
Rows = Annotated[list[Numbers], Field(min_length=1)]


class Request(BaseModel):
    """What every part of a request is: no field but those stated, no value converted."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Grid(Request):
    """Equidistant numbers, both ends included."""

    start: Number
    stop: Number
    count: Annotated[int, Field(ge=1)]


Times = Annotated[
    Given[Numbers | Grid],
    Field(description="finite, in any order; the start is t = 0, negative times are fine"),
]


def choice_of(name: str, most: int, **fields: Any) -> Any:
    """Return the type of an object that has some of these fields, one at least."""
    stated: Any = {field: (kind, Field(default_factory=dict)) for field, kind in fields.items()}
    limits: Any = {"minProperties": 1, "maxProperties": most}
    return Annotated[
        create_model(name, __base__=Request, __doc__=f"One of {', '.join(fields)}.", **stated),
        Field(json_schema_extra=limits),
    ]


def from_null(values: Any) -> Any:
    """Return nested lists with NaN in place of null."""
    if isinstance(values, list):
        return [from_null(x) for x in values]
    return math.nan if values is None else values


class SystemModel(Request):
    """A problem of one system."""

    #: What the model becomes, and the field that shows its size: a number, or a list with as many
    #: entries.
    problem_class: ClassVar[type[Problem]]
    measured: ClassVar[str]

    system: str

    @property
    def outputs(self) -> Mapping[str, tuple[str, ...]]:
        """Return the names of the axes of each output, as they are in this problem's dimension."""
        kind = self.problem_class
        if getattr(self, "sphere", None) is not None:
            return RubberBallOnSphere.outputs
        many = kind.in_many_dimensions if issubclass(kind, RollingBall) else None
        return kind.outputs if many is None or self.dimension < 4 else many.outputs

    @property
    def dimension(self) -> int:
        """Return how many components a vector of the problem has, before anything is validated."""
        value = getattr(self, self.measured)
        return value if isinstance(value, int) else len(value) if isinstance(value, list) else 0

    @cached_property
    def problem(self) -> Problem:
        """Return the problem; raises InvalidInput located below ``problem``."""
        fields = {name: getattr(self, name) for name in type(self).model_fields if name != "system"}
        try:
            return self.problem_class(**fields)
        except InvalidInput as error:
            raise error.below("problem") from None


def _list(kind: Any, least: int, most: int | None = None) -> Any:
    """Return the type of a list."""
    return Annotated[list[kind], Field(min_length=least, max_length=most)]


_VECTOR = _list(Number, 2)
_MATRIX = _list(_VECTOR, 2)
_COLUMNS = _list(Numbers, 2)
_TRIPLE = _list(Number, 3, 3)
_SQUARE = _list(_TRIPLE, 3, 3)
_FROM_THREE = _list(Number, 3)
_WHOLE = Annotated[int, Field(ge=1)]
_POWERS = _list(int, 3, 3)
_TERM = create_model("Term", __base__=Request, coefficient=(Number, ...), powers=(_POWERS, ...))
_MONOMIAL = create_model(
    "Monomial", __base__=Request, coefficient=(Number, ...), powers=(_list(_POWERS, 0), ...)
)
_POTENTIAL = choice_of(
    "Potential",
    4,
    clebsch=Number,
    family=_list(Number, 5, 5),
    polynomial=_list(_TERM, 1),
    companion=_list(_TERM, 1),
)
_SEPARABLE = choice_of(
    "SeparablePotential", 3, quartic=Number, quadratic=Number, centrifugal=_VECTOR
)
_OPERATOR = choice_of("Operator", 1, special=_VECTOR, matrix=_list(list[Number], 1))

#: The types of fields, where a system has no other.
_TYPES: Mapping[str, Any] = {
    **dict.fromkeys(("A", "q", "q_dot", "q_prime", "X", "X_dot", "position"), _VECTOR),
    **dict.fromkeys(("mass", "radius"), Number),
    "sphere": Number | None,
    "side": Literal[SIDES] | None,
    **dict.fromkeys(("n", "rank"), _WHOLE),
    **dict.fromkeys(("frame", "g"), _MATRIX | None),
    "omega": _MATRIX,
}
_TRUTH_VALUES = ("normalize", "strict", "homogeneous")
_RIGID_BODY: Mapping[str, Any] = {
    "inertia": _TRIPLE | _SQUARE,
    **dict.fromkeys(("gamma", "Omega"), _TRIPLE),
    "potential": _POTENTIAL | None,
    "frame": _SQUARE | None,
}
_BALL: Mapping[str, Any] = {
    "inertia": _TRIPLE | _SQUARE | choice_of("SpecialInertia", 1, special=_FROM_THREE),
    "gamma": _FROM_THREE,
    "Omega": _FROM_THREE | _MATRIX,
}

#: The text of a truth value that most constructors have.
_NORMALIZE = "make what is normalised or tangent only nearly exactly so first"


def summary_of(kind: type[Problem]) -> str:
    """Return the first sentence about a system."""
    return re.split(r"(?<=\.) ", " ".join((kind.__doc__ or "").split()), maxsplit=1)[0]


def _meanings(kind: type[Problem]) -> dict[str, str]:
    """Return what the docstring of a system says of its arguments, in lines such as ``- q: …``."""
    found = re.findall(r"^- ([\w, ]+): (.*(?:\n  .*)*)", inspect.getdoc(kind) or "", re.MULTILINE)
    first_last = reversed(found)  # arguments come first, and outputs may have their names
    return {
        name: " ".join(text.split()) for names, text in first_last for name in names.split(", ")
    }


def _model(
    name: str, kind: type[Problem], measured: str, own: Mapping[str, Any]
) -> type[SystemModel]:
    """Return the model of a system, some of whose fields have types of their own."""
    fields: dict[str, Any] = {"system": (Literal[kind.system], ...)}
    types: dict[str, Any] = {**_TYPES, **own}
    types = {field: Given[typed] for field, typed in types.items()}  # type: ignore[misc,valid-type]
    types |= dict.fromkeys(_TRUTH_VALUES, bool)
    # every ball has the arguments of this one
    meanings = {"normalize": _NORMALIZE, **_meanings(RubberBall), **_meanings(kind)}
    for field, parameter in inspect.signature(kind).parameters.items():
        default = ... if parameter.default is parameter.empty else parameter.default
        if field in _TRUTH_VALUES:
            default = default or False  # None would warn
        fields[field] = (Annotated[types[field], Field(description=meanings.get(field))], default)
    model = create_model(
        name, __base__=SystemModel, __module__=__name__, __doc__=summary_of(kind), **fields
    )
    model.problem_class = kind
    model.measured = measured
    return model


_MODELS = (
    _model("VeselovaModel", Veselova, "A", {"A": _VECTOR | _MATRIX}),
    _model("NeumannModel", NeumannSystem, "A", {}),
    _model("EllipsoidGeodesicModel", EllipsoidGeodesic, "A", {}),
    _model("VeselovaSO3Model", VeselovaSO3, "inertia", _RIGID_BODY),
    _model("RubberBallModel", RubberBall, "gamma", _BALL),
    _model("ChaplyginBallModel", ChaplyginBall, "gamma", _BALL),
    _model(
        "StiefelModel",
        StiefelFlow,
        "X",
        {
            "inertia": _OPERATOR,
            "X": _COLUMNS,
            **dict.fromkeys(("P", "X_dot"), _COLUMNS | None),
        },
    ),
    _model("EulerPoissonModel", EulerPoisson, "inertia", _RIGID_BODY),
    _model(
        "LRModel",
        LRSystem,
        "n",
        {"inertia": _OPERATOR, "potential": _list(_MONOMIAL, 1) | None},
    ),
    _model("SeparableModel", SeparableVeselova, "A", {"potential": _SEPARABLE | None}),
)

#: The systems, by the name that tells them apart.
SYSTEMS: Mapping[str, type[SystemModel]] = {model.problem_class.system: model for model in _MODELS}

if TYPE_CHECKING:
    ProblemModel = SystemModel
else:
    ProblemModel = Annotated[Union[_MODELS], Field(discriminator="system")]  # noqa: UP007
