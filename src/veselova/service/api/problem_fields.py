"""The fields of requests that hold numbers: taken as they come, with a schema for the OpenAPI
document. What numbers may be is said once, where problems are built, so that Python, command line
and HTTP refuse the same input with the same sentence.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

__all__ = [
    "INTEGER",
    "NULL",
    "NUMBER",
    "Request",
    "Schema",
    "Times",
    "any_of",
    "given",
    "list_of",
    "object_of",
    "one_of_fields",
]

Schema = dict[str, Any]

NULL: Schema = {"type": "null"}
INTEGER: Schema = {"type": "integer"}
NUMBER: Schema = {
    "anyOf": [
        {"type": "number"},
        {"type": "string", "pattern": r"^\s*[+-]?(\d|\.\d)[\d./eE+ -]*$", "maxLength": 2100},
    ],
    "description": 'A finite number; as a string ("0.7", "7/10") it is taken exactly.',
}


def any_of(*schemas: Schema) -> Schema:
    """Return the schema of what is as one of some schemas say."""
    return {"anyOf": list(schemas)}


def list_of(items: Schema, least: int = 1, most: int | None = None) -> Schema:
    """Return the schema of a list."""
    limit = {} if most is None else {"maxItems": most}
    return {"type": "array", "items": items, "minItems": least, **limit}


def object_of(
    required: Mapping[str, Schema], optional: Mapping[str, Schema] | None = None
) -> Schema:
    """Return the schema of an object that has fields and may have others; one of these where none
    is required.
    """
    properties = {**required, **(optional or {})}
    found = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**found, "required": list(required)} if required else {**found, "minProperties": 1}


def one_of_fields(**fields: Schema) -> Schema:
    """Return the schema of an object with one of some fields."""
    return any_of(*(object_of({name: schema}) for name, schema in fields.items()))


def given(meaning: str, *schemas: Schema) -> Any:
    """Return what annotates a field that is taken as it comes; its schema is one of those."""
    schema = schemas[0] if len(schemas) == 1 else any_of(*schemas)
    return Field(json_schema_extra={**schema, "description": meaning})


_UNIFORM = object_of({"start": NUMBER, "stop": NUMBER, "count": {**INTEGER, "minimum": 1}})

Times = Annotated[
    Any,
    given(
        "finite, in any order; the start is t = 0, negative times are fine",
        list_of(NUMBER),
        _UNIFORM,
    ),
]


class Request(BaseModel):
    """What every part of a request is: no field but those stated, no value converted."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)
