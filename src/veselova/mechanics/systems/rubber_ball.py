"""A ball that rolls on a plane without slipping and without twisting: Veselova's system."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.exact_input import Number, Numbers
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.systems.ball_on_sphere import RubberBallOnSphere
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN, RubberBallN
from veselova.mechanics.systems.rolling_veselova import RollingVeselova
from veselova.mechanics.systems.veselova import Veselova
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3, multiplier

__all__ = ["RubberBall"]

Array = NDArray[np.float64]


class RubberBall(RollingBall, VeselovaSO3):
    """A ball of mass m and radius a that rolls on a plane without slipping, with constant spin
    (Ω,γ) about the vertical γ, zero for no twist: ``VeselovaSO3`` with inertia J = I + ma².

    - inertia: 3 principal moments I about the centre, or a symmetric positive definite 3 × 3 matrix
    - mass, radius: positive numbers
    - gamma: (3,) the unit normal e_1 of the plane, from the contact point to the centre, seen from
      the body
    - Omega: (3,) the angular velocity in the body
    - frame: (3, 3) [e_1 e_2 e_3] at t = 0, columns e_i, e_1 = γ, e_2 and e_3 in the plane; None
      for the natural frame
    - position: (2,) the contact point at t = 0, along e_2 and e_3
    - sphere: the radius of a fixed sphere to roll over in place of the plane; see
      ``RubberBallOnSphere``
    - side: ``outside`` the sphere, ``inside`` it, or ``around`` it as a shell; None for outside
    - strict: whether moments that no body has, larger than the sum of the others, are refused

    The centre is at distance a above the contact point, and has no offset from the middle of the
    ball. Outputs: those of ``VeselovaSO3`` for J, and the contact point ``position`` (N, 2), its
    ``velocity`` a(Ω×γ, e_k), which is that of the centre, and the horizontal ``force`` of the plane
    on the ball, m times the acceleration of the centre. The vertical force is the weight. The
    ``multiplier`` λ is the torque λγ that keeps the ball from twisting. ``inertia`` as an attribute
    is J; ``ball`` has what was given.

    Formulations: those of ``VeselovaSO3`` with the quadrature of the contact point. Raises
    InvalidInput, which names the field. With n ≥ 4 entries of ``gamma`` the ball is a
    ``RubberBallN``.
    """

    system: ClassVar[str] = "rubber-ball"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        **RollingBall.outputs,
        "multiplier": (),
    }
    derived: ClassVar[tuple[str, ...]] = (*RollingBall.derived, "multiplier")
    in_many_dimensions: ClassVar[type[RollingBallN] | None] = RubberBallN
    twists: ClassVar[bool] = False
    rank_one_class: ClassVar[type[Veselova]] = RollingVeselova

    def __new__(cls, *arguments: Any, **fields: Any) -> Any:
        """Return the ball; over a sphere ``RubberBallOnSphere``."""
        given = cls.__signature__.bind_partial(*arguments, **fields).arguments
        if given.get("sphere") is not None:
            given["side"] = "outside" if (side := given.get("side")) is None else side
            return RubberBallOnSphere(**given)
        if given.pop("side", None) is not None:
            raise InvalidInput(("side",), "none without a sphere", show(fields.get("side")))
        given.pop("sphere", None)
        return super().__new__(cls, **given)

    def __init__(
        self,
        inertia: Numbers | Mapping[str, Any],
        mass: Number,
        radius: Number,
        gamma: Numbers,
        Omega: Numbers,
        frame: Numbers | None = None,
        position: Numbers = (0, 0),
        sphere: Number | None = None,
        side: str | None = None,
        *,
        strict: bool = True,
        normalize: bool = False,
    ) -> None:
        given = inertia, mass, radius, gamma, Omega, frame, position
        super().__init__(*given, strict=strict, normalize=normalize)

    def flow(self, formulation: str = "multiplier") -> Flow:
        """Return the field in units of this problem."""
        return self.roll(super().flow(formulation))

    def angular_acceleration(self, Omega: Array, gamma: Array) -> Array:
        """Return Ω̇ = J⁻¹(JΩ×Ω + λγ)."""
        torque = np.cross(self.momentum_of(Omega), Omega)
        return self.velocity_of(torque + multiplier(self, Omega, gamma)[..., None] * gamma)
