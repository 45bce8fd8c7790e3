"""Balls that roll on a hyperplane of ℝⁿ, n ≥ 4: the attitude of Chaplygin's, and any ball with its
contact forces as Lagrange multipliers.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.inertia_operator import Inertia
from veselova.mechanics.core.flow import Flow, Operations
from veselova.mechanics.flows.lr_flow import LARGEST_SYMBOLIC, LRFlow, MomentumFlow, MultiplierFlow
from veselova.mechanics.geometry.natural_frame import orthonormalize
from veselova.mechanics.groups.distribution import Distribution, combine

__all__ = ["ChaplyginFlowN", "ContactForceFlowN", "attitude_flow"]

Array = NDArray[np.float64]


def attitude_flow(
    J: Array, omega: Array, frame: Array, time_unit: float, formulation: str
) -> LRFlow:
    """Return the flow of the attitude of a ball that may not twist, an LR system of rank one.

    - J: (D,) the moments I_ij + ma² in any unit
    - omega: (D,) at the start, in radians per ``time_unit``
    """
    distribution = Distribution.of_rank(len(frame), 1)
    inertia = Inertia(J, 1 / J).rescale()
    g = np.ascontiguousarray(frame.T)
    along, across = distribution.components(g, inertia(omega))
    kind = MomentumFlow if formulation == "momentum" else MultiplierFlow
    return kind(distribution, inertia, None, time_unit, g, along, 0 * across, True)


@dataclass(frozen=True)
class ChaplyginFlowN(Flow):
    """The attitude of Chaplygin's ball without momentum in so(n−1): ė_i = −ωe_i with

        ω = (xq∧xξ)/D − q∧ξ,    ξ = [x⁻¹p − (p,x⁻¹q)q]/(q,xq),    J_ij = x_ix_j,

    and p = E·momentum, fixed in space.

    - roots: (n,) x
    - added: D = ma²
    - momentum: (n,) Eᵀp; its first entry is zero
    - frame: the start

    All of them are in scaled units. A state is the momentum and the frame, row-major.
    """

    roots: Array
    added: float
    momentum: Array
    frame: Array
    time_unit: float

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start as a state."""
        return np.concatenate([self.momentum, self.frame.ravel()])

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return x, 1/x and D."""
        return np.concatenate([self.roots, 1 / self.roots, [self.added]])

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return zero and Ė = −ωE."""
        n = self.roots.size
        E = state[n:].reshape(n, n)
        x, inverse, D = parameters[:n], parameters[n : 2 * n], parameters[2 * n]
        q = E[:, 0]
        p = ops.dot(E, state[:n])
        xq = x * q
        free = inverse * p
        xi = (free - ops.dot(free, q) * q) / ops.dot(q, xq)
        x_xi = x * xi
        frame_dot = np.outer(q, ops.dot(xi, E)) - np.outer(xi, ops.dot(q, E))
        of_J = np.outer(xq, ops.dot(x_xi, E)) - np.outer(x_xi, ops.dot(xq, E))
        return np.concatenate([state[:n] * 0, (frame_dot - of_J / D).ravel()])

    def project(self, state: Array) -> Array:
        """Return states with orthonormal frames."""
        n = self.roots.size
        E = orthonormalize(state[..., n:].reshape(*state.shape[:-1], n, n))
        return np.concatenate([state[..., :n], E.reshape(*E.shape[:-2], n * n)], axis=-1)

    def neighbour(self, distance: float) -> ChaplyginFlowN:
        """Return the flow of a start moved by about ``distance``."""
        direction = np.random.default_rng(13).normal(size=(self.roots.size + 1, self.roots.size))
        direction /= np.sqrt(self.roots.size)
        kick = distance * float(np.linalg.norm(self.momentum)) * direction[-1]
        kick[0] = 0.0
        frame = orthonormalize(self.frame + distance * direction[:-1])
        return replace(self, momentum=self.momentum + kick, frame=frame)

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return the frame of states put back on the manifold."""
        n = self.roots.size
        return {"frame": self.project(states)[:, n:].reshape(-1, n, n)}


@dataclass(frozen=True)
class ContactForceFlowN(Flow):
    """The ball itself: Iω̇ = [Iω,ω] + torques and mv̇ = force, with the constraints v_k = a(e_k, ωq)
    and, where it may not twist, ⟨ω, e_i∧e_j⟩ = 0 for i, j ≥ 2, kept by multipliers.

    - inertia: (D,) I_ij about the centre
    - added: ma²
    - omega, g: the start, g = Eᵀ, all in scaled units
    - radius, contact: in the problem's units
    - twists: whether the ball is free to twist

    A state is ω, v/a, g and (x−x(0))/a. The constraints are v_k/a = −⟨ω, e_1∧e_k⟩: e_i∧e_j is fixed
    in space, so that their derivatives have no further term.
    """

    inertia: Array
    added: float
    omega: Array
    g: Array
    radius: float
    contact: Array
    time_unit: float
    twists: bool
    size: float

    @cached_property
    def _distribution(self) -> Distribution:
        return Distribution.of_rank(len(self.g), 1)

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start as a state."""
        velocity = -self._distribution.components(self.g, self.omega)[0]
        return np.concatenate([self.omega, velocity, self.g.ravel(), np.zeros(self.contact.size)])

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return I, I⁻¹ and ma²."""
        return np.concatenate([self.inertia, 1 / self.inertia, [self.added]])

    @property
    def structure(self) -> Hashable | None:
        """Return what determines the field besides its parameters."""
        if self.omega.size > LARGEST_SYMBOLIC:
            return None
        return type(self), self.twists, self.omega.size

    def _split(self, state: Any) -> tuple[Any, Any, Any, Any]:
        n = len(self.g)
        first = self.omega.size
        second = first + n - 1
        third = second + n * n
        g = state[..., second:third].reshape((*state.shape[:-1], n, n))
        return state[..., :first], state[..., first:second], g, state[..., third:]

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (ω̇, v̇/a, ġ, ẋ/a): accelerations M⁻¹(F + Gᵀλ) with GM⁻¹Gᵀλ = −GM⁻¹F."""
        omega, velocity, g, _ = self._split(state)
        group = self._distribution.group
        D = omega.size
        inertia, inverse, added = parameters[:D], parameters[D : 2 * D], parameters[2 * D]
        free = inverse * group.bracket(inertia * omega, omega, ops)
        rolling, turning = self._distribution.in_body(g, ops)
        rows = rolling if self.twists else np.concatenate([rolling, turning])
        across = rows * inverse
        normal = ops.dot(across, rows.T)
        mobility = np.zeros(normal.shape, dtype=normal.dtype)
        for k in range(len(rolling)):
            mobility[k, k] = 1 / added
        forces = ops.solve(normal + mobility, -ops.dot(rows, free[:, None]))[:, 0]
        omega_dot = free + combine(forces, across, ops)
        g_dot = ops.dot(g, group.element(omega, ops))
        return np.concatenate([omega_dot, forces[: len(rolling)] / added, g_dot.ravel(), velocity])

    def project(self, state: Array) -> Array:
        """Return states with orthonormal frames and velocities that obey the constraints."""
        omega, _, g, path = self._split(state)
        g = self._distribution.group.project(g)
        along, across = self._distribution.components(g, omega)
        if not self.twists:
            omega = self._distribution.body(g, along, 0 * across)
        return np.concatenate([omega, -along, g.reshape(*g.shape[:-2], -1), path], axis=-1)

    def neighbour(self, distance: float) -> ContactForceFlowN:
        """Return the flow of a start moved by about ``distance``."""
        rng = np.random.default_rng(14)
        n = len(self.g)
        turn = distance * rng.normal(size=self.omega.size) / np.sqrt(n)
        group = self._distribution.group
        g = group.project(self.g + self.g @ group.element(turn))
        size = max(1.0, float(np.linalg.norm(self.omega)))
        omega = self.omega + distance * size * rng.normal(size=self.omega.size) / np.sqrt(n)
        if not self.twists:
            along, across = self._distribution.components(g, omega)
            omega = self._distribution.body(g, along, 0 * across)
        return replace(self, omega=omega, g=g)

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return omega, frame and position of states put back on the manifold."""
        omega, _, g, path = self._split(self.project(states))
        return {
            "omega": self._distribution.group.element(omega) / self.time_unit,
            "frame": np.ascontiguousarray(np.swapaxes(g, -1, -2)),
            "position": self.contact + self.radius * path,
        }
