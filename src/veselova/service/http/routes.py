"""The resources of the HTTP API that compute, those that describe the server, and the OpenAPI
document."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from fastapi import APIRouter, FastAPI, Request, Response
from pydantic import BaseModel

from veselova.service.api import answers as models
from veselova.service.api.answers import Problem
from veselova.service.api.media_types import FORMATS, JSON
from veselova.service.api.problem_details import MEDIA_TYPE, Refused
from veselova.service.api.problem_models import SYSTEMS, summary_of
from veselova.service.api.settings import Settings
from veselova.service.workers.answers import PROVENANCE, Answers
from veselova.service.workers.tasks import TASKS
from veselova.version import __version__

#: Where the schema of a request is.
_SCHEMA = "/openapi.json#/components/schemas/{}"


#: What is computed: path → kind, operation id and model of the answer. An operation id is the name
#: of a function in generated clients, and never changes.
RESOURCES: Mapping[str, tuple[str, str, type[BaseModel]]] = {
    "/v1/trajectories": ("trajectory", "solve_trajectory", models.Trajectory),
    "/v1/comparisons": ("comparison", "compare_engines", models.Comparison),
    "/v1/ensembles": ("ensemble", "solve_ensemble", models.Ensemble),
    "/v1/tori": ("torus", "compute_torus", models.Torus),
    "/v1/closed-forms": ("closed_form", "compute_closed_form", models.ClosedForm),
    "/v1/curves": ("curve", "compute_curve", models.Curve),
    "/v1/theta": ("theta", "evaluate_theta", models.Theta),
    "/v1/geodesics": ("geodesic", "compute_geodesics", models.Geodesics),
}


def computing_routes(answers: Answers) -> APIRouter:
    """Return the routes that compute."""
    routes = APIRouter(responses=refusals(400, 406, 413, 415, 501, 504, 507))
    for path, (kind, operation, answer) in RESOURCES.items():
        described: dict[str, Any] = {"model": answer}
        if kind == "trajectory":
            others = (entry.media_type for entry in FORMATS.values() if entry is not JSON)
            described["content"] = dict.fromkeys(others, FILE)
            meaning = {"description": "how it was computed, as JSON", "schema": {"type": "string"}}
            described["headers"] = {PROVENANCE: meaning}
        routes.add_api_route(
            path,
            _endpoint(kind, answers),
            methods=["POST"],
            operation_id=operation,
            name=operation,
            tags=["toolkit" if kind in ("curve", "theta", "geodesic") else "motions"],
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
    """Return the routes of what tells of a server: systems, health. ``missing`` says which
    of its parts are missing.
    """
    routes = APIRouter(tags=["service"], responses=refusals())

    @routes.get("/v1/systems", operation_id="list_systems")
    async def list_systems() -> models.SystemList:
        """List the systems that can be solved."""
        return models.SystemList(systems=_systems(), version=__version__, limits=settings.limits)

    @routes.get("/healthz", operation_id="check_health")
    async def healthz() -> models.Health:
        """Return that the server runs."""
        return models.Health(status="ok", version=__version__)

    @routes.get("/readyz", operation_id="check_readiness")
    async def readyz() -> models.Ready:
        """Return whether the server can answer: a warm worker, its database."""
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
            schema=_SCHEMA.format(model.__name__),
            fields=[field for field in model.model_fields if field != "system"],
            engines={kind: list(methods) for kind, methods in model.problem_class.engines.items()},
            formulations=list(model.problem_class.formulations),
            outputs=list(model.problem_class.outputs),
            time=model.problem_class.time,
            closed_form=model.problem_class.has_tori,
        )
        for name, model in SYSTEMS.items()
    ]


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
