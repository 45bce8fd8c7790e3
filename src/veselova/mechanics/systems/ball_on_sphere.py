"""A ball that rolls over a fixed sphere in ℝⁿ without slipping and without twisting."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.ball import Ball, BallN
from veselova.mechanics.bodies.principal_inertia import three_moments
from veselova.mechanics.core.arguments import require_name
from veselova.mechanics.core.errors import Faults, InvalidInput
from veselova.mechanics.core.exact_input import (
    Number,
    Numbers,
    require_moderate,
    scale_number,
    square_root,
    to_float,
)
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.core.problem import Series
from veselova.mechanics.flows.sphere_flow import SphereFlow
from veselova.mechanics.geometry.integrals_of_motion import unit_scale
from veselova.mechanics.geometry.natural_frame import admissible_frame
from veselova.mechanics.geometry.so_n import coefficients, skew, wedge
from veselova.mechanics.systems.rolling import Rolling, frame_along, read_start, require_turning
from veselova.mechanics.systems.rolling_ball_n import RubberBallN
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["SIDES", "RubberBallOnSphere"]

Array = NDArray[np.float64]

#: Where the ball is: outside the sphere, inside it, or a shell around it.
SIDES = ("outside", "inside", "around")


class RubberBallOnSphere(Rolling):
    """What ``RubberBall`` is over a fixed sphere of radius σ instead of a plane, n ≥ 3: ω = γ∧v,
    γ̇ = −εωγ, and Jω̇ = [Jω,ω] but for torques across γ, J = I + ma², ε = σ/(σ ± a).

    - inertia, mass, radius, strict: as of ``RubberBall``; for n ≥ 4 as of ``RubberBallN``
    - sphere: the radius σ
    - side: ``outside``, ε = σ/(σ+a); ``inside``, a < σ, or ``around``, a > σ, ε = σ/(σ−a)
    - gamma: (n,) the outer unit normal of the fixed sphere at the contact point, seen from the body
    - Omega: as of ``RubberBall``, with (Ω,γ) = 0; for n ≥ 4 ω = γ∧v, as of ``RubberBallN``
    - frame: (n, n) [e_1 … e_n] at t = 0, columns, e_1 = γ; None for e_2 along γ̇
    - position: none; the contact point at t = 0 is σe_1

    Outputs: Omega, gamma, frame, the contact point ``position`` = σEᵀγ on the fixed sphere along
    e_1 … e_n, (N, n). ±aγ is the contact point on the ball. ``error`` bounds gamma, frame and
    position.

    Engine ``analytic`` has ε = −1, a shell around a sphere of half its radius: A^{1/2}γ over its
    length is Neumann's point. Other motions are integrated. Raises InvalidInput, which names the
    field.
    """

    n: int
    sphere: Fraction
    side: str
    ratio: Fraction
    gamma: Array
    axes: Array
    inverse: tuple[Fraction, ...]
    exact_gamma: tuple[Fraction, ...]
    exact_velocity: tuple[Fraction, ...]

    system: ClassVar[str] = "rubber-ball"
    engines: ClassVar[Mapping[str, tuple[str, ...]]] = TorusProblem.engines
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Omega": ("axis",),
        "gamma": ("axis",),
        "frame": ("axis", "vector"),
        "position": ("vector",),
    }
    derived: ClassVar[tuple[str, ...]] = ("position",)
    bounded: ClassVar[tuple[str, ...]] = ("gamma", "frame", "position")
    shown: ClassVar[tuple[str, ...]] = ("gamma", "Omega")
    portrait: ClassVar[str] = "gamma"
    formulations: ClassVar[tuple[str, ...]] = ("momentum",)

    def __init__(
        self,
        inertia: Numbers | Mapping[str, Any],
        mass: Number,
        radius: Number,
        gamma: Numbers,
        Omega: Numbers,
        frame: Numbers | None = None,
        position: Numbers = (0, 0),
        sphere: Number = 1,
        side: str = "outside",
        *,
        strict: bool = True,
        normalize: bool = False,
    ) -> None:
        def read_ball(n: int) -> Ball | BallN:
            data = inertia, mass, radius, (0,) * (n - 1)
            return Ball.of(*data, strict) if n == 3 else BallN.of(n, False, *data)

        faults = Faults()
        if any(np.ravel(np.array(position, dtype=object))):
            faults.add(("position",), "none over a sphere: the contact is σe_1 at t = 0", "one")
        sigma = faults.attempt(scale_number, sphere, ("sphere",))
        faults.attempt(require_name, side, ("side",), SIDES)
        start = read_start(faults, read_ball, gamma, Omega, frame, normalize)
        ball, exact_gamma, direction, omega, exact_frame = start
        n = direction.size
        fits = {"outside": True, "inside": ball.radius < sigma, "around": ball.radius > sigma}
        if not fits[side]:
            least = "below" if side == "inside" else "above"
            required = f"a radius {least} that of the sphere, {float(sigma):.6g}, for a ball {side}"
            raise InvalidInput(("radius",), required, f"{float(ball.radius):.6g}")
        moving = -omega @ np.array(exact_gamma, dtype=object)
        require_moderate(moving, ("Omega",))
        moments, axes = three_moments(ball.effective) if n == 3 else (None, None)
        to_axes = tuple if axes is None else axes.to_axes
        self._set(
            n=n,
            ball=ball,
            sphere=sigma,
            side=side,
            ratio=sigma / (sigma + (ball.radius if side == "outside" else -ball.radius)),
            gamma=direction,
            axes=np.eye(n) if axes is None else axes.rounded,
            inverse=moments or tuple(1 / a for a in ball.A),
            exact_gamma=to_axes(exact_gamma),
            exact_velocity=to_axes(moving),
        )
        length = math.sqrt(float(sum(x * x for x in exact_gamma)))
        velocity = np.array([float(x) for x in moving]) / length
        velocity = velocity - (velocity @ direction) * direction
        if not normalize:
            require_turning(
                omega, coefficients(wedge(direction, velocity)), RubberBallN.restriction
            )
        if exact_frame is None:
            found = frame_along(direction, float(self.ratio) * velocity)
        else:
            found = admissible_frame(to_float(exact_frame), direction)
        self._set(Omega=self.angular_velocity(direction, velocity), frame=found)

    @property
    def without_closed_form(self) -> str | None:
        """Return why the motion has no closed form; None where it has one."""
        if self.ratio == -1:
            return None
        return (
            "over a sphere the closed form has ε = −1, a shell around a sphere of half its radius "
            f"exactly, here ε + 1 = {float(self.ratio + 1):.3g}; integrate numerically"
        )

    @property
    def size(self) -> str:
        """Return the dimension and ε."""
        return f"over a sphere, n = {self.n}, ε = {float(self.ratio):.6g}"

    @property
    def extent(self) -> float:
        """Return the length in which errors of γ, frame and contact point are measured."""
        return max(1.0, float(self.sphere))

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        return {"Omega": self.Omega[None], "gamma": self.gamma[None], "frame": self.frame[None]}

    @cached_property
    def roots(self) -> Array:
        """Return x_i along the principal axes, (n,): J_ij = x_ix_j."""
        unit = math.prod(self.inverse)
        return np.array([square_root(unit / b / b) for b in self.inverse])

    def flow(self, formulation: str = "momentum") -> Flow:
        """Return the field along the principal axes, in units of this problem."""
        gamma, velocity = self.to_principal_axes(self.start)
        start = gamma[0], velocity[0] / self.turning, self.axes.T @ self.frame
        return SphereFlow.of(unit_scale(self.roots)[0], float(self.ratio), *start, 1 / self.turning)

    def angular_velocity(self, gamma: Array, velocity: Array) -> Array:
        """Return γ∧v as Ω = v×γ, (..., 3), or by its coefficients, (..., n(n−1)/2)."""
        if self.n == 3:
            return np.asarray(np.cross(velocity, gamma))
        return coefficients(wedge(gamma, velocity))

    def velocity(self, series: Series) -> Array:
        """Return v = −ωγ of series, (..., n)."""
        gamma, Omega = series["gamma"], series["Omega"]
        if self.n == 3:
            return np.asarray(np.cross(gamma, Omega))
        return np.asarray(-np.einsum("...ij,...j->...i", skew(Omega, self.n), gamma))

    def to_principal_axes(self, series: Series) -> tuple[Array, Array]:
        """Return γ and v along the principal axes."""
        return series["gamma"] @ self.axes, self.velocity(series) @ self.axes

    def complete(self, series: Series) -> Series:
        """Return the series of a flow along the body axes, with Ω."""
        gamma, velocity = (series[name] @ self.axes.T for name in ("gamma", "velocity"))
        Omega = self.angular_velocity(gamma, velocity)
        return {"Omega": Omega, "gamma": gamma, "frame": self.axes @ series["frame"]}

    def bound(self, series: Series, error: Array) -> Array:
        """Return the error of γ, frame and contact point from that of the first two."""
        return np.asarray(error * max(1.0, 2 * math.sqrt(self.n) * float(self.sphere)))

    def derive(self, name: str, series: Series) -> Array:
        """Return the contact point on the fixed sphere."""
        in_space = np.einsum("...ji,...j->...i", series["frame"], series["gamma"])
        return np.asarray(float(self.sphere) * in_space)

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along the series, by name: ``energy`` ½⟨Jω,ω⟩,
        ``gamma_norm`` (γ,γ).
        """
        q, v = self.to_principal_axes(series)
        x = self.roots
        qq, qv, vv = (np.sum(a * x * b, axis=-1) for a, b in ((q, q), (q, v), (v, v)))
        return {
            "energy": np.asarray((qq * vv - qv * qv) / 2),
            "gamma_norm": np.asarray(np.sum(q * q, axis=-1)),
        }
