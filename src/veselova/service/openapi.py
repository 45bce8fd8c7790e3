"""The OpenAPI document: routes read their bodies themselves, so the models are put in here, with worked examples."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema

from veselova.mechanics.decimals import FEWEST_DIGITS
from veselova.service.answers import PROVENANCE
from veselova.service.examples import ANSWERS, BODY4_PROBLEM
from veselova.service.formats import FORMATS
from veselova.service.problem_details import MEDIA_TYPE
from veselova.service.routes import KEPT, RESOURCES
from veselova.service.sweep_request import SweepRequest
from veselova.service.systems import SYSTEMS
from veselova.service.tasks import TASKS
from veselova.version import __version__

__all__ = ["openapi_document"]

_NUMBERS: dict[str, Any] = {"type": "array", "items": {"type": "number"}}
_MATRIX: dict[str, Any] = {"type": "array", "items": _NUMBERS}


def _series(number: dict[str, Any]) -> dict[str, Any]:
    """Return the schemas of all outputs, by the schema of their numbers."""
    schemas: dict[str, Any] = {}
    for model in SYSTEMS.values():
        for name, axes in model.problem_class.outputs.items():
            schemas[name] = number
            for _ in range(len(axes) + 1):
                schemas[name] = {"type": "array", "items": schemas[name]}
    return schemas


_DECIMAL = {"type": "string", "pattern": r"^-?\d", "description": "a decimal"}
_NUMBER_OR_DECIMAL = {"anyOf": [{"type": "number"}, _DECIMAL]}
_BY_NAME = {"type": "object", "additionalProperties": {"type": "number"}}


def _object(properties: dict[str, Any], required: list[str] | None = None) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": list(properties) if required is None else required}


_PROVENANCE = _object(
    {
        "engine": {"type": "string"},
        "method": {"type": "string"},
        "digits": {"type": "integer"},
        "version": {"type": "string"},
        "seconds": {"type": "number"},
        "details": {"type": "object"},
    }
)

#: Schemas of answers, by the kind of answer; a problem document is one of them.
_ANSWERS: dict[str, dict[str, Any]] = {
    "Trajectory": _object(
        {
            "engine": {"type": "string"},
            "times": _NUMBERS,
            "series": {
                **_object(_series(_NUMBER_OR_DECIMAL), required=[]),
                "description": f"decimals where more than {FEWEST_DIGITS} digits, or certified errors, were asked for",
            },
            "radii": {**_object(_series(_DECIMAL), required=[]), "description": "the error of every decimal"},
            "integrals": {
                "type": "object",
                "additionalProperties": _object(
                    {"initial": {"anyOf": [{"type": "number"}, _NUMBERS]}, "drift": {"type": "number"}}
                ),
            },
            "error": {
                "type": "array",
                "items": _NUMBER_OR_DECIMAL,
                "description": "bounds the true error of every component of the bounded series at each time: true ≤ error; "
                "bounded series of system veselova: q and frame",
            },
            "provenance": _PROVENANCE,
        },
        required=["engine", "times", "series", "integrals", "error", "provenance"],
    ),
    "Comparison": _object(
        {
            "deviation": {**_BY_NAME, "description": "largest difference of the engines, per output"},
            "agrees": {"type": "boolean", "description": "whether they differ by no more than the sum of both errors"},
            "conditioning_floor": {"type": "number", "description": "what one rounding of the data moves at the last time"},
            "error": _BY_NAME,
            "drift": {"type": "object", "additionalProperties": _BY_NAME},
            "seconds": _BY_NAME,
            "provenance": {"type": "object", "additionalProperties": _PROVENANCE},
            "analytic": {"$ref": "#/components/schemas/Trajectory"},
            "numeric": {"$ref": "#/components/schemas/Trajectory"},
        }
    ),
    "Torus": _object(
        {
            "n": {"type": "integer"},
            "energy": {"type": "number"},
            "constants": _NUMBERS,
            "branch_points": _NUMBERS,
            "origins": {"type": "array", "items": {"type": "string"}},
            "periods": _MATRIX,
            "riemann_matrix": _MATRIX,
            "riemann_matrix_residual": {"type": "number"},
            "frequencies_tau1": _NUMBERS,
            "frequencies_t": _NUMBERS,
            "phases": _NUMBERS,
            "mean_rate": {"type": "number"},
            "regime": {"type": "string"},
        }
    ),
    "Problem": _object(
        {
            "type": {"type": "string", "examples": ["urn:veselova:problem:invalid-input"]},
            "title": {"type": "string"},
            "status": {"type": "integer"},
            "detail": {"type": "string"},
            "outcome": {"type": "string", "description": "the named outcome of an engine that cannot serve the problem"},
            "errors": {"type": "array", "items": _object({"pointer": {"type": "string"}, "detail": {"type": "string"}})},
        },
        required=["type", "title", "status", "detail"],
    ),
}

_REFUSALS = {
    400: "Not JSON",
    401: "No API key of this server, where it requires one",
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

#: Refusals of one path alone, and what a GET of a kept trajectory can be refused for.
_PRECONDITION = {412: "The client has this answer already (If-None-Match)"}
_KEPT_REFUSALS = {404: "Not kept, or not any more", **{status: _REFUSALS[status] for status in (406, 500, 503, 504, 507)}}

#: Refusals of the resources of jobs, and of those that every other path has.
_JOB_REFUSALS = {
    **{status: _REFUSALS[status] for status in (401, 422, 429, 500, 501)},
    404: "No such job",
    406: "No acceptable representation",
    409: "The job has not finished",
    503: "Jobs cannot be stored or read at present; see Retry-After",
}
_SWEEP_REFUSALS = {status: _REFUSALS[status] for status in (400, 401, 406, 413, 415, 422, 429, 500, 501, 503, 507)}
_COMMON_REFUSALS = {status: _REFUSALS[status] for status in (401, 429, 500, 503)}

_TEXT = {"schema": {"type": "string"}}
#: Header fields of a trajectory, in every format.
_FIELDS: dict[str, dict[str, Any]] = {
    "ETag": {"description": "hash of the request, its defaults filled in and its budget left out, and the format", **_TEXT},
    "Content-Location": {"description": "where a GET gives this trajectory, in any format, while it is kept", **_TEXT},
    PROVENANCE: {"description": "how it was computed, as JSON", **_TEXT},
}
_NAME = {
    "name": "name",
    "in": "path",
    "required": True,
    "description": "the last part of the Content-Location of an answer",
    "schema": {"type": "string"},
}
_CONDITION = {
    "name": "If-None-Match",
    "in": "header",
    "required": False,
    "description": "an ETag: nothing is sent if it is still that of the answer",
    "schema": {"type": "string"},
}


def openapi_document(app: FastAPI) -> dict[str, Any]:
    """Return the OpenAPI document of the application, built once."""
    if app.openapi_schema is None:
        document = get_openapi(
            title="veselova",
            version=__version__,
            summary="Motions of an n-dimensional rigid body under the Veselova constraint",
            description="POST a problem and times; receive the motion in theta functions or by integration, with its error.",
            routes=app.routes,
        )
        models = [(model, "validation") for model in (*(model for model, _ in TASKS.values()), SweepRequest)]
        _, definitions = models_json_schema(models, ref_template="#/components/schemas/{model}")  # type: ignore[arg-type]
        schemas = document.setdefault("components", {}).setdefault("schemas", {})
        schemas.update(definitions["$defs"], **_ANSWERS)
        for path, (kind, _, content) in RESOURCES.items():
            _describe(document["paths"][path]["post"], kind, content)
        for path, operations in document["paths"].items():
            for operation in operations.values():
                if path not in RESOURCES:
                    _refuse(operation, _refusals(path))
        document["paths"][KEPT] = {"get": _kept(), "head": _kept_head()}
        document["components"]["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
        document["security"] = [{}, {"key": []}]  # a server on loopback asks for none
        app.openapi_schema = document
    return app.openapi_schema


def _refusals(path: str) -> dict[int, str]:
    if path == "/v1/sweeps":
        return _SWEEP_REFUSALS
    return _JOB_REFUSALS if path.startswith("/v1/jobs") else _COMMON_REFUSALS


def _describe(operation: dict[str, Any], kind: str, content: str) -> None:
    """Put the body, the answer and the refusals of one resource into its operation."""
    example = (
        {"problem": BODY4_PROBLEM} if kind == "torus" else {"problem": BODY4_PROBLEM, "times": [0, 1], "outputs": ["q", "tau1"]}
    )
    body = {"schema": {"$ref": f"#/components/schemas/{TASKS[kind][0].__name__}"}, "example": example}
    operation["requestBody"] = {"required": True, "content": {"application/json": body}}
    answer: dict[str, Any] = {"schema": {"$ref": f"#/components/schemas/{kind.capitalize()}"}}
    if kind in ANSWERS:
        answer["example"] = ANSWERS[kind]
    refusals = _REFUSALS
    operation["responses"] = {"200": {"description": content, "content": {"application/json": answer}}}
    if kind == "trajectory":
        operation["parameters"], refusals = [_CONDITION], {**_REFUSALS, **_PRECONDITION}
        operation["responses"]["200"] = _trajectory(content, answer)
    _refuse(operation, refusals)


def _kept() -> dict[str, Any]:
    """Return the operation that gives a kept trajectory."""
    answer = {"schema": {"$ref": "#/components/schemas/Trajectory"}}
    operation: dict[str, Any] = {
        "tags": ["motions"],
        "summary": "Give a trajectory that is kept",
        "operationId": "kept",
        "parameters": [_NAME, _CONDITION],
        "responses": {
            "200": _trajectory("The trajectory", answer),
            "304": {"description": "The client has it already", "headers": {"ETag": _FIELDS["ETag"]}},
        },
    }
    _refuse(operation, _KEPT_REFUSALS)
    return operation


def _kept_head() -> dict[str, Any]:
    """Return the operation that gives the header of a kept trajectory alone."""
    statuses = {200: "It is kept", 304: "The client has it already", 404: "Not kept, or not any more", 406: _REFUSALS[406]}
    responses = {str(status): {"description": description} for status, description in statuses.items()}
    named = {"tags": ["motions"], "summary": "Tell whether a trajectory is kept", "operationId": "kept_head"}
    return {**named, "parameters": [_NAME, _CONDITION], "responses": responses}


def _trajectory(description: str, answer: dict[str, Any]) -> dict[str, Any]:
    """Return the response that has a trajectory in one of its formats."""
    table = {"text/csv": _TEXT}
    binary = {"schema": {"type": "string", "format": "binary"}}
    content = {form.media_type: table.get(form.media_type, binary) for form in FORMATS.values()}
    return {"description": description, "headers": _FIELDS, "content": {**content, "application/json": answer}}


def _refuse(operation: dict[str, Any], refusals: dict[int, str]) -> None:
    problem = {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}
    for status, description in sorted(refusals.items()):
        operation["responses"][str(status)] = {"description": description, "content": problem}
