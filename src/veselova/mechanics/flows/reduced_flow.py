"""The reduced flow on T*Sⁿ⁻¹ with the frame carried along: vector field, projection, and its units.

Momenta are measured in units of 1/det A (so det A never appears), lengths of A in units of 2^k near
its geometric mean, and time in units of 1/|q̇(0)|: the field is then of order one whatever the
scales of the input.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Flow, Operations
from veselova.mechanics.geometry.integrals_of_motion import sliding_velocity, unit_scale
from veselova.mechanics.geometry.natural_frame import orthonormalize

__all__ = ["ReducedFlow"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReducedFlow(Flow):
    """The extended system (extended) with ė_k = −ω e_k and dτ₁/dt, for one body and one energy.

    A state is the flat array (p, E, τ₁) of length n + n² + 1: momentum, frame matrix (row-major,
    columns e_k, e_1 = q), and Neumann time. ``twice_energy`` is W = (p,A⁻¹p)/(q,Aq), the conserved
    2h det A in these units.
    """

    A: Array
    inverse: Array
    twice_energy: float
    time_unit: float
    tau1_unit: float
    initial: Array

    @classmethod
    def of(cls, A: Array, q: Array, q_dot: Array, frame: Array) -> ReducedFlow:
        """Return the flow of a moving body (q̇ ≠ 0) that starts at t = 0 in the given state."""
        scaled, k = unit_scale(A)
        speed = float(np.max(np.abs(q_dot)))
        speed *= float(np.linalg.norm(q_dot / speed))
        p = cls._momentum(scaled, q, q_dot / speed)
        twice_energy = float(p @ (p / scaled) / (q @ (scaled * q)))
        initial = np.concatenate([p, frame.ravel(), [0.0]])
        # dτ₁/dt = √(W/(q,Aq)) is homogeneous of degree ½ in A and 1 in q̇.
        return cls(
            scaled, 1 / scaled, twice_energy, 1 / speed, float(np.sqrt(np.ldexp(1.0, k))), initial
        )

    @staticmethod
    def _momentum(A: Array, q: Array, q_dot: Array) -> Array:
        w = sliding_velocity(A, q, q_dot)
        return np.asarray(A * w * (q @ (A * q)), dtype=np.float64)

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
        twice_energy = float(p @ (self.inverse * p) / (E[:, 0] @ (self.A * E[:, 0])))
        return replace(
            self, twice_energy=twice_energy, initial=np.concatenate([p, E.ravel(), [0.0]])
        )

    @property
    def n(self) -> int:
        """Return the dimension of the body."""
        return self.A.size

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return (A, A⁻¹, W)."""
        return np.concatenate([self.A, self.inverse, [self.twice_energy]])

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
        p = p * np.sqrt(self.twice_energy * (q @ (self.A * q)) / (p @ (self.inverse * p)))
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
        p_inverse = self.inverse * (p - np.sum(p * q, axis=1, keepdims=True) * q)
        qAq = np.sum(q * self.A * q, axis=1, keepdims=True)
        q_dot = (p_inverse - np.sum(p_inverse * q, axis=1, keepdims=True) * q) / qAq
        return {"tau1": states[:, -1] * self.tau1_unit, "q_dot": q_dot / self.time_unit, "frame": E}
