"""JSON schemas of requests and answers, each of which stands alone: parts of the OpenAPI
document.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import orjson

__all__ = ["schema_document", "schema_names"]

#: Where schemas refer to one another in the OpenAPI document.
_PREFIX = "#/components/schemas/"


def schema_names(openapi: Mapping[str, Any]) -> dict[str, str]:
    """Return the names of all schemas, and what each is of, in a sentence (of an
    answer, its name).
    """
    schemas = openapi["components"]["schemas"]
    return {name: part.get("description", name).split("\n")[0] for name, part in schemas.items()}


def schema_document(openapi: Mapping[str, Any], name: str) -> dict[str, Any] | None:
    """Return one schema by its name, those that it refers to among its ``$defs``; None where there
    is none.

    ``closed-form.json`` is another name of ClosedForm, and so are those of the others.
    """
    schemas = openapi["components"]["schemas"]
    names = {re.sub("(?<=[a-z])(?=[A-Z])", "-", x).lower() + ".json": x for x in schemas}
    name = names.get(name, name)
    if name not in schemas:
        return None
    found = dict[str, Any]()
    needed = _references(schemas[name])
    while needed:
        other = needed.pop()
        if other not in found:
            found[other] = schemas[other]
            needed += _references(schemas[other])
    text = orjson.dumps({**schemas[name], "$defs": found}).decode().replace(_PREFIX, "#/$defs/")
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, "$id": f"urn:veselova:schema:{name}", **orjson.loads(text)}


def _references(schema: Mapping[str, Any]) -> list[str]:
    return re.findall(f'"{_PREFIX}([^"]*)"', orjson.dumps(schema).decode())
