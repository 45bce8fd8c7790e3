"""Balls that roll: the attitude with the quadrature of the contact point, and the ball with its
contact forces as Lagrange multipliers.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import FLOATS, Flow, Operations
from veselova.mechanics.flows.rigid_body_flow import cross
from veselova.mechanics.geometry.natural_frame import orthonormalize

__all__ = ["ChaplyginFlow", "ContactForceFlow", "RollingFlow"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RollingFlow(Flow):
    """A flow of the attitude, and the contact point by ẋ_k = −a(e_k, q̇), q = e_1.

    - attitude: a flow whose state ends with the frame E, row-major, or with g = Eᵀ
    - radius: a
    - contact: (n−1,) the contact point at the start
    - transposed: whether it ends with g

    A state is that of the attitude and (x−x(0))/a.
    """

    attitude: Any
    radius: float
    contact: Array
    size: float
    transposed: bool = False

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
        inner = self.attitude.structure
        return None if inner is None else (type(self), self.transposed, inner)

    @cached_property
    def _length(self) -> int:
        return int(self.attitude.initial.size)

    def _frame(self, state: Any) -> Any:
        """Return E of a state of the attitude, or of its derivative."""
        n = self.contact.size + 1
        matrix = state[self._length - n * n :].reshape(n, n)
        return matrix.T if self.transposed else matrix

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return the derivatives of the attitude and of the contact point."""
        rate = self.attitude.field(state[: self._length], parameters, ops)
        horizontal = self._frame(state[: self._length])[:, 1:]
        return np.concatenate([rate, -ops.dot(horizontal.T, self._frame(rate)[:, 0])])

    def project(self, state: Array) -> Array:
        """Return states with the attitude back on its manifold."""
        attitude = self.attitude.project(state[..., : self._length])
        return np.concatenate([attitude, state[..., self._length :]], axis=-1)

    def neighbour(self, distance: float) -> RollingFlow:
        """Return the flow of a start whose attitude is moved by about ``distance``."""
        return replace(self, attitude=self.attitude.neighbour(distance))

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return the series of the attitude, and position."""
        series: dict[str, Array] = self.attitude.unpack(states[:, : self._length])
        return {**series, "position": self.contact + self.radius * states[:, self._length :]}


@dataclass(frozen=True)
class ChaplyginFlow(Flow):
    """The attitude of Chaplygin's ball: ė_i = e_i×Ω with Ω = B(K + σγ), B = J⁻¹, σ =
    D(BK,γ)/(Bγ,Iγ), and the momentum EᵀK constant in space.

    Without cancellation where D is large, D(BK,γ) = (K,γ) − (IBK,γ) and 1 − D(Bγ,γ) = (Bγ,Iγ).

    - inertia, inverse: I and B, (3, 3)
    - momentum: EᵀK
    - frame: the start

    All of them are in scaled units. A state is the momentum and the frame, row-major, of length 12.
    """

    inertia: Array
    inverse: Array
    momentum: Array
    frame: Array
    time_unit: float

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start as a state."""
        return np.concatenate([self.momentum, self.frame.ravel()])

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return B and I."""
        return np.concatenate([self.inverse.ravel(), self.inertia.ravel()])

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return zero and Ė."""
        E = state[3:].reshape(3, 3)
        Omega = self._angular_velocity(state[:3], E, parameters, ops)
        frame_dot = np.stack([cross(E[:, k], Omega) for k in range(3)], axis=1)
        return np.concatenate([state[:3] * 0, frame_dot.ravel()])

    def _angular_velocity(self, momentum: Any, E: Any, parameters: Any, ops: Operations) -> Any:
        gamma = E[:, 0]
        inverse = parameters[:9].reshape(3, 3)
        Omega = ops.dot(inverse, ops.dot(E, momentum))
        across = ops.dot(inverse, gamma)
        turning = ops.dot(parameters[9:].reshape(3, 3), gamma)
        share = (momentum[0] - ops.dot(Omega, turning)) / ops.dot(across, turning)
        return Omega + share * across

    def project(self, state: Array) -> Array:
        """Return states (..., 12) with orthonormal frames."""
        E = orthonormalize(state[..., 3:].reshape(*state.shape[:-1], 3, 3))
        return np.concatenate([state[..., :3], E.reshape(*E.shape[:-2], 9)], axis=-1)

    def neighbour(self, distance: float) -> ChaplyginFlow:
        """Return the flow of a start moved by about ``distance``."""
        frame, direction = _moved(self.frame, distance)
        Omega = self._angular_velocity(self.momentum, self.frame, self.parameters, FLOATS)
        sizes = np.full(3, float(np.linalg.norm(self.momentum)))
        sizes[0] = float(np.linalg.norm(self.inertia @ Omega))  # (K,γ) = (IΩ,γ)
        return replace(self, momentum=self.momentum + distance * sizes * direction, frame=frame)

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return Omega and frame of states put back on the manifold."""
        states = self.project(states)
        frames = states[:, 3:].reshape(-1, 3, 3)
        Omega = [
            self._angular_velocity(k, E, self.parameters, FLOATS)
            for k, E in zip(states[:, :3], frames, strict=True)
        ]
        return {"Omega": np.array(Omega) / self.time_unit, "frame": frames}


@dataclass(frozen=True)
class ContactForceFlow(Flow):
    """The ball itself: IΩ̇ = IΩ×Ω + torques and mv̇ = force, with the constraints v_k = a(Ω×γ, e_k)
    and, where it may not twist, (Ω,γ) = const, kept by multipliers.

    - inertia: (3, 3) about the centre
    - added: ma²
    - Omega, frame: the start, all in scaled units
    - radius, contact: in the problem's units
    - twists: whether the ball is free to twist

    A state is Ω, v/a, the frame and (x−x(0))/a, of length 16. With b_k = γ×e_k, fixed in space, the
    constraints are v_k/a = (Ω, b_k), whose derivatives have no further term, since (Ω, b_k×Ω) = 0.
    """

    inertia: Array
    added: float
    Omega: Array
    frame: Array
    radius: float
    contact: Array
    time_unit: float
    twists: bool
    size: float

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start as a state."""
        return np.concatenate(
            [self.Omega, self._velocity(self.Omega, self.frame), self.frame.ravel(), np.zeros(2)]
        )

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return I, I⁻¹ and ma²."""
        inverse = np.linalg.inv(self.inertia)
        return np.concatenate([self.inertia.ravel(), inverse.ravel(), [self.added]])

    @property
    def structure(self) -> Hashable | None:
        """Return what determines the field besides its parameters."""
        return type(self), self.twists

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (Ω̇, v̇/a, Ė, ẋ/a): accelerations M⁻¹(F + Gᵀλ) with GM⁻¹Gᵀλ = −GM⁻¹F."""
        Omega = state[:3]
        E = state[5:14].reshape(3, 3)
        inertia = parameters[:9].reshape(3, 3)
        inverse = parameters[9:18].reshape(3, 3)
        gamma = E[:, 0]
        rows = [-cross(gamma, E[:, 1]), -cross(gamma, E[:, 2])]
        if not self.twists:
            rows.append(gamma)
        turning = np.stack(rows)
        free = ops.dot(inverse, cross(ops.dot(inertia, Omega), Omega))
        across = ops.dot(turning, inverse)
        normal = ops.dot(across, turning.T)
        mobility = np.zeros(normal.shape, dtype=normal.dtype)
        for k in range(2):
            mobility[k, k] = 1 / parameters[18]
        forces = ops.solve(normal + mobility, -ops.dot(turning, free))
        Omega_dot = free + ops.dot(across.T, forces)
        frame_dot = np.stack([cross(E[:, k], Omega) for k in range(3)], axis=1)
        return np.concatenate(
            [Omega_dot, forces[:2] / parameters[18], frame_dot.ravel(), state[3:5]]
        )

    def _velocity(self, Omega: Array, E: Array) -> Array:
        across = np.cross(Omega, E[..., 0])
        return np.asarray(np.einsum("...i,...ik->...k", across, E[..., 1:]))

    def project(self, state: Array) -> Array:
        """Return states (..., 16) with orthonormal frames and velocities that obey the
        constraints.
        """
        E = orthonormalize(state[..., 5:14].reshape(*state.shape[:-1], 3, 3))
        Omega = state[..., :3]
        if not self.twists:
            Omega = self._on_constraint(Omega, E[..., 0])
        flat = E.reshape(*E.shape[:-2], 9)
        return np.concatenate([Omega, self._velocity(Omega, E), flat, state[..., 14:]], axis=-1)

    def _on_constraint(self, Omega: Array, gamma: Array) -> Array:
        """Return Ω with the start's value of (Ω,γ)."""
        lack = self.Omega @ self.frame[:, 0] - np.sum(Omega * gamma, axis=-1)
        return np.asarray(Omega + lack[..., None] * gamma)

    def neighbour(self, distance: float) -> ContactForceFlow:
        """Return the flow of a start moved by about ``distance``; (Ω,γ) keeps its value."""
        E, direction = _moved(self.frame, distance)
        size = max(1.0, float(np.linalg.norm(self.Omega)))
        Omega = self._on_constraint(self.Omega + distance * size * direction, E[:, 0])
        return replace(self, Omega=Omega, frame=E)

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return Omega, frame and position of states put back on the manifold."""
        states = self.project(states)
        return {
            "Omega": states[:, :3] / self.time_unit,
            "frame": states[:, 5:14].reshape(-1, 3, 3),
            "position": self.contact + self.radius * states[:, 14:],
        }


def _moved(frame: Array, distance: float) -> tuple[Array, Array]:
    """Return a frame turned by about ``distance``, and a direction in which a vector is moved."""
    direction = np.random.default_rng(12).normal(size=6) / np.sqrt(3)
    turn = np.stack([np.cross(e, direction[:3]) for e in frame.T], axis=1)
    return orthonormalize(frame + distance * turn), direction[3:]
