"""A rigid body about a fixed point in a potential V(γ), free or with (Ω,γ) constant: vector field
and projection.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Operations, restoring_step
from veselova.mechanics.flows.collision import SingularFlow
from veselova.mechanics.geometry.natural_frame import orthonormalize
from veselova.mechanics.potentials.laurent import LaurentPolynomial, monomials

__all__ = ["RigidBodyFlow", "angular_velocity", "cross", "momentum"]

Array = NDArray[np.float64]

#: Constants whose gradients turn into each other by less than this (near steady rotations, at rest)
#: are not restored separately: the step, their defect divided by it, would do more harm than good.
_PARALLEL = 0.1


@dataclass(frozen=True)
class RigidBodyFlow(SingularFlow):
    """Equations (3.1, printed 4.2) with (la, printed 4.3), or (3.4, printed 4.9) where the body is
    free, and ė_i = e_i×Ω for the frame E = [e_1 e_2 e_3], e_1 = γ.

    - inertia, inverse: the tensor and its inverse, (3, 3)
    - potential: V(γ)
    - Omega, frame: the start, all in scaled units
    - constrained: whether a multiplier λγ keeps (Ω,γ) constant
    - spatial: states are (m, E) with the momentum in space m = Eᵀ𝔪, ṁ = Eᵀ(γ×∂V/∂γ), instead of
      (Ω, E): with V = 0 the equation is one of first order on the group alone, and in any
      potential m_1 = (𝔪,γ) does not move

    A state is flat, of length 3 + 9; frames are row-major.
    """

    inertia: Array
    inverse: Array
    potential: LaurentPolynomial
    Omega: Array
    frame: Array
    time_unit: float
    constrained: bool
    spatial: bool

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start as a state."""
        return self._state(self.Omega, self.frame)

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return 𝓘, 𝓘⁻¹ and the coefficients of ∂V/∂γ."""
        return np.concatenate(
            [self.inertia.ravel(), self.inverse.ravel(), self.potential.slopes[1]]
        )

    @property
    def structure(self) -> Hashable | None:
        """Return what determines the field besides its parameters."""
        return (
            type(self),
            self.constrained,
            self.spatial,
            self.potential.slopes[0].tobytes(),
            self.potential.slopes[2].tobytes(),
        )

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (Ω̇, Ė) or (ṁ, Ė)."""
        E = state[3:].reshape(3, 3)
        gamma = E[:, 0]
        inertia = parameters[:9].reshape(3, 3)
        inverse = parameters[9:18].reshape(3, 3)
        across = ops.dot(inverse, gamma)
        if self.spatial:
            Omega = ops.dot(inverse, ops.dot(E, state[:3]))
            if self.constrained:
                excess = (
                    ops.dot(Omega, gamma) - ops.dot(state[:3], ops.dot(E.T, gamma))
                ) / ops.dot(gamma, across)
                Omega = Omega - excess * across
            rate = (
                ops.dot(E.T, self._torque(gamma, parameters, ops))
                if self.potential
                else np.zeros(3)
            )
        else:
            Omega = state[:3]
            torque = cross(ops.dot(inertia, Omega), Omega)
            torque = torque + self._torque(gamma, parameters, ops) if self.potential else torque
            if self.constrained:
                torque = torque - (ops.dot(torque, across) / ops.dot(gamma, across)) * gamma
            rate = ops.dot(inverse, torque)
        return np.concatenate([rate, ops.dot(_turning(Omega), E).ravel()])

    def _torque(self, gamma: Any, parameters: Any, ops: Operations) -> Any:
        """Return γ×∂V/∂γ."""
        exponents, _, components = self.potential.slopes
        terms = parameters[18:] * monomials(exponents, gamma)
        return cross(gamma, ops.dot(components, terms))

    def project(self, state: Array) -> Array:
        """Return states (..., 12) with orthonormal frames; where they hold Ω, also with the
        constants of the start.

        These are (Ω,γ) (free: (𝓘Ω,γ)) and the energy, restored by the shortest step in Ω and the
        attitude. With the momentum in space the constraint holds by itself, and the energy is left
        as a check. The additional integral is always left: near separatrices it hardly differs from
        the energy, and restoring it cost a digit there.
        """
        first = state[..., :3]
        E = orthonormalize(_frames(state))
        if not self.spatial:
            values, slopes, sizes = self._constants(first, E)
            lengths = np.linalg.norm(slopes, axis=-1)
            lack = restoring_step(self._wanted - values, lengths**2, sizes) * lengths
            rows = _by(1 / np.where(lengths > 0, lengths, 1.0), slopes)  # no slopes at rest
            step = (np.linalg.pinv(rows, rcond=_PARALLEL) @ lack[..., None])[..., 0]
            E = orthonormalize(E + np.cross(E, step[..., None, 3:], axisa=-2, axisc=-2))
            first = self._on_constraint(first + step[..., :3], E[..., 0])
        return np.concatenate([first, E.reshape(*E.shape[:-2], 9)], axis=-1)

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

    def _state(self, Omega: Array, E: Array) -> Array:
        first = (
            E.T @ momentum(self.inertia, Omega, E[:, 0], self.constrained)
            if self.spatial
            else Omega
        )
        return np.concatenate([first, E.ravel()])

    def neighbour(self, distance: float) -> RigidBodyFlow:
        """Return the flow of a start moved by about ``distance``; (Ω,γ) or (𝓘Ω,γ)
        keeps its value.
        """
        direction = np.random.default_rng(12).normal(size=6) / np.sqrt(3)
        E = orthonormalize(self.frame + distance * _turning(direction[:3]) @ self.frame)
        size = max(1.0, float(np.linalg.norm(self.Omega)))
        Omega = self._on_constraint(self.Omega + distance * size * direction[3:], E[:, 0])
        return replace(self, Omega=Omega, frame=E)

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return Omega and frame of states put back on the manifold."""
        states = self.project(states)
        E = _frames(states)
        Omega = states[:, :3]
        if self.spatial:
            body = np.einsum("tij,tj->ti", E, Omega)
            Omega = angular_velocity(self.inverse, body, E[..., 0], self.constrained)
            Omega = self._on_constraint(Omega, E[..., 0])
        return {"Omega": Omega / self.time_unit, "frame": E}

    def _coordinates(self, state: Array) -> tuple[Array, Array]:
        """Return γ and γ̇."""
        E = state[3:].reshape(3, 3)
        Omega = (
            angular_velocity(self.inverse, E @ state[:3], E[:, 0], self.constrained)
            if self.spatial
            else state[:3]
        )
        return E[:, 0].copy(), np.cross(E[:, 0], Omega)

    @cached_property
    def _singular(self) -> Mapping[int, Callable[[Array], Array]]:
        return {i: self.potential.singular_part(i).value for i in self.potential.singular_axes}

    def _plane(self, index: int) -> str:
        return f"the singular plane gamma[{index}]"


def momentum(inertia: Array, Omega: Array, gamma: Array, constrained: bool) -> Array:
    """Return 𝔪 = 𝓘Ω − (𝓘Ω,γ)γ + (Ω,γ)γ, after (4.2a, printed 5.8), or 𝓘Ω where the body is free,
    shape (..., 3).
    """
    M = Omega @ inertia
    if not constrained:
        return np.asarray(M)
    return M - _by(_dot(M - Omega, gamma), gamma)


def angular_velocity(inverse: Array, body: Array, gamma: Array, constrained: bool) -> Array:
    """Return Ω from 𝔪: 𝓘Ω = 𝔪 − [((𝔪,𝓘⁻¹γ) − (𝔪,γ))/(γ,𝓘⁻¹γ)] γ, after (4.2a, printed 5.8)
    corrected, shape (..., 3).
    """
    Omega = body @ inverse
    if not constrained:
        return np.asarray(Omega)
    across = gamma @ inverse
    return Omega - _by(_dot(Omega - body, gamma) / _dot(gamma, across), across)


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
