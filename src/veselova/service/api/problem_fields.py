"""The types of fields of requests that hold numbers: they make the schemas of the OpenAPI document,
and values are taken as they come. What numbers may be is said once, where problems are built, so
that Python, command line and HTTP refuse the same input with the same sentence.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, PlainSerializer, WrapValidator, create_model

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
