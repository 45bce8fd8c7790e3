"""The reduced flow on T*Sⁿ⁻¹ with the frame carried along: vector field, projection, and its units.

Momenta are measured in units of 1/det A (so det A never appears), lengths of A in units of 2^k near
its geometric mean, and time in units of 1/|q̇(0)|: the field is then of order one whatever the
scales of the input.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Operations, PointFlow
from veselova.mechanics.geometry.integrals_of_motion import sliding_velocity, unit_scale
from veselova.mechanics.geometry.natural_frame import orthonormalize

__all__ = ["ReducedFlow"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReducedFlow(PointFlow):
    """The extended system (extended) with ė_k = −ω e_k and dτ₁/dt, for one body and one energy.

    A state is the flat array (p, E, τ₁) of length n + n² + 1: momentum, frame matrix (row-major,
    columns e_k, e_1 = q), and Neumann time. Parameters are A, A⁻¹ and W = (p,A⁻¹p)/(q,Aq), the
    conserved 2h det A in these units.
    """

    tau1_unit: float

    lists: ClassVar[int] = 2
    further: ClassVar[int] = 1

    @classmethod
    def of(cls, A: Array, q: Array, q_dot: Array, frame: Array) -> ReducedFlow:
        """Return the flow of a moving body (q̇ ≠ 0) that starts at t = 0 in the given state."""
        scaled, k = unit_scale(A)
        speed = float(np.max(np.abs(q_dot)))
        speed *= float(np.linalg.norm(q_dot / speed))
        p = scaled * sliding_velocity(scaled, q, q_dot / speed) * (q @ (scaled * q))
        # dτ₁/dt = √(W/(q,Aq)) is homogeneous of degree ½ in A and 1 in q̇.
        tau1_unit = float(np.sqrt(np.ldexp(1.0, k)))
        return cls._started(scaled, p, frame, 1 / speed, tau1_unit)

    @classmethod
    def _started(
        cls, A: Array, p: Array, E: Array, time_unit: float, tau1_unit: float
    ) -> ReducedFlow:
        q = E[:, 0]
        twice_energy = p @ (p / A) / (q @ (A * q))
        parameters = np.concatenate([A, 1 / A, [twice_energy]])
        return cls(parameters, time_unit, np.concatenate([p, E.ravel(), [0.0]]), tau1_unit)

    def neighbour(self, distance: float) -> ReducedFlow:
        """Return the flow of a start moved by about ``distance`` on the manifold, energy included:
        how data rounding acts.
        """
        n = self.n
        direction = np.random.default_rng(n).normal(size=self.initial.size) / np.sqrt(n)
        p = self.initial[:n]
        E = self.initial[n:-1].reshape(n, n)
        q = E[:, 0] + distance * direction[:n]
        q /= np.linalg.norm(q)
        E = orthonormalize(np.column_stack([q, E[:, 1:]]))
        p = p + distance * float(np.linalg.norm(p)) * direction[n : 2 * n]
        p = p - (p @ E[:, 0]) * E[:, 0]
        return self._started(self.parameters[:n], p, E, self.time_unit, self.tau1_unit)

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return the derivative of a state: (extended, printed 6.8) for q and p, (Po, printed 5.1)
        for the frame, (4.6, printed 6.15) for τ₁.

        ṗ = −((p,q̇)/(q,q)) q and ė_k = −(q̇,e_k) q equal these where (q,q) = 1, (q,p) = 0 and E is
        orthogonal. Off this manifold they keep (q,q) and (q,p), and so defects of rounding and
        truncation do not grow between two projections.
        """
        n = self.n
        p = state[:n]
        E = state[n:-1].reshape(n, n)
        q = E[:, 0]
        p_inverse = parameters[n:-1] * p
        qAq = ops.dot(q, parameters[:n] * q)
        qq = ops.dot(q, q)
        q_dot = (p_inverse - (ops.dot(p_inverse, q) / qq) * q) / qAq
        columns = np.empty_like(E)
        columns[:, 0] = q_dot
        columns[:, 1:] = -np.outer(q, ops.dot(q_dot, E[:, 1:]))
        time_rate = ops.sqrt(parameters[-1] / qAq)
        return np.concatenate([-(ops.dot(p, q_dot) / qq) * q, columns.ravel(), [time_rate]])

    def project(self, state: Array) -> Array:
        """Return the state back on the manifold: frame orthonormal, (q,p) = 0, p rescaled to the
        energy.

        Without it a start that is one rounding off the manifold makes the energy drift
        quadratically in time.
        """
        n = self.n
        E = orthonormalize(state[n:-1].reshape(n, n))
        q = E[:, 0]
        p = state[:n] - (state[:n] @ q) * q
        A, inverse, W = self.parameters[:n], self.parameters[n:-1], self.parameters[-1]
        p = p * np.sqrt(W * (q @ (A * q)) / (p @ (inverse * p)))
        return np.concatenate([p, E.ravel(), state[-1:]])

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return frame, q_dot and tau1 along the principal axes, from states of shape (N, n + n² +
        1).

        Frames are made orthonormal and p orthogonal to q; the energy is left as integrated, so that
        its drift can be seen.
        """
        n = self.n
        p = states[:, :n]
        E = orthonormalize(states[:, n:-1].reshape(-1, n, n))
        q = E[:, :, 0]
        A, inverse = self.parameters[:n], self.parameters[n:-1]
        p_inverse = inverse * (p - np.sum(p * q, axis=1, keepdims=True) * q)
        qAq = np.sum(q * A * q, axis=1, keepdims=True)
        q_dot = (p_inverse - np.sum(p_inverse * q, axis=1, keepdims=True) * q) / qAq
        return {"tau1": states[:, -1] * self.tau1_unit, "q_dot": q_dot / self.time_unit, "frame": E}
