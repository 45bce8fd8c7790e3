"""The resources of the HTTP API."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import orjson
from fastapi import APIRouter, Request
from fastapi.routing import APIRoute
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from veselova.service.answers import Answers
from veselova.service.problem_details import Refused
from veselova.service.settings import Settings
from veselova.service.systems import SYSTEMS
from veselova.version import __version__

__all__ = ["KEPT", "RESOURCES", "router"]

#: The path of trajectories, and that of those which are kept.
TRAJECTORIES, KEPT = "/v1/trajectories", "/v1/trajectories/{name}"

#: Path → (kind of answer, summary, what the answer holds).
RESOURCES = {
    TRAJECTORIES: ("trajectory", "Solve a motion with one engine", "The motion at the given times"),
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


def router(settings: Settings, answers: Answers, missing: Callable[[], Awaitable[list[str]]]) -> APIRouter:
    """Return the routes of one server, over its settings, its answers, and what says which of its parts are missing."""
    routes = APIRouter()
    for path, (kind, summary, _) in RESOURCES.items():
        answer = answers.trajectory if kind == "trajectory" else _answering(kind, answers)
        described: dict[str, Any] = {"summary": summary, "name": kind, "tags": ["motions"]}
        routes.add_api_route(path, answer, methods=["POST"], route_class_override=_Direct, **described)

    async def kept(request: Request) -> Response:
        return await answers.named(request.path_params["name"], request)

    # A route of Starlette, for GET and HEAD at once; openapi describes it.
    routes.add_route(KEPT, kept, methods=["GET"], name="kept")

    @routes.get("/v1/systems", summary="List the systems that can be solved", tags=["service"])
    async def systems() -> Response:
        return _json({"systems": _systems(), "version": __version__, "limits": settings.limits})

    @routes.get("/healthz", summary="Whether the server runs", tags=["service"])
    async def healthz() -> Response:
        return _json({"status": "ok", "version": __version__})

    @routes.get("/readyz", summary="Whether the server can answer: a warm worker, its database", tags=["service"])
    async def readyz() -> Response:
        if parts := await missing():
            raise Refused("not-ready", " ".join(parts), retry_after=1)
        return _json({"status": "ready"})

    for path, endpoint in (("/v1/systems", systems), ("/healthz", healthz), ("/readyz", readyz)):
        routes.add_api_route(path, endpoint, methods=["HEAD"], include_in_schema=False)

    return routes


class _Direct(APIRoute):
    """A route whose endpoint reads the request itself: the framework looks for no parameters, which takes as long as the rest.

    Nor does it keep stacks for what parameters leave to be closed; exceptions go to the handlers of the application.
    """

    def __init__(self, path: str, endpoint: Callable[[Request], Awaitable[Response]], **described: Any) -> None:
        super().__init__(path, endpoint, **described)

        async def answer(scope: Scope, receive: Receive, send: Send) -> None:
            response = await endpoint(Request(scope, receive, send))
            await response(scope, receive, send)

        self.app = answer


def _answering(kind: str, answers: Answers) -> Callable[[Request], Awaitable[Response]]:
    async def answer(request: Request) -> Response:
        return await answers.document(kind, request)

    return answer


def _json(document: dict[str, Any]) -> Response:
    return Response(orjson.dumps(document), media_type="application/json")
