"""A ball that rolls over a fixed sphere in ℝⁿ without slipping and without twisting."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.ball import Ball, BallData, BallN
from veselova.mechanics.bodies.principal_inertia import three_moments
from veselova.mechanics.core.errors import Faults, InvalidInput
from veselova.mechanics.core.exact_input import (
    Number,
    Numbers,
    entry_count,
    require_moderate,
    scale_number,
    square_root,
    to_float,
)
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.core.names import require_name
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.flows.sphere_flow import SphereFlow
from veselova.mechanics.geometry.given_frame import admissible_frame, read_frame
from veselova.mechanics.geometry.integrals_of_motion import unit_scale
from veselova.mechanics.geometry.so_n import coefficients, skew, wedge
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE, read_direction
from veselova.mechanics.groups.matrix_group import LARGEST
from veselova.mechanics.systems.rolling_ball_n import read_turning
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["SIDES", "RubberBallOnSphere"]

Array = NDArray[np.float64]

#: Where the ball is: outside the sphere, inside it, or a shell around it.
SIDES = ("outside", "inside", "around")


class RubberBallOnSphere(Problem):
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
    ball: BallData
    sphere: Fraction
    side: str
    gamma: Array
    Omega: Array
    frame: Array
    axes: Array | None
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
        faults = Faults()
        n = max(entry_count(gamma), 3)
        if n > LARGEST:
            raise InvalidInput(("gamma",), f"a list of 3 to {LARGEST} numbers", f"{n} entries")
        ball: Any = faults.attempt(_ball, n, inertia, mass, radius, strict)
        if any(np.ravel(np.array(position, dtype=object))):
            faults.add(("position",), "none over a sphere: the contact is σe_1 at t = 0", "one")
        sigma = faults.attempt(scale_number, sphere, ("sphere",))
        faults.attempt(require_name, side, ("side",), SIDES)
        point = faults.attempt(read_direction, gamma, n, normalize)
        omega = faults.attempt(read_turning, Omega, n)
        of_frame = (point and point[0], n, normalize, "gamma")
        exact_frame = faults.attempt(read_frame, frame, *of_frame)
        faults.require_none()
        fits = {"outside": True, "inside": ball.radius < sigma, "around": ball.radius > sigma}
        if not fits[side]:
            least = "below" if side == "inside" else "above"
            required = f"a radius {least} that of the sphere, {float(sigma):.6g}, for a ball {side}"
            raise InvalidInput(("radius",), required, f"{float(ball.radius):.6g}")
        exact_gamma, direction = point
        moving = -omega @ np.array(exact_gamma, dtype=object)
        require_moderate(moving, ("Omega",))
        moments, axes = three_moments(ball.effective) if n == 3 else (None, None)
        to_axes = tuple if axes is None else axes.to_axes
        self._set(
            n=n,
            ball=ball,
            sphere=sigma,
            side=side,
            gamma=direction,
            axes=None if axes is None else axes.rounded,
            inverse=moments or tuple(1 / a for a in ball.A),
            exact_gamma=to_axes(exact_gamma),
            exact_velocity=to_axes(moving),
        )
        length = math.sqrt(float(sum(x * x for x in exact_gamma)))
        velocity = np.array([float(x) for x in moving]) / length
        velocity = velocity - (velocity @ direction) * direction
        self._set(Omega=self.angular_velocity(direction, velocity))
        if not normalize:
            _require_no_twist(omega, direction, velocity)
        if exact_frame is None:
            self._set(frame=_frame_along(direction, self.epsilon * velocity))
        else:
            self._set(frame=admissible_frame(to_float(exact_frame), direction))

    @cached_property
    def ratio(self) -> Fraction:
        """Return ε = σ/(σ ± a), exactly."""
        radius = self.ball.radius if self.side == "outside" else -self.ball.radius
        return self.sphere / (self.sphere + radius)

    @property
    def epsilon(self) -> float:
        """Return ε."""
        return float(self.ratio)

    @property
    def without_closed_form(self) -> str | None:
        """Return why the motion has no closed form; None where it has one."""
        if self.ratio == -1:
            return None
        return (
            "over a sphere the closed form has ε = −1, a shell around a sphere of half its radius, "
            f"here ε = {self.epsilon:.6g}; integrate numerically"
        )

    @property
    def default_engine(self) -> str:
        """Return ``analytic`` where the motion has a closed form, else ``numeric``."""
        return "numeric" if self.without_closed_form else "analytic"

    @property
    def title(self) -> str:
        """Return the system, its dimension, ε and its energy."""
        energy = float(self.integrals(self.start)["energy"][0])
        kind = f"{self.system} over a sphere, n = {self.n}, ε = {self.epsilon:.6g}"
        return f"{kind}, energy {energy:.12g}"

    @property
    def moves(self) -> bool:
        """Return whether the ball moves."""
        return bool(np.any(self.Omega))

    @property
    def turning(self) -> float:
        """Return |ω|."""
        return float(np.linalg.norm(self.Omega))

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
        frame = self.frame if self.axes is None else self.axes.T @ self.frame
        start = gamma[0], velocity[0] / self.turning, frame
        return SphereFlow(unit_scale(self.roots)[0], self.epsilon, *start, 1 / self.turning)

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
        found = series["gamma"], self.velocity(series)
        return found if self.axes is None else (found[0] @ self.axes, found[1] @ self.axes)

    def complete(self, series: Series) -> Series:
        """Return the series of a flow along the body axes, with Ω."""
        gamma, velocity, frame = (series[name] for name in ("gamma", "velocity", "frame"))
        if self.axes is not None:
            gamma, velocity, frame = gamma @ self.axes.T, velocity @ self.axes.T, self.axes @ frame
        return {"Omega": self.angular_velocity(gamma, velocity), "gamma": gamma, "frame": frame}

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


def _ball(n: int, inertia: Any, mass: Any, radius: Any, strict: bool) -> Ball | BallN:
    """Return the ball that is given."""
    data = inertia, mass, radius, (0,) * (n - 1)
    return Ball.of(*data, strict) if n == 3 else BallN.of(n, False, *data)


def _require_no_twist(omega: Any, gamma: Array, velocity: Array) -> None:
    """Raise InvalidInput unless ω is γ∧v."""
    given = coefficients(omega.astype(np.float64))
    off = float(np.max(np.abs(given - coefficients(wedge(gamma, velocity)))))
    if off > INPUT_TOLERANCE * float(np.max(np.abs(given))):
        required = "γ∧γ̇: no twist, to 1e-9 of its largest entry (or normalize=True)"
        raise InvalidInput(("Omega",), required, f"entries that are off it by {off:.3g}")


def _frame_along(gamma: Array, velocity: Array) -> Array:
    """Return orthonormal columns of determinant one, the first along γ, the second along γ̇ where
    that is not zero.
    """
    known = [gamma, velocity] if np.any(velocity) else [gamma]
    frame, triangle = np.linalg.qr(np.column_stack([*known, np.eye(gamma.size)]))
    frame[:, : len(known)] *= np.sign(np.diag(triangle)[: len(known)])
    frame[:, -1] *= np.sign(np.linalg.det(frame))
    return np.asarray(frame)
