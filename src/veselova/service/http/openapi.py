"""The OpenAPI document: the framework makes it of the models, and here it learns how this service
refuses. Each of its schemas stands alone at /v1/schemas.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import orjson
from fastapi import FastAPI

from veselova.service.api.answers import Problem
from veselova.service.api.problem_details import MEDIA_TYPE

__all__ = ["FILE", "complete_openapi", "refusals", "schema_document", "schema_names"]

#: Where schemas refer to one another in the OpenAPI document.
_PREFIX = "#/components/schemas/"

#: The content of an answer that is a file.
FILE = {"schema": {"type": "string", "format": "binary"}}


def refusals(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the refusals of a route as it describes them: of all routes, and of some statuses."""
    return {status: {"model": Problem} for status in (401, 403, 422, 429, 500, 503, *statuses)}


def complete_openapi(app: FastAPI) -> dict[str, Any]:
    """Return the OpenAPI document of an application, built once."""
    if app.openapi_schema is None:
        document = FastAPI.openapi(app)
        for operations in document["paths"].values():
            for operation in operations.values():
                for status, response in operation["responses"].items():
                    if status >= "400":  # the framework names the type of a good answer
                        (content,) = response["content"].values()
                        response["content"] = {MEDIA_TYPE: content}
        document["components"]["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
        document["security"] = [{}, {"key": []}]  # a server on loopback asks for none
    assert app.openapi_schema is not None
    return app.openapi_schema


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
