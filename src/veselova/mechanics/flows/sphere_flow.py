"""A ball that rolls over a fixed sphere without slipping and twisting: γ, its momentum, and the
frame of space seen from the body.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import FLOATS, Flow, Operations
from veselova.mechanics.geometry.natural_frame import orthonormalize

__all__ = ["SphereFlow"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SphereFlow(Flow):
    """With ω = γ∧v and (Jω)_ij = x_ix_jω_ij,

        γ̇ = εv,    ṗ = −ωp + (1−ε)(Jω)v,    ė_k = −ωe_k,    v = [x⁻¹p − (p,x⁻¹γ)γ]/(γ,xγ)

    for p = −(Jω)γ: ε = 1 is the plane, where p is fixed in space. A state is (p, γ, E).

    - roots: (n,) x; epsilon: ε
    - gamma, velocity: (n,) γ and v at the start
    - frame: (n, n) the start, all of them in scaled units
    """

    roots: Array
    epsilon: float
    gamma: Array
    velocity: Array
    frame: Array
    time_unit: float

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return x, 1/x and ε."""
        return np.concatenate([self.roots, 1 / self.roots, [self.epsilon]])

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start as a state."""
        q, v, x = self.gamma, self.velocity, self.roots
        p = (q @ (x * q)) * (x * v) - (v @ (x * q)) * (x * q)
        return np.concatenate([p, q, self.frame.ravel()])

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return the derivatives of p, γ and E."""
        n = self.roots.size
        p, q, E = state[:n], state[n : 2 * n], state[2 * n :].reshape(n, n)
        epsilon = parameters[2 * n]
        v, xq = self._velocity(p, q, parameters, ops)
        xv = parameters[:n] * v
        moved = (1.0 - epsilon) * (ops.dot(xv, v) * xq - ops.dot(xq, v) * xv)
        turned = ops.dot(q, p) * v - ops.dot(v, p) * q
        columns = np.outer(v, ops.dot(q, E)) - np.outer(q, ops.dot(v, E))
        return np.concatenate([turned + moved, epsilon * v, columns.ravel()])

    def _velocity(self, p: Any, q: Any, parameters: Any, ops: Operations) -> tuple[Any, Any]:
        """Return v and xγ."""
        n = self.roots.size
        free, xq = parameters[n : 2 * n] * p, parameters[:n] * q
        along = ops.dot(free, q) / ops.dot(q, q)
        return (free - along * q) / ops.dot(q, xq), xq

    def project(self, state: Array) -> Array:
        """Return the state with γ of length one, p across it, E orthonormal, and the energy ½(p,v)
        of the start.
        """
        n = self.roots.size
        p, q, E = np.split(state, [n, 2 * n])
        q = q / np.linalg.norm(q)
        p = p - (p @ q) * q
        energy = p @ self._velocity(p, q, self.parameters, FLOATS)[0]
        p = p * np.sqrt((self.initial[:n] @ self.velocity) / energy)
        return np.concatenate([p, q, orthonormalize(E.reshape(n, n)).ravel()])

    def neighbour(self, distance: float) -> SphereFlow:
        """Return the flow of a start moved by about ``distance``."""
        n = self.roots.size
        moves = distance * np.random.default_rng(17).normal(size=(n + 2, n)) / np.sqrt(n)
        q = self.gamma + moves[0]
        q = q / np.linalg.norm(q)
        v = self.velocity + moves[1]
        frame = orthonormalize(self.frame + moves[2:])
        return replace(self, gamma=q, velocity=v - (v @ q) * q, frame=frame)

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return γ, v and the frame of states put back on the manifold, along the principal axes;
        the energy is that of the start.
        """
        n = self.roots.size
        states = np.array([self.project(state) for state in states])
        p, q, E = np.split(states, [n, 2 * n], axis=1)
        v = [self._velocity(*pair, self.parameters, FLOATS)[0] for pair in zip(p, q, strict=True)]
        frames = E.reshape(-1, n, n)
        return {"gamma": q, "velocity": np.array(v) / self.time_unit, "frame": frames}
