"""What balls on a plane share: their data, their start, and the series of the contact point."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.ball import Ball
from veselova.mechanics.core.arguments import entry_count
from veselova.mechanics.core.decimals import exact_as
from veselova.mechanics.core.errors import Faults
from veselova.mechanics.core.exact_input import Number, Numbers
from veselova.mechanics.core.problem import Series
from veselova.mechanics.systems.rigid_body import RigidBody
from veselova.mechanics.systems.rolling import RollingOnPlane
from veselova.mechanics.systems.rolling_ball_n import RollingBallN

__all__ = ["RollingBall"]

Array = NDArray[np.float64]


class RollingBall(RollingOnPlane, RigidBody):
    """A ball that rolls without slipping: a rigid body with the inertia J = I + ma² about the
    contact point, and the path of that point.

    - ball: what was given of the ball
    - inertia: J
    """

    ball: Ball

    #: What the same ball is in ℝⁿ, n ≥ 4.
    in_many_dimensions: ClassVar[type[RollingBallN] | None] = None
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Omega": ("axis",),
        "gamma": ("axis",),
        "frame": ("axis", "vector"),
        "position": ("horizontal",),
        "velocity": ("horizontal",),
        "force": ("horizontal",),
        "momentum": ("axis",),
    }
    derived: ClassVar[tuple[str, ...]] = ("gamma", "velocity", "force", "momentum")

    def __new__(cls, *arguments: Any, **fields: Any) -> Any:
        """Return the ball; with n ≥ 4 entries of γ that of ``in_many_dimensions``."""
        gamma = arguments[3] if len(arguments) > 3 else fields.get("gamma")
        if cls.in_many_dimensions is not None and entry_count(gamma) > 3:
            return cls.in_many_dimensions(*arguments, **fields)
        return super().__new__(cls)

    def __init__(
        self,
        inertia: Numbers | Mapping[str, Any],
        mass: Number,
        radius: Number,
        gamma: Numbers,
        Omega: Numbers,
        frame: Numbers | None = None,
        position: Numbers = (0, 0),
        *,
        strict: bool = True,
        normalize: bool = False,
    ) -> None:
        faults = Faults()
        ball = faults.attempt(Ball.of, inertia, mass, radius, position, strict)
        self._set(ball=ball)
        # the other fields do not depend on the moments
        moments = (1, 1, 1) if ball is None else ball.effective
        state = (gamma, Omega, None, frame)
        faults.attempt(RigidBody.__init__, self, moments, *state, normalize=normalize)
        faults.require_none()
        self._set(rolling_radius=float(ball.radius))

    def _shown(self) -> Mapping[str, Any]:
        ball = self.ball
        known = {"inertia": ball.tensor, "mass": float(ball.mass), "radius": float(ball.radius)}
        return {**known, "gamma": self.gamma, "Omega": self.Omega}

    @abstractmethod
    def angular_acceleration(self, Omega: Array, gamma: Array) -> Array:
        """Return Ω̇ in the body, (..., 3)."""

    def derive(self, name: str, series: Series) -> Array:
        """Return velocity, force, or what the body has."""
        frame = series["frame"]
        if name in ("velocity", "force"):  # of the contact point and of the centre: a(Ω×γ, e_k)
            moved, factor = series["Omega"], self.ball.radius
            if name == "force":  # mass times the acceleration of the centre
                moved = self.angular_acceleration(moved, frame[..., 0])
                factor = factor * self.ball.mass
            across = np.cross(moved, frame[..., 0]) * exact_as(frame, factor)
            return np.asarray(np.einsum("...i,...ik->...k", across, frame[..., 1:]))
        return super().derive(name, series)
