"""A rigid body about a fixed point in a potential V(γ), free or with (Ω,γ) constant: vector field
and projection.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Flow, Operations, restoring_step
from veselova.mechanics.flows.collision import SingularFlow
from veselova.mechanics.geometry.natural_frame import orthonormalize
from veselova.mechanics.potentials.laurent import LaurentPolynomial, monomials

__all__ = ["MomentumInSpace", "RigidBodyFlow", "SpatialFlow", "momentum"]

Array = NDArray[np.float64]

#: Constants whose gradients turn into each other by less than this (near steady rotations, at rest)
#: are not restored separately: the step, their defect divided by it, would do more harm than good.
_PARALLEL = 0.1


@dataclass(frozen=True)
class MomentumInSpace(Flow):
    """A flow of attitudes E whose states are the momentum in space and E, row-major.

    - momentum: (n,)
    - frame: (n, n), the start
    """

    momentum: Array
    frame: Array

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start as a state."""
        return np.concatenate([self.momentum, self.frame.ravel()])

    @property
    @abstractmethod
    def _sizes(self) -> Array:
        """Return the sizes of the parts of the momentum, which neighbours are off by."""

    def project(self, state: Array) -> Array:
        """Return states with orthonormal frames; the energy is left as a check."""
        n = len(self.frame)
        E = orthonormalize(state[..., n:].reshape(*state.shape[:-1], n, n))
        return np.concatenate([state[..., :n], E.reshape(*E.shape[:-2], n * n)], axis=-1)

    def neighbour(self, distance: float) -> MomentumInSpace:
        """Return the flow of a start moved by about ``distance``."""
        n = len(self.frame)
        direction = distance * np.random.default_rng(13).normal(size=(n + 1, n)) / np.sqrt(n)
        frame = orthonormalize(self.frame + direction[:-1])
        return replace(self, momentum=self.momentum + self._sizes * direction[-1], frame=frame)


@dataclass(frozen=True)
class BodyFlow(SingularFlow):
    """A rigid body with the frame E = [e_1 e_2 e_3], ė_i = e_i×Ω, e_1 = γ, in a potential V(γ).

    - inverse: B = 𝓘⁻¹, (3, 3)
    - potential: V(γ)
    - frame: the start, all in scaled units

    A state is flat, of length 3 + 9; frames are row-major.
    """

    inverse: Array
    potential: LaurentPolynomial
    frame: Array
    time_unit: float

    @property
    def structure(self) -> Hashable | None:
        """Return what determines the field besides its parameters."""
        exponents, _, components = self.potential.slopes
        return type(self), self._kind, exponents.tobytes(), components.tobytes()

    @property
    @abstractmethod
    def _kind(self) -> bool:
        """Return whether the body is constrained."""

    def _torque(self, gamma: Any, parameters: Any, ops: Operations) -> Any:
        """Return γ×∂V/∂γ from the coefficients of ∂V/∂γ."""
        exponents, _, components = self.potential.slopes
        terms = parameters * monomials(exponents, gamma)
        return cross(gamma, ops.dot(components, terms))

    @abstractmethod
    def angular_velocity(self, state: Array) -> Array:
        """Return Ω of a state put back on the manifold, or of several, (..., 3)."""

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return Omega and frame of states put back on the manifold."""
        states = self.project(states)
        return {"Omega": self.angular_velocity(states) / self.time_unit, "frame": _frames(states)}

    def _coordinates(self, state: Array) -> tuple[Array, Array]:
        """Return γ and γ̇."""
        gamma = state[3::3].copy()
        return gamma, np.cross(gamma, self.angular_velocity(state))

    @cached_property
    def _singular(self) -> Mapping[int, Callable[[Array], Array]]:
        return {i: self.potential.singular_part(i).value for i in self.potential.singular_axes}

    def _plane(self, index: int) -> str:
        return f"the singular plane gamma[{index}]"


@dataclass(frozen=True)
class SpatialFlow(MomentumInSpace, BodyFlow):
    """The body by its momentum in space m = Eᵀ𝔪, ṁ = Eᵀ(γ×∂V/∂γ): with V = 0 an equation of first
    order on the group alone; m_1 = (𝔪,γ) does not move in any potential.

    Ω = B𝔪 + σBγ with σ = [m_1 − (WB𝔪,γ)]/(Bγ,Wγ) for a ``weight`` W: one, where (Ω,γ) is constant,
    after (4.2a, printed 5.8); the inertia about the centre of Chaplygin's ball, without the
    cancellation of D(BK,γ) = (K,γ) − (IBK,γ) and 1 − D(Bγ,γ) = (Bγ,Iγ) where D is large. None for a
    free body, σ = 0. A state is (m, E).
    """

    weight: Array | None

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return B, W and the coefficients of ∂V/∂γ."""
        weight = np.eye(3) if self.weight is None else self.weight
        return np.concatenate([self.inverse.ravel(), weight.ravel(), self.potential.slopes[1]])

    @property
    def _kind(self) -> bool:
        return self.weight is not None

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (ṁ, Ė)."""
        E = state[3:].reshape(3, 3)
        inverse, weight = parameters[:9].reshape(3, 3), parameters[9:18].reshape(3, 3)
        gamma = E[:, 0]
        Omega = ops.dot(inverse, ops.dot(E, state[:3]))
        if self.weight is not None:
            across, weighed = ops.dot(inverse, gamma), ops.dot(weight, gamma)
            share = (state[0] - ops.dot(Omega, weighed)) / ops.dot(across, weighed)
            Omega = Omega + share * across
        rate = np.zeros(3)
        if self.potential:
            rate = ops.dot(E.T, self._torque(gamma, parameters[18:], ops))
        return np.concatenate([rate, ops.dot(_turning(Omega), E).ravel()])

    def angular_velocity(self, state: Array) -> Array:
        """Return Ω."""
        E = _frames(state)
        Omega = (E @ state[..., :3, None])[..., 0] @ self.inverse
        if self.weight is None:
            return np.asarray(Omega)
        gamma = E[..., 0]
        across, weighed = gamma @ self.inverse, gamma @ self.weight
        return Omega + _by((state[..., 0] - _dot(Omega, weighed)) / _dot(across, weighed), across)

    @property
    def _sizes(self) -> Array:
        sizes = np.full(3, float(np.linalg.norm(self.momentum)))
        if self.weight is not None:  # (𝔪,γ) = (WΩ,γ)
            sizes[0] = float(np.linalg.norm(self.weight @ self.angular_velocity(self.initial)))
        return sizes


@dataclass(frozen=True)
class RigidBodyFlow(BodyFlow):
    """Equations (3.1, printed 4.2) with (la, printed 4.3), or (3.4, printed 4.9) where the body is
    free.

    - inertia: 𝓘, (3, 3)
    - Omega: the start
    - constrained: whether a multiplier λγ keeps (Ω,γ) constant

    A state is (Ω, E).
    """

    inertia: Array
    Omega: Array
    constrained: bool

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start as a state."""
        return np.concatenate([self.Omega, self.frame.ravel()])

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return 𝓘, 𝓘⁻¹ and the coefficients of ∂V/∂γ."""
        return np.concatenate(
            [self.inertia.ravel(), self.inverse.ravel(), self.potential.slopes[1]]
        )

    @property
    def _kind(self) -> bool:
        return self.constrained

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (Ω̇, Ė)."""
        Omega, E = state[:3], state[3:].reshape(3, 3)
        inertia, inverse = parameters[:9].reshape(3, 3), parameters[9:18].reshape(3, 3)
        gamma = E[:, 0]
        torque = cross(ops.dot(inertia, Omega), Omega)
        if self.potential:
            torque = torque + self._torque(gamma, parameters[18:], ops)
        if self.constrained:
            across = ops.dot(inverse, gamma)
            torque = torque - (ops.dot(torque, across) / ops.dot(gamma, across)) * gamma
        return np.concatenate([ops.dot(inverse, torque), ops.dot(_turning(Omega), E).ravel()])

    def project(self, state: Array) -> Array:
        """Return states (..., 12) with orthonormal frames and the constants of the start.

        These are (Ω,γ) (free: (𝓘Ω,γ)) and the energy, restored by the shortest step in Ω and the
        attitude. The additional integral is left: near separatrices it hardly differs from the
        energy, and restoring it cost a digit there.
        """
        E = orthonormalize(_frames(state))
        values, slopes, sizes = self._constants(state[..., :3], E)
        lengths = np.linalg.norm(slopes, axis=-1)
        lack = restoring_step(self._wanted - values, lengths**2, sizes) * lengths
        rows = _by(1 / np.where(lengths > 0, lengths, 1.0), slopes)  # no slopes at rest
        step = (np.linalg.pinv(rows, rcond=_PARALLEL) @ lack[..., None])[..., 0]
        E = orthonormalize(E + np.cross(E, step[..., None, 3:], axisa=-2, axisc=-2))
        Omega = self._on_constraint(state[..., :3] + step[..., :3], E[..., 0])
        return np.concatenate([Omega, E.reshape(*E.shape[:-2], 9)], axis=-1)

    @cached_property
    def _wanted(self) -> Array:
        return self._constants(self.Omega, self.frame)[0]

    def _constants(self, Omega: Array, E: Array) -> tuple[Array, Array, Array]:
        """Return the constants (..., 2), their derivatives by Ω and by a rotation x → x + x×δ,
        (..., 2, 6), and sizes (..., 2).

        Sizes are those of ``restoring_step``, 0 for the linear constant: its slope never vanishes,
        and it is restored in full.
        """
        gamma = E[..., 0]
        M = Omega @ self.inertia
        across = E[..., 0] @ self.inertia
        kinetic = _dot(Omega, M) / 2
        by_Omega = M
        by_gamma = self.potential.gradient(gamma)
        energy = kinetic + self.potential.value(gamma)
        size = kinetic + self.potential.magnitude(gamma)
        if self.constrained:
            linear = _dot(Omega, gamma)
            along = _dot(M, gamma)
            energy = energy - linear * along
            size = size + np.abs(linear * along)
            by_Omega = by_Omega - _by(along, gamma) - _by(linear, across)
            by_gamma = by_gamma - _by(along, Omega) - _by(linear, M)
            rows = [(gamma, Omega), (by_Omega, by_gamma)]
        else:
            linear = _dot(M, gamma)
            rows = [(across, M), (by_Omega, by_gamma)]
        slopes = [np.concatenate([row, np.cross(force, gamma)], axis=-1) for row, force in rows]
        sizes = np.stack([np.zeros_like(size), size], axis=-1)
        return np.stack([linear, energy], axis=-1), np.stack(slopes, axis=-2), sizes

    def _on_constraint(self, Omega: Array, gamma: Array) -> Array:
        """Return Ω with the start's value of the linear constant, to the last bit."""
        across = gamma if self.constrained else gamma @ self.inertia
        return Omega + _by((self._wanted[0] - _dot(Omega, across)) / _dot(gamma, across), gamma)

    def neighbour(self, distance: float) -> RigidBodyFlow:
        """Return the flow of a start moved by about ``distance``; (Ω,γ) or (𝓘Ω,γ)
        keeps its value.
        """
        direction = np.random.default_rng(12).normal(size=6) / np.sqrt(3)
        E = orthonormalize(self.frame + distance * _turning(direction[:3]) @ self.frame)
        size = max(1.0, float(np.linalg.norm(self.Omega)))
        Omega = self._on_constraint(self.Omega + distance * size * direction[3:], E[:, 0])
        return replace(self, Omega=Omega, frame=E)

    def angular_velocity(self, state: Array) -> Array:
        """Return Ω."""
        return np.asarray(state[..., :3])


def momentum(inertia: Array, Omega: Array, gamma: Array, constrained: bool) -> Array:
    """Return 𝔪 = 𝓘Ω − (𝓘Ω,γ)γ + (Ω,γ)γ, after (4.2a, printed 5.8), or 𝓘Ω where the body is free,
    shape (..., 3).
    """
    M = Omega @ inertia
    if not constrained:
        return np.asarray(M)
    return M - _by(_dot(M - Omega, gamma), gamma)


def _dot(a: Array, b: Array) -> Array:
    # the sum of three terms as np.sum makes it, which takes four times as long for many rows
    products = a * b
    return np.asarray(products[..., 0] + products[..., 1] + products[..., 2])


def _by(factor: Array, vector: Array) -> Array:
    return np.asarray(factor[..., None] * vector)


def _frames(states: Array) -> Array:
    return states[..., 3:].reshape(*states.shape[:-1], 3, 3)


def cross(a: Any, b: Any) -> Any:
    """Return a×b of floats or symbols."""
    a1, a2, a3 = a
    b1, b2, b3 = b
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], dtype=a.dtype)


def _turning(Omega: Any) -> Any:
    """Return the matrix of x ↦ x×Ω."""
    a, b, c = Omega
    return np.array([[0.0, c, -b], [-c, 0.0, a], [b, -a, 0.0]], dtype=Omega.dtype)
