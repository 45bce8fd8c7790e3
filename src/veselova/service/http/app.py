"""The ASGI application: routes, workers for its life, problem documents for every failure, and what
stands around them.
"""

from __future__ import annotations

import logging
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from http import HTTPStatus

from anyio import to_thread
from asgi_correlation_id import CorrelationIdMiddleware
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.middleware.cors import CORSMiddleware
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.routing import Match, Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from veselova.mechanics.core.errors import InvalidInput, InvalidRequest, VeselovaError, show
from veselova.service.access.keys import Keys, open_keys
from veselova.service.access.middleware import PROBES, Access, requires_keys
from veselova.service.answers.endpoint import Answers
from veselova.service.answers.rendering import read_body
from veselova.service.api.media_types import FORMATS
from veselova.service.api.private_folder import require_own
from veselova.service.api.problem_details import Refused, problem_code, problem_response
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.http.job_routes import routes as job_routes
from veselova.service.http.job_service import JobService, missing_parts
from veselova.service.http.openapi import complete_openapi
from veselova.service.http.pages import add_explorer, add_guide
from veselova.service.http.routes import RESOURCES, computing_routes, telling_routes
from veselova.service.http.security_headers import SecurityHeaders
from veselova.service.observability.metrics import Metrics
from veselova.service.observability.request_log import Failures, RequestLog, note
from veselova.service.workers.pool import Workers
from veselova.service.workers.tasks import TASKS
from veselova.version import __version__

__all__ = ["create_app"]

_LOG = logging.getLogger("veselova.service")

#: The names of loopback.
_LOOPBACK = ("localhost", "*.localhost", "127.0.0.1", "[::1]", "::1")

#: What a page of another origin may send, and see of an answer.
_CORS_SENT = (
    "Authorization",
    "Content-Type",
    "Idempotency-Key",
    "X-Request-ID",
    "baggage",
    "traceparent",
    "tracestate",
)
_CORS_SEEN = (
    "ETag",
    "Location",
    "Retry-After",
    "Veselova-Provenance",
    "X-Request-ID",
)


def create_app(settings: Settings | None = None, *, loopback: bool = False) -> FastAPI:
    """Return the application; settings come from the environment when none are given.

    ``loopback`` says that nobody but this machine can connect; clients need no API key then, unless
    the settings require one. Raises Refused where keys are required and their database cannot be
    opened, InvalidInput for a folder that others may write.
    """
    limits = settings or Settings()
    require_own(limits.data_dir)
    metrics = Metrics()
    keyed = requires_keys(limits, loopback)
    workers = Workers(limits, metrics)
    answers = Answers(limits, workers, metrics)
    keys = open_keys(limits) if keyed else None
    if keys is not None and not any(key.state == "valid" for key in keys.list()):
        _LOG.warning("clients need an API key and there is none yet: veselova keys create NAME")
    jobs = JobService(limits)
    metrics.gauges("veselova_jobs", "Sweeps by state", "state", jobs.counts)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        await to_thread.run_sync(answers.open)
        async with jobs.running(), workers.running():
            yield
        if keys is not None:
            keys.close()

    app = FastAPI(
        title="veselova",
        version=__version__,
        summary="Motions of an n-dimensional rigid body under the Veselova constraint",
        description="POST a problem and times; receive the motion in theta functions or by "
        "integration, with its error.",
        servers=[{"url": limits.root_path}] if limits.root_path else None,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,  # its address would be made of the request's Host
        telemetry={"exclude": lambda scope: scope.get("path") in PROBES},
    )
    app.state.answers = answers
    app.state.jobs = jobs
    missing = partial(missing_parts, workers, jobs, keys)
    for part in (computing_routes(answers), telling_routes(limits, missing), job_routes):
        app.router.routes.extend(part.routes)
    add_explorer(app)
    add_guide(app)
    problems = _Problems(limits, workers, metrics)
    for kind in (VeselovaError, Refused, HTTPException, RequestValidationError):
        app.add_exception_handler(kind, problems.answer)
    app.openapi = partial(complete_openapi, app)  # type: ignore[method-assign]
    hosts = _allowed_hosts(limits) if loopback or not keyed else ["*"]
    _surround(app, limits, keys, hosts, metrics)
    return app


def _allowed_hosts(settings: Settings) -> list[str]:
    """Return the hosts that a server without keys goes by. A page of the web can let a name of
    its own point to 127.0.0.1 (DNS rebinding), and then calls the server by that name.
    """
    return [*_LOOPBACK, *re.findall(r"[^\s,]+", settings.allowed_hosts)]


def _surround(
    app: FastAPI, settings: Settings, keys: Keys | None, hosts: list[str], metrics: Metrics
) -> None:
    """Put what looks at every request around an application: each of these stands around those
    before it.
    """
    metrics.serve(app)
    app.add_middleware(_Requests, most_bytes=settings.max_body_bytes)
    packed = (entry.media_type for entry in FORMATS.values() if entry.compressed)
    app.add_middleware(
        GZipMiddleware,
        minimum_size=1000,
        compresslevel=1,  # on the mantissas of a motion a higher level costs seconds, saves little
        exclude_content_types=(*DEFAULT_EXCLUDED_CONTENT_TYPES, *packed),
    )
    app.add_middleware(Access, keys=keys, refused=metrics.count_refused)
    app.add_middleware(Failures)
    if settings.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=re.findall(r"[^\s,]+", settings.cors_origins),
            allow_methods=("GET", "POST", "DELETE"),
            allow_headers=_CORS_SENT,
            expose_headers=_CORS_SEEN,
        )
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=hosts, www_redirect=False)
    app.add_middleware(RequestLog, quiet=PROBES | {"/metrics"})
    app.add_middleware(SecurityHeaders)
    app.add_middleware(CorrelationIdMiddleware, validator=_is_request_id)


def _is_request_id(text: str) -> bool:
    """Return whether an id that a client made up may stand in logs and answers."""
    return re.fullmatch(r"[A-Za-z0-9._-]{1,64}", text) is not None


class _Requests:
    """ASGI middleware: answers HEAD as GET, whose body the server leaves out, and refuses large
    bodies. The framework's own limit is no problem document.
    """

    def __init__(self, app: ASGIApp, most_bytes: int) -> None:
        self._app = app
        self._most_bytes = most_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""
        size = 0

        async def receive_some() -> Message:
            nonlocal size
            message = await receive()
            size += len(message.get("body", b""))
            if size > self._most_bytes:
                detail = f"The body: required at most {self._most_bytes} bytes; given more."
                raise HTTPException(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, detail)
            return message

        if scope.get("method") == "HEAD":
            scope = {**scope, "method": "GET"}
        await self._app(scope, receive_some, send)


class _Problems:
    """The handler of exceptions: answers with the problem document of each, and counts it."""

    def __init__(self, settings: Settings, workers: Workers, metrics: Metrics) -> None:
        self._settings = settings
        self._workers = workers
        self._metrics = metrics

    async def answer(self, request: Request, error: Exception) -> Response:
        """Return the answer to a request that ended with an exception."""
        if isinstance(error, RequestValidationError):
            error = await self._invalid(request, error)
        elif isinstance(error, HTTPException) and isinstance(error.__cause__, ClientDisconnect):
            detail = "The client closed the connection before its request was complete."
            error = Refused("client-gone", detail)
        response = problem_response(error)
        if response.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
            # the framework names those of one route alone
            response.headers["Allow"] = ", ".join(sorted(_methods(request)))
        note(outcome=problem_code(error))
        if isinstance(error, Refused):
            self._metrics.count_refused(error.code)
        elif response.status_code == HTTPStatus.INTERNAL_SERVER_ERROR:
            _LOG.error("a request failed", exc_info=error)
        return response

    async def _invalid(self, request: Request, error: RequestValidationError) -> Exception:
        """Return what is wrong with a request that the framework could not read. All faults of a
        body are found in a worker, where the numbers can be looked at as well.
        """
        first, *others = error.errors()
        if first["loc"][0] != "body":
            faults = [
                InvalidInput(item["loc"][1:], item["msg"].lower(), show(item.get("input")))
                for item in (first, *others)
            ]
            return InvalidRequest(faults)
        body = await request.body()
        if body and isinstance(error.body, bytes):
            given = request.headers.get("content-type", "none")[:100]
            required = "Content-Type: required application/json"
            return Refused("unsupported-media-type", f"{required}; given {given}.")
        model = _MODELS[request.scope["route"].path]
        budget_s = self._settings.max_budget_s
        try:
            await self._workers.run(read_body, model, body, self._settings, budget_s=budget_s)
        except (VeselovaError, Refused) as found:
            return found
        return error


#: The models of bodies, by path.
_MODELS = {path: TASKS[resource.kind][0] for path, resource in RESOURCES.items()}
_MODELS["/v1/sweeps"] = SweepRequest


def _methods(request: Request) -> set[str]:
    """Return the methods that some route has for the path of a request."""
    routes = [route for route in request.app.routes if isinstance(route, Route)]
    found = [route for route in routes if route.matches(request.scope)[0] is not Match.NONE]
    methods = {method for route in found for method in route.methods or ()}
    return methods | {"HEAD"} if "GET" in methods else methods
