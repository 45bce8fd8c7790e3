"""Bodies and balls in space in ball arithmetic, from the series of the problem on whose torus they
move.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.closed.area_veselova import AreaVeselova
from veselova.analytic.closed.bodies import AreaBody
from veselova.analytic.digits.area_start import exact_start
from veselova.mechanics.core.enclosures import exact_as
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["series_of_body"]


def series_of_body(
    body: AreaBody, torus: TorusProblem, series: Mapping[str, Values], digits: int
) -> Mapping[str, Values]:
    """Return the series of a body by name, in the order of its outputs, from those of the problem
    on its torus; ``digits``: those of its start.

    Both frames are the same where (Ω,γ) = 0. Else E(t) = [v u −n](t) [v u −n](0)ᵀ E(0), and Ω =
    B(K + σγ) with K fixed in space. A ball is at x(0) − a·displacement.
    """
    frame, plane = series["frame"], None
    if isinstance(torus, AreaVeselova):
        at_start, momentum = exact_start(body, digits)
        frame = frame @ exact_as(frame, np.array(torus.columns, dtype=object) @ at_start)
        plane = -(np.array(torus.plane, dtype=object) @ at_start[:, 1:])
        Omega = _angular_velocity(body, momentum, frame)
    else:
        Omega = np.cross(series["q_dot"], frame[:, :, 0])
    found: dict[str, Values] = {"Omega": Omega, "frame": frame}
    if isinstance(body, RollingBall):
        moved = series["displacement"]
        if plane is not None:
            moved = moved @ exact_as(moved, plane)
        start_point, radius = (exact_as(moved, x) for x in (body.ball.contact, body.ball.radius))
        found["position"] = start_point - radius * moved
    for name in body.derived:
        found[name] = body.derive(name, found)
    return {name: found[name] for name in body.outputs}


def _angular_velocity(body: AreaBody, momentum: tuple[Fraction, ...], frame: Values) -> Any:
    """Return Ω = B(K + σγ), σ = (c − (BK,γ))/(Bγ,γ), or D(BK,γ)/(1 − D(Bγ,γ))."""
    along, *across_gamma = momentum
    added, gamma = body.added, frame[:, :, 0]
    # (Ω,γ), which exceeds the others in small bodies, has no part in BK
    momentum = (Fraction(0) if added is None else along, *across_gamma)
    free = body.velocity_of(frame @ exact_as(frame, momentum))
    across = body.velocity_of(gamma)
    if added is None:
        share = exact_as(frame, along) - np.sum(free * gamma, axis=1)
        share = share / np.sum(across * gamma, axis=1)
    else:
        # 1 − D(Bγ,γ) = (Bγ,Iγ), without cancellation
        inertia = [moment - added for moment in body.moments]
        share = exact_as(frame, added) * np.sum(free * gamma, axis=1)
        share = share / np.sum(across * (exact_as(gamma, inertia) * gamma), axis=1)
    return free + share[:, None] * across
