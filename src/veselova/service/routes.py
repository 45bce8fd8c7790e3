"""The resources of the HTTP API."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

import anyio
import orjson
from fastapi import APIRouter, Request
from starlette.responses import Response

from veselova.service.admission import admit, read_json, require_acceptable
from veselova.service.problem_details import Refused
from veselova.service.schemas import read_request
from veselova.service.settings import Settings
from veselova.service.systems import SYSTEMS
from veselova.service.tasks import TASKS
from veselova.service.workers import Workers
from veselova.version import __version__

__all__ = ["RESOURCES", "router"]

#: Path → (kind of answer, summary, what the answer holds).
RESOURCES = {
    "/v1/trajectories": ("trajectory", "Solve a motion with one engine", "The motion at the given times"),
    "/v1/comparisons": ("comparison", "Solve a motion with both engines", "Both motions and how they agree"),
    "/v1/tori": ("torus", "Describe the invariant torus of a motion", "Curve, periods, frequencies, phases"),
}


def _systems() -> list[dict[str, Any]]:
    """Return the systems served, for clients that discover them."""
    return [
        {
            "system": name,
            "title": (model.__doc__ or "").strip().splitlines()[0],
            "fields": [field for field in model.model_fields if field != "system"],
            "engines": {engine: list(methods) for engine, methods in model.problem_class.engines.items()},
            "formulations": list(model.problem_class.formulations),
            "outputs": list(model.problem_class.outputs),
            "time": model.problem_class.time,
        }
        for name, model in SYSTEMS.items()
    ]


def router(settings: Settings, workers: Workers) -> APIRouter:
    """Return the routes of one server, over its settings and workers."""
    routes = APIRouter()
    for path, (kind, summary, _) in RESOURCES.items():
        routes.add_api_route(
            path, _computing(kind, settings, workers), methods=["POST"], summary=summary, name=kind, tags=["motions"]
        )

    @routes.get("/v1/systems", summary="List the systems that can be solved", tags=["service"])
    async def systems() -> Response:
        return _json({"systems": _systems(), "version": __version__, "limits": settings.limits})

    @routes.get("/healthz", summary="Whether the server runs", tags=["service"])
    async def healthz() -> Response:
        return _json({"status": "ok", "version": __version__})

    @routes.get("/readyz", summary="Whether a worker is warm", tags=["service"])
    async def readyz() -> Response:
        if not workers.warm:
            raise Refused("not-ready", "No worker is warm yet.", retry_after=1)
        return _json({"status": "ready"})

    return routes


def _computing(kind: str, settings: Settings, workers: Workers) -> Callable[[Request], Awaitable[Response]]:
    model, _ = TASKS[kind]

    async def compute(request: Request) -> Response:
        require_acceptable(request.headers.get("accept"))
        asked = read_request(model, await read_json(request, settings))
        admit(asked, settings)
        try:
            body = await _while_connected(request, partial(workers.run, kind, asked.model_dump(), asked.budget_s))
        except anyio.get_cancelled_exc_class():
            # The grace after SIGTERM has run out. The worker is dead by now; the client is owed an answer all the same.
            raise Refused("shutting-down", "The server is shutting down and stopped this work.", retry_after=5) from None
        return Response(body, media_type="application/json")

    return compute


async def _while_connected(request: Request, work: Callable[[], Awaitable[bytes]]) -> bytes:
    """Return what the work gives; end it when the client has gone."""
    answers: list[bytes] = []
    failures: list[Exception] = []

    async def run() -> None:
        try:
            answers.append(await work())
        except Exception as error:
            failures.append(error)
        tasks.cancel_scope.cancel()

    async def watch() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass
        tasks.cancel_scope.cancel()

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(run)
        tasks.start_soon(watch)
    if failures:
        raise failures[0]
    if not answers:
        raise Refused("client-gone", "The client closed the connection, and the work was stopped.")
    return answers[0]


def _json(document: dict[str, Any]) -> Response:
    return Response(orjson.dumps(document), media_type="application/json")
