"""Generalized Chaplygin reduction of an LR system to H\\G: reduced Lagrangian and equations,
momentum equation, invariants.

The redundant coordinates of a point q = Hg of H\\G are those of any g over it; a velocity q̇ is
what ġ is up to 𝔥·g. Everything here depends on Hg alone, which the tests hold, because 𝔥 is a
subalgebra and v is H-invariant.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.systems.lr_system import LRSystem

__all__ = ["ChaplyginReduction"]

Array = NDArray[np.float64]

#: Singular values of 𝔥 on ℝᴺ, and of functions on 𝔡, below this count as zero.
_NULL = 1e-9


@dataclass(frozen=True)
class ChaplyginReduction:
    """The reduced system on Q = H\\G of an LR system with a subalgebra 𝔥, an H-invariant potential
    and c_s = 0.

    g, g_dot, … are matrices (N, N), elements of 𝔤 too; g_dot and the variations xi are tangent at
    g.
    """

    system: LRSystem

    @cached_property
    def fixed_vectors(self) -> Array:
        """Return orthonormal columns (N, f) of the vectors that H fixes: E_1 … E_r for D_r of
        (4.1, printed 5.3).
        """
        distribution = self.system.distribution
        N = self.system.distribution.group.size
        h = distribution.group.element(distribution.space[distribution.rank :]).reshape(-1, N)
        if not len(h):
            return np.eye(N)
        _, values, vectors = np.linalg.svd(h)
        vectors = vectors[int(np.sum(values > _NULL)) :]
        # Along coordinate axes where the fixed space is one of coordinates.
        projector = vectors.T @ vectors
        axes = np.flatnonzero(np.abs(np.diag(projector) - 1) < _NULL)
        return (
            np.eye(N)[:, axes]
            if len(axes) == len(vectors)
            else np.asarray(vectors.T, dtype=np.float64)
        )

    def coordinates(self, g: Array) -> Array:
        """Return 𝒳 = g⁻¹·(fixed vectors), (N, f), functions on H\\G: (e_1 … e_r) on the Stiefel
        variety V(r, n).
        """
        return np.swapaxes(g, -1, -2) @ self.fixed_vectors

    def projector(self, g: Array) -> Array:
        """Return the matrix (D, D) of pr_{g⁻¹𝔡g}, functions on H\\G that are there also where H
        fixes no vector.
        """
        W, _ = self.system.distribution.in_body(g)
        return np.asarray(np.swapaxes(W, -1, -2) @ W, dtype=np.float64)

    def _quasivelocity(self, g: Array, g_dot: Array) -> Array:
        """Return u_k with Φ(q,q̇) = Σ u_k 𝒲_k."""
        group = self.system.distribution.group
        return self.system.distribution.components(
            g, group.coordinates(np.swapaxes(g, -1, -2) @ g_dot)
        )[0]

    def _element(self, x: Any) -> Array:
        return np.asarray(self.system.distribution.group.element(x), dtype=np.float64)

    def _lift(self, g: Array, u: Any) -> Array:
        distribution = self.system.distribution
        return distribution.body(g, u, np.zeros((*u.shape[:-1], distribution.constraints)))

    def momentum_map(self, g: Array, g_dot: Array) -> Array:
        """Return Φ(q,q̇) = pr_{g⁻¹𝔡g} g⁻¹ġ, an element of 𝔤; (4.3) on the Stiefel variety."""
        return self._element(self._lift(g, self._quasivelocity(g, g_dot)))

    def lagrangian(self, g: Array, g_dot: Array) -> Array:
        """Return L(q,q̇) = ½⟨𝓘Φ,Φ⟩ − V(q)."""
        return np.asarray(self.energy(g, g_dot) - 2 * self._potential(g))

    def energy(self, g: Array, g_dot: Array) -> Array:
        """Return E(q,q̇) = ½⟨𝓘Φ,Φ⟩ + V(q), an integral."""
        phi = self._lift(g, self._quasivelocity(g, g_dot))
        return np.asarray(np.sum(self.system.inertia(phi) * phi, axis=-1) / 2 + self._potential(g))

    def _potential(self, g: Array) -> Any:
        return self.system.potential.value(g) if self.system.potential else np.zeros(g.shape[:-2])

    def metric(self, g: Array) -> Array:
        """Return ⟨𝓘𝒲_k, 𝒲_l⟩, the metric ds²_{𝓘,D} in the frame of Q whose quasivelocities are u_k,
        (…, d, d).
        """
        W, _ = self.system.distribution.in_body(g)
        return np.asarray(self.system.inertia(W) @ np.swapaxes(W, -1, -2), dtype=np.float64)

    def curvature(self, g: Array, g_dot: Array, xi: Array) -> Array:
        """Return pr_{g⁻¹𝔥g}[Φ(q,q̇), Φ(q,ξ)], g⁻¹ times the curvature B(ġ,ξ) of the connection, an
        element of 𝔤.
        """
        distribution = self.system.distribution
        one, other = (self._lift(g, self._quasivelocity(g, vector)) for vector in (g_dot, xi))
        _, across = distribution.components(g, distribution.group.bracket(one, other))
        return self._element(
            distribution.body(g, np.zeros((*across.shape[:-1], distribution.rank)), across)
        )

    def constraint_force(self, g: Array, g_dot: Array, xi: Array) -> Array:
        """Return ⟨𝓘Φ(q,q̇), pr_{g⁻¹𝔥g}[Φ(q,q̇),Φ(q,ξ)]⟩, the right side of (1.2, printed 2.10)."""
        phi = self._lift(g, self._quasivelocity(g, g_dot))
        curvature = self.system.distribution.group.coordinates(self.curvature(g, g_dot, xi))
        return np.asarray(np.sum(self.system.inertia(phi) * curvature, axis=-1))

    def acceleration(self, g: Array, g_dot: Array) -> Array:
        """Return u̇_k from (1.2, printed 2.10), for u of the velocity given, (d,): the reduced
        Lagrange–d'Alembert equation solved.

        In the chart x ↦ H exp(Σ x_k w_k) g of Q, centred at q, where ẋ = u and ẍ = u̇, the left
        side of (1.2) for ξ = w_l is ⟨𝓘Φ, (1 + pr_𝔥)[Φ,𝒲_l]⟩ − ⟨𝓘𝒲_l, Σ u̇_k𝒲_k⟩ − ∂_l V: the
        derivative of exp gives [Φ,𝒲_l] its factor 1 − ½pr_𝔡, twice.
        """
        distribution = self.system.distribution
        group = distribution.group
        W, _ = distribution.in_body(g)
        phi = self._quasivelocity(g, g_dot) @ W
        brackets = group.bracket(np.broadcast_to(phi, W.shape), W)
        along, across = distribution.components(g, brackets)
        vertical = distribution.body(g, np.zeros_like(along), across)
        left = (brackets + vertical) @ self.system.inertia(phi)
        if self.system.potential:
            left = left - W @ self.system.potential.gradient(group, g)
        right = np.array(
            [self.constraint_force(g, g_dot, g @ element) for element in group.element(W)]
        )
        return np.asarray(np.linalg.solve(self.metric(g), left - right), dtype=np.float64)

    def momentum(self, g: Array, g_dot: Array) -> Array:
        """Return Φ*(q,p) = pr_{g⁻¹𝔡g} 𝓘Φ(q,q̇) for p = ∂L/∂q̇, equation (*), an element of 𝔤."""
        distribution = self.system.distribution
        phi = self._lift(g, self._quasivelocity(g, g_dot))
        along, _ = distribution.components(g, self.system.inertia(phi))
        return self._element(self._lift(g, along))

    def velocity(self, g: Array, momentum: Array) -> Array:
        """Return Φ(q,q̇) of the velocity with p = ∂L/∂q̇, from Φ*(q,p): the inverse of (*), an
        element of 𝔤.
        """
        distribution = self.system.distribution
        along, _ = distribution.components(g, distribution.group.coordinates(momentum))
        return self._element(self._lift(g, np.linalg.solve(self.metric(g), along)))

    def momentum_rate(self, g: Array, momentum: Array) -> Array:
        """Return [Φ*(q,p), Φ(q,q̇)], the right side of the reduced momentum equation (**), without
        potential.
        """
        phi = self.velocity(g, momentum)
        return momentum @ phi - phi @ momentum

    def invariants(self, momentum: Array) -> Array:
        """Return tr M², tr M⁴, … of M = Φ*(q,p), (…, ⌊N/2⌋): with them every function of the
        algebra 𝒜 is known, up to signs.

        They are integrals without potential. (Odd traces of a real skew matrix vanish.)
        """
        square = momentum @ momentum
        power = square
        found = [np.trace(square, axis1=-2, axis2=-1)]
        for _ in range(1, momentum.shape[-1] // 2):
            power = power @ square
            found.append(np.trace(power, axis1=-2, axis2=-1))
        return np.stack(found, axis=-1)

    @cached_property
    def independent_invariants(self) -> int:
        """Return the number of independent functions in 𝒜: dim pr_𝔡(ann ξ) for a generic ξ ∈ 𝔡."""
        distribution = self.system.distribution
        group = distribution.group
        w = distribution.space[: distribution.rank]
        xi = np.random.default_rng(group.dimension).normal(size=distribution.rank) @ w
        brackets = group.bracket(
            np.broadcast_to(xi, (group.dimension, group.dimension)), np.eye(group.dimension)
        )
        _, values, vectors = np.linalg.svd(brackets.T)
        annihilator = vectors[int(np.sum(values > _NULL)) :]
        return int(np.linalg.matrix_rank(annihilator @ w.T, tol=_NULL)) if len(annihilator) else 0
