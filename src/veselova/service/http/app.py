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

from asgi_correlation_id import CorrelationIdMiddleware
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.middleware.cors import CORSMiddleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.responses import Response
from starlette.routing import BaseRoute, Match, Route

from veselova.mechanics.core.errors import InvalidInput, InvalidRequest, VeselovaError, show
from veselova.service.access.keys import Keys, open_keys
from veselova.service.access.middleware import PROBES, Access, requires_keys
from veselova.service.answers.endpoint import Answers
from veselova.service.answers.request_reading import Reader
from veselova.service.api.private_folder import require_own
from veselova.service.api.problem_details import Refused, problem_code, problem_response
from veselova.service.api.settings import Settings
from veselova.service.http.job_routes import routes as job_routes
from veselova.service.http.job_service import JobService, missing_parts
from veselova.service.http.openapi import openapi_document
from veselova.service.http.pages import add_explorer, add_guide
from veselova.service.http.routes import router
from veselova.service.http.security_headers import SecurityHeaders
from veselova.service.observability.metrics import Metrics
from veselova.service.observability.request_log import Failures, RequestLog, note
from veselova.service.workers.pool import Workers
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
    metrics = Metrics()
    require_own(limits.data_dir)
    keyed = requires_keys(limits, loopback)
    workers = Workers(limits, metrics)
    reader = Reader(limits, workers)
    answers = Answers(limits, workers, reader, metrics)
    keys = open_keys(limits) if keyed else None
    if keys is not None and not any(key.state == "valid" for key in keys.list()):
        _LOG.warning("clients need an API key and there is none yet: veselova keys create NAME")
    jobs = JobService(limits)
    metrics.gauges("veselova_jobs", "Sweeps by state", "state", jobs.counts)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        async with answers.serving(), jobs.running(), workers.running():
            yield
        if keys is not None:
            keys.close()

    app = FastAPI(
        title="veselova",
        version=__version__,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,  # its address would be made of the request's Host
        telemetry={"exclude": lambda scope: scope.get("path") in PROBES},
    )
    app.state.reader = reader
    app.state.jobs = jobs
    routers = (
        router(limits, answers, partial(missing_parts, workers, jobs, keys)),
        job_routes,
    )
    for part in routers:
        app.router.routes.extend(part.routes)
    add_explorer(app)
    add_guide(app)
    answer = partial(_answer_problem, metrics, [route for part in routers for route in part.routes])
    for kind in (VeselovaError, Refused, HTTPException, RequestValidationError):
        app.add_exception_handler(kind, answer)

    app.openapi = lambda: openapi_document(app, limits.root_path)  # type: ignore[method-assign]
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


async def _answer_problem(
    metrics: Metrics, routes: list[BaseRoute], request: Request, error: Exception
) -> Response:
    # parameters and headers, which the framework reads
    if isinstance(error, RequestValidationError):
        faults = [
            InvalidInput(item["loc"][1:], item["msg"].lower(), show(item.get("input")))
            for item in error.errors()
        ]
        error = InvalidRequest(faults)
    response = problem_response(error)
    if response.status_code == HTTPStatus.METHOD_NOT_ALLOWED and (
        methods := _methods(routes, request)
    ):
        # the framework names those of one route alone
        response.headers["Allow"] = ", ".join(sorted(methods))
    note(outcome=problem_code(error))
    if isinstance(error, Refused):
        metrics.count_refused(error.code)
    elif response.status_code == HTTPStatus.INTERNAL_SERVER_ERROR:
        _LOG.error("a request failed", exc_info=error)
    return response


def _methods(routes: list[BaseRoute], request: Request) -> set[str]:
    """Return the methods that some route has for the path of a request."""
    found = (
        route
        for route in routes
        if isinstance(route, Route) and route.matches(request.scope)[0] is not Match.NONE
    )
    return {method for route in found for method in route.methods or ()}
