"""Balls that roll: the quadrature of the contact point beside an attitude, and attitudes in ℝⁿ."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Flow, Operations
from veselova.mechanics.flows.rigid_body_flow import MomentumInSpace

__all__ = ["AttitudeFlow", "RollingFlow"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RollingFlow(Flow):
    """A flow of the attitude, and the contact point by ẋ_k = −a(e_k, q̇), q = e_1.

    - attitude: a flow whose state ends with the frame E, row-major
    - radius: a
    - contact: (n−1,) the contact point at the start

    A state is that of the attitude and (x−x(0))/a.
    """

    attitude: Any
    radius: float
    contact: Array
    size: float

    @property
    def time_unit(self) -> float:  # type: ignore[override]
        """Return the unit of time of the attitude."""
        return float(self.attitude.time_unit)

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start as a state."""
        return np.concatenate([self.attitude.initial, np.zeros(self.contact.size)])

    @property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return those of the attitude."""
        return np.asarray(self.attitude.parameters)

    @property
    def structure(self) -> Hashable | None:
        """Return what determines the field besides its parameters."""
        return type(self), self.attitude.structure

    def _frame(self, attitude: Any) -> Any:
        """Return E of a state of the attitude, or of its derivative."""
        n = self.contact.size + 1
        return attitude[-n * n :].reshape(n, n)

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return the derivatives of the attitude and of the contact point."""
        attitude = state[: -self.contact.size]
        rate = self.attitude.field(attitude, parameters, ops)
        horizontal = self._frame(attitude)[:, 1:]
        return np.concatenate([rate, -ops.dot(horizontal.T, self._frame(rate)[:, 0])])

    def project(self, state: Array) -> Array:
        """Return states with the attitude back on its manifold."""
        attitude, path = np.split(state, [-self.contact.size], axis=-1)
        return np.concatenate([self.attitude.project(attitude), path], axis=-1)

    def neighbour(self, distance: float) -> RollingFlow:
        """Return the flow of a start whose attitude is moved by about ``distance``."""
        return replace(self, attitude=self.attitude.neighbour(distance))

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return the series of the attitude, and position."""
        attitude, path = np.split(states, [-self.contact.size], axis=-1)
        position = self.contact + self.radius * path
        return {**self.attitude.unpack(attitude), "position": position}


@dataclass(frozen=True)
class AttitudeFlow(MomentumInSpace):
    """The attitude of a ball in ℝⁿ without momentum in so(n−1): ė_i = −ωe_i with

        ω_ij = s_ij(q∧ξ)_ij,    ξ = [x⁻¹p − (p,x⁻¹q)q]/(q,xq),

    and p = E·momentum, fixed in space.

    - shares: (n, n) s, symmetric
    - roots: (n,) x

    All of them are in scaled units; the first entry of the momentum Eᵀp is zero.
    """

    shares: Array
    roots: Array
    time_unit: float

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return x, 1/x and s."""
        return np.concatenate([self.roots, 1 / self.roots, self.shares.ravel()])

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return zero and Ė = −ωE."""
        n = self.roots.size
        E = state[n:].reshape(n, n)
        x, inverse, shares = np.split(parameters, [n, 2 * n])
        q = E[:, 0]
        free = inverse * ops.dot(E, state[:n])
        xi = (free - ops.dot(free, q) * q) / ops.dot(q, x * q)
        omega = shares.reshape(n, n) * (np.outer(q, xi) - np.outer(xi, q))
        return np.concatenate([state[:n] * 0, -ops.dot(omega, E).ravel()])

    @property
    def _sizes(self) -> Array:
        sizes = np.full(self.roots.size, float(np.linalg.norm(self.momentum)))
        sizes[0] = 0.0
        return sizes

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return the frame of states put back on the manifold."""
        n = self.roots.size
        return {"frame": self.project(states)[:, n:].reshape(-1, n, n)}
