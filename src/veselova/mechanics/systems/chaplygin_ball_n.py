"""Chaplygin's ball in ℝⁿ, n ≥ 4, without momentum in so(n−1)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from operator import mul
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.flows.ball_flow import RollingFlow
from veselova.mechanics.flows.ball_flow_n import ChaplyginFlowN
from veselova.mechanics.geometry.integrals_of_motion import unit_scale
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE, over_largest, unit
from veselova.mechanics.systems.commuting_veselova import CommutingVeselova
from veselova.mechanics.systems.rolling_ball_n import ExactVector, RollingBallN
from veselova.mechanics.systems.rolling_veselova import RollingVeselova

__all__ = ["ChaplyginBallN"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class ChaplyginBallN(RollingBallN):
    """What ``ChaplyginBall`` is in ℝⁿ, n ≥ 4, without momentum in so(n−1): it rolls without
    slipping and is free to twist, and k = Iω + D(γγᵀω + ωγγᵀ) = γ∧p, D = ma².

    - inertia: {"special": [A_1 … A_n]} with J_ij = A_iA_j/det A above ma²: the moments about the
      centre are I_ij = D²/(J_ij − D)
    - mass, radius, gamma, frame, position, strict: as of ``RubberBallN``
    - Omega: ω at t = 0, its n(n−1)/2 coefficients on E_i∧E_j, i < j, or the skew matrix (n, n);
      the momentum k that it makes has to be γ∧p to 1e-9

    With ``normalize=True`` γ is scaled, and ω becomes the one with this γ̇ = −ωγ and momentum γ∧p.
    The motion commutes with that of ``RubberBallN`` of the same A: ω = J(γ∧ξ)/D − γ∧ξ, where ξ is
    the velocity of that one with the same p. Outputs, error, engines: as of ``RubberBallN``.

    Formulation: ``momentum``, ω from the momentum p in space, with the quadrature of the contact
    point. Against the ball itself 1e-12 for n = 4, 5 and t ≤ 20. Raises InvalidInput, which names
    the field.
    """

    system: ClassVar[str] = "chaplygin-ball"
    twists: ClassVar[bool] = True
    formulations: ClassVar[tuple[str, ...]] = ("momentum",)

    def _velocity_of_point(self, omega: Any, normalize: bool) -> ExactVector:
        if normalize:
            return self._velocity_of(self._momentum_of(self._rate_of(omega)))
        gamma = self._exact_gamma
        J = [moment + self.ball.added for moment in self.ball.moments]
        for value, i, j in zip(J, *np.triu_indices(self.n, 1), strict=True):
            omega[i, j], omega[j, i] = value * omega[i, j], value * omega[j, i]
        momentum = tuple(-(omega @ np.array(gamma, dtype=object)))
        velocity = self._velocity_of(momentum)
        self._require_no_momentum(np.array(omega, dtype=np.float64))
        return velocity

    def _require_no_momentum(self, momentum: Array) -> None:
        """Raise InvalidInput unless Iω, of (I+D)ω, is along γ alone."""
        rows, columns = np.triu_indices(self.n, 1)
        share = self.ball.operator / (self.ball.operator + float(self.ball.added))
        M = np.zeros_like(momentum)
        M[rows, columns] = momentum[rows, columns] * share
        M = M - M.T
        gamma = unit(to_float(over_largest(self._exact_gamma)))
        along = np.outer(gamma, gamma @ M)
        off = float(np.max(np.abs(M - along + along.T)))
        if off > INPUT_TOLERANCE * float(np.max(np.abs(momentum))):
            required = (
                "one without momentum in so(n−1), (Iω)(u, v) = 0 for u, v across γ, to 1e-9 "
                "(or normalize=True)"
            )
            raise InvalidInput(("Omega",), required, f"a momentum there of {off:.3g}")

    def _velocity_of(self, momentum: ExactVector) -> ExactVector:
        """Return ξ = Δ/(q,Aq) [A⁻¹p − (p,A⁻¹q)q] over p's unit, from p."""
        A, gamma = self.ball.A, self._exact_gamma
        square = sum(map(mul, gamma, gamma))
        factor = math.prod(A) * square / sum(a * x * x for a, x in zip(A, gamma, strict=True))
        free = [p / a for p, a in zip(momentum, A, strict=True)]
        share = Fraction(sum(map(mul, free, gamma)), square)
        return tuple(factor * (y - share * x) for y, x in zip(free, gamma, strict=True))

    def _momentum_of(self, q_dot: ExactVector) -> ExactVector:
        """Return p with p/D − ξ(p) = q̇ and (p,γ) = 0: a linear system, symmetric and positive
        definite across γ.
        """
        from flint import fmpq, fmpq_mat

        A, gamma, n = self.ball.A, self._exact_gamma, self.n
        square = sum(map(mul, gamma, gamma))
        factor = math.prod(A) * square / sum(a * x * x for a, x in zip(A, gamma, strict=True))
        system = fmpq_mat(n + 1, n + 1)
        for i in range(n):
            system[i, i] = fmpq(*(1 / self.ball.added - factor / A[i]).as_integer_ratio())
            system[i, n] = system[n, i] = fmpq(*gamma[i].as_integer_ratio())
        right = fmpq_mat(n + 1, 1, [*(fmpq(*x.as_integer_ratio()) for x in q_dot), fmpq(0)])
        found = system.solve(right).entries()[:n]
        return tuple(Fraction(int(x.p), int(x.q)) for x in found)

    def _torus_of(self, velocity: ExactVector) -> RollingVeselova:
        data = (self.ball.A, self._exact_gamma, velocity, self._exact_frame)
        return CommutingVeselova(*data, added=self.ball.added)

    def _omega_of(self, q: Array, xi: Array) -> Array:
        x = self.ball.roots
        momentum = (x * q)[..., :, None] * (x * xi)[..., None, :] / float(self.ball.added)
        product = momentum - q[..., :, None] * xi[..., None, :]
        return np.asarray(product - np.swapaxes(product, -1, -2))

    def flow(self, formulation: str = "momentum") -> Flow:
        """Return the field in units of this problem."""
        _, power = unit_scale(self.ball.operator)
        power -= power % 2
        attitude = ChaplyginFlowN(
            roots=np.ldexp(self.ball.roots, -power // 2),
            added=float(np.ldexp(float(self.ball.added), -power)),
            momentum=np.ldexp(self.momentum_in_space / self.turning, -power),
            frame=self.frame,
            time_unit=1 / self.turning,
        )
        contact = self.start["position"][0]
        return RollingFlow(attitude, float(self.ball.radius), contact, self.ball.size)
