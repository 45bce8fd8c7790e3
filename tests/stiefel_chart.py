"""Canonical coordinates (u, p) on T*V(r,n) near a point, and the reduced flow in them: for volumes
and symplectic forms.

X(u) = (1−ξ/2)⁻¹(1+ξ/2)X₀ with ξ = Σ u_a w_a, w a basis of 𝓓_r at X₀ (Cayley), and p_a = tr
Pᵀ∂X/∂u_a. Nothing is taken from the paper's Hamiltonian form: Ẋ and Ṗ are those of (dot_P), plus
the force of a potential.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from veselova.mechanics.bodies.stiefel_inertia import BodyInertia
from veselova.mechanics.core.flow import FLOATS
from veselova.mechanics.geometry.stiefel import momentum_map, product

#: Step of central differences: truncation and rounding are both about 1e-10 here.
STEP = 2e-5


def dimension(n: int, r: int) -> int:
    """Return N = dim V(r,n) = rn − r(r+1)/2, which is dim 𝓓_r."""
    return r * n - r * (r + 1) // 2


def admissible_basis(X: Any) -> Any:
    """Return e_α∧e_j, α ≤ r, α < j ≤ n, an orthonormal basis of 𝓓_r, shape (N, n, n), for one X.

    e_{r+1} … e_n complete X to an orthonormal basis; 𝓓_r does not depend on how.
    """
    n, r = X.shape
    frame = np.column_stack([X, np.linalg.svd(X)[0][:, r:]])
    pairs = [(a, j) for a in range(r) for j in range(a + 1, n)]
    first, second = (frame[:, list(column)].T for column in zip(*pairs))
    outer = first[:, :, None] * second[:, None, :]
    return outer - np.swapaxes(outer, -1, -2)


class Chart:
    """Coordinates around one X₀ for one inertia operator, with a potential V(X) and its gradient,
    both or neither.
    """

    def __init__(
        self, inertia: BodyInertia, X0: Any, potential: Any = None, gradient: Any = None
    ) -> None:
        self.inertia, self.X0, self.potential, self.gradient = inertia, X0, potential, gradient
        self.basis = admissible_basis(X0)
        self.N = len(self.basis)

    def point(self, u: Any) -> tuple[Any, Any, Any]:
        """Return X, ∂X/∂u_a and (1−ξ/2)⁻¹."""
        half = np.tensordot(u, self.basis, axes=1) / 2
        one = np.eye(len(half))
        inverse = np.linalg.inv(one - half)
        X = inverse @ (one + half) @ self.X0
        return X, inverse @ self.basis @ (X + self.X0) / 2, inverse

    def momentum(self, u: Any, p: Any) -> Any:
        """Return the P of (condX) with tr Pᵀ∂X/∂u_a = p_a."""
        _, tangents, _ = self.point(u)
        gram = np.einsum("aij,bij->ab", tangents, tangents)
        return np.tensordot(np.linalg.solve(gram, p), tangents, axes=1)

    def omega(self, u: Any, p: Any) -> Any:
        """Return ω(X,P)."""
        return self.inertia.angular_velocity(
            self.point(u)[0], self.momentum(u, p), self.inertia.parameters, FLOATS
        )

    def hamiltonian(self, u: Any, p: Any) -> float:
        """Return ½⟨𝓘ω,ω⟩ + V."""
        X = self.point(u)[0]
        potential = 0.0 if self.potential is None else self.potential(X)
        return (
            float(product(momentum_map(X, self.momentum(u, p)), self.omega(u, p)) / 2) + potential
        )

    def field(self, z: Any) -> Any:
        """Return (u̇, ṗ) at z = (u, p)."""
        u, p = z[: self.N], z[self.N :]
        X, tangents, inverse = self.point(u)
        P, omega = self.momentum(u, p), self.omega(u, p)
        gram = np.einsum("aij,bij->ab", tangents, tangents)
        u_dot = np.linalg.solve(gram, np.einsum("aij,ij->a", tangents, -omega @ X))
        X_dot, xi_dot = (
            np.tensordot(u_dot, tangents, axes=1),
            np.tensordot(u_dot, self.basis, axes=1),
        )
        tangents_dot = inverse @ (self.basis @ X_dot + xi_dot @ tangents) / 2
        P_dot = -omega @ P - (0 if self.gradient is None else self.gradient(X))
        p_dot = np.einsum("aij,ij->a", tangents, P_dot) + np.einsum("aij,ij->a", tangents_dot, P)
        return np.concatenate([u_dot, p_dot])


def slopes(function: Callable[[Any], Any], z: Any) -> Any:
    """Return the derivatives of a function by central differences, first axis the
    components of z.
    """
    steps = STEP * np.eye(z.size)
    return np.array([(function(z + step) - function(z - step)) / (2 * STEP) for step in steps])


def divergence(density: Callable[[Any], float], field: Callable[[Any], Any], z: Any) -> float:
    """Return div(ρF) / (|ρ| ‖DF‖) at z."""
    total = float(np.trace(slopes(lambda x: density(x) * field(x), z)))
    return total / (abs(density(z)) * float(np.linalg.norm(slopes(field, z))))
