"""The fields that problems share in JSON: their schemas, and what every model of a request is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, WithJsonSchema

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.problem import Problem

__all__ = [
    "NUMBER",
    "Attitude",
    "BallInertia",
    "BodyInertia",
    "Columns",
    "Direction",
    "Frame",
    "Inertia",
    "InertiaOperator",
    "Matrix",
    "Number",
    "Potential",
    "PotentialData",
    "Request",
    "SeparableData",
    "SystemModel",
    "Tensor",
    "Times",
    "Triple",
    "Turning",
    "Vector",
    "Whole",
]

NUMBER = {
    "anyOf": [
        {"type": "number"},
        {"type": "string", "pattern": r"^\s*[+-]?(\d|\.\d)[\d./eE+ -]*$", "maxLength": 2100},
    ],
    "description": 'A finite number; as a string ("0.7", "7/10") it is taken exactly.',
}
_VECTOR = {"type": "array", "items": NUMBER, "minItems": 2}
_MATRIX = {"type": "array", "items": _VECTOR, "minItems": 2}
_UNIFORM = {
    "type": "object",
    "properties": {"start": NUMBER, "stop": NUMBER, "count": {"type": "integer", "minimum": 1}},
    "required": ["start", "stop", "count"],
    "additionalProperties": False,
}
_WHOLE = {"type": "integer", "minimum": 1}
_INERTIA_OPERATOR = {
    "anyOf": [
        {
            "type": "object",
            "properties": {name: schema},
            "required": [name],
            "additionalProperties": False,
        }
        for name, schema in (
            (
                "special",
                {
                    **_VECTOR,
                    "description": "A_1 … A_n > 0 of (4.5): 𝓘(E_i∧E_j) = (A_iA_j/det A) E_i∧E_j",
                },
            ),
            (
                "matrix",
                {"type": "array", "items": {"type": "array", "items": NUMBER}, "minItems": 1},
            ),
        )
    ],
}
_MONOMIAL = {
    "type": "object",
    "properties": {
        "coefficient": NUMBER,
        "powers": {
            "type": "array",
            "items": {"type": "array", "items": {"type": "integer"}, "minItems": 3, "maxItems": 3},
        },
    },
    "required": ["coefficient", "powers"],
    "additionalProperties": False,
    "description": "c Π g_ij^p for powers [[i, j, p], …], i and j from 1",
}
_TIMES = {"anyOf": [{"type": "array", "items": NUMBER, "minItems": 1}, _UNIFORM]}

_TRIPLE = {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3}
_SQUARE = {"type": "array", "items": _TRIPLE, "minItems": 3, "maxItems": 3}
_TERM = {
    "type": "object",
    "properties": {
        "coefficient": NUMBER,
        "powers": {"type": "array", "items": {"type": "integer"}, "minItems": 3, "maxItems": 3},
    },
    "required": ["coefficient", "powers"],
    "additionalProperties": False,
}
_POTENTIAL = {
    "type": "object",
    "properties": {
        "clebsch": NUMBER,
        "family": {"type": "array", "items": NUMBER, "minItems": 5, "maxItems": 5},
        "polynomial": {"type": "array", "items": _TERM, "minItems": 1},
        "companion": {"type": "array", "items": _TERM, "minItems": 1},
    },
    "minProperties": 1,
    "additionalProperties": False,
}
_SEPARABLE = {
    "type": "object",
    "properties": {"quartic": NUMBER, "quadratic": NUMBER, "centrifugal": _VECTOR},
    "minProperties": 1,
    "additionalProperties": False,
}
_COLUMNS = {
    "type": "array",
    "items": {"type": "array", "items": NUMBER, "minItems": 1},
    "minItems": 2,
}
_BODY_INERTIA = {
    "anyOf": [
        {
            "type": "object",
            "properties": {name: form},
            "required": [name],
            "additionalProperties": False,
        }
        for name, form in (("special", _VECTOR), ("matrix", _COLUMNS))
    ]
}

_FROM_THREE = {"type": "array", "items": NUMBER, "minItems": 3}
_BALL_INERTIA = {
    "anyOf": [
        _TRIPLE,
        _SQUARE,
        {
            "type": "object",
            "properties": {"special": _FROM_THREE},
            "required": ["special"],
            "additionalProperties": False,
        },
    ]
}

Vector = Annotated[Any, WithJsonSchema(_VECTOR)]
Inertia = Annotated[Any, WithJsonSchema({"anyOf": [_VECTOR, _MATRIX]})]
Frame = Annotated[Any, WithJsonSchema({"anyOf": [_MATRIX, {"type": "null"}]})]
Direction = Annotated[Any, WithJsonSchema(_FROM_THREE)]
Turning = Annotated[Any, WithJsonSchema({"anyOf": [_FROM_THREE, _MATRIX]})]
BallInertia = Annotated[Any, WithJsonSchema(_BALL_INERTIA)]
Number = Annotated[Any, WithJsonSchema(NUMBER)]
Triple = Annotated[Any, WithJsonSchema(_TRIPLE)]
Tensor = Annotated[Any, WithJsonSchema({"anyOf": [_TRIPLE, _SQUARE]})]
Attitude = Annotated[Any, WithJsonSchema({"anyOf": [_SQUARE, {"type": "null"}]})]
PotentialData = Annotated[Any, WithJsonSchema({"anyOf": [_POTENTIAL, {"type": "null"}]})]
Columns = Annotated[Any, WithJsonSchema(_COLUMNS)]
BodyInertia = Annotated[Any, WithJsonSchema(_BODY_INERTIA)]
Whole = Annotated[Any, WithJsonSchema(_WHOLE)]
InertiaOperator = Annotated[Any, WithJsonSchema(_INERTIA_OPERATOR)]
Matrix = Annotated[Any, WithJsonSchema(_MATRIX)]
Potential = Annotated[
    Any,
    WithJsonSchema(
        {"anyOf": [{"type": "array", "items": _MONOMIAL, "minItems": 1}, {"type": "null"}]}
    ),
]
SeparableData = Annotated[Any, WithJsonSchema({"anyOf": [_SEPARABLE, {"type": "null"}]})]
Times = Annotated[Any, WithJsonSchema(_TIMES)]


class Request(BaseModel):
    """What every part of a request is: no field but those stated, no value converted."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


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
        return self.problem_class.outputs

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
