"""The two fields of an LR system: its momentum equation on the group alone, and Euler–Poincaré
equations with multipliers.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.inertia_operator import Inertia, apply_operator
from veselova.mechanics.core.flow import FLOATS, Operations, restoring_step
from veselova.mechanics.flows.collision import SingularFlow
from veselova.mechanics.groups.distribution import Distribution, combine
from veselova.mechanics.potentials.on_group import GroupPotential

__all__ = [
    "LARGEST_SYMBOLIC",
    "LRFlow",
    "MomentumFlow",
    "MultiplierFlow",
    "multipliers_of",
]

Array = NDArray[np.float64]

#: dim G up to which a field is written in symbols (SO(12)): the expressions grow like its square.
LARGEST_SYMBOLIC = 66


@dataclass(frozen=True)
class LRFlow(SingularFlow):
    """An LR system in scaled units: moments of inertia near one, angular velocities near one.

    - along: (d,) m_k = ⟨𝓘ω, 𝒲_k⟩ at the start
    - across: (m,) the constants c_s = ⟨ω, ℱ_s⟩ of the constraints
    - conserves: whether the Jacobi–Painlevé integral is one: not where v changes along
      constants c_s ≠ 0
    """

    distribution: Distribution
    inertia: Inertia
    potential: GroupPotential | None
    time_unit: float
    g: Array
    along: Array
    across: Array
    conserves: bool

    @property
    def _coefficients(self) -> Array:
        return self.potential.coefficients if self.potential else np.empty(0)

    @property
    def structure(self) -> Hashable | None:
        """Return what the compiled field depends on besides its parameters."""
        if self.distribution.group.dimension > LARGEST_SYMBOLIC:
            return None
        powers = self.potential.powers if self.potential else None
        return type(self), self.distribution.key, powers, self.parameters.size

    def _matrix(self, flat: Any) -> Any:
        N = self.distribution.group.size
        return flat.reshape((*flat.shape[:-1], N, N))

    def _torque(self, g: Any, parameters: Any, ops: Operations) -> Any:
        """Return −y(v) in coordinates."""
        if self.potential is None:
            return 0.0
        coefficients = parameters[parameters.size - self._coefficients.size :]
        return -self.potential.gradient(self.distribution.group, g, coefficients, ops)

    @property
    def _operator(self) -> Array:
        """Return what (mom, printed 2.8) is solved with: 𝓘 or its inverse."""
        return self.inertia.inverse if self.distribution.uses_inverse else self.inertia.operator

    def omega(self, g: Array, along: Array) -> Array:
        """Return ω from m_k and the group elements, in coordinates (…, D)."""
        W, F = self.distribution.in_body(g)
        return np.asarray(
            self.distribution.velocity(self._operator, W, F, along, self.across), dtype=np.float64
        )

    def jacobi(self, g: Array, omega: Array) -> Array:
        """Return the Jacobi–Painlevé integral, shape (…)."""
        value = self.distribution.jacobi(self.inertia, self.across, g, omega)
        return value + self.potential.value(g) if self.potential else value

    def neighbour(self, distance: float) -> LRFlow:
        """Return the flow of a start moved by about ``distance``, its momentum and constraints in
        proportion.
        """
        group = self.distribution.group
        rng = np.random.default_rng(self.g.size)
        turn = distance * rng.normal(size=group.dimension) / np.sqrt(group.size)
        kicks = (1 + distance * rng.normal(size=x.size) for x in (self.along, self.across))
        g = group.project(self.g + self.g @ group.element(turn))
        along, across = (x * kick for x, kick in zip((self.along, self.across), kicks, strict=True))
        side = (
            distance
            * float(np.linalg.norm(self.along))
            * rng.normal(size=along.size)
            / np.sqrt(max(along.size, 1))
        )
        return replace(self, g=g, along=along + side, across=across)

    def _coordinates(self, state: Array) -> tuple[Array, Array]:
        """Return g and ġ."""
        g, omega = (part[0] for part in self.motion(state[None]))
        return g, g @ self.distribution.group.element(omega)

    @cached_property
    def _singular(self) -> Mapping[tuple[int, int], Callable[[Array], Any]]:
        v = self.potential
        return {entry: v.singular_part(entry).value for entry in v.singular_entries} if v else {}

    def _plane(self, index: tuple[int, int]) -> str:
        return f"g_{index[0] + 1}{index[1] + 1}"

    @abstractmethod
    def motion(self, states: Array) -> tuple[Array, Array]:
        """Return g (N, …) on the group and ω in coordinates (N, D), in scaled units."""

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return frame = gᵀ and omega along states (N, m)."""
        parts = [self.motion(part) for (part,) in self.distribution.parts(states)]
        g, omega = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        element = self.distribution.group.element(omega) / self.time_unit
        return {"frame": np.ascontiguousarray(np.swapaxes(g, -1, -2)), "omega": element}


@dataclass(frozen=True)
class MomentumFlow(LRFlow):
    """ġ = g ω(g) with ω from (mom, printed 2.8) and the momentum in space, m = g𝓜g⁻¹, constant:
    (mom_eq, printed 2.7) solved once for all.

    All integrals but those that a potential breaks are restored; the other formulation leaves them
    as integrated. A state is (g, m_1 … m_d): a potential turns the 𝔡-part of m by its torque.
    """

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start."""
        return np.concatenate([self.g.ravel(), self.along])

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return the operator that (mom, printed 2.8) is solved with, the constants c unless all
        are zero, and those of the potential.
        """
        constants = self.across if np.any(self.across) else np.empty(0)
        return np.concatenate([self._operator.ravel(), constants, self._coefficients])

    def _split(self, state: Any) -> tuple[Any, Any]:
        area = self.g.size
        return self._matrix(state[..., :area]), state[..., area:]

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (gω, m_k' = −⟨y(v), 𝒲_k⟩)."""
        g, m = self._split(state)
        W, F = self.distribution.in_body(g, ops)
        operator, rest = np.split(parameters, [self._operator.size])
        c = rest[: self.across.size] if np.any(self.across) else self.across
        omega = self.distribution.velocity(operator.reshape(self._operator.shape), W, F, m, c, ops)
        g_dot = ops.dot(g, self.distribution.group.element(omega, ops)).ravel()
        rate = ops.dot(W, self._torque(g, parameters, ops)) if self.potential else 0 * m
        return np.concatenate([g_dot, rate])

    @cached_property
    def _energy(self) -> float:
        return float(self.jacobi(self.g, self.omega(self.g, self.along)))

    def _restore(self, states: Array) -> tuple[Array, Array]:
        """Return g and m_k of states (…, m) with g on the group and the energy of the start, by one
        step along its gradient.

        The gradient at constant momentum is [ω,𝓘ω] + y(v); it vanishes at steady rotations too.
        """
        group, (g, along) = self.distribution.group, self._split(states)
        g = group.project(g)
        if not self.conserves:
            return g, along
        omega = self.omega(g, along)
        momentum = self.inertia(omega)
        excess = self.jacobi(g, omega) - self._energy
        turn = group.bracket(omega, momentum) - self._torque(g, self.parameters, FLOATS)
        # Twice the kinetic part: constants of the constraints add one like it.
        size = np.sum(np.abs(omega * momentum), axis=-1) + (
            self.potential.magnitude(g) if self.potential else 0.0
        )
        step = restoring_step(-excess, np.sum(turn * turn, axis=-1), size)[..., None]
        return group.project(g + g @ group.element(step * turn)), along

    def project(self, state: Array) -> Array:
        """Return the state with g on the group and the energy of the start."""
        g, along = self._restore(state)
        return np.concatenate([g.ravel(), along])

    def motion(self, states: Array) -> tuple[Array, Array]:
        """Return g and ω, with the energy restored: between steps the integrator interpolates, ten
        times less accurately.
        """
        g, along = self._restore(states)
        return g, self.omega(g, along)


@dataclass(frozen=True)
class MultiplierFlow(LRFlow):
    """𝓘ω̇ = [𝓘ω,ω] − y(v) + Σ λ_s ℱ_s, ġ = gω, equation (EPS, printed 2.4), for states (ω, g); λ
    from ⟨ω̇, ℱ_s⟩ = 0.

    Only the group is restored: constraints, momentum and energy are left as integrated, to be seen.
    """

    @cached_property
    def initial(self) -> Array:  # type: ignore[override]
        """Return the start."""
        return np.concatenate([self.omega(self.g, self.along), self.g.ravel()])

    @cached_property
    def parameters(self) -> Array:  # type: ignore[override]
        """Return 𝓘⁻¹, 𝓘 and the potential's coefficients."""
        return np.concatenate(
            [self.inertia.inverse.ravel(), self.inertia.operator.ravel(), self._coefficients]
        )

    def _split(self, state: Any) -> tuple[Any, Any]:
        D = self.distribution.group.dimension
        return state[..., :D], self._matrix(state[..., D:])

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (ω̇, gω)."""
        group, (omega, g) = self.distribution.group, self._split(state)
        shape = self.inertia.operator.shape
        area = self.inertia.operator.size
        inverse = parameters[:area].reshape(shape)
        operator = parameters[area : 2 * area].reshape(shape)
        force = group.bracket(apply_operator(operator, omega, ops), omega, ops) + self._torque(
            g, parameters, ops
        )
        omega_dot = apply_operator(inverse, force, ops)
        if self.distribution.constraints:
            F = self.distribution.in_body(g, ops)[1]
            multipliers, rotated = multipliers_of(inverse, F, force, ops)
            omega_dot = omega_dot + combine(multipliers, rotated, ops)
        return np.concatenate([omega_dot, ops.dot(g, group.element(omega, ops)).ravel()])

    def project(self, state: Array) -> Array:
        """Return the state with g on the group."""
        omega, g = self._split(state)
        return np.concatenate([omega, self.distribution.group.project(g).ravel()])

    def motion(self, states: Array) -> tuple[Array, Array]:
        """Return g and ω."""
        omega, g = self._split(states)
        return self.distribution.group.project(g), omega


def multipliers_of(inverse: Any, F: Any, force: Any, ops: Operations = FLOATS) -> tuple[Any, Any]:
    """Return λ_s with ⟨𝓘⁻¹(force + Σ λ_l ℱ_l), ℱ_s⟩ = 0, (…, m), and 𝓘⁻¹ℱ_s, (…, m, D)."""
    rotated = apply_operator(inverse, F, ops)
    matrix = ops.dot(rotated, np.swapaxes(F, -1, -2))
    return ops.solve(matrix, -ops.dot(rotated, force[..., None]))[..., 0], rotated
