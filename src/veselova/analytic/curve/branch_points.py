"""The two spectra that give the branch points, to as many digits as their differences ask for.

I_1 < … < I_m are the inverses of the A's that move; ``Polynomials`` has the spheroconic coordinates
λ_1 < … < λ_{m−1} at the start and the constants c_1 < c_2 < … < c_{m−1} as its zeros; c_1 = 0 but
for Neumann's system. They interlace: max(c_s, I_s) ≤ λ_s ≤ min(c_{s+1}, I_{s+1}). The data are
exact rationals, and digits are added until every difference of neighbours has enough of its own: a
gap of 1e-280 is resolved as well as one of 0.1.

Their exact polynomials, whose zeros FLINT isolates:

    U(λ) = Σ_i q_i² Π_{k≠i}(λ−I_k) = |q|² Π_s (λ−λ_s),   (S_n, printed 6.10)
    N(λ) = U(λ) + Σ_{i<j} (q_iq_j' − q_jq_i')² Π_{k≠i,j}(λ−I_k) = |q|² Π_k (λ−c_k),
           and the second sum is (U V − W²)/Π_k(λ−I_k), V and W as U with q_i'² and q_iq_i'

Zeros that U or N have in common with a pole I_i, with one another, or at 0 are known exactly.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal

import numpy as np
from flint import arb, fmpq_poly

from veselova.analytic.arithmetic.balls import Balls, Values, balls
from veselova.analytic.curve.moving_part import Moving, rationals, squared_rates
from veselova.mechanics.core.arguments import FEWEST_DIGITS
from veselova.mechanics.core.budget import checkpoint, iterate, stated_s
from veselova.mechanics.core.decimals import rational
from veselova.mechanics.core.errors import InternalContradiction, OverBudget, Unsolved

__all__ = [
    "COINCIDE",
    "Resolved",
    "Spectrum",
    "product_over_poles",
    "resolve_spectrum",
    "spectrum",
    "spheroconic",
    "sum_over_poles",
    "tangent",
    "zeros_of_position",
]

#: Derived: branch points nearer than 10 to minus this part of the largest count as one, where
#: doubles are to hold their differences, and squares of roots of them.
COINCIDE = 290

#: Derived: digits beyond twice the wanted ones (a coordinate is a square root: λ−b of 1e-32 turns
#: it by 1e-16) for the sums themselves.
_SPARE = 12


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


def _difference(a: Any, b: Any) -> Any:
    """Return a − b, exactly zero for one ball."""
    return 0 * a.mid() if a is b else a - b


@dataclass(frozen=True)
class Spectrum:
    """The spectra of what moves, as numbers of ``arithmetic``, in units of the largest I; calculate
    ``with spectrum.arithmetic``.

    Numbers that are equal are one object, or equal.

    - inverse: (m,) the I's, the last one 1
    - q, q_prime: (m,) along the moving directions, q_prime = dq/dτ₁
    - constants: (m−1,) c_1 … c_{m−1}
    - spheroconic: (m−1,) λ's at the start
    - time_rate: dτ₁/d(time) there
    """

    arithmetic: Balls
    inverse: Values
    q: Values
    q_prime: Values
    constants: Values
    spheroconic: Values
    time_rate: Any

    @cached_property
    def branch_points(self) -> list[tuple[Any, Literal["I", "c"], int]]:
        """Return (value, kind, index), increasing."""
        labelled: list[tuple[Any, Literal["I", "c"], int]] = [
            (c, "c", k) for k, c in enumerate(self.constants)
        ]
        labelled += [(x, "I", i) for i, x in enumerate(self.inverse)]
        return sorted(labelled, key=lambda item: (item[0].mid(), item[1]))

    @property
    def points(self) -> list[Any]:
        """Return the branch points, increasing."""
        return [value for value, _, _ in self.branch_points]

    @cached_property
    def widths(self) -> list[Any]:
        """Return b_{j+1} − b_j, j = 0…2g−1: gaps for even j, cuts for odd j."""
        with self.arithmetic:
            return [_difference(b, a) for a, b in itertools.pairwise(self.points)]

    @cached_property
    def on_cuts(self) -> list[tuple[Any, Any]]:
        """Return λ_s − b_{2s−1} and b_{2s} − λ_s at the start."""
        ends = self.points
        with self.arithmetic:
            return [
                (_difference(x, ends[2 * s + 1]), _difference(ends[2 * s + 2], x))
                for s, x in enumerate(self.spheroconic)
            ]

    @cached_property
    def _slopes(self) -> list[Any]:
        """Return Σ q_iq_i'/(λ_s−I_i), of the sign of λ_s'; zero at an end of a cut, where either
        direction serves.
        """
        with self.arithmetic:
            products = self.q * self.q_prime
            return [
                sum(x / (point - I) for x, I in zip(products, self.inverse, strict=True))
                if all(at != 0 for at in ends)
                else 0
                for point, ends in zip(self.spheroconic, self.on_cuts, strict=True)
            ]

    @property
    def increasing(self) -> list[bool]:
        """Return whether each λ_s increases at the start."""
        return [bool(slope >= 0) for slope in self._slopes]

    @property
    def signs(self) -> list[int]:
        """Return the constant sign ς_i of each q_i against its root (analytic.digits.frame).

        Directions are chosen so that q_i ≥ 0, and q_i' > 0 where q_i = 0. There, and nearer to it
        than these balls resolve, the root passes zero, upwards along sn at ψ = 0, downwards along
        cn at ψ = π. For ψ in (−π, π) sn has its sign and cn is positive, which ψ rounded to π no
        longer tells.
        """
        found, increasing = [1] * len(self.q), self.increasing
        for j, (_, kind, i) in enumerate(self.branch_points):
            s, lower_end = (j - 1) // 2, j % 2 == 1
            if kind == "I":
                off = self.on_cuts[s][not lower_end] if j else 1
                here = (self.q_prime[i] > 0) == lower_end
                up = increasing[s] or not lower_end if abs(off) > 0 else here
                found[i] = 1 if up else -1
        return found

    def is_known(self, digits: int) -> bool:
        """Return whether every difference of neighbours, of balls, has digits of its own, and the
        direction of every λ_s is known.
        """
        bits = digits * math.log2(10)
        parts = (*self.widths, *itertools.chain(*self.on_cuts))
        return all(x == 0 or x.rel_accuracy_bits() > bits for x in parts) and all(
            slope == 0 or abs(slope) > 0 for slope in self._slopes
        )


@dataclass(frozen=True)
class Resolved:
    """The spectrum of a start without coincidences; ``separatrices`` are the axes i (sorted) where
    c_k = I_i had to be opened.
    """

    moving: Moving
    spectrum: Spectrum
    separatrices: tuple[int, ...]


def resolve_spectrum(
    moving: Moving,
    digits: int,
    distance: Fraction | None = None,
    beyond: int = 0,
    coincide: int = COINCIDE,
) -> Resolved:
    """Return the spectrum in which every interval is open and known to twice ``digits``.

    Coincidences are opened by moving the start by 10^(−2·digits−10−beyond), on a separatrix by
    ``distance`` where that is given. Where I_i = c_k is an end of a closed cut, or of a gap and
    less than the root of 10^−``coincide`` of the rest moves along its direction, or of 10^−20 times
    the opening squared, the direction is frozen; at a gap that is a separatrix to all digits.

    Raises Unsolved: ``beyond-floats`` where the least I is no larger than that part of the others,
    or |q'|² than their inverse part; ``at-rest`` where one direction alone is left, beside a stable
    equilibrium of Neumann's system.
    """
    exponent = 2 * digits + 10 + beyond
    opening = Fraction(1, 10**exponent)
    coinciding = max(coincide, 2 * exponent + 20)
    # Between A's nearer than that, a cut that closes would not say that a direction hardly moves.
    moving = moving.separate(opening, Fraction(1, 10 ** (coinciding // 2)))
    separatrices = set[int]()
    coincident = set[int]()
    while True:
        if moving.size < 2:
            further = f"{FEWEST_DIGITS} digits, not certified, are those of rest"
            raise Unsolved("at-rest", f"nothing moves by more than 1e-{coinciding // 2}; {further}")
        found = spectrum(moving, digits, coinciding)
        threshold = Fraction(1, 10**coinciding)
        widths = list(map(rational, found.widths))
        if widths[0] > 10**coinciding:
            raise Unsolved(
                "beyond-floats", f"q' is above 1e{coinciding // 2} times the frequencies √I"
            )
        closed = [j for j, width in enumerate(widths) if width < threshold]
        if not closed:
            return Resolved(moving, found, tuple(sorted(separatrices | coincident)))
        # Cuts first: what is left beside a saddle when its stable directions are frozen is no rest.
        j = next((j for j in closed if j % 2 == 1), closed[0])
        ends = found.branch_points[j : j + 2]
        axis = next((index for _, kind, index in ends if kind == "I"), None)
        # between c_1 = 0 and the least I, which is no separatrix; cuts between other I's that are
        # as small close then, whatever moves
        if (
            closed[0] == 0
            and moving.time != "tau1"
            and (axis is None or j == 0 or not moving.hardly_moves(axis, threshold))
        ):
            raise Unsolved(
                "beyond-floats", f"the A's are too far apart: their ratio is above 1e{coinciding}"
            )
        if axis is None:  # c_k = c_{k+1}
            moving = moving.perturb(0, opening)
        elif j % 2 == 1:
            moving = moving.without(axis)
        elif moving.hardly_moves(axis, Fraction(1, 10**coinciding)):
            # across it the motion is not stable
            coincident.add(moving.axes[axis])
            leaves_one = distance is None and moving.size == 2  # an unstable equilibrium is no rest
            apart = opening if leaves_one else distance
            moving = moving.without(axis) if apart is None else moving.lift_axis(axis, apart)
        elif axis in separatrices:
            raise InternalContradiction("a closed gap did not open")
        else:
            separatrices.add(axis)
            moving = moving.perturb(axis, opening if distance is None else distance)


def spectrum(moving: Moving, digits: int, coinciding: int = COINCIDE) -> Spectrum:
    """Return the spectra of what moves with enough digits for all differences of neighbours above
    10^−coinciding.
    """
    wanted = 2 * digits + _SPARE
    working, most = wanted + _SPARE, wanted + coinciding
    polynomials = Polynomials(moving)
    while True:
        with balls(working) as xp:
            inverse, points, constants = map(np.array, polynomials.zeros())
            q, q_prime, rate = tangent(moving, xp)
        found = Spectrum(xp, inverse, q, q_prime, constants, points, rate)
        if working == most or found.is_known(wanted):
            return found
        working = min(most, 2 * working)


def tangent(moving: Moving, arithmetic: Balls) -> tuple[Values, Values, Any]:
    """Return q of unit length, q' = dq/dτ₁ tangent to the sphere, and dτ₁/d(time), exact until
    roots are taken: see ``squared_rates``. Call it ``with`` the arithmetic.
    """
    speed, rate = squared_rates(moving)
    q2, v2, qv = (rationals(x) for x in (moving.q_squared, moving.v_squared, moving.qv))
    size, along = sum(q2), sum(qv)
    root, number = arithmetic.sqrt, arithmetic.number
    q = [root(number(x / size)) for x in q2]
    v = [
        number(x - along * own / size) / root(number(own)) if own else root(number(other))
        for own, other, x in zip(q2, v2, qv, strict=True)
    ]
    return np.array(q), np.array(v) / root(number(speed)), root(number(rate))
