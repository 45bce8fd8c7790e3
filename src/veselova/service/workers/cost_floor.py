"""What a request costs at the least, in seconds and in memory, from its size alone: points × n² ×
digits.

The constants are floors, the smallest cost of any measured request (``python
benchmarks/estimates.py`` measures them again), so that a request is only refused when it is
hopeless. What a problem adds to its size (a stiff flow, a far time, a narrow gap) is not known
before the work; the budget ends that.
"""

from __future__ import annotations

from typing import NamedTuple

from veselova.mechanics.core.decimals import FEWEST_DIGITS, beyond_double
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.api.request_models import (
    BudgetedRequest,
    ComparisonRequest,
    TrajectoryRequest,
)
from veselova.service.api.settings import MEGABYTE, Settings
from veselova.service.api.toolkit_requests import CurveRequest

__all__ = ["Cost", "cost", "require_affordable", "require_affordable_on_curve"]

#: Seconds for each time and n², by engine, in double precision.
_SECONDS = {"analytic": 7e-7, "numeric": 9e-8}

#: Seconds for each time, n² and FEWEST_DIGITS digits beyond double precision; and for the set-up,
#: for each n, at that many digits, where it grows like digits^1.5.
_SECONDS_EXACT = 2.5e-5
_SET_UP_EXACT = 3e-3
_SET_UP_POWER = 1.5

#: Bytes for each time and n²: the frame, ω, and as much again while they are computed; a decimal is
#: an object of its own.
_BYTES = 32
_BYTES_DECIMAL = 400

#: Seconds for each number of a point of a curve beyond double precision.
_SECONDS_ON_CURVE = 4e-5


class Cost(NamedTuple):
    """What a request costs at the least."""

    seconds: float
    megabytes: float


def cost(request: ComparisonRequest) -> Cost:
    """Return the least cost of a motion, or of two for a comparison."""
    n = request.problem.dimension
    points = request.time_count()
    entries = float(points) * n * n
    if not isinstance(request, TrajectoryRequest):
        engines = request.problem.problem_class.engines
        seconds = sum(_SECONDS.values()) if len(engines) > 1 else 2 * _SECONDS["numeric"]
        return Cost(entries * seconds, 2 * entries * _BYTES / MEGABYTE)
    if beyond_double(request.digits, request.certified):
        length = max(request.digits, FEWEST_DIGITS) / FEWEST_DIGITS
        seconds = entries * length * _SECONDS_EXACT + n * length**_SET_UP_POWER * _SET_UP_EXACT
        return Cost(seconds, entries * (_BYTES_DECIMAL + request.digits) / MEGABYTE)
    return Cost(entries * _SECONDS[request.chosen_engine], entries * _BYTES / MEGABYTE)


def require_affordable(request: ComparisonRequest, settings: Settings) -> None:
    """Raise InvalidInput where even the least cost is beyond the budget, by the slack of the
    settings, or beyond the memory.
    """
    seconds, megabytes = cost(request)
    _require_within_budget(seconds, "times", request, settings)
    if megabytes > settings.worker_memory_mb:
        required = (
            f"what {settings.worker_memory_mb} MB, the memory of a worker on this server, can hold"
        )
        raise InvalidInput(
            ("times",), required, f"work for {megabytes:.3g} MB or more, as estimated"
        )


def require_affordable_on_curve(request: CurveRequest, settings: Settings) -> None:
    """Raise InvalidInput where points of a curve to many digits take longer than the budget by the
    slack of the settings, at the least.
    """
    if beyond_double(request.digits, request.certified):
        length = max(request.digits, FEWEST_DIGITS) / FEWEST_DIGITS
        seconds = request.point_count() * request.genus * length * _SECONDS_ON_CURVE
        _require_within_budget(seconds, "points", request, settings)


def _require_within_budget(
    seconds: float, field: str, request: BudgetedRequest, settings: Settings
) -> None:
    if settings.estimate_slack and seconds > settings.estimate_slack * request.budget_s:
        required = (
            f"fewer {field} or digits, or more than budget_s = {request.budget_s:g} (at most "
            f"{settings.max_budget_s:g})"
        )
        raise InvalidInput((field,), required, f"work for {seconds:.3g} s or more, as estimated")
