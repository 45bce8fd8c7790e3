"""Chaplygin's reducing multiplier of the reduced LR flow on T*V(r,n), and what stands in its way.

The reduced flow (2.1, printed 3.12) is q̇ = ∂H/∂p, ṗ = −∂H/∂q + Π with Π(ξ) = −⟨𝓘ω, pr_⊥[ω,Φ(ξ)]⟩,
the right-hand side of (1.2, printed 2.10). It needs no
coordinates: Π is the tensor Π_abc = −⟨𝓘w_a, pr_⊥[w_b,w_c]⟩, made symmetric in a, b, of an
𝓘-orthonormal basis w of 𝓓_r. Its cyclic sum vanishes, so it is the sum of a trace, which is exactly
(x5, printed 3.18) with d ln 𝒩 in proportion to it, and of a traceless part. The trace is closed,
since there is an invariant measure (Theorem mes). Hence a multiplier 𝒩(q) exists if and only if the
traceless part vanishes everywhere; for dim Q = 2 there is none, which is Chaplygin's theorem (item
2 of Theorem Th_reduce).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiefel_chart import admissible_basis, dimension
from veselova.mechanics.bodies.stiefel_inertia import BodyInertia, body_inertia
from veselova.mechanics.core.flow import FLOATS
from veselova.mechanics.geometry.stiefel import (
    admissible_part,
    angular_velocity,
    momentum_map,
    product,
)
from veselova.mechanics.results.trajectory import Trajectory

__all__ = [
    "ChaplyginMultiplier",
    "gyroscopic_tensor",
    "invariant_density",
    "restricted_determinant",
]

Array = NDArray[np.float64]

#: Nodes of the Gauss rule on each radian of turning: 𝒩 is analytic there, and twelve leave 1e-14.
_NODES = 12

#: A tensor Π smaller than this, against an inertia operator of order one, is rounding: the flow is
#: Hamiltonian as it stands.
_NO_FORCE = 1e-12


def restricted_determinant(inertia: BodyInertia, X: Array) -> float:
    """Return det(𝓘|𝓓_r), equation (IM3, printed 5.10), in units of 2^exponent of the operator."""
    basis = admissible_basis(X)
    return float(np.linalg.det(_gram(basis, inertia.apply(basis))))


def invariant_density(inertia: BodyInertia, X: Array) -> float:
    """Return 1/√det(𝓘|𝓓_r), the density of the invariant measure with respect to Ω^N (Theorem mes),
    in those units.
    """
    return float(1 / np.sqrt(restricted_determinant(inertia, X)))


def _gram(first: Array, second: Array) -> Array:
    return product(first[:, None], second[None, :])


def _orthonormal_basis(inertia: BodyInertia, X: Array) -> Array:
    """Return a basis w of 𝓓_r with ⟨𝓘w_a,w_b⟩ = δ_ab, (N, n, n)."""
    basis = admissible_basis(X)
    factor = np.linalg.cholesky(_gram(basis, inertia.apply(basis)))
    return np.tensordot(np.linalg.inv(factor), basis, axes=1)


def gyroscopic_tensor(inertia: BodyInertia, X: Array) -> tuple[Array, Array]:
    """Return Π_abc, so that Π(w_c) = Σ Π_abc ω_a ω_b for ω = Σ ω_a w_a, (N, N, N), and the basis w
    of 𝓓_r, (N, n, n).

    The basis has ⟨𝓘w_a,w_b⟩ = δ_ab in the units of the operator. Π_abc = Π_bac, and Π_abc + Π_bca +
    Π_cab = 0.
    """
    basis = _orthonormal_basis(inertia, X)
    products = basis[:, None] @ basis[None, :]
    brackets = products - np.swapaxes(products, 0, 1)
    beyond = brackets - admissible_part(X, brackets)
    tensor = -product(inertia.apply(basis)[:, None, None], beyond[None])
    return (tensor + tensor.transpose(1, 0, 2)) / 2, basis


def _force_of_multiplier(slopes: Array) -> Array:
    """Return the tensor of (x5, printed 3.18), Π(ξ) = (Gp,p) d ln 𝒩(ξ) − d ln 𝒩(q̇) (p,ξ), from the
    slopes d ln 𝒩(w_a).
    """
    once = np.multiply.outer(slopes, np.eye(slopes.size))
    return once.transpose(1, 2, 0) - (once + once.transpose(1, 0, 2)) / 2


@dataclass(frozen=True)
class ChaplyginMultiplier:
    """𝒩 = det(𝓘|𝓓_r)^(−1/(2(N−1))), N = dim V(r,n): by item 1 of Theorem Th_reduce no other one, up
    to a factor, can exist.

    dτ = 𝒩 dt, P̃ = 𝒩P, X' = dX/dτ = Ẋ/𝒩. For r = 1, n ≥ 3 and the special inertia 𝒩 = √(det
    A/(Aq,q)) (Theorem main). Where N = 1 every 𝒩 will do, and it is 1. ``potential`` V(X) ↦ number
    is that of L* and H*; None for V = 0.
    """

    inertia: BodyInertia
    rank: int
    potential: Callable[[Array], float] | None = None

    @classmethod
    def of(
        cls, inertia: Any, n: int, rank: int, potential: Callable[[Array], float] | None = None
    ) -> ChaplyginMultiplier:
        """Return the multiplier of an inertia operator, given as in ``StiefelFlow``."""
        return cls(body_inertia(inertia, n), rank, potential)

    @property
    def freedom(self) -> int:
        """Return N = dim V(r,n), the degrees of freedom."""
        return dimension(self.inertia.n, self.rank)

    def value(self, X: Array) -> float:
        """Return 𝒩(X)."""
        if self.freedom == 1:
            return 1.0
        power = -0.5 / (self.freedom - 1)
        unit = np.exp2(power * self.inertia.exponent * self.freedom)
        return float(restricted_determinant(self.inertia, X) ** power * unit)

    def slopes(self, X: Array, directions: Array) -> Array:
        """Return d ln 𝒩 along Ẋ = −ηX for skew η (k, n, n), shape (k,): Σ_a ⟨𝓘w_a,[η,w_a]⟩/(N−1), w
        an 𝓘-orthonormal basis.
        """
        if self.freedom == 1:
            return np.zeros(len(directions))
        basis = _orthonormal_basis(self.inertia, X)
        brackets = directions[:, None] @ basis - basis @ directions[:, None]
        return np.asarray(
            np.sum(product(self.inertia.apply(basis), brackets), axis=1) / (self.freedom - 1),
            dtype=np.float64,
        )

    def momentum(self, X: Array, P: Array) -> Array:
        """Return P̃ = 𝒩P."""
        return self.value(X) * P

    def lagrangian(self, X: Array, X_prime: Array) -> float:
        """Return L*(X,X') = ½𝒩²⟨𝓘Φ(X,X'),Φ(X,X')⟩ − V, from X' = dX/dτ."""
        omega = angular_velocity(X, X_prime)
        kinetic = np.ldexp(product(self.inertia.apply(omega), omega) / 2, self.inertia.exponent)
        return float(kinetic * self.value(X) ** 2 - self._potential(X))

    def hamiltonian(self, X: Array, P_tilde: Array) -> float:
        """Return H*(X,P̃) = H(X,P̃/𝒩), from P̃ = 𝒩P."""
        omega = self.inertia.angular_velocity(X, P_tilde, self.inertia.parameters, FLOATS)
        kinetic = np.ldexp(product(momentum_map(X, P_tilde), omega) / 2, -self.inertia.exponent)
        return float(kinetic / self.value(X) ** 2 + self._potential(X))

    def _potential(self, X: Array) -> float:
        return 0.0 if self.potential is None else float(self.potential(X))

    def obstruction(self, X: Array) -> float:
        """Return ‖Π − Π_𝒩‖/‖Π‖, how far (x5, printed 3.18) is from true at X: 0 where 𝒩 makes the
        flow Hamiltonian, at most 1; 0 where Π = 0.

        Π_𝒩 is the trace of Π, the nearest tensor of the form (x5) whatever 𝒩 is: no other
        multiplier does better, at any X.
        """
        tensor, basis = gyroscopic_tensor(self.inertia, X)
        size = float(np.linalg.norm(tensor))
        if size <= _NO_FORCE:
            return 0.0
        return float(np.linalg.norm(tensor - _force_of_multiplier(self.slopes(X, basis)))) / size

    def time(self, trajectory: Trajectory) -> Array:
        """Return τ = ∫𝒩 dt, zero at t = 0, at the times of a trajectory of ``StiefelFlow``; error
        about 1e-13·(1 + |τ|).
        """
        times = trajectory.times
        turning = trajectory.problem.turning
        edges = np.union1d(times, 0.0)
        edges = np.union1d(
            edges, np.linspace(edges[0], edges[-1], 2 + int((edges[-1] - edges[0]) * turning))
        )
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        half = np.diff(edges)[:, None] / 2
        points = edges[:-1, None] + half * (nodes + 1)
        values = [self.value(X) for X in trajectory.at(points.ravel()).series("X")]
        passed = np.concatenate(
            [[0.0], np.cumsum(np.sum(half * weights * np.reshape(values, points.shape), axis=1))]
        )
        return np.asarray(
            passed[np.searchsorted(edges, times)] - passed[np.searchsorted(edges, 0.0)],
            dtype=np.float64,
        )
