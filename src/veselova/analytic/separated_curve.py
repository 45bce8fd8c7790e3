"""The curve of a motion in a separable potential: w² = R(λ) with R of any degree, its roots, and the cuts where λ_s move.

In time τ, dτ = √(det A/(q,Aq)) dt, the spheroconic coordinates obey λ_k' = 2w_k/Π_{s≠k}(λ_k−λ_s), w² = R(λ) = 2λΦ(λ)[v(λ) − C(λ)]
(docs/separable.md). The data are rationals, so R is exact, and its roots have as many digits as their differences ask for.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.four_points import FourPoints
from veselova.analytic.precision import DOUBLE, Decimals
from veselova.analytic.rational_polynomial import (
    NEAR,
    Polynomial,
    monic,
    product,
    quotient,
    remainder,
    roots,
    total,
    trimmed,
    value,
)
from veselova.analytic.secular import TooFewDigits, zeros_between_poles
from veselova.mechanics.errors import Unsolved

__all__ = ["SeparableStart", "SeparatedCut", "separated_cuts"]

Array = NDArray[np.float64]

#: Digits of λ_s at the start, and of the roots: a start on a coordinate axis is one where a difference of them is zero.
_DIGITS = 60

#: A root nearer to the end of a cut than this part of the cut makes its period nearly infinite: a separatrix.
_SEPARATRIX = 1e-12


@dataclass(frozen=True)
class SeparableStart:
    """A start (q, q̇) in the potential of v(λ) = Σ_m v_m λ^m − Σ_i β_iΦ'(I_i)/(λ−I_i), all exact; (q,q̇) = 0, |q| any.

    inverse (n,) distinct I's, increasing · q, q_dot (n,) along these axes · polynomial: the v_m · centrifugal (n,) the β_i,
    none of them at q_i = 0 · size: 1 where q̇ is scaled as q is, (q,q) where it is the velocity of the unit vector
    """

    inverse: tuple[Fraction, ...]
    q: tuple[Fraction, ...]
    q_dot: tuple[Fraction, ...]
    polynomial: tuple[Fraction, ...]
    centrifugal: tuple[Fraction, ...]
    size: Fraction = Fraction(1)

    @cached_property
    def q_squared(self) -> list[Fraction]:
        """Return q_i² for |q| = 1."""
        size = sum((x * x for x in self.q), Fraction())
        return [x * x / size for x in self.q]

    @cached_property
    def conics(self) -> Polynomial:
        """Return U(λ) = Σ q_i² Π_{k≠i}(λ−I_k) = Π(λ−λ_s)."""
        parts = [[square * c for c in monic(_without(self.inverse, i))] for i, square in enumerate(self.q_squared)]
        return total(parts)

    @cached_property
    def constants(self) -> Polynomial:
        """Return C(λ), its leading coefficient the energy h: λC = ½Σ_{i<j}(q∧q')²_ij Π_{k≠i,j}(λ−I_k) + T U + λ[v mod U]."""
        size = sum((x * x for x in self.q), Fraction())
        pairs = list(itertools.combinations(range(len(self.q)), 2))
        wedges = {(i, j): ((self.q[i] * self.q_dot[j] - self.q[j] * self.q_dot[i]) / size) ** 2 * self.size for i, j in pairs}
        # (dt/dτ)² = (q,Aq)/det A, and T = ½Σ (q∧q̇)²_ij Π_{k≠i,j} I_k.
        rest = {(i, j): math.prod(_without(self.inverse, i, j)) for i, j in pairs}
        kinetic = sum((rest[pair] * wedges[pair] for pair in pairs), Fraction()) / 2
        rate = sum((x / a for x, a in zip(self.q_squared, self.inverse, strict=True)), Fraction()) * math.prod(self.inverse)
        parts = [[rate * wedges[i, j] / 2 * c for c in monic(_without(self.inverse, i, j))] for i, j in pairs]
        conics = self.conics
        shifted = total([*parts, [kinetic * c for c in conics]])
        rest_of_v = remainder(list(self.polynomial), conics)
        for i, beta in enumerate(self.centrifugal):
            if beta:  # 1/(λ−I_i) mod U = (U(I_i) − U(λ))/((λ−I_i)U(I_i)), and U(I_i) = q_i²Φ'(I_i)
                rest_of_v = total([rest_of_v, [beta / self.q_squared[i] * c for c in quotient(conics, self.inverse[i])]])
        return total([shifted[1:], rest_of_v])

    @cached_property
    def factor(self) -> Polynomial:
        """Return S(λ) with R = 2λ Π_{β_i=0}(λ−I_i) S(λ): what is left to find roots of."""
        walls = [x for x, beta in zip(self.inverse, self.centrifugal, strict=True) if beta]
        excess = total([list(self.polynomial), [-c for c in self.constants]])
        parts = [product(monic(walls), excess)]
        for i, beta in enumerate(self.centrifugal):
            if beta:
                slope = math.prod(self.inverse[i] - x for x in _without(self.inverse, i))
                parts.append([-beta * slope * c for c in monic([x for x in walls if x != self.inverse[i]])])
        return trimmed(total(parts))

    @property
    def degree(self) -> int:
        """Return the degree of R."""
        return len(self.factor) + self.centrifugal.count(Fraction())

    @cached_property
    def spheroconic(self) -> list[Fraction]:
        """Return λ_1 < … < λ_{n−1} at the start, to _DIGITS digits."""
        digits = _DIGITS
        while True:
            try:
                with Decimals(digits) as arithmetic:
                    poles, weights = arithmetic.array(self.inverse), arithmetic.array(self.q_squared)
                    return [Fraction(x) for x in zeros_between_poles(poles, weights, 0, arithmetic)]
            except TooFewDigits:
                digits *= 2


@dataclass(frozen=True)
class SeparatedCut:
    """The interval [a, b] on which λ_s moves, in the elliptic angle ψ of its ends and the real roots of R next to them.

    lower a · width b−a · left (…) a−r of the real roots r < a, the nearest last · right (…) r−b of those above, the nearest first
    pairs (…, 2) a−Re r, Im r of complex ones · leading |leading coefficient of R| · below, above: λ_s−a and b−λ_s at the start
    axes: the numbers of the I's that are a and b, None where an end is none
    """

    lower: float
    width: float
    left: Array
    right: Array
    pairs: Array
    leading: float
    below: float
    above: float
    axes: tuple[int | None, int | None]

    @cached_property
    def points(self) -> FourPoints:
        """Return the cut with its neighbours; λ = 0 is a root, so there always is one below."""
        return FourPoints(DOUBLE, self.left[-1], self.width, self.right[0] if self.right.size else None)

    def point(self, psi: Array) -> tuple[Array, Array]:
        """Return λ−a and b−λ at angles ψ."""
        below, above = self.points.roots(psi)
        return below * below, above * above

    def _factors(self, psi: Array) -> tuple[Array, Array]:
        """Return |λ−r| for the neighbours, multiplied, and for all other roots."""
        below, above = (x[..., None] for x in self.point(psi))
        left, right = below + self.left, above + self.right
        far = np.prod(left[..., :-1], axis=-1) * np.prod(right[..., 1:], axis=-1)
        complex_ones = np.prod((below + self.pairs[:, 0]) ** 2 + self.pairs[:, 1] ** 2, axis=-1)
        return left[..., -1] * (right[..., 0] if self.right.size else 1.0), self.leading * far * complex_ones

    def outer_root(self, psi: Array) -> Array:
        """Return √(R/((λ−a)(b−λ))) at angles ψ."""
        near, far = self._factors(psi)
        return np.asarray(np.sqrt(near * far))

    def speed(self, psi: Array) -> Array:
        """Return √R dψ/dλ at angles ψ."""
        return np.asarray(np.sqrt(self._factors(psi)[1]) / (2 * self.points.density))


def separated_cuts(start: SeparableStart) -> list[SeparatedCut]:
    """Return the cuts of a start; raises Unsolved (``collision``, ``separatrix``, ``clustered-roots``)."""
    factor = start.factor
    found = roots(factor)
    free = [x for x, beta in zip(start.inverse, start.centrifugal, strict=True) if not beta]
    real = sorted([Fraction(0), *free, *(x for x, y in found if y == 0)])
    pairs = [(x, y) for x, y in found if y > 0]
    R = [2 * c for c in product([Fraction(0), Fraction(1)], product(monic(free), factor))]
    return [_cut(start, s, point, real, pairs, R) for s, point in enumerate(start.spheroconic)]


def _cut(
    start: SeparableStart, s: int, point: Fraction, real: list[Fraction], pairs: list[tuple[Fraction, Fraction]], R: Polynomial
) -> SeparatedCut:
    low, high = start.inverse[s], start.inverse[s + 1]
    scale = start.inverse[-1]
    marks = [x for x in real if low <= x <= high]
    at = next((x for x in marks if abs(x - point) <= NEAR * scale), None)
    before = [x for x in marks if x < point and x != at]
    after = [x for x in marks if x > point and x != at]
    if at is None:
        ends = (before[-1] if before else None), (after[0] if after else None)
    else:  # it starts at a turning point, and moves to where R > 0; where that is nowhere, it stays
        up = bool(after) and value(R, (at + after[0]) / 2) > 0
        down = bool(before) and value(R, (at + before[-1]) / 2) > 0
        ends = (at, after[0]) if up else (before[-1], at) if down else (at, at)
        point = at
    lower, upper = ends
    if lower is None or upper is None:
        axis = s if lower is None else s + 1
        raise Unsolved("collision", f"the motion runs into the plane q_{axis + 1} = 0 of the sorted axes, where V is −∞")
    width = upper - lower
    others = list(real)
    others.remove(lower)
    others.remove(upper)
    nearest = min((abs(x - end) for x in others for end in (lower, upper)), default=scale)
    if nearest <= Fraction(_SEPARATRIX) * (width if width else scale):
        raise Unsolved("separatrix", "a turning point is nearly a double root: the motion is asymptotic, or within 1e-12 of one")
    names = {x: i for i, x in enumerate(start.inverse) if not start.centrifugal[i]}
    return SeparatedCut(
        lower=float(lower),
        width=float(width),
        left=np.array([float(lower - x) for x in sorted(others) if x < lower]),
        right=np.array([float(x - upper) for x in sorted(others) if x > upper]),
        pairs=np.array([(float(lower - x), float(y)) for x, y in pairs]).reshape(-1, 2),
        leading=abs(float(R[-1])),
        below=float(point - lower),
        above=float(upper - point),
        axes=(names.get(lower), names.get(upper)),
    )


def _without(values: Sequence[Fraction], *omitted: int) -> list[Fraction]:
    return [x for i, x in enumerate(values) if i not in omitted]
