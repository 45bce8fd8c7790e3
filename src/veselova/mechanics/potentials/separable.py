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

from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.geometry.integrals_of_motion import energy

__all__ = [
    "SeparablePotential",
    "family_polynomial",
    "separated_family",
    "separation_constants",
    "separation_polynomial",
    "spheroconic_polynomial",
    "turning_points",
]

Array = NDArray[np.float64]

#: A root of R whose imaginary part is below this (relative) is real: half of the digits, as for a
#: double root.
_REAL = 1e-8


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


def separated_family(A: Array, alphas: Sequence[float]) -> SeparablePotential:
    """Return the potential (3.5, printed 4.10), n = 3, 𝓘 = A⁻¹: v(λ) of ``family_polynomial``, and
    β_i = α_{i+2}.
    """
    quartic, quadratic = (Fraction(alpha) for alpha in alphas[:2])
    v = family_polynomial([1 / Fraction(a) for a in A.tolist()], quartic, quadratic)
    return SeparablePotential(to_float(v), np.array(alphas[2:], dtype=np.float64))


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


def separation_polynomial(A: Array, constants: Array, potential: SeparablePotential) -> Array:
    """Return R(λ) = 2λΦ(λ)[v(λ) − C(λ)], a polynomial: its poles at I_i cancel, R(I_i) = −2 I_i β_i
    Φ'(I_i)².

    Degree 2n−1 for v = 0 and for 1/q_i² alone, n+1+m where the polynomial part has degree m ≥ n−1;
    so for (3.5), n = 3: 5 (α₁ = α₂ = 0), 6 (α₁ = 0), 7. For V = 0 it is 2h times (Rad).
    """
    I = 1 / A
    R = polynomial.polymul(_product(I), polynomial.polysub(potential.polynomial, constants))
    for i in np.flatnonzero(potential.centrifugal):
        others = np.delete(I, i)
        R = polynomial.polysub(
            R, potential.centrifugal[i] * np.prod(I[i] - others) * _product(others)
        )
    return np.asarray(2 * polynomial.polymulx(polynomial.polytrim(R)), dtype=np.float64)


def turning_points(A: Array, R: Array, spheroconic: Array) -> Array:
    """Return the ends of the intervals on which R ≥ 0 at λ_1 … λ_{n−1}, shape (n−1, 2).

    λ_s moves between its two ends, or rests where they coincide. They lie in [I_s, I_{s+1}], I
    sorted: β_i > 0 makes R(I_i) negative, and the motion turns back before q_i = 0; β_i = 0 makes
    I_i a root, where q_i changes sign; with β_i < 0 R(I_i) is positive, and where I_i is an end the
    motion runs into the plane q_i = 0 in finite time.
    """
    ordered = np.sort(1 / A)
    roots = polynomial.polyroots(R)
    real = roots.real[np.abs(roots.imag) <= _REAL * ordered[-1]]
    ends = []
    for position, low, high in zip(spheroconic, ordered[:-1], ordered[1:], strict=True):
        marks = np.array([low, *np.sort(real[(low < real) & (real < high)]), high])
        open_ones = polynomial.polyval((marks[:-1] + marks[1:]) / 2, R) > 0
        # A turning point is a root and the position only up to rounding: take the nearest interval.
        distance = np.where(
            open_ones, np.maximum(marks[:-1] - position, position - marks[1:]), np.inf
        )
        nearest = int(np.argmin(distance))
        closed = distance[nearest] > _REAL * ordered[-1]
        ends.append((position, position) if closed else (marks[nearest], marks[nearest + 1]))
    return np.array(ends)


def _product(roots: Array) -> Array:
    """Return the coefficients of Π(λ − root)."""
    return np.asarray(polynomial.polyfromroots(roots), dtype=np.float64)
