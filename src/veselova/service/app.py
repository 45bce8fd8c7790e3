"""The ASGI application: routes, workers for its life, problem documents for every failure."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import anyio
from fastapi import FastAPI, Request
from starlette.exceptions import HTTPException
from starlette.responses import Response

from veselova.mechanics.errors import VeselovaError
from veselova.service.answers import Answers
from veselova.service.job_routes import job_router
from veselova.service.job_service import JobService
from veselova.service.openapi import openapi_document
from veselova.service.problem_details import Refused, problem_response
from veselova.service.routes import router
from veselova.service.settings import Settings
from veselova.service.workers import Workers
from veselova.version import __version__

__all__ = ["create_app"]

_LOG = logging.getLogger("veselova.service")


def create_app(settings: Settings | None = None) -> FastAPI:
    """Return the application; settings come from the environment when none are given."""
    limits = settings or Settings()
    workers = Workers(limits)

    answers = Answers(limits, workers)
    jobs = JobService(limits)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        async with answers.serving(), jobs.running(), anyio.create_task_group() as tasks:
            tasks.start_soon(_warm, workers)
            yield
            tasks.cancel_scope.cancel()

    app = FastAPI(title="veselova", version=__version__, lifespan=lifespan)
    app.include_router(router(limits, workers, answers))
    app.include_router(job_router(limits, jobs))
    for kind in (VeselovaError, Refused, HTTPException, Exception):
        app.add_exception_handler(kind, _answer_problem)
    app.openapi = lambda: openapi_document(app)  # type: ignore[method-assign]
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
