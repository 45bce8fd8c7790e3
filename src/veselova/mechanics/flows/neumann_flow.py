"""Equation (4.7, printed 6.16) with the frame carried along, ė = −(q∧q')e: Neumann's system in its
own time, and a geodesic's in arc length.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Operations, PointFlow, restoring_step
from veselova.mechanics.geometry.integrals_of_motion import neumann_velocity
from veselova.mechanics.geometry.natural_frame import orthonormalize

__all__ = ["GaussFlow", "NeumannFlow"]

Array = NDArray[np.float64]


class NeumannFlow(PointFlow):
    """Neumann's system for flat states (q', E), q the first column of the frame E; parameters are
    the I_i.
    """

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (q'', E')."""
        return _neumann_field(state, parameters, ops)

    def project(self, state: Array) -> Array:
        """Return the state with E orthonormal, q' tangent, and, by one step along its gradient, the
        energy of the start.
        """
        (v, E), (v_start, E_start) = _on_sphere(state, self.n), _on_sphere(self.initial, self.n)
        q = E[:, 0]
        energy = self._energy(q, v)
        force = self.parameters * q - (q @ (self.parameters * q)) * q
        step = restoring_step(
            energy - self._energy(E_start[:, 0], v_start), force @ force + v @ v, energy
        )
        E = np.column_stack([q - step * force, E[:, 1:]])
        return np.concatenate(_flat(_on_sphere(np.concatenate([v - step * v, E.ravel()]), self.n)))

    def _energy(self, q: Array, v: Array) -> Array:
        return np.asarray(v @ v + q @ (self.parameters * q)) / 2

    def neighbour(self, distance: float) -> NeumannFlow:
        """Return the flow of a start moved by about ``distance``."""
        moved = _on_sphere(_perturb(self.initial, distance, self.n), self.n)
        return replace(self, initial=np.concatenate(_flat(moved)))

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return the frame and q_dot = dq/dτ₁ along the principal axes."""
        v, E = _on_spheres(states, self.n)
        return {"q_dot": v / self.time_unit, "frame": E}


class GaussFlow(PointFlow):
    """A geodesic on the ellipsoid through its unit normal q (Theorem Kno): states (q', E, τ₁) in
    arc length.

    dτ₁/ds = √J (q,Aq); parameters are the I_i, the A_i and √J, in units of the longest semiaxis.
    """

    lists: ClassVar[int] = 2
    further: ClassVar[int] = 1

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return d(q', E, τ₁)/ds."""
        n = self.n
        q = state[n:-1].reshape(n, n)[:, 0]
        rate = parameters[-1] * ops.dot(parameters[n:-1] * q, q)
        derivative = np.empty_like(state)
        derivative[:-1] = rate * _neumann_field(state[:-1], parameters[:n], ops)
        derivative[-1] = rate
        return derivative

    def project(self, state: Array) -> Array:
        """Return the state with E orthonormal, q' tangent and F_0 = 0, equation (4.8)."""
        v, E = _on_sphere(state[:-1], self.n)
        v = neumann_velocity(self.parameters[self.n : -1], E[:, 0], v)
        return np.concatenate([*_flat((v, E)), state[-1:]])

    def neighbour(self, distance: float) -> GaussFlow:
        """Return the flow of a start moved by about ``distance``, and √J, a datum of its own here,
        by half of it.
        """
        initial = self.project(np.append(_perturb(self.initial[:-1], distance, self.n), 0.0))
        side = 1 if self.n % 2 else -1  # either would do, and not always the same one
        root_J = self.parameters[-1] * (1 + side * distance / 2)
        return replace(self, initial=initial, parameters=np.append(self.parameters[:-1], root_J))

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return frame and tau1."""
        _, E = _on_spheres(states[:, :-1], self.n)
        return {"frame": E, "tau1": states[:, -1] * self.time_unit}


def _neumann_field(state: Any, inverse: Any, ops: Operations) -> Any:
    """Return (q'', E'), with λ divided by (q,q): off the sphere the motion is then not unstable."""
    n = inverse.size
    v = state[:n]
    E = state[n:].reshape(n, n)
    q = E[:, 0]
    multiplier = (ops.dot(inverse * q, q) - ops.dot(v, v)) / ops.dot(q, q)
    rotated = np.outer(v, ops.dot(q, E)) - np.outer(q, ops.dot(v, E))
    return np.concatenate([multiplier * q - inverse * q, rotated.ravel()])


def _perturb(state: Array, distance: float, n: int) -> Array:
    """Return a state (a vector, then a frame) whose vector and first column are moved by about
    ``distance``.
    """
    direction = np.random.default_rng(n).normal(size=(2, n)) / np.sqrt(n)
    size = max(float(np.linalg.norm(state[:n])), 1.0)
    E = state[n:].reshape(n, -1).copy()
    E[:, 0] += distance * direction[0]
    return np.concatenate([state[:n] + distance * size * direction[1], E.ravel()])


def _on_sphere(state: Array, n: int) -> tuple[Array, Array]:
    """Return q' tangent and the frame orthonormal, its first column along q."""
    v, E = _on_spheres(state[None], n)
    return v[0], E[0]


def _on_spheres(states: Array, n: int) -> tuple[Array, Array]:
    v = states[:, :n]
    E = states[:, n:].reshape(-1, n, n)
    q = E[:, :, :1] / np.linalg.norm(E[:, :, :1], axis=1, keepdims=True)
    rest = E[:, :, 1:] - q @ (np.swapaxes(q, 1, 2) @ E[:, :, 1:])
    E = orthonormalize(np.concatenate([q, rest], axis=2))
    q = E[:, :, 0]
    return v - np.sum(q * v, axis=1, keepdims=True) * q, E


def _flat(state: tuple[Array, Array]) -> tuple[Array, Array]:
    return state[0], state[1].ravel()
