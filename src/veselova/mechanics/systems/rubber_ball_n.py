"""A ball in ℝⁿ, n ≥ 4, that rolls on a hyperplane without slipping and without twisting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.flows.ball_flow import RollingFlow
from veselova.mechanics.flows.ball_flow_n import attitude_flow
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.systems.rolling_ball_n import ExactVector, RollingBallN
from veselova.mechanics.systems.rolling_veselova import RollingVeselova

__all__ = ["RubberBallN"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class RubberBallN(RollingBallN):
    """What ``RubberBall`` is in ℝⁿ, n ≥ 4: the rank-one Veselova system with inertia J = I + ma²,
    equation (4.5, printed 5.11), as a rolling ball.

    - inertia: {"special": [A_1 … A_n]}, the effective operator J with J_ij = A_iA_j/det A, all of
      them above ma²; the moments about the centre are I_ij = J_ij − ma²
    - mass, radius: positive numbers m and a
    - gamma: (n,) the unit normal e_1 = γ of the hyperplane, seen from the body
    - Omega: ω = γ∧γ̇ = γγ̇ᵀ − γ̇γᵀ at t = 0, its n(n−1)/2 coefficients on E_i∧E_j, i < j, or the
      skew matrix (n, n)
    - frame: (n, n) [e_1 … e_n] at t = 0, columns, e_1 = γ; None for the natural frame
    - position: (n−1,) the contact point at t = 0, along e_2 … e_n; the pair (0, 0) is the origin
    - strict: not asked here: no body of masses has such moments, but symmetric ones

    With ``normalize=True`` γ is scaled and ω projected on γ∧γ̇. Outputs: Omega (N, n(n−1)/2), gamma
    (N, n), frame (N, n, n), the contact point ``position`` (N, n−1), its ``velocity`` −a(e_k, γ̇),
    the ``force`` of the hyperplane along it, and the momentum γ∧p about the contact point, (N,
    n(n−1)/2), p fixed in space. ``error`` bounds frame and position.

    Engine ``analytic``: theta functions or angles, and the path by Fourier series or panels.
    Formulations: ``multiplier`` and ``momentum``, those of ``LRSystem`` with the quadrature of the
    contact point. Against the ball itself 1e-12 for n = 4, 5 and t ≤ 20. Raises InvalidInput, which
    names the field.
    """

    system: ClassVar[str] = "rubber-ball"
    twists: ClassVar[bool] = False
    formulations: ClassVar[tuple[str, ...]] = ("multiplier", "momentum")

    def _velocity_of_point(self, omega: Any, normalize: bool) -> ExactVector:
        turning = np.array(omega, dtype=np.float64)
        q_dot = -turning @ self.gamma
        product = np.outer(self.gamma, q_dot)
        off = float(np.max(np.abs(turning - product + product.T)))
        if not normalize and off > INPUT_TOLERANCE * float(np.max(np.abs(turning))):
            required = "γ∧γ̇ to 1e-9 of its largest entry: no twist (or normalize=True)"
            raise InvalidInput(("Omega",), required, f"entries that are off it by {off:.3g}")
        return self._rate_of(omega)

    def _torus_of(self, velocity: ExactVector) -> RollingVeselova:
        data = (self.ball.A, self._exact_gamma, velocity, self._exact_frame)
        return RollingVeselova(*data, normalize=True)

    def _omega_of(self, q: Array, xi: Array) -> Array:
        product = q[..., :, None] * xi[..., None, :]
        return np.asarray(product - np.swapaxes(product, -1, -2))

    def flow(self, formulation: str = "multiplier") -> Flow:
        """Return the field in units of this problem."""
        J = self.ball.operator + float(self.ball.added)
        unit = 1 / self.turning
        attitude = attitude_flow(J, self.Omega * unit, self.frame, unit, formulation)
        contact = self.start["position"][0]
        return RollingFlow(attitude, float(self.ball.radius), contact, self.ball.size, True)
