"""The closed form of a motion as a document: by the kernel, or where that does not serve from its
solution.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.document import (
    FAR,
    OWN_ROUNDING,
    DocumentParts,
    Modes,
    fields_of,
    parts_of,
)
from veselova.analytic.closed.motion import has_documents, kernel_motion
from veselova.analytic.motion.area_solution import AreaSolution, solution_of
from veselova.analytic.motion.ball_n_motion import ball_fields
from veselova.analytic.motion.closed_form_area import (
    area_fields,
    error_of_body,
    growth_of_path,
    largest_modes,
)
from veselova.analytic.motion.displacement import AlongMomentum
from veselova.analytic.motion.error_bound import ErrorBound
from veselova.analytic.motion.evaluation_plan import EvaluationPlan
from veselova.analytic.motion.steepness import steepness_in_time
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.theta.riemann_theta import Theta
from veselova.analytic.time_map.fourier import find_modes
from veselova.analytic.time_map.rate import TIME_RATE_POWERS
from veselova.analytic.time_map.torus_series import NormalComponent, find_series
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.closed_form import ClosedForm, require_accuracy
from veselova.mechanics.results.closed_form_schema import AREA_FORMAT
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.rolling_veselova import RollingVeselova
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.torus_problem import on_torus
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3
from veselova.version import __version__

__all__ = ["closed_form"]

Array = NDArray[np.float64]


def closed_form(given: Problem, accuracy: float | None = None) -> ClosedForm:
    """Return the motion of a problem as a document.

    ``accuracy``: the error that modes left out of the time map may make in q and the frame,
    1e-12 when left out. Raises InvalidInput for another number, Unsolved at rest, on a
    separatrix (``no-closed-form``) and where theta functions or modes are too many.
    """
    accuracy = require_accuracy(accuracy)
    problem = on_torus(given)
    motion = kernel_motion(problem) if has_documents(problem) else None
    fields: dict[str, Any]
    if motion is not None:
        fields = fields_of(parts_of(motion), accuracy)
    else:
        fields = _fields_of_solution(given, solution_of(problem), accuracy)
    head = {
        "format": AREA_FORMAT if "area" in fields else ClosedForm.format,
        "version": __version__,
        "time": problem.time,
        "digits": FEWEST_DIGITS,
    }
    # The problem stands last, so that a reader without a JSON parser finds the field that it looks
    # for.
    return ClosedForm({**head, **fields, "problem": given.as_dict()})


def _fields_of_solution(given: Problem, solution: Solution, accuracy: float) -> dict[str, Any]:
    """Return all fields but the head: also those of an area constant and of the path of a ball."""
    if solution.separatrices:
        reason = (
            "the start lies on a separatrix, which no torus describes for long; solve at "
            "times instead"
        )
        raise Unsolved("no-closed-form", reason)
    parts = _parts_of_solution(solution)
    fields = fields_of(parts, accuracy)
    if isinstance(solution, AreaSolution):
        assert isinstance(given, (VeselovaSO3, ChaplyginBall))
        fields |= area_fields(solution, parts, given, accuracy)
        fields["error"] = error_of_body(fields["error"], given)
        fields["axes"] = None if given.axes is None else given.axes.tolist()
    elif isinstance(given, (RubberBall, RollingBallN)):
        fields |= {"path": _path(solution, parts, given, accuracy)}
        if isinstance(given, RollingBallN):
            fields |= {"ball": ball_fields(given)}
        fields["error"] = {key: given.ball.size * x for key, x in fields["error"].items()}
    growth = growth_of_path(parts, fields)
    fields["error"]["per_unit_time"] += growth
    fields["error"]["per_cycle"] += growth / parts.fastest
    return fields


def _parts_of_solution(solution: Solution) -> DocumentParts:
    """Return the numbers of a document: the bound of the engine wherever on the torus the state is,
    and how it grows.
    """
    quotients, steepest = solution.quotients, steepness_in_time(solution)
    cycle = 1 / solution.fastest
    far = FAR * cycle
    plan = EvaluationPlan.of(solution, np.array([cycle, far]), "theta", "fourier")
    # raises where the rate varies too much, or modes are too many
    bound = ErrorBound(solution, "theta").anywhere(plan, plan.make_time_map(solution), steepest)
    at_start, later = (OWN_ROUNDING * bound).tolist()
    of_rates = (float(solution.sensitivity.by_rates) + steepest) / solution.mean_rate
    growth = max(later - at_start, 2 * OWN_ROUNDING * np.finfo(float).eps * of_rates * far)
    modes = Modes(np.empty((0, solution.curve.genus), np.int64), np.empty(0))
    if solution.problem.time != "tau1":
        orders, coefficients, *_ = find_modes(solution.rate)
        modes = Modes(orders, coefficients)
    assert isinstance(quotients.theta, Theta)
    return DocumentParts(
        solution.problem,
        solution.moving,
        quotients.theta,
        quotients.functions,
        quotients.places,
        quotients.constants,
        solution.rate_constant,
        TIME_RATE_POWERS[solution.problem.time],
        solution.rotation,
        solution.frozen_part if solution.moving.frozen else 0 * solution.frozen_part,
        solution.in_tau1.start,
        solution.in_tau1.rates,
        solution.mean_rate,
        steepest / solution.mean_rate,
        modes,
        at_start,
        growth / far,
    )


def _path(
    solution: Solution, parts: DocumentParts, ball: RubberBall | RollingBallN, accuracy: float
) -> dict[str, Any]:
    """Return the contact point: the speed along the momentum, and the modes across it that the
    accuracy asks for, largest first.
    """
    assert isinstance(solution.problem, RollingVeselova)
    side = AlongMomentum(solution).side
    components = (
        NormalComponent.of(solution.frame, solution.inversion, k)
        for k in range(1, solution.curve.genus)
    )
    transverse = [
        largest_modes(find_series(component).scaled(side), parts, 1.0, accuracy)
        for component in components
    ]
    return {
        "radius": float(ball.ball.radius),
        "position": [float(x) for x in ball.ball.contact],
        "speed": solution.problem.speed,
        "transverse": transverse,
    }
