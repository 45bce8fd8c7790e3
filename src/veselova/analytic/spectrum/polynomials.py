"""The two spectra of a start as zeros of rational polynomials, which FLINT isolates.

    U(λ) = Σ_i q_i² Π_{k≠i}(λ−I_k) = |q|² Π_s (λ−λ_s),   (S_n, printed 6.10)
    N(λ) = U(λ) + Σ_{i<j} (q_iq_j' − q_jq_i')² Π_{k≠i,j}(λ−I_k) = |q|² Π_k (λ−c_k),
           and the second sum is (U V − W²)/Π_k(λ−I_k), V and W as U with q_i'² and q_iq_i'

Zeros that U or N have in common with a pole I_i, with one another, or at 0 are known exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb, fmpq_poly

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.spectrum.moving_part import Moving, rationals, squared_rates
from veselova.mechanics.core.budget import checkpoint, iterate, stated_s
from veselova.mechanics.core.errors import OverBudget

__all__ = [
    "Polynomials",
    "product_over_poles",
    "spheroconic",
    "sum_over_poles",
    "zeros_of_position",
]


#: Calibrated: seconds in which FLINT isolates the zeros of polynomials of that degree, and the
#: power of the degree by which they grow.
_SECONDS, _SIZE, _POWER = 0.8, 64, 3.5


class Polynomials:
    """The polynomials U, of the spheroconic coordinates, and N, of the constants, of what moves,
    exact; I: (m,).
    """

    def __init__(self, moving: Moving) -> None:
        self.I = [1 / a for a in rationals(moving.A)]
        weights = moving.q_squared, moving.v_squared, moving.qv
        self.U, V, W = (sum_over_poles(self.I, rationals(x)) for x in weights)
        across = (self.U * V - W * W) // product_over_poles(self.I)
        self.N = self.U + across * (1 / squared_rates(moving)[0])
        self._neumann = moving.time == "tau1"  # c_1 is not known to be zero

    def zeros(self) -> tuple[list[Any], list[Any], list[Any]]:
        """Return I_1 … I_m, λ_1 … λ_{m−1} and c_1 … c_{m−1}, increasing, as balls of the working
        precision. Numbers that are equal are one object.
        """
        self._require_time()
        I = [arb(x) for x in self.I]
        spheroconic, U = self._at_poles(self.U, I)
        constants, N = self._at_poles(self.N, I)
        if not self._neumann:
            constants.append(arb(0))
            N //= fmpq_poly([0, 1])
        common = U.gcd(N)
        shared = real_zeros(common)
        spheroconic += [*shared, *real_zeros(U // common)]
        constants += [*shared, *real_zeros(N // common)]
        return I, sorted(spheroconic, key=_middle), sorted(constants, key=_middle)

    def _require_time(self) -> None:
        """Raise OverBudget where isolating the zeros, which nothing stops, would take too long."""
        checkpoint()
        seconds = _SECONDS * (len(self.I) / _SIZE) ** _POWER
        if len(self.I) > _SIZE and seconds > stated_s():
            raise OverBudget(stated_s(), seconds, " of the branch points, or allow more")

    def _at_poles(self, polynomial: Any, I: list[Any]) -> tuple[list[Any], Any]:
        """Return the zeros that are poles, and the polynomial without them."""
        found = []
        for x, ball in zip(self.I, I, strict=True):
            while polynomial.degree() > 0 and polynomial(x) == 0:
                found.append(ball)
                polynomial //= fmpq_poly([-x, 1])
        return found, polynomial


def zeros_of_position(I: Sequence[Any], q_squared: Sequence[Any]) -> list[Any]:
    """Return the zeros of U, increasing, as balls of the working precision."""
    return real_zeros(sum_over_poles(rationals(I), rationals(q_squared)))


def spheroconic(q: Values, inverse: Values, xp: Any) -> Values:
    """Return the λ's of positions q (N, m), shape (N, m−1): the zeros of Σ q_i² Π_{k≠i}(λ−I_k).

    They are eigenvalues of A⁻¹ on q⊥, which move by at most 4|δq| max A⁻¹: those of the midpoints
    are found, and widened by that.
    """
    apart = (4 * np.sum(np.abs(q - xp.midpoints(q)), axis=1) + 4 * xp.epsilon) * inverse[-1]
    if not all(x.is_finite() for x in apart):
        raise ZeroDivisionError("a position that is not known at all")
    poles = [x.mid().fmpq() for x in inverse]
    rows = [[x.mid().fmpq() ** 2 for x in row] for row in q]
    found = np.array([zeros_of_position(poles, row) for row in iterate(rows)])
    return np.asarray(xp.add_error(found, apart[:, None]))


def real_zeros(polynomial: Any) -> list[Any]:
    """Return the zeros of a rational polynomial that has real ones alone, increasing and with their
    multiplicities, as disjoint balls to the working precision, relatively.
    """
    if polynomial.degree() < 1:
        return []
    zeros = [root.real for root, order in polynomial.complex_roots() for _ in range(order)]
    return sorted(zeros, key=_middle)


def _middle(x: Any) -> Any:
    return x.mid()


def product_over_poles(I: Sequence[Any]) -> Any:
    """Return Π_k(λ−I_k)."""
    return math.prod((fmpq_poly([-x, 1]) for x in I), start=fmpq_poly([1]))


def sum_over_poles(I: Sequence[Any], weights: Sequence[Any]) -> Any:
    """Return Σ_i w_i Π_{k≠i}(λ−I_k)."""
    every = product_over_poles(I)
    parts = (w * (every // fmpq_poly([-x, 1])) for x, w in zip(I, weights, strict=True))
    return sum(parts, fmpq_poly([0]))
