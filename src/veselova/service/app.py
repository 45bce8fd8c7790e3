"""The ASGI application: routes, workers for its life, problem documents for every failure, and what stands around them."""

from __future__ import annotations

import logging
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial

import anyio
from asgi_correlation_id import CorrelationIdMiddleware
from fastapi import FastAPI, Request
from starlette.exceptions import HTTPException
from starlette.responses import Response

from veselova.mechanics.errors import VeselovaError
from veselova.service.answers import Answers
from veselova.service.job_routes import job_router
from veselova.service.job_service import JobService
from veselova.service.metrics import Metrics
from veselova.service.openapi import openapi_document
from veselova.service.problem_details import Refused, problem_code, problem_response
from veselova.service.readiness import missing_parts
from veselova.service.request_log import Failures, RequestLog, note
from veselova.service.routes import router
from veselova.service.settings import Settings
from veselova.service.workers import Workers
from veselova.version import __version__

__all__ = ["create_app"]

_LOG = logging.getLogger("veselova.service")

#: Paths for the probes of orchestrators.
UNLIMITED = frozenset({"/healthz", "/readyz"})


def create_app(settings: Settings | None = None) -> FastAPI:
    """Return the application; settings come from the environment when none are given."""
    limits = settings or Settings()
    metrics = Metrics()
    workers = Workers(limits, metrics)
    answers = Answers(limits, workers, metrics)
    jobs = JobService(limits)
    metrics.gauges("veselova_jobs", "Sweeps by state", "state", jobs.counts)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        async with answers.serving(), jobs.running(), anyio.create_task_group() as tasks:
            tasks.start_soon(_warm, workers)
            yield
            tasks.cancel_scope.cancel()

    app = FastAPI(
        title="veselova",
        version=__version__,
        lifespan=lifespan,
        telemetry={"exclude": lambda scope: scope.get("path") in UNLIMITED},
    )
    app.include_router(router(limits, answers, partial(missing_parts, workers, jobs, None)))
    app.include_router(job_router(limits, jobs))
    for kind in (VeselovaError, Refused, HTTPException):
        app.add_exception_handler(kind, partial(_answer_problem, metrics))
    app.openapi = lambda: openapi_document(app)  # type: ignore[method-assign]
    _surround(app, metrics)
    return app


def _surround(app: FastAPI, metrics: Metrics) -> None:
    """Put what looks at every request around an application: each of these stands around those before it."""
    metrics.serve(app)
    app.add_middleware(Failures)
    app.add_middleware(RequestLog, quiet=UNLIMITED | {"/metrics"})
    app.add_middleware(CorrelationIdMiddleware, validator=_is_request_id)


def _is_request_id(text: str) -> bool:
    """Return whether an id that a client made up may stand in logs and answers."""
    return re.fullmatch(r"[A-Za-z0-9._-]{1,64}", text) is not None


async def _warm(workers: Workers) -> None:
    try:
        await workers.start()
    except Exception:
        _LOG.exception("the first worker could not be started; /readyz stays at 503")


async def _answer_problem(metrics: Metrics, _: Request, error: Exception) -> Response:
    response = problem_response(error)
    note(outcome=problem_code(error))
    if isinstance(error, Refused):
        metrics.refused(error.code)
    elif response.status_code >= 500:
        _LOG.error("a request failed", exc_info=error)
    return response
