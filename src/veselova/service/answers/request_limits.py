"""The limits of a server's settings for the work of one request."""

from __future__ import annotations

from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.service.api.ensemble_request import EnsembleRequest
from veselova.service.api.request_models import (
    BudgetedRequest,
    TorusRequest,
)
from veselova.service.api.settings import Settings
from veselova.service.api.toolkit_requests import ToolkitRequest

__all__ = ["beyond_limits"]


def beyond_limits(request: BudgetedRequest, settings: Settings) -> list[InvalidInput]:
    """Return what of a request is beyond the limits of this server, before its numbers are looked
    at.
    """
    faults = Faults()
    if request.budget_s > settings.max_budget_s:
        required = f"at most {settings.max_budget_s:g} on this server"
        faults.add(("budget_s",), required, f"{request.budget_s:g}")
    if isinstance(request, TorusRequest):
        _admit_motion(request, settings, faults)
    elif isinstance(request, ToolkitRequest):
        _admit_points(request, settings, faults)
    return faults.found


def _admit_motion(request: TorusRequest, settings: Settings, faults: Faults) -> None:
    n = request.problem.dimension
    count = request.time_count()
    if n > settings.max_dimension:
        place = ("problem", request.problem.measured)
        faults.add(place, f"at most {settings.max_dimension} entries on this server", show(n))
    if count * n * n > settings.max_values:
        required = f"at most {settings.max_values} frame entries (times × n²) on this server"
        faults.add(("times",), required, show(count * n * n))


def _admit_points(request: ToolkitRequest, settings: Settings, faults: Faults) -> None:
    path = (request.point_fields[0],)
    if isinstance(request, EnsembleRequest) and request.dimension > settings.max_dimension:
        required = f"rows of at most {settings.max_dimension} numbers on this server"
        faults.add((*path, "q"), required, show(request.dimension))
    values = request.value_count()
    if max(values, request.point_count()) > settings.max_values:
        required = f"at most {settings.max_values} numbers in one answer on this server"
        faults.add(path, required, show(values))
