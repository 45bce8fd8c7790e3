"""Bodies and balls in space in ball arithmetic, from the series of the problem on whose torus they
move.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.closed.area_veselova import AreaVeselova, unit_of, vector_of
from veselova.analytic.closed.bodies import AreaBody
from veselova.mechanics.core.decimals import Objects, enclose, exact_as, rational, working_digits
from veselova.mechanics.geometry.symmetric_axes import midpoints
from veselova.mechanics.systems.rigid_body import RigidBody
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["series_of_body"]

#: Derived: digits beyond those asked for.
_SPARE = 30

#: Derived: a column of the natural frame in double precision this near to one of many digits is
#: that one.
_NEARLY_NATURAL = 1e-9


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
        at_start, momentum = _exact_start(body, digits)
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


def _exact_start(body: RigidBody, digits: int) -> tuple[Objects, tuple[Fraction, ...]]:
    """Return the frame at t = 0, (3, 3), orthonormal, and the components of K along e_1, e_2, e_3,
    the first the area constant: rationals along the principal axes, which are exact, whose error is
    below 10^−digits.

    K = 𝓘Ω − (𝓘Ω,γ)γ + (Ω,γ)γ, or that of Chaplygin's ball, K = JΩ − D(Ω,γ)γ.

    The frame is the natural one of γ and γ̇ = γ×Ω where none was given and double precision knows
    it: γ, p/|p| and their vector product. Otherwise it is that in double precision, made
    orthonormal.
    """
    with working_digits(digits + _SPARE):
        gamma = unit_of(vector_of(body.exact_gamma))
        Omega, moments = vector_of(body.exact_Omega), vector_of(body.moments)
        frame = _natural(gamma, Omega, moments, body) if body.exact_frame is None else None
        if frame is None:
            frame = _orthonormal(gamma, body, digits)
        M = Omega * moments
        shift = Omega @ gamma
        D = body.added
        shift = shift - M @ gamma if D is None else -vector_of([D])[0] * shift
        momentum = tuple(map(rational, (M + shift * gamma) @ frame))
        return np.frompyfunc(rational, 1, 1)(frame), momentum


def _natural(gamma: Objects, Omega: Objects, moments: Objects, body: RigidBody) -> Objects | None:
    """Return the columns γ, ±p×γ/|p|, ±p/|p| in the order and with the signs of the frame in
    double precision; None where it is another.
    """
    rate = np.cross(gamma, Omega)
    Aq, Av = gamma / moments, rate / moments
    p = midpoints((gamma @ Aq) * Av - (rate @ Aq) * Aq)
    if all(x == 0 for x in p):
        return None
    p = unit_of(p)
    found = [gamma]
    for near in body.frame.T[1:]:
        for vector in (p, np.cross(p, gamma)):
            cosine = float(np.dot(near, vector.astype(np.float64)))
            if abs(cosine) > 1 - _NEARLY_NATURAL:
                found.append(vector if cosine > 0 else -vector)
    return np.stack(found, axis=1) if len(found) == 3 else None


def _orthonormal(gamma: Objects, body: RigidBody, digits: int) -> Objects:
    """Return γ and the polar factor of the given columns across it: the nearest orthonormal
    vectors, by Newton–Schulz steps X(3 − XᵀX)/2.
    """
    given = body.frame if body.exact_frame is None else body.exact_frame
    X = enclose(np.array(given, dtype=object))[:, 1:]
    X = X - np.outer(gamma, gamma @ X)
    for _ in range((digits + _SPARE).bit_length() + 6):
        X = midpoints((3 * X - X @ (X.T @ X)) / 2)
    return np.column_stack([gamma, X])
