"""The ASGI application: routes, workers, problem documents for every failure, and middleware."""

from __future__ import annotations

import logging
import re
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from functools import partial
from http import HTTPStatus

from anyio import to_thread
from asgi_correlation_id import CorrelationIdMiddleware
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.middleware.cors import CORSMiddleware
from starlette.middleware.errors import ServerErrorMiddleware
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from veselova.mechanics.core.errors import InvalidInput, InvalidRequest, VeselovaError, show
from veselova.service.access.keys import Keys, open_keys
from veselova.service.access.middleware import PROBES, Access, requires_keys
from veselova.service.api.media_types import MEDIA_TYPES
from veselova.service.api.private_files import require_own
from veselova.service.api.problem_details import Refused, problem_code, problem_response
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.http.job_routes import routes as job_routes
from veselova.service.http.job_service import JobService, missing_parts
from veselova.service.http.pages import add_explorer, add_guide
from veselova.service.http.routes import (
    RESOURCES,
    complete_openapi,
    computing_routes,
    telling_routes,
)
from veselova.service.observability.logs import RequestLog, note
from veselova.service.observability.metrics import Metrics
from veselova.service.workers.answers import PROVENANCE, Answers
from veselova.service.workers.pool import Workers
from veselova.service.workers.tasks import TASKS
from veselova.version import __version__

_LOG = logging.getLogger("veselova.service")

#: The names of loopback.
_LOOPBACK = ("localhost", "*.localhost", "127.0.0.1", "[::1]", "::1")


#: Files on which no content coding is put.
_COMPRESSED = (MEDIA_TYPES["npz"], MEDIA_TYPES["parquet"])

#: The methods of routes, and others that metrics count by their names.
_METHODS = ("GET", "POST", "DELETE", "OPTIONS", "PUT", "PATCH")

#: An answer of the service is data: nothing in it is to be run, framed or guessed at.
_HEADERS = {
    "content-security-policy": "default-src 'none'; frame-ancestors 'none'",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
}

#: Status codes that the framework refuses with → the codes of their documents.
_CODES = {
    400: "malformed-json",
    404: "not-found",
    405: "method-not-allowed",
    413: "body-too-large",
}


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
    metrics.jobs(jobs.counts)

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
    app.state.metrics = metrics
    app.state.ending = lambda: False  # its server says when it is to end
    missing = partial(missing_parts, workers, jobs, keys)
    for part in (computing_routes(answers), telling_routes(limits, missing), job_routes):
        app.router.routes.extend(part.routes)
    add_explorer(app)
    add_guide(app)
    for kind in (VeselovaError, HTTPException, RequestValidationError):
        app.add_exception_handler(kind, _answer)
    app.openapi = partial(complete_openapi, app)  # type: ignore[method-assign]
    # a page of the web can let a name of its own point to 127.0.0.1 (DNS rebinding), and then calls
    # a server without keys by that name
    hosts = ["*"] if keyed and not loopback else [*_LOOPBACK, *_listed(limits.allowed_hosts)]
    _surround(app, limits, keys, hosts, metrics)
    return app


def _surround(
    app: FastAPI, settings: Settings, keys: Keys | None, hosts: list[str], metrics: Metrics
) -> None:
    """Add the middleware to an application, each around those before it."""
    metrics.serve(app)
    app.add_middleware(_Requests, most_bytes=settings.max_body_bytes)
    app.add_middleware(
        GZipMiddleware,
        minimum_size=1000,
        compresslevel=1,  # on the mantissas of a motion a higher level costs seconds, saves little
        exclude_content_types=(*DEFAULT_EXCLUDED_CONTENT_TYPES, *_COMPRESSED),
    )
    app.add_middleware(Access, keys=keys, refused=metrics.count_refused)
    # that of the framework, which stands outside of all, would answer without headers
    app.add_middleware(ServerErrorMiddleware, handler=_fail)
    if settings.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=_listed(settings.cors_origins),
            allow_methods=("GET", "POST", "DELETE"),
            allow_headers=["*"],
            expose_headers=("Location", "Retry-After", PROVENANCE, "X-Request-ID"),
        )
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=hosts, www_redirect=False)
    app.add_middleware(RequestLog, quiet=PROBES | {"/metrics"})
    app.add_middleware(_SecurityHeaders)
    app.add_middleware(CorrelationIdMiddleware, validator=_is_request_id)


def _listed(text: str) -> list[str]:
    """Return the parts of a setting that is a list."""
    return re.findall(r"[^\s,]+", text)


def _is_request_id(text: str) -> bool:
    """Return whether an id that a client made up may stand in logs and answers."""
    return re.fullmatch(r"[A-Za-z0-9._-]{1,64}", text) is not None


class _Requests:
    """ASGI middleware: answers HEAD as GET, whose body the server leaves out, gives methods that
    clients make up one name, since metrics keep each, and refuses large bodies. The framework's own
    limit is no problem document.
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

        if (method := scope.get("method", "GET")) not in _METHODS:
            scope = {**scope, "method": "GET" if method == "HEAD" else "OTHER"}
        await self._app(scope, receive_some, send)


class _SecurityHeaders:
    """ASGI middleware: adds the headers that an answer does not have; failures are not to be
    stored.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and its answer back with the headers."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                stored = {"cache-control": "no-store"} if message["status"] >= 400 else {}
                for name, value in {**_HEADERS, **stored}.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with_headers if scope["type"] == "http" else send)


async def _answer(request: Request, error: Exception) -> Response:
    """Return the problem document of what ended a request, and count it."""
    if isinstance(error, RequestValidationError):
        error = await _invalid(request, error)
    headers: Mapping[str, str] = {}
    if isinstance(error, HTTPException):
        headers = error.headers or {}
        error = _refusal(error)
    response = problem_response(error)
    response.headers.update(headers)
    if response.status_code == HTTPStatus.METHOD_NOT_ALLOWED and "route" in request.scope:
        # the framework names those of one route alone
        methods = request.app.openapi()["paths"].get(request.scope["route"].path, ())
        allowed = {*map(str.upper, methods)} | ({"HEAD"} if "get" in methods else set())
        response.headers["Allow"] = ", ".join(sorted(allowed)) or response.headers["Allow"]
    note(outcome=problem_code(error))
    if isinstance(error, Refused):
        request.app.state.metrics.count_refused(error.code)
    elif response.status_code == HTTPStatus.INTERNAL_SERVER_ERROR:
        _LOG.error("a request failed", exc_info=error)
    return response


def _refusal(error: HTTPException) -> Refused:
    """Return the framework's refusal as one of the service."""
    if isinstance(error.__cause__, ClientDisconnect):
        detail = "The client closed the connection before its request was complete."
        return Refused("client-gone", detail)
    code, detail = _CODES[error.status_code], str(error.detail)
    if code == "malformed-json" and error.__cause__ is not None:
        detail = "The body: required JSON without deep nesting, of integers to 4300 digits."
    return Refused(code, detail)


async def _fail(_: Request, error: Exception) -> Response:
    """Return the answer to a failure of ours, which the server logs."""
    note(outcome=problem_code(error))
    return problem_response(error)


async def _invalid(request: Request, error: RequestValidationError) -> Exception:
    """Return what is wrong with a request that the framework could not read. All faults of a body
    are found in a worker, where the numbers can be looked at as well.
    """
    faults = [
        InvalidInput(item["loc"][1:], item["msg"].lower(), show(item.get("input")))
        for item in error.errors()
        if item["loc"][0] != "body"
    ]
    if faults:
        return InvalidRequest(faults)
    body = await request.body()
    if body and isinstance(error.body, bytes):
        given = request.headers.get("content-type", "none")[:100]
        required = "Content-Type: required application/json"
        return Refused("unsupported-media-type", f"{required}; given {given}.")
    path = request.scope["route"].path
    model = TASKS[RESOURCES[path][0]][0] if path in RESOURCES else SweepRequest
    try:
        await request.app.state.answers.check(model, body)
    except VeselovaError as found:
        return found
    return error
