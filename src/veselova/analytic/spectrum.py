"""The two spectra that give the branch points, to more digits than the curve needs.

I_1 < … < I_n are the inverses of the A's; c_1 = 0 < c_2 < … < c_{n−1} are the zeros of N(λ), the eigenvalues of
A⁻¹ − q'q'ᵀ on q⊥; the spheroconic coordinates λ_1 < … < λ_{n−1} at the start are those of A⁻¹ on q⊥. They interlace:
max(c_s, I_s) ≤ λ_s ≤ min(c_{s+1}, I_{s+1}). Coefficients are exact rationals of the data, so the differences of nearby
branch points keep their digits however small they are.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from veselova.analytic.precision import Extended, Values
from veselova.mechanics.errors import InternalContradiction
from veselova.mechanics.integrals import neumann_polynomial
from veselova.mechanics.veselova import Veselova

__all__ = ["Spectrum", "spectrum"]

#: Newton's method from an eigenvalue good to 1e-15 doubles its digits each time; ten steps reach 10⁴ digits.
_NEWTON_STEPS = 14


@dataclass(frozen=True)
class Spectrum:
    """Body axes sorted by increasing I, and the spectra there, as numbers of ``arithmetic``.

    order (n,) the user's axis of each sorted one · inverse (n,) the I's · q, q_prime (n,) with q_prime = dq/dτ₁
    constants (n−1,) c_1 = 0 … c_{n−1} · spheroconic (n−1,) λ's at t = 0 · clock_rate dτ₁/dt at t = 0
    """

    arithmetic: Extended
    order: tuple[int, ...]
    inverse: Values
    q: Values
    q_prime: Values
    constants: Values
    spheroconic: Values
    clock_rate: Any


def spectrum(problem: Veselova, arithmetic: Extended) -> Spectrum:
    """Return the spectra of a moving body, each number to the digits of ``arithmetic`` relative to max I_i."""
    exact = problem.exact
    order = tuple(sorted(range(problem.n), key=lambda i: -exact.A[i]))
    A = [exact.A[i] for i in order]
    q = [exact.q[i] for i in order]
    wedge = [[exact.wedge[i][j] for j in order] for i in order]
    qq = sum(x * x for x in q)
    qAq = sum(a * x * x for a, x in zip(A, q, strict=True))
    rate_squared = sum(A[i] * A[j] * wedge[i][j] ** 2 for j in range(problem.n) for i in range(j)) / qAq
    inverse = [1 / a for a in A]
    q_squared = [x * x / qq for x in q]
    wedge_squared = [[w * w / (qq * rate_squared) for w in row] for row in wedge]

    number = arithmetic.number
    I = arithmetic.array(inverse)
    q2, P2 = arithmetic.array(q_squared), arithmetic.array(wedge_squared)
    length, rate = arithmetic.sqrt(number(qq)), arithmetic.sqrt(number(rate_squared))
    u = arithmetic.array(q) / length
    # (q∧q̇)ᵀq/(q,q) is the tangential part of q̇.
    tangent = [sum(q[i] * wedge[i][j] for i in range(problem.n)) / qq for j in range(problem.n)]
    v = arithmetic.array(tangent) / rate

    zero = 0 * P2
    spheroconic = _polished(lambda x: neumann_polynomial(x, I, q2, zero), problem.spheroconic, arithmetic)
    constants = _polished(lambda x: neumann_polynomial(x, I, q2, P2), problem.constants, arithmetic)
    if spheroconic is None or constants is None or not _interlace(I, spheroconic, constants):
        spheroconic, constants = _eigenvalues(arithmetic, I, u, v)
    return Spectrum(arithmetic, order, I, u, v, arithmetic.array([0, *constants]), arithmetic.array(spheroconic), rate)


def _polished(function: Callable[[Any], tuple[Any, Any]], guesses: Values, arithmetic: Extended) -> list[Any] | None:
    """Return the roots near the guesses by Newton's method, or None where two guesses lead to one root."""
    roots = []
    for guess in guesses.tolist():
        x = arithmetic.number(guess)
        for _ in range(_NEWTON_STEPS):
            value, slope = function(x)
            if value == 0 or slope == 0:
                break
            step = value / slope
            x = x - step
            if abs(step) <= 10 * arithmetic.epsilon * abs(x):
                break
        roots.append(x)
    return roots if all(a < b for a, b in itertools.pairwise(roots)) else None


def _interlace(inverse: Values, spheroconic: list[Any], constants: list[Any]) -> bool:
    slack = 1e-20 * abs(inverse[-1])
    lower = [inverse[0], *(max(c, i) for c, i in zip(constants, inverse[1:]))]
    upper = [*(min(c, i) for c, i in zip(constants, inverse[1:])), inverse[-1]]
    return all(low - slack <= x <= up + slack for low, x, up in zip(lower, spheroconic, upper, strict=True))


def _eigenvalues(arithmetic: Extended, inverse: Values, u: Values, v: Values) -> tuple[list[Any], list[Any]]:
    """Return both spectra as eigenvalues in extended precision: slower, and indifferent to clusters."""
    n = len(u)
    w = u.copy()
    w[-1] = w[-1] + (1 if w[-1] >= 0 else -1)
    basis = (arithmetic.array(np.eye(n).tolist()) - np.outer(w, w) * (2 / sum(w * w)))[:, :-1]
    position = basis.T @ (basis * inverse[:, None])
    along = basis.T @ v
    spheroconic = arithmetic.symmetric_eigenvalues(position)
    constants = arithmetic.symmetric_eigenvalues(position - np.outer(along, along))[1:]
    if not _interlace(inverse, spheroconic, constants):
        raise InternalContradiction("spectra do not interlace")
    return spheroconic, constants
