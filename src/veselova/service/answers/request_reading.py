"""Bodies of requests, read and validated: small ones by the server itself, others in a worker.

Whatever is in a body of the largest size, the event loop only passes it on. Nor does it build a
problem, which takes a second where few numbers have many digits: what a fault or a choice depends
on a problem for, a worker reads.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from functools import partial
from typing import Any

from pydantic import ValidationError
from starlette.requests import ClientDisconnect, Request

from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.service.answers.request_limits import beyond_limits, require_modest
from veselova.service.api.json_text import decode
from veselova.service.api.problem_details import Refused
from veselova.service.api.request_models import (
    BudgetedRequest,
    ComparisonRequest,
    read_request,
)
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.api.toolkit_requests import ToolkitRequest
from veselova.service.workers.pool import Workers
from veselova.service.workers.tasks import TASKS

__all__ = ["Asked", "Reader"]

#: Bytes of a body that the event loop reads itself, in a millisecond or two whatever they are.
_SMALL_BYTES = 8_000

#: Numbers from which an answer is written to a file.
_LARGE_NUMBERS = 100_000


@dataclass(frozen=True)
class Asked:
    """A request as its server needs it: what it is about, and a pickle, of its validated fields for
    the worker, of the SweepPlan.

    ``is_large`` says whether the answer is written to a file.
    """

    system: str
    engine: str
    budget_s: float
    is_large: bool
    content: bytes


class Reader:
    """Reads the bodies that one server is sent."""

    def __init__(self, settings: Settings, workers: Workers) -> None:
        self._settings = settings
        self._workers = workers

    async def parse_body(self, kind: str, request: Request) -> Asked:
        """Return what the body of a request asks, of a kind of TASKS or of a sweep.

        Raises Refused for another media type, a body over the limit, one that does not come whole,
        or text that is not JSON; InvalidInput or InvalidRequest for what is wrong with it.
        """
        body = await self._body(request)
        # problems of every sweep are looked at
        if kind != "sweep" and len(body) <= _SMALL_BYTES:
            asked = _read_plain(kind, body, self._settings)
            if asked is not None:
                return asked
        budget_s = self._settings.max_budget_s
        return await self._workers.run(_read, kind, body, self._settings, budget_s=budget_s)

    async def _body(self, request: Request) -> bytes:
        _require_json(request)
        limit = self._settings.max_body_bytes
        too_large = Refused(
            "body-too-large", f"The body: required at most {limit} bytes; given more."
        )
        declared = request.headers.get("content-length", "")
        if declared.isdigit() and int(declared[:20]) > limit:
            raise too_large
        body = bytearray()
        try:
            async for chunk in request.stream():
                body += chunk
                if len(body) > limit:
                    raise too_large
        except ClientDisconnect:
            detail = "The client closed the connection before its request was complete."
            raise Refused("client-gone", detail) from None
        return bytes(body)


def _require_json(request: Request) -> None:
    media_type = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if media_type != "application/json" and not (
        media_type.startswith("application/") and media_type.endswith("+json")
    ):
        raise Refused(
            "unsupported-media-type",
            f"Content-Type: required application/json; given {media_type[:100] or 'none'}.",
        )
    if (
        coding := request.headers.get("content-encoding", "identity").strip().lower()
    ) != "identity":
        raise Refused(
            "unsupported-media-type", f"Content-Encoding: required none; given {coding[:100]}."
        )


def _read_plain(kind: str, body: bytes, settings: Settings) -> Asked | None:
    """Return what a small body asks, None where its problem has to be built to say that, or to say
    all that is wrong with it.
    """
    document = decode(body)
    require_modest(document, settings)
    try:
        request = TASKS[kind][0].model_validate(document)
    except ValidationError:
        return None
    if request.depends_on_problem or request.option_faults() or beyond_limits(request, settings):
        return None
    return _asked(kind, request)


def _read(kind: str, body: bytes, settings: Settings) -> Asked:
    """Return what a body asks; raises Refused and InvalidInput as ``Reader.parse_body`` does."""
    document = decode(body)
    require_modest(document, settings)
    model: type[BudgetedRequest] = SweepRequest if kind == "sweep" else TASKS[kind][0]
    return _asked(kind, read_request(model, document, partial(beyond_limits, settings=settings)))


def _asked(kind: str, request: Any) -> Asked:
    """Return what a valid request asks."""
    if isinstance(request, SweepRequest):
        content = pickle.dumps(request.plan, pickle.HIGHEST_PROTOCOL)
        return Asked(
            request.subject,
            request.engine or "",
            request.budget_s,
            False,
            content,
        )
    stated = request.model_dump()
    engine = "both" if kind == "comparison" else getattr(request, "chosen_engine", "analytic")
    content = pickle.dumps(stated, pickle.HIGHEST_PROTOCOL)
    is_large = _numbers(request) > _LARGE_NUMBERS
    return Asked(request.subject, engine, request.budget_s, is_large, content)


def _numbers(request: BudgetedRequest) -> float:
    """Return how many doubles the largest output of an answer has the digits of."""
    if isinstance(request, ToolkitRequest):
        return request.value_count()
    if not isinstance(request, ComparisonRequest):
        return 0
    return request.time_count() * request.problem.dimension**2 * request.digits / FEWEST_DIGITS
