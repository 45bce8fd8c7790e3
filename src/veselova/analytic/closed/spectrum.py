"""The branch points of a start, by FLINT from rational polynomials (section 2 of the paper).

    U(λ) = Σ_i q_i² Π_{k≠i}(λ−I_k) = Π_s (λ−λ_s)
    N(λ) = U(λ) + Σ_{i<j} (q_iq_j' − q_jq_i')² Π_{k≠i,j}(λ−I_k) = Π_k (λ−c_k),   |q| = 1

Roots come as balls whose bits are doubled until every difference of neighbours has its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cmp_to_key
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from flint import arb, fmpq, fmpq_poly
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.spectrum.moving_part import Moving, squared_rates

__all__ = ["Start", "exact_start", "to_doubles"]

Array = NDArray[np.float64]

#: Derived: digits of the roots at first, and at most; so many of every difference are its own.
_DIGITS, _MOST_DIGITS, _OWN = 60, 4000, 27


class Start(NamedTuple):
    """What ``kernel.torus.make_torus`` takes of a start; axes by decreasing A.

    - d: (2g+1, 2g+1) b_j − b_i; points: (2g+1,) b_j, the largest I is 1
    - of_I: (n,) place of I_i among the b; of_c: (g,) that of c_k
    - signs: (n,) of the roots of ``frame``
    - on_cuts: (2, g) λ_s−b_{2s−1} and b_{2s}−λ_s; up: (g,) whether λ_s increases
    - rate: (1,) d(time)/dτ₁
    """

    d: Any
    points: Any
    of_I: NDArray[np.int64]
    of_c: NDArray[np.int64]
    signs: Array
    on_cuts: Any
    up: NDArray[np.bool_]
    rate: Any


def exact_start(moving: Moving) -> Start | None:
    """Return the start of what moves in balls, every difference of branch points with digits of its
    own; None where two coincide.
    """
    numbers = _Rationals(moving)
    if numbers.has_coincidence:
        return None
    digits = _DIGITS
    while digits <= _MOST_DIGITS:
        with balls(digits):
            found = numbers.start()
        if found is not None:
            return found
        digits *= 2
    return None


def to_doubles(start: Start) -> Start:
    """Return the start with every number rounded once."""
    found = {
        name: np.vectorize(float, otypes=[np.float64])(getattr(start, name))
        for name in ("d", "points", "on_cuts", "rate")
    }
    return start._replace(**found)


class _Rationals:
    """The polynomials of a start, exact."""

    def __init__(self, moving: Moving) -> None:
        m = moving.size
        self.speed, self.rate = squared_rates(moving)
        self.time = moving.time
        self.I = [_rational(1 / a) for a in moving.A]
        self.q2 = [_rational(x) for x in moving.q_squared]
        self.v2 = [_rational(x) for x in moving.v_squared]
        self.qv = [_rational(x) for x in moving.qv]
        x = fmpq_poly([0, 1])
        factors = [x - p for p in self.I]
        every = fmpq_poly([1])
        for factor in factors:
            every *= factor
        without = [every // factor for factor in factors]
        qq = sum(self.q2, fmpq(0))
        self.U = sum((self.q2[i] * without[i] for i in range(m)), fmpq_poly([0]))
        wedge = fmpq_poly([0])
        for i in range(m):
            for j in range(i):
                square = self.q2[i] * self.v2[j] + self.q2[j] * self.v2[i]
                square -= 2 * self.qv[i] * self.qv[j]
                if square != 0:
                    wedge += square * (without[i] // factors[j])
        self.N = self.U + wedge * (1 / _rational(self.speed)) if m > 1 else self.U
        self.qq = qq

    @property
    def has_coincidence(self) -> bool:
        """Return whether two A's are equal or some c_k is I_i exactly."""
        return len({str(x) for x in self.I}) < len(self.I) or any(self.N(x) == 0 for x in self.I)

    def start(self) -> Start | None:
        """Return the start at the working precision, None where that leaves differences open."""
        I, g = [arb(x) for x in self.I], len(self.I) - 1
        lam, c = (_real_roots(P, g) for P in (self.U, self.N))
        if lam is None or c is None:
            return None
        if self.time != "tau1":
            c[0] = arb(0)
        labelled = [(x, 0, i) for i, x in enumerate(I)] + [(x, 1, k) for k, x in enumerate(c)]
        labelled.sort(key=cmp_to_key(_compare))
        place = {(kind, i): k for k, (_, kind, i) in enumerate(labelled)}
        of_I = [place[0, i] for i in range(g + 1)]
        b = [item[0] for item in labelled]
        if not all(_is_known(y - x) for x, y in pairwise(b)):
            return None
        up, on_cuts = [], np.empty((2, g), dtype=object)
        for s in range(g):
            turning = next(
                (i for i in (s, s + 1) if self.U(self.I[i]) == 0 and lam[s].overlaps(I[i])), None
            )
            ends = [lam[s] - b[2 * s + 1], b[2 * s + 2] - lam[s]]
            if turning is not None:  # λ_s turns at the start: either direction serves
                at = of_I[turning] - 2 * s - 1
                ends[at], ends[1 - at] = arb(0), b[2 * s + 2] - b[2 * s + 1]
                up.append(True)
            else:
                terms = (x / (lam[s] - p) for x, p in zip(self.qv, I, strict=True) if x != 0)
                slope = sum(terms, arb(0))
                if not (slope > 0 or slope < 0 or slope == 0):
                    return None
                up.append(bool(slope >= 0))
            if not all(end == 0 or _is_known(end) for end in ends):
                return None
            on_cuts[:, s] = ends
        signs = []
        for i in range(g + 1):
            s, lower = (of_I[i] - 1) // 2, of_I[i] % 2 == 1
            if self.q2[i] == 0:  # the root passes zero with ψ: q_i ≥ 0, and q̇_i > 0 where it is 0
                signs.append(1.0 if lower else -1.0)
            else:
                signs.append(1.0 if up[s] or not lower else -1.0)
        rate = 1 / arb(_rational(self.rate)).sqrt()
        points = np.array(b, dtype=object)
        return Start(
            points[None, :] - points[:, None],
            points,
            np.array(of_I),
            np.array([place[1, k] for k in range(g)]),
            np.array(signs),
            on_cuts,
            np.array(up),
            np.array([rate], dtype=object),
        )


def _rational(x: Fraction) -> Any:
    return fmpq(x.numerator, x.denominator)


def _real_roots(polynomial: Any, count: int) -> list[Any] | None:
    """Return the roots, which are real, increasing; None where they are not told apart."""
    found = [(root.real, order) for root, order in polynomial.complex_roots()]
    if len(found) < count:
        return None
    return sorted((x for x, _ in found), key=cmp_to_key(_order))


def _order(one: Any, other: Any) -> int:
    return -1 if one < other else 1


def _compare(one: Sequence[Any], other: Sequence[Any]) -> int:
    return -1 if one[0] < other[0] else 1 if one[0] > other[0] else -1


def _is_known(x: Any) -> bool:
    """Return whether a difference is positive and has enough digits of its own."""
    return bool(x > 0) and x.rel_accuracy_bits() > 3.33 * _OWN
