"""What a request computes: called in a worker process by the server, in the same process by the
command line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from veselova.engines import closed_form, compare, solve, torus
from veselova.ensembles import solve_starts
from veselova.mechanics.results.closed_form import ClosedForm
from veselova.mechanics.results.comparison import Comparison
from veselova.mechanics.results.ensemble import Ensemble
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.examples import BODY4, BODY4_PROBLEM, CURVE, GEODESIC, THETA
from veselova.service.api.json_documents import (
    comparison_document,
    encode,
    ensemble_document,
    geodesics_document,
)
from veselova.service.api.request_models import (
    BudgetedRequest,
    ComparisonRequest,
    EnsembleRequest,
    TorusRequest,
    TrajectoryRequest,
)
from veselova.service.api.toolkit_requests import (
    ClosedFormRequest,
    CurveRequest,
    GeodesicRequest,
    ThetaRequest,
)


def solve_request(request: TrajectoryRequest) -> Trajectory:
    """Return the motion that a request asks of one engine."""
    options: dict[str, Any] = {
        name: getattr(request, name) for name in ("digits", "certified", "formulation")
    }
    problem = request.problem.problem
    return solve(problem, request.time_grid, request.engine, request.method, **options)


def compare_request(request: ComparisonRequest) -> Comparison:
    """Return the comparison that a request asks for."""
    problem, formulation = request.problem.problem, request.formulation
    return compare(problem, request.time_grid, request.method, formulation=formulation)


def ensemble_request(request: EnsembleRequest) -> Ensemble:
    """Return the motions of many starts that a request asks for."""
    return solve_starts(request.parsed, request.time_grid, request.outputs)


def closed_form_request(request: ClosedFormRequest) -> ClosedForm:
    """Return the closed form that a request asks for."""
    return closed_form(request.problem.problem, request.accuracy)


def curve_document(request: CurveRequest) -> dict[str, Any]:
    """Return the document of the curve that a request asks for."""
    from veselova.curves import RealHyperelliptic

    curve = RealHyperelliptic(
        request.branch_points, request.sign, digits=request.digits, certified=request.certified
    )
    return curve.data(*request.places, request.z, request.outputs or ()).as_dict()


def theta_document(request: ThetaRequest) -> dict[str, Any]:
    """Return the document of the theta functions that a request asks for."""
    from veselova.theta import evaluate_theta

    return evaluate_theta(request.arguments).as_dict()


def geodesic_document(request: GeodesicRequest) -> dict[str, Any]:
    """Return the document of the geodesics, or of the polygon, that a request asks for."""
    from veselova.geodesics import Ellipsoid

    ellipsoid, given = Ellipsoid(request.ellipsoid), request.arguments
    if "points" in given:
        return dict(vars(ellipsoid.polygon(**given)))
    solve: Any = ellipsoid.inverse if "Q" in given else ellipsoid.direct
    if "count" in given:
        solve = ellipsoid.geodesics_between
    return geodesics_document(solve(**given), request.at)


#: Kind of answer → (model of the request, what computes its document, or the trajectory itself).
TASKS: Mapping[str, tuple[type[BudgetedRequest], Callable[[Any], Any]]] = {
    "trajectory": (TrajectoryRequest, solve_request),
    "comparison": (
        ComparisonRequest,
        lambda request: comparison_document(compare_request(request), request.outputs),
    ),
    "ensemble": (EnsembleRequest, lambda request: ensemble_document(ensemble_request(request))),
    "torus": (TorusRequest, lambda request: torus(request.problem.problem).as_dict()),
    "closed_form": (ClosedFormRequest, lambda request: dict(closed_form_request(request).document)),
    "curve": (CurveRequest, curve_document),
    "theta": (ThetaRequest, theta_document),
    "geodesic": (GeodesicRequest, geodesic_document),
}


@cache
def warm_up() -> None:
    """Load both engines and run them once, so that the first request finds nothing
    left to import.
    """
    bodies = {
        "comparison": {**BODY4, "times": [0.0, 0.1]},
        "torus": {"problem": BODY4_PROBLEM},
        "curve": CURVE,
        "theta": THETA,
        "geodesic": GEODESIC,
    }
    for kind, body in bodies.items():
        model, task = TASKS[kind]
        encode(task(model.model_validate(body)))
