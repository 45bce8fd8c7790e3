"""Equation (4.7, printed 6.16) with the frame carried along, ė = −(q∧q')e: Neumann's system in its
own time; and geodesics of an ellipsoid in ℝⁿ, with the normals of the touching quadrics carried
along.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Operations, PointFlow, restoring_step
from veselova.mechanics.geometry.natural_frame import orthonormalize

__all__ = ["GeodesicFlow", "NeumannFlow"]

Array = NDArray[np.float64]


class NeumannFlow(PointFlow):
    """Neumann's system for flat states (q', E), q the first column of the frame E; parameters are
    the I_i.
    """

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (q'', E'), with λ divided by (q,q): off the sphere the motion is then not
        unstable.
        """
        n = self.n
        v, E = state[:n], state[n:].reshape(n, n)
        q = E[:, 0]
        multiplier = (ops.dot(parameters * q, q) - ops.dot(v, v)) / ops.dot(q, q)
        rotated = np.outer(v, ops.dot(q, E)) - np.outer(q, ops.dot(v, E))
        return np.concatenate([multiplier * q - parameters * q, rotated.ravel()])

    def project(self, state: Array) -> Array:
        """Return the state with E orthonormal, q' tangent, and, by one step along its gradient, the
        energy of the start.
        """
        v, E = self._on_sphere(state)
        v_start, E_start = self._on_sphere(self.initial)
        q = E[:, 0]
        energy = self._energy(q, v)
        force = self.parameters * q - (q @ (self.parameters * q)) * q
        excess = energy - self._energy(E_start[:, 0], v_start)
        step = restoring_step(excess, force @ force + v @ v, energy)
        E = np.column_stack([q - step * force, E[:, 1:]])
        return self._state(v - step * v, E)

    def _energy(self, q: Array, v: Array) -> Array:
        return np.asarray(v @ v + q @ (self.parameters * q)) / 2

    def neighbour(self, distance: float) -> NeumannFlow:
        """Return the flow of a start moved by about ``distance``."""
        n = self.n
        direction = np.random.default_rng(n).normal(size=(2, n)) / np.sqrt(n)
        v, E = self.initial[:n], self.initial[n:].reshape(n, n).copy()
        E[:, 0] += distance * direction[0]
        v = v + distance * max(float(np.linalg.norm(v)), 1.0) * direction[1]
        return replace(self, initial=self._state(v, E))

    def _state(self, v: Array, E: Array) -> Array:
        """Return the state with q' tangent and the frame orthonormal, its first column along q."""
        v, E = self._on_sphere(np.concatenate([v, E.ravel()]))
        return np.concatenate([v, E.ravel()])

    def _on_sphere(self, states: Array) -> tuple[Array, Array]:
        n = self.n
        v, E = states[..., :n], states[..., n:].reshape(*states.shape[:-1], n, n)
        q = E[..., :1] / np.linalg.norm(E[..., :1], axis=-2, keepdims=True)
        rest = E[..., 1:] - q @ (np.swapaxes(q, -1, -2) @ E[..., 1:])
        E = orthonormalize(np.concatenate([q, rest], axis=-1))
        q = E[..., 0]
        return v - np.sum(q * v, axis=-1, keepdims=True) * q, E

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return the frame and q_dot = dq/dτ₁ along the principal axes."""
        v, E = self._on_sphere(states)
        return {"q_dot": v / self.time_unit, "frame": E}


class GeodesicFlow(PointFlow):
    """X'' = −(V,A⁻¹V)/(X,A⁻²X) A⁻¹X, V = X', with N' = −(q∧dq/ds)N (norms, printed 7.8) for N =
    (n_2 … n_{n−1}), and dτ₁/ds (knorrer, printed 7.2).

    Flat states (X, V, N, τ₁) in units of the longest semiaxis; parameters are the I_i in these
    units.
    """

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return d(X, V, N, τ₁)/ds."""
        n = parameters.size
        X = state[:n]
        V = state[n : 2 * n]
        N = state[2 * n : -1].reshape(n, n - 2)
        # along q and dq
        u = parameters * X
        w = parameters * V
        uu = ops.dot(u, u)
        VIV = ops.dot(V, w)
        derivative = np.empty_like(state)
        derivative[:n] = V
        derivative[n : 2 * n] = -(VIV / uu) * u
        if n > 2:
            derivative[2 * n : -1] = (
                np.outer(w / uu, ops.dot(u, N)) - np.outer(u / uu, ops.dot(w, N))
            ).ravel()
        derivative[-1] = ops.sqrt(VIV / uu) * ops.dot(X, u)
        return derivative

    def project(self, state: Array) -> Array:
        """Return the state with X on the ellipsoid, V a unit tangent, N orthonormal and orthogonal
        to V and the normal.
        """
        n = self.n
        E = self._frames(state[None])[0]
        X = state[:n] / np.sqrt(state[:n] @ (self.parameters * state[:n]))
        return np.concatenate([X, E[:, -1], E[:, 1:-1].ravel(), state[-1:]])

    def neighbour(self, distance: float) -> GeodesicFlow:
        """Return the flow of a start moved by about ``distance``."""
        direction = np.random.default_rng(self.n).normal(size=self.initial.size) / np.sqrt(self.n)
        direction[-1] = 0.0
        return replace(self, initial=self.project(self.initial + distance * direction))

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return frame and tau1."""
        return {"frame": self._frames(states), "tau1": states[:, -1] * self.time_unit}

    def _frames(self, states: Array) -> Array:
        """Return [q, n_2 … n_{n−1}, V], orthonormal, shape (N, n, n)."""
        n = self.n
        normal = self.parameters * states[:, :n]
        q = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        V = states[:, n : 2 * n] - np.sum(states[:, n : 2 * n] * q, axis=1, keepdims=True) * q
        V = V / np.linalg.norm(V, axis=1, keepdims=True)
        N = states[:, 2 * n : -1].reshape(len(states), n, n - 2)
        pair = np.stack([q, V], axis=2)
        N = N - pair @ (np.swapaxes(pair, 1, 2) @ N)
        return orthonormalize(np.concatenate([q[:, :, None], N, V[:, :, None]], axis=2))
