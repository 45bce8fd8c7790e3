"""The closed form of a motion as a document: the kernel's numbers by their names."""

from __future__ import annotations

from typing import Any

from veselova.analytic.closed.document import DocumentParts, fields_of, parts_of
from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.series import series_of
from veselova.analytic.closed.torus import torus_motion
from veselova.analytic.motion.closed_form_area import (
    area_fields,
    error_of_body,
    growth_of_path,
    largest_modes,
)
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.closed_form import ClosedForm, require_accuracy
from veselova.mechanics.results.closed_form_schema import AREA_FORMAT
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.rolling_veselova import CommutingVeselova, RollingVeselova
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.torus_problem import on_torus
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3
from veselova.version import __version__

__all__ = ["closed_form"]


def closed_form(given: Problem, accuracy: float | None = None) -> ClosedForm:
    """Return the motion of a problem as a document.

    ``accuracy``: the error that modes left out of the time map may make in q and the frame,
    1e-12 when left out. Raises InvalidInput for another number, Unsolved at rest, on a
    separatrix (``no-closed-form``) and where theta functions or modes are too many.
    """
    accuracy = require_accuracy(accuracy)
    problem = on_torus(given)
    motion = torus_motion(problem)
    if motion.on_separatrix:
        reason = (
            "the start lies on a separatrix, or too near one for doubles, and no torus describes "
            "it for long; solve at times instead"
        )
        raise Unsolved("no-closed-form", reason)
    fields = _fields(given, motion, accuracy)
    head = {
        "format": AREA_FORMAT if "area" in fields else ClosedForm.format,
        "version": __version__,
        "time": problem.time,
        "digits": FEWEST_DIGITS,
    }
    # The problem stands last, so that a reader without a JSON parser finds the field that it looks
    # for.
    return ClosedForm({**head, **fields, "problem": given.as_dict()})


def _fields(given: Problem, motion: KernelMotion, accuracy: float) -> dict[str, Any]:
    """Return all fields but the head: also those of an area constant and of the path of a ball."""
    parts = parts_of(motion)
    fields = fields_of(parts, accuracy)
    if isinstance(motion.problem, AreaVeselova):
        assert isinstance(given, (VeselovaSO3, ChaplyginBall))
        fields |= area_fields(motion, parts, given, accuracy)
        fields["error"] = error_of_body(fields["error"], given)
        fields["axes"] = None if given.axes is None else given.axes.tolist()
    elif isinstance(given, (RubberBall, RollingBallN)):
        fields |= {"path": _path(motion, parts, given, accuracy)}
        if isinstance(given, RollingBallN):
            fields["ball"] = {
                "roots": given.ball.roots.tolist(),
                "momentum": given.momentum_in_space.tolist(),
                "added": float(given.ball.added) if given.twists else None,
            }
        fields["error"] = {key: given.ball.size * x for key, x in fields["error"].items()}
    growth = growth_of_path(parts, fields)
    fields["error"]["per_unit_time"] += growth
    fields["error"]["per_cycle"] += growth / parts.fastest
    return fields


def _path(
    motion: KernelMotion, parts: DocumentParts, ball: RubberBall | RollingBallN, accuracy: float
) -> dict[str, Any]:
    """Return the contact point: the speed along the momentum, and the modes across it that the
    accuracy asks for, largest first.
    """
    assert isinstance(motion.problem, RollingVeselova)
    side = -1.0 if isinstance(motion.problem, CommutingVeselova) else 1.0
    transverse = []
    for k in range(1, motion.genus):
        series = series_of(motion.torus, k)
        series = series._replace(coefficients=side * series.coefficients)
        transverse.append(largest_modes(series, parts, 1.0, accuracy))
    return {
        "radius": float(ball.ball.radius),
        "position": [float(x) for x in ball.ball.contact],
        "speed": motion.problem.speed,
        "transverse": transverse,
    }
