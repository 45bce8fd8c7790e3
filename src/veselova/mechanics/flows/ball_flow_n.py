"""The attitudes of balls that roll on a hyperplane of ℝⁿ, n ≥ 4."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.inertia_operator import Inertia
from veselova.mechanics.core.flow import Flow, Operations
from veselova.mechanics.flows.lr_flow import LRFlow, MomentumFlow, MultiplierFlow
from veselova.mechanics.geometry.natural_frame import orthonormalize
from veselova.mechanics.groups.distribution import Distribution

__all__ = ["ChaplyginFlowN", "attitude_flow"]

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
