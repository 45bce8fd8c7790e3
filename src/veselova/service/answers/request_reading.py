"""Bodies of requests, read and validated: small ones by the server itself, others in a worker, so
that the event loop only passes them on.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from functools import partial

from pydantic import ValidationError
from starlette.requests import ClientDisconnect, Request

from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.service.answers.request_limits import beyond_limits
from veselova.service.api.problem_details import Refused, loads
from veselova.service.api.request_models import (
    BudgetedRequest,
    ComparisonRequest,
    TorusRequest,
    read_request,
    require_valid,
)
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepPlan, SweepRequest
from veselova.service.api.toolkit_requests import ToolkitRequest
from veselova.service.workers.pool import Workers

__all__ = ["Asked", "Reader"]

#: Bytes of a body that the event loop reads itself, in a millisecond or two whatever they are.
_SMALL_BYTES = 8_000

#: Numbers from which an answer is written to a file.
_LARGE_NUMBERS = 100_000


@dataclass(frozen=True)
class Asked:
    """A request as its server needs it, and its pickle for the worker. ``is_large`` says whether
    the answer is written to a file.
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

    async def parse_body(self, model: type[BudgetedRequest], request: Request) -> Asked:
        """Return the request that a body states.

        Raises Refused for another media type, a body over the limit, one that does not come whole,
        or text that is not JSON; InvalidRequest for what is wrong with its fields.
        """
        body = await self._body(request)
        if len(body) <= _SMALL_BYTES:
            document = loads(body)
            try:
                return _asked(model.model_validate(document))
            except ValidationError:
                pass  # a worker looks for further faults
        budget_s = self._settings.max_budget_s
        return await self._workers.run(_read, model, body, self._settings, budget_s=budget_s)

    async def parse_sweep(self, request: Request) -> SweepPlan:
        """Return the plan of the sweep that a body states; raises as ``parse_body`` does, and
        InvalidRequest with all of its faults.
        """
        asked = await self.parse_body(SweepRequest, request)
        budget_s = self._settings.max_budget_s
        return await self._workers.run(_plan, asked.content, self._settings, budget_s=budget_s)

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


def _read(model: type[BudgetedRequest], body: bytes, settings: Settings) -> Asked:
    """Return what a body asks; raises InvalidRequest with all of its faults."""
    document = loads(body)
    try:
        return _asked(model.model_validate(document))
    except ValidationError:
        return _asked(read_request(model, document, partial(beyond_limits, settings=settings)))


def _plan(request: bytes, settings: Settings) -> SweepPlan:
    """Return the plan of a sweep, of which ``request`` is a pickle."""
    asked: SweepRequest = pickle.loads(request)
    require_valid(asked, partial(beyond_limits, settings=settings))
    return asked.plan


def _asked(request: BudgetedRequest) -> Asked:
    content = pickle.dumps(request, pickle.HIGHEST_PROTOCOL)
    is_large = _numbers(request) > _LARGE_NUMBERS
    return Asked(request.subject, _engine(request), request.budget_s, is_large, content)


def _engine(request: BudgetedRequest) -> str:
    """Return the engine asked for, or the first of the system."""
    if type(request) is ComparisonRequest:
        return "both"
    engines = request.problem.problem_class.engines if isinstance(request, TorusRequest) else ()
    return getattr(request, "engine", None) or next(iter(engines), "analytic")


def _numbers(request: BudgetedRequest) -> float:
    """Return how many doubles the largest output of an answer has the digits of."""
    if isinstance(request, ToolkitRequest):
        return request.value_count()
    if not isinstance(request, ComparisonRequest):
        return 0
    return request.time_count() * request.problem.dimension**2 * request.digits / FEWEST_DIGITS
