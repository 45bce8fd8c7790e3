"""The curve of a motion in a separable potential: w² = R(λ) with R of any degree, its roots, and
the cuts where λ_s move.

In time τ, dτ = √(det A/(q,Aq)) dt, the spheroconic coordinates obey λ_k' = 2w_k/Π_{s≠k}(λ_k−λ_s),
w² = R(λ) = 2λΦ(λ)[v(λ) − C(λ)] (docs/separable.md). The data are rationals, so R is exact, and its
roots have as many digits as their differences ask for. A motion in the plane q_i = 0 is one of n−1
axes: ``SeparableStart.without``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from flint import fmpq, fmpq_poly
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.curve.branch_points import (
    product_over_poles,
    sum_over_poles,
    zeros_of_position,
)
from veselova.analytic.curve.kernel_text import rebound
from veselova.analytic.kernel import elliptic
from veselova.mechanics.core.errors import Unsolved

__all__ = ["SeparableStart", "SeparatedCut", "find_cuts", "moving_axes", "separate"]

Array = NDArray[np.float64]

T = TypeVar("T")

#: The text of elliptic angles over arrays.
_ELLIPTIC = rebound(vars(elliptic) | {"cos": np.cos, "sin": np.sin, "sqrt": np.sqrt})

#: Numbers nearer than this, relative to those around, count as one: roots have more digits.
_NEAR = fmpq(1, 10**40)

#: Derived: digits of the roots, and more where they are asked for.
_ROOT_DIGITS = 77

#: Derived: digits of λ_s at the start, beyond those by which the I's are apart.
_DIGITS = 60

#: I's nearer than this part of themselves are separated by it: far below any digit, and products
#: of such differences are floats.
_APART = Fraction(1, 10**30)

#: Calibrated: a root nearer to the end of a cut than this part of the cut makes its period nearly
#: infinite: a separatrix.
_SEPARATRIX = fmpq(1, 10**12)

#: Derived: what R's leading coefficient, its reciprocal, and the squares of its roots multiplied
#: may be: a float, and so their products.
_LARGEST = 10**150


@dataclass(frozen=True)
class SeparableStart:
    """A start (q, q̇) in the potential of v(λ) = Σ_m v_m λ^m − Σ_i β_iΦ'(I_i)/(λ−I_i), all FLINT's
    rationals; (q,q̇) = 0, |q| any.

    - inverse: (n,) distinct I's, increasing
    - q, q_dot: (n,) along these axes
    - polynomial: the v_m
    - centrifugal: (n,) the β_i, none of them at q_i = 0
    - size: 1 where q̇ is scaled as q is, (q,q) where it is the velocity of the unit vector
    """

    inverse: list[Any]
    q: list[Any]
    q_dot: list[Any]
    polynomial: list[Any]
    centrifugal: list[Any]
    size: Any = 1

    @cached_property
    def q_squared(self) -> list[Any]:
        """Return q_i² for |q| = 1."""
        squares = [x * x for x in self.q]
        return [x / sum(squares) for x in squares]

    @cached_property
    def conics(self) -> Any:
        """Return U(λ) = Σ q_i² Π_{k≠i}(λ−I_k) = Π(λ−λ_s), as FLINT's polynomials."""
        return sum_over_poles(self.inverse, self.q_squared)

    @cached_property
    def constants(self) -> Any:
        """Return C(λ), its leading coefficient the energy h: λC = ½Σ_{i<j}(q∧q')²_ij
        Π_{k≠i,j}(λ−I_k) + T U + λ[v mod U].
        """
        size = sum(x * x for x in self.q)
        # (dt/dτ)² = (q,Aq)/det A, and T = ½Σ (q∧q̇)²_ij Π_{k≠i,j} I_k.
        rate = math.prod(self.inverse) * sum(
            x / a for x, a in zip(self.q_squared, self.inverse, strict=True)
        )
        shifted = fmpq_poly([0])
        for i, j in itertools.combinations(range(len(self.q)), 2):
            wedge = (self.q[i] * self.q_dot[j] - self.q[j] * self.q_dot[i]) / size
            half = wedge * wedge * self.size / 2
            others = _without(self.inverse, i, j)
            shifted += half * (
                math.prod(others, start=fmpq(1)) * self.conics + rate * product_over_poles(others)
            )
        found = shifted // fmpq_poly([0, 1]) + fmpq_poly(self.polynomial) % self.conics
        for own, square, beta in zip(self.inverse, self.q_squared, self.centrifugal, strict=True):
            if beta:  # 1/(λ−I_i) mod U = (U(I_i) − U(λ))/((λ−I_i)U(I_i)), and U(I_i) = q_i²Φ'(I_i)
                found += beta / square * (self.conics // fmpq_poly([-own, 1]))
        return found

    @cached_property
    def factor(self) -> Any:
        """Return S(λ) with R = 2λ Π_{β_i=0}(λ−I_i) S(λ): what is left to find roots of."""
        walls = [x for x, beta in zip(self.inverse, self.centrifugal, strict=True) if beta]
        found = product_over_poles(walls) * (fmpq_poly(self.polynomial) - self.constants)
        for i, (own, beta) in enumerate(zip(self.inverse, self.centrifugal, strict=True)):
            if beta:
                slope = math.prod(own - x for x in _without(self.inverse, i))
                found -= beta * slope * product_over_poles([x for x in walls if x != own])
        return found

    @property
    def degree(self) -> int:
        """Return the degree of R."""
        return int(self.factor.length()) + self.centrifugal.count(0)

    @cached_property
    def apart(self) -> int:
        """Return the digits that the nearest I's have in common: distances in their gap need as
        many more.
        """
        gap = min(y - x for x, y in itertools.pairwise(self.inverse))
        return len(str(int(self.inverse[-1] / gap)))

    def without(self, axis: int) -> SeparableStart:
        """Return the start among the other axes, for a motion in the plane q_i = 0: T, and so V, in
        units of I_i.

        There one λ_s is I_i, and the divided difference v[λ_1 … λ_{n−1}] = V is that of
        (v(λ)−v(I_i))/(λ−I_i) at the others.
        """
        own = self.inverse[axis]
        inverse, q, q_dot, walls = (
            _without(values, axis)
            for values in (self.inverse, self.q, self.q_dot, self.centrifugal)
        )
        quotient = fmpq_poly(self.polynomial) // fmpq_poly([-own, 1])
        polynomial = [c / own for c in quotient.coeffs()]
        return SeparableStart(
            inverse, q, q_dot, polynomial, [beta / own for beta in walls], self.size
        )

    @cached_property
    def spheroconic(self) -> list[Any]:
        """Return λ_1 < … < λ_{n−1} at the start, to _DIGITS digits of the gaps that they are in."""
        with balls(_DIGITS + self.apart):
            return [x.mid().fmpq() for x in zeros_of_position(self.inverse, self.q_squared)]


@dataclass(frozen=True)
class SeparatedCut:
    """The interval [a, b] on which λ_s moves, in the elliptic angle ψ of its ends and the real
    roots of R next to them; λ = 0 is a root, so there always is one below.

    - ends: a and b, exact
    - interval: the kernel's
    - left: (…) a−r of the real roots r < a, the nearest last
    - right: (…) r−b of those above, the nearest first
    - pairs: (…, 2) a−Re r, Im r of complex ones
    - leading: |leading coefficient of R|
    - below, above: λ_s−a and b−λ_s at the start
    - axes: the numbers of the I's that are a and b, None where an end is none
    """

    ends: tuple[Any, Any]
    interval: Array
    left: Array
    right: Array
    pairs: Array
    leading: float
    below: float
    above: float
    axes: tuple[int | None, int | None]

    def roots(self, psi: Array) -> Array:
        """Return √(λ−a) along sn and √(b−λ) along cn at angles ψ (N,), (2, N)."""
        return np.array(_ELLIPTIC["roots"](psi, self.interval))

    def _roots_of_factors(self, psi: Array) -> tuple[Array, Array]:
        """Return √|λ−r| for the neighbours, multiplied, and for all other roots: the product of
        many may be no float.
        """
        below, above = (x[..., None] for x in self.roots(psi) ** 2)
        left = np.sqrt(below + self.left)
        right = np.sqrt(above + self.right)
        far = np.prod(left[..., :-1], axis=-1) * np.prod(right[..., 1:], axis=-1)
        complex_ones = np.prod(np.hypot(below + self.pairs[:, 0], self.pairs[:, 1]), axis=-1)
        near = left[..., -1] * (right[..., 0] if self.right.size else 1.0)
        return near, np.sqrt(self.leading) * far * complex_ones

    def moving_root(self, psi: Array) -> Array:
        """Return √R with the sign of λ_s', over the roots of the ends that are I's, at angles ψ."""
        near, far = self._roots_of_factors(psi)
        result = near * far
        for root, axis in zip(self.roots(psi), self.axes, strict=True):
            if axis is None:
                result = result * root
        return result

    def speed(self, psi: Array) -> Array:
        """Return √R dψ/dλ at angles ψ."""
        return np.asarray(self._roots_of_factors(psi)[1] / (2 * self.interval[elliptic.DENSITY]))


def separate(values: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """Return increasing numbers, of which those that are equal, or nearly so, are separated by
    1e-30 of themselves.
    """
    result = list(values)
    for i in range(1, len(result)):
        result[i] = max(result[i], result[i - 1] * (1 + _APART))
    return tuple(result)


class _Resting(Exception):
    """A coordinate that rests at I_i, a double root of R with R ≤ 0 on both sides: q_i = 0 for
    good, to twenty digits; with the number of I_i.
    """


def moving_axes(start: SeparableStart) -> tuple[SeparableStart, list[SeparatedCut], list[int]]:
    """Return the start among the axes along which it moves, its cuts, and the numbers of these
    axes.

    Raises Unsolved (``collision``, ``separatrix``, ``clustered-roots``, ``at-rest``,
    ``beyond-floats``).
    """
    axes = list(range(len(start.q)))
    still = [i for i, x in enumerate(start.q) if x == start.q_dot[i] == 0]
    while True:
        for i in reversed(still):
            if len(axes) == 2:
                raise Unsolved("at-rest", "nothing moves by more than 1e-20; integrate numerically")
            start = start.without(i)
            del axes[i]
        try:
            return start, find_cuts(start), axes
        except _Resting as resting:
            still = [*resting.args]


def _roots(polynomial: Any, further: int = 0) -> list[tuple[Any, Any]]:
    """Return (Re, Im ≥ 0) of the roots of FLINT's polynomial, real ones and one of each pair,
    FLINT's rationals, to 77 digits and ``further`` ones.

    Each is isolated by Arb: two real roots however near each other are two, and no pair of complex
    ones. Raises Unsolved (``clustered-roots``) for multiple roots, and for those that are nearer
    than _NEAR.
    """
    with balls(_ROOT_DIGITS + further, False):
        found = polynomial.complex_roots()
    if any(count > 1 for _, count in found):
        raise Unsolved(
            "clustered-roots",
            "R has a double root: the motion is on a separatrix, or at rest in one coordinate",
        )
    points = [(root.real.mid().fmpq(), root.imag.mid().fmpq()) for root, _ in found]
    for (a, b), (c, d) in itertools.combinations(points, 2):
        if abs(a - c) + abs(b - d) <= _NEAR * (1 + abs(a)):
            raise Unsolved(
                "clustered-roots",
                "two roots of R could not be told apart: the motion is near a separatrix",
            )
    return [(x, y) for x, y in points if y >= 0]


def find_cuts(start: SeparableStart) -> list[SeparatedCut]:
    """Return the cuts of a start of which every coordinate moves; raises Unsolved and _Resting as
    ``moving_axes`` has it.
    """
    factor = start.factor
    found = _roots(factor, start.apart)
    free = [x for x, beta in zip(start.inverse, start.centrifugal, strict=True) if not beta]
    near = _NEAR * min(y - x for x, y in itertools.pairwise(start.inverse))
    # A root that is I_i to all digits is I_i: a double root is then seen to be one.
    walls = [x for x in start.inverse if x not in free]
    single = [
        next((own for own in free if abs(x - own) <= near), _beside(walls, x, near, factor))
        for x, y in found
        if y == 0
    ]
    real = sorted([fmpq(0), *free, *single])
    pairs = [(x, y) for x, y in found if y > 0]
    R = fmpq_poly([0, 2]) * product_over_poles(free) * factor
    leading = abs(R[R.degree()])
    far = math.prod((max(fmpq(1), x * x + y * y) for x, y in found), start=fmpq(1))
    if max(leading, 1 / leading, far) > _LARGEST:
        raise Unsolved("beyond-floats", "R leaves the range of a float; integrate numerically")
    return [_cut(start, s, point, real, pairs, R) for s, point in enumerate(start.spheroconic)]


def _beside(walls: list[Any], x: Any, near: Any, factor: Any) -> Any:
    """Return a root of the factor, on the right side of a wall I_i that it is near: where β_i is
    tiny its digits do not tell, and one step of Newton's method from I_i is exact.
    """
    wall = next((own for own in walls if abs(x - own) <= near), None)
    if wall is None:
        return x
    at, slope = factor(wall), factor.derivative()(wall)
    return wall - at / slope if slope else x


def _cut(
    start: SeparableStart,
    s: int,
    point: Any,
    real: list[Any],
    pairs: list[tuple[Any, Any]],
    R: Any,
) -> SeparatedCut:
    low = start.inverse[s]
    high = start.inverse[s + 1]
    marks = [x for x in real if low <= x <= high]
    at = min(marks, key=lambda x: abs(x - point), default=None)
    names = {x: i for i, x in enumerate(start.inverse) if not start.centrifugal[i]}
    if at is None or abs(at - point) > _NEAR * (high - low):
        lower = max((x for x in marks if x < point), default=None)
        upper = min((x for x in marks if x > point), default=None)
    else:
        point = at
        ends = _ends_from(at, marks, low, high, R)
        if ends is None and at in names:
            raise _Resting(names[at])
        if ends is None:
            reason = "R has a double root: a coordinate rests there; integrate numerically"
            raise Unsolved("clustered-roots", reason)
        lower, upper = ends
    if lower is None or upper is None:  # R > 0 up to the plane of I_s, or I_{s+1}
        raise Unsolved(
            "collision",
            "the motion runs into a plane where the potential is −∞, and has no closed form; "
            "integrate numerically, up to the time of the collision",
        )
    width = upper - lower
    others = list(real)
    for end in (lower, upper):
        others.remove(end)
    gap = min((abs(x - end) for x in others for end in (lower, upper)), default=width)
    if gap <= _SEPARATRIX * width:
        raise Unsolved(
            "separatrix",
            "a turning point is nearly a double root: the motion is asymptotic, or within "
            "1e-12 of one",
        )
    left = [float(lower - x) for x in sorted(others) if x < lower]
    right = [float(x - upper) for x in sorted(others) if x > upper]
    interval, is_last = np.zeros(elliptic.ROOM), not right
    after = 0.0 if is_last else right[0]
    elliptic.set_interval(left[-1], float(width), after, False, is_last, interval)
    return SeparatedCut(
        ends=(lower, upper),
        interval=interval,
        left=np.array(left),
        right=np.array(right),
        pairs=np.array([(float(lower - x), float(y)) for x, y in pairs]).reshape(-1, 2),
        leading=abs(float(R[R.degree()])),
        below=float(point - lower),
        above=float(upper - point),
        axes=(names.get(lower), names.get(upper)),
    )


def _ends_from(at: Any, marks: list[Any], low: Any, high: Any, R: Any) -> tuple[Any, Any] | None:
    """Return the ends between which a coordinate moves that starts at a turning point: on the side
    where R > 0; None where there is none. An end is None where no turning point bounds it.
    """
    before = max((x for x in marks if x < at), default=None)
    after = min((x for x in marks if x > at), default=None)
    if R((at + (high if after is None else after)) / 2) > 0:
        return at, after
    if R((at + (low if before is None else before)) / 2) > 0:
        return before, at
    return None


def _without(values: Sequence[T], *omitted: int) -> list[T]:
    return [x for i, x in enumerate(values) if i not in omitted]
