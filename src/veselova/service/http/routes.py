"""The resources of the HTTP API that compute, and those that tell of the server itself."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, NamedTuple

import orjson
from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from veselova.mechanics.core.errors import show
from veselova.service.answers.endpoint import PROVENANCE, Answers
from veselova.service.api import answers as models
from veselova.service.api.media_types import FORMATS, JSON
from veselova.service.api.problem_details import Refused
from veselova.service.api.problem_models import SYSTEMS, summary_of
from veselova.service.api.settings import Settings
from veselova.service.http.openapi import FILE, refusals, schema_document, schema_names
from veselova.service.workers.tasks import TASKS
from veselova.version import __version__

__all__ = ["RESOURCES", "computing_routes", "telling_routes"]

#: The path of one JSON schema, and the media type of it.
_SCHEMA = "/v1/schemas/{name}"
_SCHEMA_TYPE = "application/schema+json"


class _Resource(NamedTuple):
    """What is computed: the operation id, which is the name of a function in generated clients and
    never changes, and the model of the answer.
    """

    kind: str
    operation: str
    summary: str
    answer: type[BaseModel]
    tag: str = "motions"


#: What is computed, by its path.
RESOURCES: Mapping[str, _Resource] = {
    "/v1/trajectories": _Resource(
        "trajectory", "solve_trajectory", "Solve a motion with one engine", models.Trajectory
    ),
    "/v1/comparisons": _Resource(
        "comparison", "compare_engines", "Solve a motion with both engines", models.Comparison
    ),
    "/v1/ensembles": _Resource(
        "ensemble", "solve_ensemble", "Solve the motions of many starts", models.Ensemble
    ),
    "/v1/tori": _Resource(
        "torus", "compute_torus", "Describe the invariant torus of a motion", models.Torus
    ),
    "/v1/closed-forms": _Resource(
        "closed_form",
        "compute_closed_form",
        "Give a motion in closed form as data",
        models.ClosedForm,
    ),
    "/v1/curves": _Resource(
        "curve",
        "compute_curve",
        "Compute the periods of a hyperelliptic curve",
        models.Curve,
        "toolkit",
    ),
    "/v1/theta": _Resource(
        "theta", "evaluate_theta", "Evaluate Riemann theta functions", models.Theta, "toolkit"
    ),
}


def computing_routes(answers: Answers) -> APIRouter:
    """Return the routes of what is computed."""
    routes = APIRouter(responses=refusals(400, 406, 413, 415, 501, 504, 507))
    for path, resource in RESOURCES.items():
        described: dict[str, Any] = {"model": resource.answer}
        if resource.kind == "trajectory":
            others = (entry.media_type for entry in FORMATS.values() if entry is not JSON)
            described["content"] = dict.fromkeys(others, FILE)
            meaning = {"description": "how it was computed, as JSON", "schema": {"type": "string"}}
            described["headers"] = {PROVENANCE: meaning}
        routes.add_api_route(
            path,
            _endpoint(resource.kind, answers),
            methods=["POST"],
            operation_id=resource.operation,
            summary=resource.summary,
            name=resource.kind,
            tags=[resource.tag],
            response_model=None,
            responses={200: described},
        )
    return routes


def _endpoint(kind: str, answers: Answers) -> Callable[..., Awaitable[Response]]:
    async def answer(asked: Any, request: Request) -> Response:
        return await answers.answer(kind, asked, request)

    answer.__annotations__["asked"] = TASKS[kind][0]
    return answer


def telling_routes(settings: Settings, missing: Callable[[], Awaitable[list[str]]]) -> APIRouter:
    """Return the routes of what tells of a server: systems, schemas, health. ``missing`` says which
    of its parts are missing.
    """
    routes = APIRouter(tags=["service"], responses=refusals())

    @routes.get("/v1/systems", operation_id="list_systems")
    async def list_systems() -> models.SystemList:
        """List the systems that can be solved."""
        return models.SystemList(
            systems=_systems(), toolkit=_toolkit(), version=__version__, limits=settings.limits
        )

    @routes.get("/v1/schemas", operation_id="list_schemas")
    async def list_schemas(request: Request) -> models.SchemaList:
        """List the JSON schemas of requests and answers."""
        listed = schema_names(request.app.openapi()).items()
        links = [{"name": n, "title": title, "link": _SCHEMA.format(name=n)} for n, title in listed]
        return models.SchemaList.model_validate({"schemas": links})

    content = {_SCHEMA_TYPE: {"schema": {"type": "object"}}}

    @routes.get(
        _SCHEMA,
        operation_id="get_schema",
        response_class=Response,
        responses={200: {"content": content}, **refusals(404)},
    )
    async def get_schema(name: str, request: Request) -> Response:
        """Give one JSON schema by its name."""
        if (document := schema_document(request.app.openapi(), name)) is None:
            detail = f"No schema is called {show(name)}; GET /v1/schemas lists all."
            raise Refused("no-such-resource", detail)
        return Response(orjson.dumps(document), media_type=_SCHEMA_TYPE)

    @routes.get("/healthz", operation_id="check_health")
    async def healthz() -> models.Health:
        """Tell that the server runs."""
        return models.Health(status="ok", version=__version__)

    @routes.get("/readyz", operation_id="check_readiness")
    async def readyz() -> models.Ready:
        """Tell whether the server can answer: a warm worker, its database."""
        if parts := await missing():
            raise Refused("not-ready", " ".join(parts), retry_after=1)
        return models.Ready(status="ready")

    return routes


def _systems() -> list[models.System]:
    """Return the systems served, for clients that discover them."""
    return [
        models.System(
            system=name,
            title=summary_of(model.problem_class),
            schema=_SCHEMA.format(name=model.__name__),
            fields=[field for field in model.model_fields if field != "system"],
            engines={kind: list(methods) for kind, methods in model.problem_class.engines.items()},
            formulations=list(model.problem_class.formulations),
            outputs=list(model.problem_class.outputs),
            time=model.problem_class.time,
            closed_form=model.problem_class.has_documents,
        )
        for name, model in SYSTEMS.items()
    ]


def _toolkit() -> list[models.Tool]:
    """Return what is served besides motions."""
    return [
        models.Tool(
            path=path,
            title=resource.summary,
            schema=_SCHEMA.format(name=TASKS[resource.kind][0].__name__),
            fields=list(TASKS[resource.kind][0].model_fields),
        )
        for path, resource in RESOURCES.items()
        if resource.tag == "toolkit"
    ]
