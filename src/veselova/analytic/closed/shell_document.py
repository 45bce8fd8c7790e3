"""The shell around a sphere of half its radius as a document: Neumann's, with a time map and the
attitude in Floquet's form.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from veselova.analytic.closed.attitude_on_torus import Floquet
from veselova.analytic.closed.document import (
    Flow,
    document_of,
    growth_of_slow_modes,
    largest_modes,
)
from veselova.analytic.closed.series import Series
from veselova.analytic.closed.shell_motion import ShellMotion
from veselova.mechanics.systems.ball_on_sphere import RubberBallOnSphere

__all__ = ["shell_fields"]

_EPSILON = float(np.finfo(float).eps)

#: Calibrated: roundings of a round of the fastest phase in the angles of the attitude.
_ROUND = 8.0

#: Calibrated: by how much a document is off more than the engine.
_OWN_ROUNDING = 2.0


def shell_fields(ball: RubberBallOnSphere, accuracy: float) -> dict[str, Any]:
    """Return the fields of a document but for its head. ``accuracy``: what modes left out may make
    in γ and the frame. Raises Unsolved as ``ShellMotion``, and ``too-many-modes``.
    """
    motion = ShellMotion(ball)
    fields, _, _ = document_of(motion.kernel, accuracy)
    clock, (_, by_flow) = motion.time_map, motion.slopes
    flow = Flow(motion.flow.rates, clock.mean, 1.0, by_flow)
    series = Series(2 * clock.modes, clock.coefficients, clock.off, 0.0)
    orders, coefficients = largest_modes(series, flow, by_flow, accuracy / 2)
    attitude = motion.attitude.floquet()
    roots, directions = motion.roots, motion.kernel.moving.directions
    start = ball.axes.T @ ball.frame
    moved = directions.T @ start
    from_start = attitude.start @ moved
    once, later = (float(motion.error_at(np.array(s))) for s in (0.0, 1.0))
    later += 2 * math.pi * _ROUND * _EPSILON * flow.fastest * flow.mean - once
    # y = B^{1/2}x over its length is less exact than x
    once += fields["error"]["at_start"] * float(np.max(roots) / np.min(roots)) + attitude.skew
    growth = (later + by_flow * growth_of_slow_modes(flow, orders, coefficients)) / flow.mean
    bounds = ball.bound({}, _OWN_ROUNDING * np.array([once, growth]) + [accuracy, 0.0])
    at_start, growth = bounds.tolist()
    return {
        **fields,
        "axes": ball.axes.tolist(),
        "frequencies": motion.flow.rates.tolist(),
        "mean_rate": clock.mean,
        "modes": (orders // 2).tolist(),
        "coefficients": coefficients,
        "units": {**fields["units"], "time": "t"},
        "error": {
            "at_start": at_start,
            "per_unit_time": growth,
            "per_cycle": growth / flow.fastest,
        },
        "shell": {
            "sphere": float(ball.sphere),
            "constant": motion.reduced[1],
            "roots": roots.tolist(),
            "rates": attitude.rates.tolist(),
            "start": [from_start.real.tolist(), from_start.imag.tolist()],
            "still": (start - directions @ moved).tolist(),
            **_terms(attitude, accuracy / 4),
        },
    }


def _terms(attitude: Floquet, accuracy: float) -> dict[str, Any]:
    """Return the largest terms of the attitude; those left out add up to the accuracy, and their
    rounding to decimal places to a fourth of it.
    """
    left_out = np.cumsum(np.abs(attitude.coefficients[::-1]))[::-1]
    kept = int(np.count_nonzero(left_out > accuracy))
    places = math.ceil(-math.log10(accuracy / (4 * max(1, kept))))
    coefficients = attitude.coefficients[:kept]
    return {
        "modes": attitude.orders[:kept].tolist(),
        "columns": attitude.columns[:kept].tolist(),
        "real": np.round(coefficients.real, places).tolist(),
        "imaginary": np.round(coefficients.imag, places).tolist(),
    }
