"""A ball that rolls over a fixed sphere without slipping and twisting: γ, its momentum, and the
frame of space seen from the body.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import FLOATS, Operations, PointFlow
from veselova.mechanics.geometry.natural_frame import orthonormalize

__all__ = ["SphereFlow"]

Array = NDArray[np.float64]


class SphereFlow(PointFlow):
    """With ω = γ∧v and (Jω)_ij = x_ix_jω_ij,

        γ̇ = εv,    ṗ = −ωp + (1−ε)(Jω)v,    ė_k = −ωe_k,    v = [x⁻¹p − (p,x⁻¹γ)γ]/(γ,xγ)

    for p = −(Jω)γ: ε = 1 is the plane, where p is fixed in space. Flat states (p, γ, E);
    parameters x, 1/x and ε.
    """

    lists: ClassVar[int] = 2
    further: ClassVar[int] = 1

    @classmethod
    def of(
        cls, x: Array, epsilon: float, q: Array, v: Array, frame: Array, time_unit: float
    ) -> SphereFlow:
        """Return the flow of a start (γ, v, E) in scaled units."""
        p = (q @ (x * q)) * (x * v) - (v @ (x * q)) * (x * q)
        parameters = np.concatenate([x, 1 / x, [epsilon]])
        return cls(parameters, time_unit, np.concatenate([p, q, frame.ravel()]))

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return the derivatives of p, γ and E."""
        n = self.n
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
        n = self.n
        free, xq = parameters[n : 2 * n] * p, parameters[:n] * q
        along = ops.dot(free, q) / ops.dot(q, q)
        return (free - along * q) / ops.dot(q, xq), xq

    def _on_manifold(self, states: Array) -> tuple[Array, Array, Array]:
        """Return p across γ, γ of length one, and E orthonormal."""
        n = self.n
        p, q, E = np.split(states, [n, 2 * n], axis=-1)
        q = q / np.linalg.norm(q, axis=-1, keepdims=True)
        p = p - np.sum(p * q, axis=-1, keepdims=True) * q
        return p, q, orthonormalize(E.reshape(*E.shape[:-1], n, n))

    def _twice_energy(self, p: Array, q: Array) -> Any:
        return p @ self._velocity(p, q, self.parameters, FLOATS)[0]

    def project(self, state: Array) -> Array:
        """Return the state on the manifold with the energy ½(p,v) of the start."""
        p, q, E = self._on_manifold(state)
        of_start = self._twice_energy(*np.split(self.initial[: 2 * self.n], 2))
        p = p * np.sqrt(of_start / self._twice_energy(p, q))
        return np.concatenate([p, q, E.ravel()])

    def neighbour(self, distance: float) -> SphereFlow:
        """Return the flow of a start moved by about ``distance``."""
        n = self.n
        direction = np.random.default_rng(17).normal(size=self.initial.size) / np.sqrt(n)
        direction[:n] *= np.linalg.norm(self.initial[:n])
        moved = self._on_manifold(self.initial + distance * direction)
        return replace(self, initial=np.concatenate([part.ravel() for part in moved]))

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return γ, v and the frame along the principal axes, with the energy of the start."""
        p, q, E = self._on_manifold(np.array([self.project(state) for state in states]))
        v = [self._velocity(*pair, self.parameters, FLOATS)[0] for pair in zip(p, q, strict=True)]
        return {"gamma": q, "velocity": np.array(v) / self.time_unit, "frame": E}
