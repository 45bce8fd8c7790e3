"""The resources of the HTTP API."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

import orjson
from fastapi import APIRouter, Request
from starlette.responses import Response

from veselova.mechanics.core.errors import show
from veselova.service.answers.endpoint import Answers
from veselova.service.api.problem_details import Refused
from veselova.service.api.problem_models import SYSTEMS
from veselova.service.api.settings import Settings
from veselova.service.http.json_schemas import PREFIX, schema_document, schema_names
from veselova.service.http.readable import add_readable
from veselova.service.workers.tasks import TASKS
from veselova.version import __version__

__all__ = ["RESOURCES", "SCHEMA", "router"]

#: The path of one JSON schema.
SCHEMA = "/v1/schemas/{name}"

#: The media type of JSON schemas.
_SCHEMA_TYPE = "application/schema+json"

#: Path → (kind of answer, summary, what the answer holds).
RESOURCES = {
    "/v1/trajectories": (
        "trajectory",
        "Solve a motion with one engine",
        "The motion at the given times",
    ),
    "/v1/comparisons": (
        "comparison",
        "Solve a motion with both engines",
        "Both motions and how they agree",
    ),
    "/v1/ensembles": (
        "ensemble",
        "Solve the motions of many starts",
        "The motions at the given times, in arrays",
    ),
    "/v1/tori": (
        "torus",
        "Describe the invariant torus of a motion",
        "Curve, periods, frequencies, phases",
    ),
    "/v1/closed-forms": (
        "closed_form",
        "Give a motion in closed form as data",
        "The motion at all times as a document",
    ),
    "/v1/curves": (
        "curve",
        "Compute the periods of a hyperelliptic curve",
        "Periods, Riemann matrix, characteristics, images of points",
    ),
    "/v1/theta": (
        "theta",
        "Evaluate Riemann theta functions",
        "Values or derivatives, with their errors",
    ),
}

#: Kind of answer → operation id: names of functions in generated clients, which never change.
_OPERATIONS = {
    "trajectory": "solve_trajectory",
    "comparison": "compare_engines",
    "ensemble": "solve_ensemble",
    "torus": "compute_torus",
    "closed_form": "compute_closed_form",
    "curve": "compute_curve",
    "theta": "evaluate_theta",
}

#: Kinds that are asked of curves and theta functions, not of motions.
_TOOLKIT = ("curve", "theta")


def _first_sentence(text: str) -> str:
    """Return the first sentence of a docstring, whose lines are broken anywhere."""
    paragraph = " ".join(text.strip().split("\n\n")[0].split())
    return re.split(r"(?<=\.) ", paragraph, maxsplit=1)[0]


def _systems() -> list[dict[str, Any]]:
    """Return the systems served, for clients that discover them."""
    return [
        {
            "system": name,
            "title": _first_sentence(model.__doc__ or ""),
            "schema": SCHEMA.format(name=model.__name__),
            "fields": [field for field in model.model_fields if field != "system"],
            "engines": {
                engine: list(methods) for engine, methods in model.problem_class.engines.items()
            },
            "formulations": list(model.problem_class.formulations),
            "outputs": list(model.problem_class.outputs),
            "time": model.problem_class.time,
            "closed_form": model.problem_class.has_documents,
        }
        for name, model in SYSTEMS.items()
    ]


def _toolkit() -> list[dict[str, Any]]:
    """Return what is served besides motions."""
    return [
        {
            "path": path,
            "title": summary,
            "schema": SCHEMA.format(name=TASKS[kind][0].__name__),
            "fields": list(TASKS[kind][0].model_fields),
        }
        for path, (kind, summary, _) in RESOURCES.items()
        if kind in _TOOLKIT
    ]


def router(
    settings: Settings, answers: Answers, missing: Callable[[], Awaitable[list[str]]]
) -> APIRouter:
    """Return the routes of one server, over its settings, its answers, and what says which of its
    parts are missing.
    """
    routes = APIRouter()
    for path, (kind, summary, _) in RESOURCES.items():
        routes.add_api_route(
            path,
            _answering(kind, answers),
            methods=["POST"],
            operation_id=_OPERATIONS[kind],
            summary=summary,
            name=kind,
            tags=["toolkit" if kind in _TOOLKIT else "motions"],
        )
    _add_service_routes(routes, settings, missing)
    return routes


def _add_service_routes(
    routes: APIRouter, settings: Settings, missing: Callable[[], Awaitable[list[str]]]
) -> None:
    """Add what tells of a server itself: systems, schemas, health."""

    readable = partial(_readable, routes)
    described = _describe("SystemList")

    @readable("/v1/systems", "list_systems", "List the systems that can be solved", described)
    async def systems() -> Response:
        """Return the systems, the version and the limits."""
        known = {"systems": _systems(), "toolkit": _toolkit()}
        return _json({**known, "version": __version__, "limits": settings.limits})

    summary = "List the JSON schemas of requests and answers"

    @readable("/v1/schemas", "list_schemas", summary, _describe("SchemaList"))
    async def schemas() -> Response:
        """Return the names of all schemas."""
        listed = [
            {"name": name, "title": title, "link": SCHEMA.format(name=name)}
            for name, title in schema_names().items()
        ]
        return _json({"schemas": listed})

    any_schema = {_SCHEMA_TYPE: {"schema": {"type": "object"}}}

    @readable(SCHEMA, "get_schema", "Give one JSON schema", any_schema)
    async def schema(name: str) -> Response:
        """Return one schema by its name."""
        try:
            return _json(schema_document(name), _SCHEMA_TYPE)
        except KeyError:
            raise Refused(
                "no-such-resource", f"No schema is called {show(name)}; GET /v1/schemas lists all."
            ) from None

    @readable("/healthz", "check_health", "Whether the server runs", _describe("Health"))
    async def healthz() -> Response:
        """Return that the server runs."""
        return _json({"status": "ok", "version": __version__})

    summary = "Whether the server can answer: a warm worker, its database"

    @readable("/readyz", "check_readiness", summary, _describe("Health"))
    async def readyz() -> Response:
        """Return that the server can answer; raises Refused where a part is missing."""
        if parts := await missing():
            raise Refused("not-ready", " ".join(parts), retry_after=1)
        return _json({"status": "ready"})


def _readable(
    routes: APIRouter, path: str, operation: str, summary: str, content: dict[str, Any]
) -> Callable[[Callable[..., Awaitable[Response]]], None]:
    """Return a decorator that adds an endpoint to the routes."""
    described: dict[str, Any] = {
        "operation_id": operation,
        "summary": summary,
        "tags": ["service"],
        "responses": {200: {"description": summary, "content": content}},
    }
    return lambda endpoint: add_readable(
        routes, path, endpoint, response_class=Response, **described
    )


def _answering(kind: str, answers: Answers) -> Callable[[Request], Awaitable[Response]]:
    async def answer(request: Request) -> Response:
        return await answers.answer(kind, request)

    return answer


def _describe(name: str) -> dict[str, Any]:
    """Return the content of an answer that a schema describes."""
    return {"application/json": {"schema": {"$ref": f"{PREFIX}{name}"}}}


def _json(document: dict[str, Any], media_type: str = "application/json") -> Response:
    return Response(orjson.dumps(document), media_type=media_type)
