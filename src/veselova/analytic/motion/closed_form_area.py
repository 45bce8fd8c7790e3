"""The fields of a closed-form document for a body with an area constant, beside those of the
rank-one problem on whose torus it moves.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from veselova.analytic.motion.area_motion import AreaBody, plane_of_path
from veselova.analytic.motion.area_solution import AreaSolution
from veselova.analytic.motion.displacement import WithAreaConstant
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.time_map.fourier_modes import TorusSeries, largest_first
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball import RollingBall

__all__ = ["area_fields", "error_of_body", "largest_modes", "no_series", "places_of", "rounded"]


_EPSILON = float(np.finfo(float).eps)

#: Derived: roundings of the constant rotation between the frames and of its product, as in
#: area_motion, and once more in the evaluator.
_ROUNDINGS = 16.0


def no_series() -> dict[str, Any]:
    """Return the fields of a series without modes."""
    return {"modes": [], "coefficients": [], "turn": 0.0}


def places_of(reaches: Any, accuracy: float, unit: float) -> list[int]:
    """Return to how many decimal places coefficients per unit of τ₁ are rounded: what that changes,
    times each one's reach (M,), adds up to an eighth of the accuracy.
    """
    least = np.maximum(reaches, np.finfo(float).tiny)
    steps = accuracy / (4 * max(1, len(reaches)) * least) / unit
    return [min(300, max(0, -math.floor(math.log10(step)))) for step in steps.tolist()]


def rounded(values: Any, places: list[int]) -> list[float]:
    """Return coefficients rounded to their decimal places."""
    return [round(float(value), place) for value, place in zip(values, places, strict=True)]


def largest_modes(
    series: TorusSeries, solution: Solution, factor: float, accuracy: float
) -> dict[str, Any]:
    """Return the modes of a series whose integral over τ₁, times a factor, is wanted to an
    accuracy, largest first, and their coefficients per unit of the problem's τ₁.
    """
    pace = np.abs(series.orders @ solution.in_tau1.rates) / 2
    reach = factor * 2 / (np.pi * np.maximum(pace, 1e-300))
    selected = largest_first(np.abs(series.coefficients) * reach, accuracy / 4)
    values = series.coefficients[selected] / solution.tau1_unit
    return {
        "modes": series.orders[selected].tolist(),
        "coefficients": rounded(values, places_of(reach[selected], accuracy, solution.tau1_unit)),
        "turn": float(series.turns[0]) if len(series.turns) else 0.0,
    }


def area_fields(
    solution: AreaSolution, steepest: float, body: AreaBody, accuracy: float
) -> dict[str, Any]:
    """Return the field ``area``, and for a ball its ``path``; ``steepest``: that of
    ``steepness_in_time``.
    """
    torus = solution.problem
    axes = np.eye(3) if body.axes is None else body.axes
    odd = solution.odd_part_of_rate
    # the odd part moves the phases, and a ball along n
    reach = steepest / solution.mean_rate
    if isinstance(body, RollingBall):
        reach = max(reach, abs(torus.across))
    if isinstance(body, ChaplyginBall):
        form = -body.inverse @ body.ball.tensor / float(body.ball.added)
        momentum = body.frame.T @ body.derive("momentum", body.start)[0]
        momentum[0] = body.area_constant
        constant = 0.0
    else:
        form, momentum, constant = body.inverse, body.horizontal_momentum, body.linear
    area = {
        "odd": no_series() if odd is None else largest_modes(odd, solution, reach, accuracy),
        "attitude": (torus.frame.T @ (axes.T @ body.frame)).tolist(),
        "momentum": momentum.tolist(),
        "inverse": body.inverse.tolist(),
        "form": form.tolist(),
        "constant": constant,
    }
    if not isinstance(body, RollingBall):
        return {"area": area}
    return {"area": area, "path": _path(solution, body, accuracy)}


def _path(solution: AreaSolution, ball: RollingBall, accuracy: float) -> dict[str, Any]:
    """Return the contact point: uniform along n, with the odd part of the time, and the modes of
    (q',n_2) along e_⊥.
    """
    torus = solution.problem
    plane = plane_of_path(ball, torus)
    transverse = []
    if solution.curve.genus > 1:
        displacement = WithAreaConstant(solution)
        found = no_series()
        if displacement.count:
            across = displacement.series[0].scaled(float(displacement.peaks[0]))
            found = largest_modes(across, solution, 1.0, accuracy)
        transverse.append(found)
        plane = np.stack([torus.sign * solution.side * plane[1], plane[0]])
    return {
        "radius": float(ball.ball.radius),
        "position": [float(x) for x in ball.ball.contact],
        "speed": torus.uniform,
        "odd": -torus.across,
        "plane": (-plane[: solution.curve.genus]).tolist(),
        "transverse": transverse,
    }


def error_of_body(error: dict[str, float], body: AreaBody) -> dict[str, float]:
    """Return the bound for the body from that of the rank-one problem: a row of errors times a
    column of unit length, and the roundings of the product.
    """
    size = body.ball.size if isinstance(body, RollingBall) else 1.0
    found = {key: size * float(np.sqrt(3)) * value for key, value in error.items()}
    found["at_start"] += size * _ROUNDINGS * _EPSILON
    return found
