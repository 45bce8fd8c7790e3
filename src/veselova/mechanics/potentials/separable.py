"""Separation of variables for the reduced rank-one system with a potential: Stäckel form in
spheroconic coordinates, any n.

In time τ, dτ = √(det A/(q,Aq)) dt, the system has the Hamiltonian H* = −2 Σ_k
λ_kΦ(λ_k)π_k²/Π_{s≠k}(λ_k−λ_s) + V with Φ(λ) = Π(λ−I_i). It separates where V = Σ_k
v(λ_k)/Π_{s≠k}(λ_k−λ_s); then, on h and the other constants f_k,

    λ_k' = ±2 √R(λ_k)/Π_{s≠k}(λ_k−λ_s),  R(λ) = 2λΦ(λ)[v(λ) − C(λ)],  C(λ) = h λ^{n−2} + f_{n−3}
        λ^{n−3} + … + f_0.

docs/separable.md derives it. Polynomials are arrays of coefficients, lowest first. A is diagonal,
(n,), I_i = 1/A_i distinct.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from veselova.mechanics.geometry.integrals_of_motion import energy

__all__ = [
    "SeparablePotential",
    "family_polynomial",
    "separation_constants",
    "spheroconic_polynomial",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SeparablePotential:
    """V(q) = Σ_m v_m h_{m−n+2}(λ) + Σ_i β_i/q_i², from v(λ) = Σ_m v_m λ^m − Σ_i β_i
    Φ'(I_i)/(λ−I_i).

    h_j is the complete homogeneous symmetric polynomial of degree j of λ_1 … λ_{n−1}: h_0 = 1, h_1
    = Σ I_i − (A⁻¹q,q), and all are polynomials in the moments (A⁻ʲq,q), of degree 2j in q. Powers m
    < n−2 give V = 0.

    - polynomial: v_0, v_1, …
    - centrifugal: β_1 … β_n
    """

    polynomial: Array
    centrifugal: Array

    def value(self, A: Array, q: Array) -> Any:
        """Return V(q) at a point of the sphere, (n,); complex points too, so that derivatives can
        be taken.
        """
        conics = spheroconic_polynomial(A, q)
        h: list[Any] = [1.0]
        for j in range(1, len(self.polynomial) - A.size + 2):
            # Π(1 − λ_s x) Σ h_j x^j = 1
            h.append(
                -sum(conics[A.size - 1 - i] * h[j - i] for i in range(1, min(j, A.size - 1) + 1))
            )
        occurring = self.centrifugal != 0
        centrifugal = np.sum(self.centrifugal[occurring] / q[occurring] ** 2)
        return sum(
            (v * x for v, x in zip(self.polynomial[A.size - 2 :], h, strict=False)), centrifugal
        )


def family_polynomial(
    inverse: Sequence[Fraction], quartic: Fraction, quadratic: Fraction
) -> tuple[Fraction, ...]:
    """Return the coefficients of v(λ) = λⁿ⁻²[α₂(σ₁−λ) − α₁(λ²−σ₁λ+σ₂)], n+1 numbers, lowest first,
    of n ≥ 2 numbers I_i.

    σ₁, σ₂ are their elementary symmetric functions. V = α₁[(A⁻²q,q) − (A⁻¹q,q)²] + α₂(A⁻¹q,q), for
    n = 3 that of (3.5, printed 4.10).
    """
    first = sum(inverse, Fraction())
    second = sum((x * y for x, y in combinations(inverse, 2)), Fraction())
    below = [Fraction()] * (len(inverse) - 2)
    return (*below, quadratic * first - quartic * second, quartic * first - quadratic, -quartic)


def spheroconic_polynomial(A: Array, q: Array) -> Array:
    """Return U(λ) = Σ_i q_i² Π_{k≠i}(λ−I_k) = Π_s(λ−λ_s), n coefficients, for (q,q) = 1."""
    return np.asarray(sum(q[i] ** 2 * _product(np.delete(1 / A, i)) for i in range(A.size)))


def separation_constants(A: Array, q: Array, q_dot: Array, potential: SeparablePotential) -> Array:
    """Return C = (f_0, …, f_{n−3}, h), shape (n−1,): the energy and the other constants of a state
    (q, q̇ = dq/dt).

    λC(λ) = ½ Σ_{i<j}(q∧q')²_ij Π_{k≠i,j}(λ−I_k) + T U(λ) + λ [v mod U](λ), q' = dq/dτ, T the
    kinetic energy: C(λ_k) is what Hamilton–Jacobi's equation separates into, and this form divides
    by no λ_k−I_i, only by q_i² where β_i ≠ 0.
    """
    I = 1 / A
    n = A.size
    conics = spheroconic_polynomial(A, q)
    rate_squared = np.prod(A) / (q @ (A * q))
    pairs = [(i, j) for j in range(n) for i in range(j)]
    wedges = sum(
        (q[i] * q_dot[j] - q[j] * q_dot[i]) ** 2 * _product(np.delete(I, [i, j])) for i, j in pairs
    )
    kinetic = energy(A, q, q_dot) * conics
    kinetic[:-1] += wedges / (2 * rate_squared)
    remainder = polynomial.polydiv(potential.polynomial, conics)[1]
    for i in np.flatnonzero(potential.centrifugal):
        # 1/(λ−I_i) mod U is (U(I_i) − U(λ))/((λ−I_i)U(I_i)), and U(I_i) = q_i² Φ'(I_i).
        quotient = polynomial.polydiv(conics, [-I[i], 1.0])[0]
        remainder = polynomial.polyadd(remainder, potential.centrifugal[i] / q[i] ** 2 * quotient)
    constants = polynomial.polyadd(kinetic[1:], remainder)
    return np.asarray(np.pad(constants, (0, n))[: n - 1], dtype=np.float64)


def _product(roots: Array) -> Array:
    """Return the coefficients of Π(λ − root)."""
    return np.asarray(polynomial.polyfromroots(roots), dtype=np.float64)
