"""The OpenAPI document: routes read their bodies themselves, so the models are put in here, with
worked examples.
"""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from veselova.service.answers.endpoint import PROVENANCE
from veselova.service.api.examples import ANSWERS, BODIES
from veselova.service.api.media_types import FORMATS
from veselova.service.api.problem_details import MEDIA_TYPE
from veselova.service.http.json_schemas import PREFIX, answer_name, component_schemas
from veselova.service.http.routes import RESOURCES, SCHEMA
from veselova.service.workers.tasks import TASKS
from veselova.version import __version__

__all__ = ["openapi_document"]

_REFUSALS = {
    400: "Not JSON",
    401: "No API key of this server, where it requires one",
    403: "The scope of the API key does not allow it",
    406: "No acceptable representation",
    413: "Body too large",
    415: "Not application/json",
    422: "Invalid input, or a problem that the engine cannot serve",
    429: "Too many requests of one key or address; see Retry-After",
    500: "The server failed",
    501: "An optional library is not installed on this server",
    503: "Overloaded, or the worker was lost; see Retry-After",
    504: "Over the time budget",
    507: "The work needs more memory than a worker has, or the disk is full",
}

#: Refusals of the resources of jobs, and of those that every other path has.
_JOB_REFUSALS = {
    **{status: _REFUSALS[status] for status in (401, 403, 422, 429, 500, 501)},
    404: "No such job",
    406: "No acceptable representation",
    409: "The job has not finished",
    503: "Jobs cannot be stored or read at present; see Retry-After",
    507: "The disk is full",
}
_SWEEP_REFUSALS = {
    status: _REFUSALS[status]
    for status in (400, 401, 403, 406, 413, 415, 422, 429, 500, 501, 503, 507)
}
_COMMON_REFUSALS = {status: _REFUSALS[status] for status in (401, 403, 429, 500, 503)}
_SCHEMA_REFUSALS = {404: "No schema of this name", **_COMMON_REFUSALS}

_TEXT = {"schema": {"type": "string"}}
#: Header fields of a trajectory, in every format.
_FIELDS: dict[str, dict[str, Any]] = {
    PROVENANCE: {"description": "how it was computed, as JSON", **_TEXT},
}


def openapi_document(app: FastAPI, root_path: str = "") -> dict[str, Any]:
    """Return the OpenAPI document of the application, built once; its paths are below a prefix."""
    if app.openapi_schema is None:
        document = get_openapi(
            title="veselova",
            version=__version__,
            summary="Motions of an n-dimensional rigid body under the Veselova constraint",
            description="POST a problem and times; receive the motion in theta functions or by "
            "integration, with its error.",
            routes=app.routes,
            servers=[{"url": root_path}] if root_path else None,
        )
        document.setdefault("components", {})["schemas"] = component_schemas()
        for path, (kind, _, content) in RESOURCES.items():
            _describe(document["paths"][path]["post"], kind, content)
        for path, operations in document["paths"].items():
            for operation in operations.values():
                if path not in RESOURCES:
                    # the framework's: all refusals are problem documents here
                    operation["responses"].pop("422", None)
                    _refuse(operation, _refusals(path))
        document["components"]["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
        document["security"] = [{}, {"key": []}]  # a server on loopback asks for none
        app.openapi_schema = document
    return app.openapi_schema


def _refusals(path: str) -> dict[int, str]:
    if path == "/v1/sweeps":
        return _SWEEP_REFUSALS
    if path == SCHEMA:
        return _SCHEMA_REFUSALS
    return _JOB_REFUSALS if path.startswith("/v1/jobs") else _COMMON_REFUSALS


def _describe(operation: dict[str, Any], kind: str, content: str) -> None:
    """Put the body, the answer and the refusals of one resource into its operation."""
    body = {"schema": {"$ref": f"{PREFIX}{TASKS[kind][0].__name__}"}, "example": BODIES[kind]}
    operation["requestBody"] = {"required": True, "content": {"application/json": body}}
    answer: dict[str, Any] = {"schema": {"$ref": f"{PREFIX}{answer_name(kind)}"}}
    if kind in ANSWERS:
        answer["example"] = ANSWERS[kind]
    operation["responses"] = {
        "200": {"description": content, "content": {"application/json": answer}}
    }
    if kind == "trajectory":
        operation["responses"]["200"] = _trajectory(content, answer)
    _refuse(operation, _REFUSALS)


def _trajectory(description: str, answer: dict[str, Any]) -> dict[str, Any]:
    """Return the response that has a trajectory in one of its formats."""
    table = {"text/csv": _TEXT}
    binary = {"schema": {"type": "string", "format": "binary"}}
    content = {form.media_type: table.get(form.media_type, binary) for form in FORMATS.values()}
    return {
        "description": description,
        "headers": _FIELDS,
        "content": {**content, "application/json": answer},
    }


def _refuse(operation: dict[str, Any], refusals: dict[int, str]) -> None:
    problem = {MEDIA_TYPE: {"schema": {"$ref": f"{PREFIX}Problem"}}}
    for status, description in sorted(refusals.items()):
        operation["responses"][str(status)] = {"description": description, "content": problem}
