"""Inertia operators on so(n): the special one (4.5, printed 5.11) of a diagonal A, and any other,
as a symmetric positive definite matrix.

Both are kept in units 2^exponent near their own size, so that neither det A nor the unit of the
input leaves the float range.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.inertia_operator import Inertia
from veselova.mechanics.core.flow import Operations
from veselova.mechanics.geometry.integrals_of_motion import unit_scale
from veselova.mechanics.geometry.so_n import coefficients, skew

__all__ = ["BodyInertia", "MatrixInertia", "SpecialInertia", "body_inertia"]

Array = NDArray[np.float64]


def _wedge(X: Any, transposed: Any, ops: Operations) -> Any:
    """Return XWᵀ − WXᵀ from X and Wᵀ."""
    turning = ops.dot(X, transposed)
    return turning - np.swapaxes(turning, -1, -2)


@dataclass(frozen=True)
class SpecialInertia:
    """𝓘(E_i∧E_j) = (A_iA_j/det A) E_i∧E_j, equation (4.5, printed 5.11), that is 𝓘ω = AωA/det A; A
    (n,) has determinant near one.
    """

    A: Array
    determinant: float
    exponent: int

    @classmethod
    def of(cls, A: Array) -> SpecialInertia:
        """Return the operator of n positive numbers."""
        scaled, k = unit_scale(A)
        return cls(scaled, float(np.prod(scaled)), k * (2 - A.size))

    @property
    def n(self) -> int:
        """Return the dimension of the body."""
        return self.A.size

    @property
    def parameters(self) -> Array:
        """Return (A, det A/A, det A)."""
        return np.concatenate([self.A, self.determinant / self.A, [self.determinant]])

    def apply(self, omega: Array) -> Array:
        """Return AωA/det A."""
        return np.asarray(self.A[:, None] * omega * (self.A / self.determinant), dtype=np.float64)

    def angular_velocity(self, X: Any, P: Any, parameters: Any, ops: Operations) -> Any:
        """Return the ω ∈ 𝓓_r with pr_𝓓 𝓘ω = XPᵀ − PXᵀ, the inverse of (dotX->P), shape (..., n, n).

        X, P are (..., n, r) and meet (condX, printed 5.20); symbols have no leading axes. The
        condition is −(𝓘ω)X = Y = P + XXᵀP, and ω = XWᵀ − WXᵀ with W = det A·(A⁻¹Y +
        ½XK⁻¹YᵀX)K⁻¹, K = XᵀAX: (dot_q, printed 6.6) for every rank.

        AωAX = −det A·Y is then an identity: ωAX = XWᵀAX − WK, and WᵀAX = ½ det A·K⁻¹YᵀX.
        """
        n = self.n
        A = parameters[:n, None]
        inverse = parameters[n:-1, None]
        determinant = parameters[-1]
        transposed = np.swapaxes(X, -1, -2)
        K = ops.dot(transposed, A * X)
        skewed = ops.dot(transposed, P)
        along = determinant * ops.solve(K, -skewed)
        right = inverse * (P + ops.dot(X, skewed)) + ops.dot(X, along)
        return _wedge(X, ops.solve(K, np.swapaxes(right, -1, -2)), ops)


@dataclass(frozen=True)
class MatrixInertia:
    """An inertia operator given by its matrix on the coefficients of E_i∧E_j, of size near one."""

    n: int
    operator: Array
    exponent: int

    @classmethod
    def of(cls, operator: Array, n: int) -> MatrixInertia:
        """Return the operator of a symmetric positive definite matrix (m, m), m = n(n−1)/2."""
        k = int(np.rint(np.mean(np.log2(np.diag(operator)))))
        return cls(n, np.ldexp(operator, -k), k)

    @property
    def parameters(self) -> Array:
        """Return the entries of the matrix."""
        return self.operator.ravel()

    def apply(self, omega: Array) -> Array:
        """Return 𝓘ω."""
        return skew(coefficients(omega) @ self.operator, self.n)

    def angular_velocity(self, X: Any, P: Any, parameters: Any, ops: Operations) -> Any:
        """Return ω = XWᵀ − WXᵀ, W (n, r) the solution of −(𝓘ω)X + X(XᵀW + WᵀX) = P + XXᵀP, a
        definite system of nr equations.

        The second term, zero at the solution, takes away that W is determined up to X times a
        symmetric matrix only.
        """
        n, r = X.shape[-2:]
        size = n * (n - 1) // 2
        lead = X.shape[:-2]
        transposed = np.swapaxes(X, -1, -2)
        # Σ_j 𝓘_{ij,kl} X_jα, then with X_lβ: the quadratic form of W, axes i, α, k, β.
        once = ops.dot(
            transposed, self._tensor(parameters.reshape(size, size)).reshape(n, -1)
        ).reshape(*lead, r * n * n, n)
        form = np.moveaxis(ops.dot(once, X).reshape(*lead, r, n, n, r), -4, -3)
        gamma = ops.dot(X, transposed)
        form = form + X[..., :, None, None, :] * transposed[..., None, :, :, None]
        for alpha in range(r):
            form[..., :, alpha, :, alpha] = form[..., :, alpha, :, alpha] + gamma
        image = P + ops.dot(X, ops.dot(transposed, P))
        W = ops.solve(form.reshape(*lead, n * r, n * r), image.reshape(*lead, n * r, 1)).reshape(
            *lead, n, r
        )
        return _wedge(X, np.swapaxes(W, -1, -2), ops)

    def _tensor(self, matrix: Any) -> Any:
        """Return 𝓘_{ij,kl}, skew in both pairs, with the axes in the order j, i, k, l."""
        n = self.n
        rows, columns = np.triu_indices(n, 1)
        half = np.zeros((n, n, matrix.shape[1]), dtype=matrix.dtype)
        half[columns, rows], half[rows, columns] = matrix, -matrix
        tensor = np.zeros((n, n, n, n), dtype=matrix.dtype)
        tensor[:, :, rows, columns], tensor[:, :, columns, rows] = half, -half
        return tensor


#: An inertia operator 𝓘 on so(n), in units of 2^exponent: symmetric and positive definite for ⟨X,Y⟩
#: = −½ tr XY.
BodyInertia: TypeAlias = SpecialInertia | MatrixInertia


def body_inertia(inertia: Any, n: int) -> BodyInertia:
    """Return the operator of {"special": [A_1 … A_n]} or {"matrix": m × m numbers}, m = n(n−1)/2;
    raises InvalidInput.
    """
    stated = Inertia.of(inertia, n)
    return MatrixInertia.of(stated.matrix, n) if stated.A is None else SpecialInertia.of(stated.A)
