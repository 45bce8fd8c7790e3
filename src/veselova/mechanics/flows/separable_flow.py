"""The reduced flow on T*Sⁿ⁻¹ in the potentials of (3.5, printed 4.10), in n dimensions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import FLOATS, Operations, PointFlow, restoring_step
from veselova.mechanics.flows.collision import SingularFlow
from veselova.mechanics.geometry.integrals_of_motion import sliding_velocity, unit_scale

__all__ = ["SeparableFlow"]

Array = NDArray[np.float64]


class SeparableFlow(PointFlow, SingularFlow):
    """The extended system (extended, printed 6.8) for q and p with the tangential force of V =
    α₁[(I²q,q)−(Iq,q)²] + α₂(Iq,q) + Σ β_i/q_i².

    Flat states (q, p), p in units of 1/det A; parameters A, I, β, α₁, α₂, the last three times det
    A, in units of time.
    """

    lists: ClassVar[int] = 3
    further: ClassVar[int] = 2

    @classmethod
    def of(
        cls, A: Array, q: Array, q_dot: Array, potential: tuple[float, float, Array], turning: float
    ) -> SeparableFlow:
        """Return the flow of a start (q, q̇) in the potential (α₁, α₂, β)."""
        scaled, k = unit_scale(A)
        n = A.size
        inverse = 1 / scaled
        p = scaled * sliding_velocity(scaled, q, q_dot / turning) * (q @ (scaled * q))
        # T is A²/det A; V in its units, with I in units of 2^−k.
        unit = float(np.prod(scaled)) * 2.0 ** (k * (n - 2))
        quartic, quadratic, betas = potential
        forces = np.array([*(betas * unit), quartic * unit * 4.0**-k, quadratic * unit * 2.0**-k])
        forces = forces / turning / turning  # the square of a slow turning is no float
        return cls(np.concatenate([scaled, inverse, forces]), 1 / turning, np.concatenate([q, p]))

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (q̇, ṗ): (extended, printed 6.8), and −∂V/∂q along the sphere."""
        n = self.n
        q, p = state[:n], state[n:]
        A, inverse, *_ = self._split(parameters)
        p_inverse = inverse * p
        qAq, qq, along, pp, pq = (
            ops.dot(a, b) for a, b in ((q, A * q), (q, q), (p_inverse, q), (p, p_inverse), (p, q))
        )
        force = self._force(q, parameters, ops)
        derivative = np.empty_like(state)
        derivative[:n] = (p_inverse - (along / qq) * q) / qAq
        derivative[n:] = (
            (-(pp * qq - pq * along) / (qAq * qq * qq)) * q + force - (ops.dot(force, q) / qq) * q
        )
        return derivative

    def _split(self, parameters: Any) -> list[Any]:
        """Return A, I, β and (α₁, α₂)."""
        return np.split(parameters, [self.n, 2 * self.n, 3 * self.n])

    def _force(self, q: Any, parameters: Any, ops: Operations) -> Any:
        _, inverse, betas, (quartic, quadratic) = self._split(parameters)
        moment = ops.dot(inverse * q, q)
        force = (-2.0 * quartic) * (inverse * inverse * q)
        force = force + (4.0 * quartic * moment - 2.0 * quadratic) * (inverse * q)
        walls = np.zeros(self.n, dtype=q.dtype)
        for i in np.flatnonzero(self._walls):
            walls[i] = 2.0 * betas[i] / (q[i] * q[i] * q[i])
        return force + walls

    @property
    def _walls(self) -> Array:
        return np.asarray(self._split(self.parameters)[2])

    @property
    def structure(self) -> Any:
        """Return the dimension and where there are walls."""
        return type(self), self.n, tuple(np.flatnonzero(self._walls))

    def _energies(self, q: Array, p: Array) -> Array:
        """Return the parts of the energy."""
        A, inverse, betas, (quartic, quadratic) = self._split(self.parameters)
        moment = inverse @ (q * q)
        live = betas != 0
        quartics = quartic * np.array([(inverse * inverse) @ (q * q), -moment * moment])
        kinetic = p @ (inverse * p) / (2 * (q @ (A * q)))
        walls = betas[live] / q[live] ** 2
        return np.array([kinetic, *quartics, quadratic * moment, *walls])

    def _on_sphere(self, state: Array) -> tuple[Array, Array]:
        q = state[: self.n]
        p = state[self.n :]
        q = q / np.linalg.norm(q)
        return q, p - (p @ q) * q

    def project(self, state: Array) -> Array:
        """Return the state with |q| = 1, (q,p) = 0 and the energy of the start, by one step along
        its gradient.
        """
        q, p = self._on_sphere(state)
        A, inverse, *_ = self._split(self.parameters)
        qAq = q @ (A * q)
        by_q = -(p @ (inverse * p) / qAq**2) * (A * q) - self._force(q, self.parameters, FLOATS)
        by_p = inverse * p / qAq
        by_q = by_q - (by_q @ q) * q
        by_p = by_p - (by_p @ q) * q
        parts = self._energies(q, p)
        excess = parts.sum() - self._energies(*self._on_sphere(self.initial)).sum()
        step = restoring_step(excess, by_q @ by_q + by_p @ by_p, np.abs(parts).sum())
        return np.concatenate(self._on_sphere(np.concatenate([q - step * by_q, p - step * by_p])))

    def neighbour(self, distance: float) -> SeparableFlow:
        """Return the flow of a start moved by about ``distance``."""
        direction = np.random.default_rng(self.n).normal(size=self.initial.size) / np.sqrt(self.n)
        # what is near a wall moves relative to it
        direction[: self.n] *= np.abs(self.initial[: self.n]) ** (self._walls != 0)
        return replace(
            self, initial=np.concatenate(self._on_sphere(self.initial + distance * direction))
        )

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return q and q_dot, on the manifold."""
        states = np.array([self.project(state) for state in states])
        q, p = states[:, : self.n], states[:, self.n :]
        A, inverse, *_ = self._split(self.parameters)
        p_inverse = inverse * p
        q_dot = p_inverse - np.sum(p_inverse * q, axis=1, keepdims=True) * q
        q_dot = q_dot / np.sum(q * A * q, axis=1, keepdims=True)
        return {"q": q, "q_dot": q_dot / self.time_unit}

    def _coordinates(self, state: Array) -> tuple[Array, Array]:
        """Return q and q̇."""
        return state[: self.n].copy(), self.vector_field(0.0, state)[: self.n]

    @cached_property
    def _singular(self) -> Mapping[int, Callable[[Array], float]]:
        def part(i: int) -> Callable[[Array], float]:
            return lambda q: float(self._walls[i] / q[i] ** 2)

        return {i: part(i) for i in np.flatnonzero(self._walls).tolist()}

    def _plane(self, index: int) -> str:
        return f"the plane q[{index}]"
