"""The fields of a closed-form document for a body with an area constant, beside those of the
rank-one problem on whose torus it moves.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from veselova.analytic.closed.document import (
    DocumentParts,
    Modes,
    growth_of_slow_modes,
    largest,
)
from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.series import Series, series_of
from veselova.analytic.motion.bodies import AreaBody, plane_of_path
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball import RollingBall

__all__ = ["area_fields", "error_of_body", "growth_of_path", "largest_modes"]


_EPSILON = float(np.finfo(float).eps)

#: Derived: roundings of the constant rotation between the frames and of its product, as in
#: bodies, and once more in the evaluator.
_ROUNDINGS = 16.0


def _no_series() -> dict[str, Any]:
    """Return the fields of a series without modes."""
    return {"modes": [], "coefficients": [], "turn": 0.0}


def largest_modes(
    series: Series, parts: DocumentParts, factor: float, accuracy: float
) -> dict[str, Any]:
    """Return the modes of a series whose integral over τ₁, times a factor, is wanted to an
    accuracy, largest first, and their coefficients per unit of the problem's τ₁.
    """
    pace = np.abs(series.orders @ parts.frequencies) / 2
    reaches = factor * 2 / (np.pi * np.maximum(pace, 1e-300))
    modes = Modes(series.orders, series.coefficients)
    orders, coefficients = largest(parts, modes, reaches, accuracy / 4)
    return {"modes": orders.tolist(), "coefficients": coefficients, "turn": series.turn}


def growth_of_path(parts: DocumentParts, fields: dict[str, Any]) -> float:
    """Return by how much the error grows in a unit of time because frequencies are doubles, beside
    that of the time's even part.
    """

    def growth(series: dict[str, Any]) -> float:
        return growth_of_slow_modes(parts, series["modes"], series["coefficients"])

    found = parts.fastest_turn * growth(fields["area"]["odd"]) if "area" in fields else 0.0
    if "path" not in fields:
        return found
    found += sum(map(growth, fields["path"]["transverse"]))
    return max(1.0, float(fields["path"]["radius"])) * found


def area_fields(
    motion: KernelMotion, parts: DocumentParts, body: AreaBody, accuracy: float
) -> dict[str, Any]:
    """Return the field ``area``, and for a ball its ``path``."""
    torus = motion.problem
    assert isinstance(torus, AreaVeselova)
    axes = np.eye(3) if body.axes is None else body.axes
    # the odd part moves the phases, and a ball along n
    reach = parts.fastest_turn
    if isinstance(body, RollingBall):
        reach = max(reach, abs(float(torus.across)))
    if isinstance(body, ChaplyginBall):
        form = -body.inverse @ body.ball.tensor / float(body.ball.added)
        momentum = body.frame.T @ body.derive("momentum", body.start)[0]
        momentum[0] = body.area_constant
        constant = 0.0
    else:
        form, momentum, constant = body.inverse, body.horizontal_momentum, body.linear
    odd = _no_series() if parts.odd is None else largest_modes(parts.odd, parts, reach, accuracy)
    area = {
        "odd": odd,
        "attitude": (torus.frame.T @ (axes.T @ body.frame)).tolist(),
        "momentum": momentum.tolist(),
        "inverse": body.inverse.tolist(),
        "form": form.tolist(),
        "constant": constant,
    }
    if not isinstance(body, RollingBall):
        return {"area": area}
    return {"area": area, "path": _path(motion, torus, parts, body, accuracy)}


def _path(
    motion: KernelMotion,
    torus: AreaVeselova,
    parts: DocumentParts,
    ball: RollingBall,
    accuracy: float,
) -> dict[str, Any]:
    """Return the contact point: uniform along n, with the odd part of the time, and the modes of
    (q',n_2) along e_⊥.
    """
    plane = plane_of_path(ball, torus)
    transverse = []
    if motion.genus > 1:
        transverse.append(largest_modes(series_of(motion.torus, 1), parts, 1.0, accuracy))
        plane = np.stack([torus.sign * motion.side * plane[1], plane[0]])
    return {
        "radius": float(ball.ball.radius),
        "position": [float(x) for x in ball.ball.contact],
        "speed": float(torus.uniform),
        "odd": -float(torus.across),
        "plane": (-plane[: motion.genus]).tolist(),
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
