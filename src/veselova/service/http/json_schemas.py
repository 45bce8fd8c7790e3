"""JSON schemas of all requests and answers: for the OpenAPI document, and for /v1/schemas, where
each stands alone.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import orjson
from pydantic.json_schema import models_json_schema

from veselova.service.api.answers import ANSWERS
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.http.job_document import JobDocument, JobList
from veselova.service.workers.tasks import TASKS

__all__ = ["PREFIX", "answer_name", "component_schemas", "schema_document", "schema_names"]

#: Where the schemas stand in the OpenAPI document.
PREFIX = "#/components/schemas/"


@cache
def _components() -> bytes:
    """Return all schemas by their names, as JSON."""
    requests: list[tuple[Any, Any]] = [
        (model, "validation") for model in (*(model for model, _ in TASKS.values()), SweepRequest)
    ]
    answers: list[tuple[Any, Any]] = [
        (model, "serialization") for model in (*ANSWERS, JobDocument, JobList)
    ]
    _, definitions = models_json_schema([*requests, *answers], ref_template=PREFIX + "{model}")
    return orjson.dumps(definitions["$defs"])


def component_schemas() -> dict[str, Any]:
    """Return the schemas of all requests and answers by their names, which refer to one another
    below ``PREFIX``.
    """
    return dict(orjson.loads(_components()))


def answer_name(kind: str) -> str:
    """Return the name of the schema of a kind of answer: ClosedForm for closed_form."""
    return "".join(word.capitalize() for word in kind.split("_"))


def schema_names() -> dict[str, str]:
    """Return the names of all schemas, and what each is of, in a sentence (of an
    answer, its name).
    """
    return {
        name: schema.get("description", name).split("\n")[0]
        for name, schema in component_schemas().items()
    }


def schema_document(name: str) -> dict[str, Any]:
    """Return one schema by its name, those that it refers to among its ``$defs``;
    raises KeyError.

    ``closed-form.json`` is another name of ClosedForm, and so are those of the others.
    """
    schemas = component_schemas()
    if name not in schemas:
        files = {_file_name(known): known for known in schemas}
        name = files[name]
    schema = schemas[name]
    needed = {name}
    found = set[str]()
    while needed := {other for known in needed for other in _references(schemas[known])} - found:
        found |= needed
    definitions = {other: schemas[other] for other in schemas if other in found}
    text = orjson.dumps({**schema, "$defs": definitions}).decode().replace(PREFIX, "#/$defs/")
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, "$id": f"urn:veselova:schema:{name}", **orjson.loads(text)}


def _file_name(name: str) -> str:
    return re.sub("(?<=[a-z])(?=[A-Z])", "-", name).lower() + ".json"


def _references(schema: dict[str, Any]) -> list[str]:
    return re.findall(f'"{PREFIX}([^"]*)"', orjson.dumps(schema).decode())
