"""Separation in spheroconic coordinates: polynomials whose zeros are constants and turning points,
and coordinates back to points of the sphere.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.potentials.separable import SeparablePotential, family_polynomial

Array = NDArray[np.float64]

#: A root of R whose imaginary part is below this (relative) is real: half of the digits, as for a
#: double root.
_REAL = 1e-8


def neumann_polynomial(
    point: Any, inverse: Any, q_squared: Any, wedge_squared: Any
) -> tuple[Any, Any]:
    """Return N(λ) = Σ_{i<j} P_ij² Π_{k≠i,j}(λ−I_k) + Σ_i q_i² Π_{k≠i}(λ−I_k), and its derivative.

    ``inverse`` holds the I_i, ``q_squared`` the q_i², ``wedge_squared`` the P_ij². N = Φ𝓕 with 𝓕 of
    (family1, printed 6.25) and Φ = Π(λ−I_k); its zeros are c_1 = 0, c_2, …, c_{n−1}. No division
    occurs, so I's may coincide. Works in any arithmetic with + − ×: floats, arrays of λ,
    multiprecision numbers, fractions.
    """
    zero = 0 * point
    # Π_{k<m}(λ−I_k) and its derivative
    product = zero + 1
    slope = zero
    value = zero
    value_slope = zero
    partial: list[tuple[Any, Any]] = []  # Π_{k<m, k≠i}(λ−I_k) for each i < m, with derivatives
    for m, I_m in enumerate(inverse):
        x = point - I_m
        value_slope = value_slope * x + value + q_squared[m] * slope
        value = value * x + q_squared[m] * product
        for i, (t, t_slope) in enumerate(partial):
            value = value + wedge_squared[i][m] * t
            value_slope = value_slope + wedge_squared[i][m] * t_slope
        partial = [(t * x, t_slope * x + t) for t, t_slope in partial]
        partial.append((product, slope))
        product, slope = product * x, slope * x + product
    return value, value_slope


def from_spheroconic(A: Array, spheroconic: Array, signs: Array) -> Array:
    """Return q with q_i² = Π_s(I_i−λ_s)/Π_{j≠i}(I_i−I_j), equation (S_n, printed 6.10), and the
    given signs, shape (..., n).

    The A_i are distinct, and the λ_s interlace the I_i.
    """
    inverse = 1 / A
    numerator = np.prod(inverse[:, None] - spheroconic[..., None, :], axis=-1)
    difference = inverse[:, None] - inverse[None, :]
    np.fill_diagonal(difference, 1.0)
    return np.asarray(
        np.sign(signs) * np.sqrt(np.abs(numerator / np.prod(difference, axis=1))), dtype=np.float64
    )


def separated_family(A: Array, alphas: Sequence[float]) -> SeparablePotential:
    """Return the potential (3.5, printed 4.10), n = 3, 𝓘 = A⁻¹: v(λ) of ``family_polynomial``, and
    β_i = α_{i+2}.
    """
    quartic, quadratic = (Fraction(alpha) for alpha in alphas[:2])
    v = family_polynomial([1 / Fraction(a) for a in A.tolist()], quartic, quadratic)
    return SeparablePotential(to_float(v), np.array(alphas[2:], dtype=np.float64))


def separation_polynomial(A: Array, constants: Array, potential: SeparablePotential) -> Array:
    """Return R(λ) = 2λΦ(λ)[v(λ) − C(λ)], a polynomial: its poles at I_i cancel, R(I_i) = −2 I_i β_i
    Φ'(I_i)².

    Degree 2n−1 for v = 0 and for 1/q_i² alone, n+1+m where the polynomial part has degree m ≥ n−1;
    so for (3.5), n = 3: 5 (α₁ = α₂ = 0), 6 (α₁ = 0), 7. For V = 0 it is 2h times (Rad).
    """
    I = 1 / A
    R = polynomial.polymul(
        polynomial.polyfromroots(I), polynomial.polysub(potential.polynomial, constants)
    )
    for i in np.flatnonzero(potential.centrifugal):
        others = np.delete(I, i)
        R = polynomial.polysub(
            R, potential.centrifugal[i] * np.prod(I[i] - others) * polynomial.polyfromroots(others)
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
