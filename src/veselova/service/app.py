"""The ASGI application: routes, problem documents, OpenAPI."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio
from fastapi import FastAPI, Request
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema
from starlette.exceptions import HTTPException
from starlette.responses import Response

from veselova.mechanics.errors import VeselovaError
from veselova.service.problem_details import MEDIA_TYPE, Refused, problem_response
from veselova.service.routes import RESOURCES, router
from veselova.service.settings import Settings
from veselova.service.tasks import TASKS
from veselova.service.workers import Workers
from veselova.version import __version__

__all__ = ["create_app"]

_LOG = logging.getLogger("veselova.service")

_PROBLEM_SCHEMA = {
    "type": "object",
    "required": ["type", "title", "status", "detail"],
    "properties": {
        "type": {"type": "string", "examples": ["urn:veselova:problem:invalid-input"]},
        "title": {"type": "string"},
        "status": {"type": "integer"},
        "detail": {"type": "string"},
        "outcome": {"type": "string", "description": "the named outcome of an engine that cannot serve the problem"},
        "errors": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["pointer", "detail"],
                "properties": {"pointer": {"type": "string"}, "detail": {"type": "string"}},
            },
        },
    },
}

_REFUSALS = {
    400: "Not JSON",
    406: "No acceptable representation",
    413: "Body too large",
    415: "Not application/json",
    422: "Invalid input, or a problem that the engine cannot serve",
    501: "An optional library is not installed on this server",
    503: "Overloaded, or the worker was lost; see Retry-After",
    504: "Over the time budget",
}


def create_app(settings: Settings | None = None) -> FastAPI:
    """Return the application; settings come from the environment when none are given."""
    limits = settings or Settings()
    workers = Workers(limits)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(_warm, workers)
            yield
            tasks.cancel_scope.cancel()

    app = FastAPI(title="veselova", version=__version__, lifespan=lifespan)
    app.include_router(router(limits, workers))
    for kind in (VeselovaError, Refused, HTTPException, Exception):
        app.add_exception_handler(kind, _answer_problem)
    app.openapi = lambda: _openapi(app)  # type: ignore[method-assign]
    return app


async def _warm(workers: Workers) -> None:
    try:
        await workers.start()
    except Exception:
        _LOG.exception("the first worker could not be started; /readyz stays at 503")


async def _answer_problem(_: Request, error: Exception) -> Response:
    response = problem_response(error)
    if response.status_code >= 500 and not isinstance(error, Refused):
        _LOG.error("a request failed", exc_info=error)
    return response


def _openapi(app: FastAPI) -> dict[str, Any]:
    """Return the OpenAPI document: routes read their bodies themselves, so the models are put in here, with their examples."""
    if app.openapi_schema is None:
        document = get_openapi(
            title="veselova",
            version=__version__,
            summary="Motions of an n-dimensional rigid body under the Veselova constraint",
            description="POST a problem and times; receive the motion in theta functions or by integration, with its error.",
            routes=app.routes,
        )
        models = [(model, "validation") for model, _ in TASKS.values()]
        _, definitions = models_json_schema(models, ref_template="#/components/schemas/{model}")  # type: ignore[arg-type]
        schemas = document.setdefault("components", {}).setdefault("schemas", {})
        schemas.update(definitions["$defs"], Problem=_PROBLEM_SCHEMA)
        for path, (kind, _, content) in RESOURCES.items():
            model = TASKS[kind][0]
            operation = document["paths"][path]["post"]
            example = model.model_config["json_schema_extra"]["examples"][0]  # type: ignore[index]
            reference = {"$ref": f"#/components/schemas/{model.__name__}"}
            operation["requestBody"] = {
                "required": True,
                "content": {"application/json": {"schema": reference, "example": example}},
            }
            operation["responses"] = {
                "200": {"description": content, "content": {"application/json": {"schema": {"type": "object"}}}}
            }
            problem = {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}
            for status, description in _REFUSALS.items():
                operation["responses"][str(status)] = {"description": description, "content": problem}
        app.openapi_schema = document
    return app.openapi_schema
