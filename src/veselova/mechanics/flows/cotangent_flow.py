"""The reduced LR flow on T*V(r,n), equation (dot_P, printed 5.22), and the same motion by its
momentum equation (4.1c, printed 5.6).

Momenta are measured in units in which the inertia operator is near one and the angular velocity at
the start is one: the field is then of order one whatever the scales of the input.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.stiefel_inertia import BodyInertia
from veselova.mechanics.core.flow import FLOATS, Flow, Operations
from veselova.mechanics.geometry.so_n import coefficients, skew
from veselova.mechanics.geometry.stiefel import (
    admissible_part,
    cotangent,
    momentum_map,
    nearest_orthonormal,
    product,
    tangent_part,
)

__all__ = ["CotangentFlow", "MomentumFlow"]

Array = NDArray[np.float64]

#: The torque, squared, below which turning the state no longer restores the energy: its rounding
#: would turn it farther.
_LEAST_TORQUE = 1e-4


@dataclass(frozen=True)
class CotangentFlow(Flow):
    """Ẋ = −ωX, Ṗ = −ωP, equation (dot_P, printed 5.22), ω ∈ 𝓓_r from (dotX->P, printed 5.19); a
    state is the flat array (X, P) of length 2nr.

    Both factors are turned by the same rotation, so that XᵀX, XᵀP and PᵀP are constant; of a state
    that left the manifold by rounding the nearest rotation of the start is kept, turned along the
    torque until the energy is that of the start.
    """

    inertia: BodyInertia
    rank: int
    time_unit: float
    momentum_unit: float
    start: Array

    @classmethod
    def of(cls, inertia: BodyInertia, X: Array, omega: Array) -> CotangentFlow:
        """Return the flow of a moving body (ω ≠ 0) that starts in X with angular velocity ω ∈ 𝓓_r,
        in units of the problem.
        """
        speed = float(np.max(np.abs(omega)))
        speed *= float(np.sqrt(product(omega / speed, omega / speed)))
        P = cotangent(X, inertia.apply(omega / speed))
        return cls(inertia, X.shape[1], 1 / speed, speed, np.stack([X, P]))

    @property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start."""
        return self._flat(self.start)

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return those of the inertia operator."""
        return self.inertia.parameters

    @property
    def structure(self) -> Hashable | None:
        """Return what determines the field besides its parameters."""
        return type(self), type(self.inertia), self.inertia.n, self.rank

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (−ωX, −ωP)."""
        X, P = state.reshape(2, self.inertia.n, self.rank)
        omega = self.inertia.angular_velocity(X, P, parameters, ops)
        return np.concatenate([ops.dot(omega, -X).ravel(), ops.dot(omega, -P).ravel()])

    def _momenta(self, pairs: Array) -> tuple[Array, Array]:
        """Return ω and 𝓘ω at (X, P), shape (..., n, n)."""
        omega = self.inertia.angular_velocity(
            pairs[..., 0, :, :], pairs[..., 1, :, :], self.parameters, FLOATS
        )
        return omega, self.inertia.apply(omega)

    @cached_property
    def _twice_energy(self) -> Array:
        return product(*self._momenta(self.start))

    def _pairs(self, states: Array) -> Array:
        """Return (X, P) of states, (..., 2, n, r)."""
        return states.reshape(*states.shape[:-1], *self.start.shape)

    def _flat(self, pairs: Array) -> Array:
        """Return the states of (X, P)."""
        return pairs.reshape(*pairs.shape[:-3], -1)

    def project(self, state: Array) -> Array:
        """Return states as rotations of the start, with its energy."""
        return self._flat(self._restore(self._pairs(state)))

    def _restore(self, pairs: Array) -> Array:
        pairs = self._rotate(pairs)
        omega, momentum = self._momenta(pairs)
        torque = momentum @ omega - omega @ momentum
        # Turned by ξ, the energy changes by ⟨ξ,[𝓘ω,ω]⟩ to first order.
        excess = (product(momentum, omega) - self._twice_energy) / 2
        turn = torque * (-excess / (product(torque, torque) + _LEAST_TORQUE))[..., None, None]
        return self._rotate(pairs + turn[..., None, :, :] @ pairs)

    def _rotate(self, pairs: Array) -> Array:
        """Return the rotations of the start that are nearest to (X, P), shape (..., 2, n, r)."""
        now, start = (
            np.concatenate([pair[..., 0, :, :], pair[..., 1, :, :]], axis=-1)
            for pair in (pairs, self.start)
        )
        left, _, right = np.linalg.svd(now @ start.T)
        return np.asarray((left @ right)[..., None, :, :] @ self.start, dtype=np.float64)

    def neighbour(self, distance: float) -> CotangentFlow:
        """Return the flow of a start moved by about ``distance`` on the manifold, energy included:
        how data rounding acts.
        """
        X, P = self.start
        move = np.random.default_rng(self.inertia.n).normal(size=self.start.shape) / np.sqrt(
            self.inertia.n
        )
        X = nearest_orthonormal(X + distance * move[0])
        P = P + distance * float(np.linalg.norm(P)) * move[1]
        return replace(self, start=np.stack([X, tangent_part(X, P)]))

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return X and P in units of the problem, on the manifold: between its steps an integrator
        has fewer digits.
        """
        pairs = self._restore(self._pairs(states))
        return {
            "X": pairs[:, 0],
            "P": np.ldexp(pairs[:, 1] * self.momentum_unit, self.inertia.exponent),
        }


class MomentumFlow(CotangentFlow):
    """𝓜̇ = [𝓜,ω], Ẋ = −ωX, equations (4.1c, printed 5.6), (4.2a, printed 5.8), 𝓜 = pr_𝓓 𝓘ω + pr_⊥
    ω; a state is (X, 𝓜), 𝓜 by its coefficients.

    Here ω solves the full linear system (4.2) of n(n−1)/2 equations, in floating point only.
    """

    @property
    def structure(self) -> None:
        """Return None: no symbols."""
        return

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (−ωX, [𝓜,ω])."""
        X, momentum = self._parts(state)
        apply, basis = self.inertia.apply, self._basis
        system = coefficients(basis + admissible_part(X, apply(basis) - basis))
        omega = skew(np.linalg.solve(system.T, coefficients(momentum)), self.inertia.n)
        rate = coefficients(momentum @ omega - omega @ momentum)
        return np.concatenate([(-omega @ X).ravel(), rate])

    @cached_property
    def _basis(self) -> Array:
        n = self.inertia.n
        return skew(np.eye(n * (n - 1) // 2), n)

    def _parts(self, states: Array) -> tuple[Array, Array]:
        n, r = self.inertia.n, self.rank
        return states[..., : n * r].reshape(*states.shape[:-1], n, r), skew(states[..., n * r :], n)

    def _pairs(self, states: Array) -> Array:
        X, momentum = self._parts(states)
        return np.stack([X, cotangent(X, momentum)], axis=-3)

    def _flat(self, pairs: Array) -> Array:
        X, P = pairs[..., 0, :, :], pairs[..., 1, :, :]
        first = X.reshape(*X.shape[:-2], -1)
        return np.concatenate([first, coefficients(momentum_map(X, P))], axis=-1)
