"""The closed form of a motion as a document: the kernel's numbers by their names."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.area_veselova import AreaVeselova
from veselova.analytic.closed.bodies import AreaBody, plane_of_path
from veselova.analytic.closed.document import Flow, document_of, growth_of_slow_modes, largest_modes
from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.series import Series, series_of
from veselova.analytic.closed.shell_motion import ShellMotion
from veselova.analytic.closed.torus import torus_motion
from veselova.mechanics.core.arguments import FEWEST_DIGITS
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.closed_form import ClosedForm, require_accuracy
from veselova.mechanics.results.closed_form_schema import AREA_FORMAT, SHELL_FORMAT
from veselova.mechanics.systems.ball_on_sphere import RubberBallOnSphere
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.rolling_veselova import RollingVeselova
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.torus_problem import on_torus
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3
from veselova.version import __version__

__all__ = ["closed_form"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Derived: roundings of the constant rotation between the frames and of its product, as in
#: bodies, and once more in the evaluator.
_ROUNDINGS = 16.0


def closed_form(given: Problem, accuracy: float | None = None) -> ClosedForm:
    """Return the motion of a problem as a document.

    ``accuracy``: the error that modes left out of the time map may make in q and the frame,
    1e-12 when left out. Raises InvalidInput for another number, Unsolved at rest, on a
    separatrix (``no-closed-form``) and where theta functions or modes are too many.
    """
    accuracy = require_accuracy(accuracy)
    if isinstance(given, RubberBallOnSphere):
        return _document(
            given, SHELL_FORMAT, given.time, ShellMotion(given).document_fields(accuracy)
        )
    problem = on_torus(given)
    motion = torus_motion(problem)
    if motion.on_separatrix:
        reason = (
            "the start lies on a separatrix, or too near one for doubles, and no torus describes "
            "it for long; solve at times instead"
        )
        raise Unsolved("no-closed-form", reason)
    fields = _fields(given, motion, accuracy)
    form = AREA_FORMAT if "area" in fields else ClosedForm.format
    return _document(given, form, problem.time, fields)


def _document(given: Problem, form: str, time: str, fields: dict[str, Any]) -> ClosedForm:
    head = {"format": form, "version": __version__, "time": time, "digits": FEWEST_DIGITS}
    # The problem stands last, so that a reader without a JSON parser finds the field that it looks
    # for.
    return ClosedForm({**head, **fields, "problem": given.as_dict()})


def _fields(given: Problem, motion: KernelMotion, accuracy: float) -> dict[str, Any]:
    """Return all fields but the head: also those of an area constant and of the path of a ball."""
    fields, flow, odd = document_of(motion, accuracy)
    if isinstance(motion.problem, AreaVeselova):
        assert isinstance(given, (VeselovaSO3, ChaplyginBall))
        fields |= _area_fields(motion, flow, odd, given, accuracy)
        fields["error"] = _error_of_body(fields["error"], given)
        fields["axes"] = None if given.axes is None else given.axes.tolist()
    elif isinstance(given, (RubberBall, RollingBallN)):
        fields |= {"path": _path(motion, flow, given, accuracy)}
        if isinstance(given, RollingBallN):
            fields["ball"] = {
                "roots": given.ball.roots.tolist(),
                "momentum": given.momentum_in_space.tolist(),
                "added": float(given.ball.added) if given.twists else None,
            }
        fields["error"] = {key: given.ball.size * x for key, x in fields["error"].items()}
    growth = _growth_of_path(flow, fields)
    fields["error"]["per_unit_time"] += growth
    fields["error"]["per_cycle"] += growth / flow.fastest
    return fields


def _path(
    motion: KernelMotion,
    flow: Flow,
    ball: RubberBall | RollingBall | RollingBallN,
    accuracy: float,
) -> dict[str, Any]:
    """Return the contact point: the speed along the momentum, and the modes across it that the
    accuracy asks for, largest first. With an area constant it is uniform along n, with the odd part
    of the time, and the modes are those of (q',n_2) along e_⊥.
    """
    problem = motion.problem
    assert isinstance(problem, (RollingVeselova, AreaVeselova))
    sense = problem.sense if isinstance(problem, RollingVeselova) else 1.0
    found: dict[str, Any] = {
        "radius": float(ball.ball.radius),
        "position": [float(x) for x in ball.ball.contact],
    }
    if isinstance(problem, AreaVeselova):
        assert isinstance(ball, RollingBall)
        plane = plane_of_path(ball, problem)
        if motion.genus > 1:
            plane = np.stack([problem.sign * motion.side * plane[1], plane[0]])
        found["speed"], found["odd"] = float(problem.uniform), -float(problem.across)
        found["plane"] = (-plane[: motion.genus]).tolist()
    else:
        found["speed"] = problem.speed
    transverse = []
    for k in range(1, motion.genus):
        series = series_of(motion.torus, k)
        series = series._replace(coefficients=sense * series.coefficients)
        transverse.append(_modes(series, flow, 1.0, accuracy))
    return {**found, "transverse": transverse}


def _modes(series: Series, flow: Flow, factor: float, accuracy: float) -> dict[str, Any]:
    """Return the ``largest_modes`` of a series as they stand in a document."""
    orders, coefficients = largest_modes(series, flow, factor, accuracy / 4)
    return {"modes": orders.tolist(), "coefficients": coefficients, "turn": series.turn}


def _growth_of_path(flow: Flow, fields: dict[str, Any]) -> float:
    """Return by how much the error grows in a unit of time because frequencies are doubles, beside
    that of the time's even part.
    """

    def growth(series: dict[str, Any]) -> float:
        return growth_of_slow_modes(flow, series["modes"], series["coefficients"])

    found = flow.turning * growth(fields["area"]["odd"]) if "area" in fields else 0.0
    if "path" not in fields:
        return found
    found += sum(map(growth, fields["path"]["transverse"]))
    return max(1.0, float(fields["path"]["radius"])) * found


def _area_fields(
    motion: KernelMotion, flow: Flow, odd: Series, body: AreaBody, accuracy: float
) -> dict[str, Any]:
    """Return the field ``area``, and for a ball its ``path``."""
    torus = motion.problem
    assert isinstance(torus, AreaVeselova)
    axes = np.eye(3) if body.axes is None else body.axes
    # the odd part moves the phases, and a ball along n
    reach = flow.turning
    if isinstance(body, RollingBall):
        reach = max(reach, abs(float(torus.across)))
    if isinstance(body, ChaplyginBall):
        form = -body.inverse @ body.ball.tensor / float(body.ball.added)
        momentum, constant = body.momentum_in_space, 0.0
    else:
        form, momentum, constant = body.inverse, body.horizontal_momentum, body.linear
    area = {
        "odd": _modes(odd, flow, reach, accuracy),
        "attitude": (torus.frame.T @ (axes.T @ body.frame)).tolist(),
        "momentum": momentum.tolist(),
        "inverse": body.inverse.tolist(),
        "form": form.tolist(),
        "constant": constant,
    }
    if not isinstance(body, RollingBall):
        return {"area": area}
    return {"area": area, "path": _path(motion, flow, body, accuracy)}


def _error_of_body(error: dict[str, float], body: AreaBody) -> dict[str, float]:
    """Return the bound for the body from that of the rank-one problem: a row of errors times a
    column of unit length, and the roundings of the product.
    """
    size = body.ball.size if isinstance(body, RollingBall) else 1.0
    found = {key: size * float(np.sqrt(3)) * value for key, value in error.items()}
    found["at_start"] += size * _ROUNDINGS * _EPSILON
    return found
