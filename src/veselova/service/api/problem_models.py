"""The JSON of problems: one model for each system, told apart by ``system``. Its fields are the
arguments of the system's constructor, with their defaults and what its docstring says of them.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union

from pydantic import Field, create_model

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.ellipsoid import EllipsoidGeodesic
from veselova.mechanics.systems.euler_poisson import EulerPoisson
from veselova.mechanics.systems.lr_system import LRSystem
from veselova.mechanics.systems.neumann import NeumannSystem
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.separable_veselova import SeparableVeselova
from veselova.mechanics.systems.stiefel import StiefelFlow
from veselova.mechanics.systems.veselova import Veselova
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3
from veselova.service.api.problem_fields import (
    INTEGER,
    NULL,
    NUMBER,
    Request,
    Schema,
    any_of,
    given,
    list_of,
    object_of,
    one_of_fields,
)

__all__ = ["SYSTEMS", "ProblemModel", "SystemModel", "summary_of"]


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
        many = kind.in_many_dimensions if issubclass(kind, RollingBall) else None
        return kind.outputs if many is None or self.dimension < 4 else many.outputs

    @property
    def dimension(self) -> int:
        """Return how many components a vector of the problem has, before anything is validated."""
        value = getattr(self, self.measured)
        return value if isinstance(value, int) else len(value) if isinstance(value, list) else 0

    def problem(self) -> Problem:
        """Return the problem; raises InvalidInput located below ``problem``."""
        fields = {name: getattr(self, name) for name in type(self).model_fields if name != "system"}
        try:
            return self.problem_class(**fields)
        except InvalidInput as error:
            raise error.below("problem") from None


_VECTOR = list_of(NUMBER, 2)
_MATRIX = list_of(_VECTOR, 2)
_COLUMNS = list_of(list_of(NUMBER), 2)
_TRIPLE = list_of(NUMBER, 3, 3)
_SQUARE = list_of(_TRIPLE, 3, 3)
_FROM_THREE = list_of(NUMBER, 3)
_WHOLE = {**INTEGER, "minimum": 1}
_TERM = object_of({"coefficient": NUMBER, "powers": list_of(INTEGER, 3, 3)})
_MONOMIAL = object_of({"coefficient": NUMBER, "powers": list_of(list_of(INTEGER, 3, 3), 0)})
_POTENTIAL = object_of(
    {},
    {
        "clebsch": NUMBER,
        "family": list_of(NUMBER, 5, 5),
        "polynomial": list_of(_TERM),
        "companion": list_of(_TERM),
    },
)
_SEPARABLE = object_of({}, {"quartic": NUMBER, "quadratic": NUMBER, "centrifugal": _VECTOR})

#: The schemas of fields, where a system has no other.
_SCHEMAS: Mapping[str, Schema] = {
    **dict.fromkeys(("A", "q", "q_dot", "q_prime", "X", "X_dot", "position"), _VECTOR),
    **dict.fromkeys(("mass", "radius"), NUMBER),
    **dict.fromkeys(("n", "rank"), _WHOLE),
    **dict.fromkeys(("frame", "g"), any_of(_MATRIX, NULL)),
    "omega": _MATRIX,
}
_TRUTH_VALUES = ("normalize", "strict", "homogeneous")
_RIGID_BODY: Mapping[str, Schema] = {
    "inertia": any_of(_TRIPLE, _SQUARE),
    **dict.fromkeys(("gamma", "Omega"), _TRIPLE),
    "potential": any_of(_POTENTIAL, NULL),
    "frame": any_of(_SQUARE, NULL),
}
_BALL: Mapping[str, Schema] = {
    "inertia": any_of(_TRIPLE, _SQUARE, one_of_fields(special=_FROM_THREE)),
    "gamma": _FROM_THREE,
    "Omega": any_of(_FROM_THREE, _MATRIX),
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
    name: str, kind: type[Problem], measured: str, own: Mapping[str, Schema]
) -> type[SystemModel]:
    """Return the model of a system, some of whose fields have schemas of their own."""
    fields: dict[str, Any] = {"system": (Literal[kind.system], ...)}
    schemas = {**_SCHEMAS, **own}
    # every ball has the arguments of this one
    meanings = {"normalize": _NORMALIZE, **_meanings(RubberBall), **_meanings(kind)}
    for field, parameter in inspect.signature(kind).parameters.items():
        default = ... if parameter.default is parameter.empty else parameter.default
        if field in _TRUTH_VALUES:
            typed = Annotated[bool, Field(description=meanings.get(field))]
            fields[field] = (typed, default or False)  # None would warn
        else:
            fields[field] = (
                Annotated[Any, given(meanings.get(field, ""), schemas[field])],
                default,
            )
    model = create_model(
        name, __base__=SystemModel, __module__=__name__, __doc__=summary_of(kind), **fields
    )
    model.problem_class = kind
    model.measured = measured
    return model


_MODELS = (
    _model("VeselovaModel", Veselova, "A", {"A": any_of(_VECTOR, _MATRIX)}),
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
            "inertia": one_of_fields(special=_VECTOR, matrix=_COLUMNS),
            "X": _COLUMNS,
            **dict.fromkeys(("P", "X_dot"), any_of(_COLUMNS, NULL)),
        },
    ),
    _model("EulerPoissonModel", EulerPoisson, "inertia", _RIGID_BODY),
    _model(
        "LRModel",
        LRSystem,
        "n",
        {
            "inertia": one_of_fields(special=_VECTOR, matrix=list_of(list_of(NUMBER, 0))),
            "potential": any_of(list_of(_MONOMIAL), NULL),
        },
    ),
    _model("SeparableModel", SeparableVeselova, "A", {"potential": any_of(_SEPARABLE, NULL)}),
)

#: The systems, by the name that tells them apart.
SYSTEMS: Mapping[str, type[SystemModel]] = {model.problem_class.system: model for model in _MODELS}

if TYPE_CHECKING:
    ProblemModel = SystemModel
else:
    ProblemModel = Annotated[Union[_MODELS], Field(discriminator="system")]  # noqa: UP007
