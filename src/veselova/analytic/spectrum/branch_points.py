"""The two spectra that give the branch points, to as many digits as their differences ask for.

I_1 < … < I_m are the inverses of the A's that move; ``Polynomials`` has the spheroconic coordinates
λ_1 < … < λ_{m−1} at the start and the constants c_1 < c_2 < … < c_{m−1} as its zeros; c_1 = 0 but
for Neumann's system. They interlace: max(c_s, I_s) ≤ λ_s ≤ min(c_{s+1}, I_{s+1}). The data are
exact rationals, and digits are added until every difference of neighbours has enough of its own: a
gap of 1e-280 is resolved as well as one of 0.1.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.analytic.arithmetic.balls import Balls, balls
from veselova.analytic.spectrum.moving_part import Moving, rationals, squared_rates
from veselova.analytic.spectrum.polynomials import Polynomials
from veselova.mechanics.core.decimals import FEWEST_DIGITS, rational
from veselova.mechanics.core.errors import InternalContradiction, Unsolved

__all__ = [
    "COINCIDE",
    "Resolved",
    "Spectrum",
    "resolve_spectrum",
    "spectrum",
    "tangent",
]

#: Derived: branch points nearer than 10 to minus this part of the largest count as one, where
#: doubles are to hold their differences, and squares of roots of them.
COINCIDE = 290

#: Derived: digits beyond twice the wanted ones (a coordinate is a square root: λ−b of 1e-32 turns
#: it by 1e-16) for the sums themselves.
_SPARE = 12


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

        Directions are chosen so that q_i ≥ 0, and q_i' > 0 where q_i = 0: there the root passes
        zero, upwards along sn at ψ = 0, downwards along cn at ψ = π. For ψ in (−π, π) sn has its
        sign and cn is positive, which ψ rounded to π no longer tells.
        """
        found, increasing = [1] * len(self.q), self.increasing
        for j, (_, kind, i) in enumerate(self.branch_points):
            lower_end = j % 2 == 1
            if kind == "I":
                up = lower_end if self.q[i] == 0 else increasing[(j - 1) // 2] or not lower_end
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
    most = wanted + coinciding
    polynomials = Polynomials(moving)
    working = wanted + _SPARE
    while True:
        with balls(working) as xp:
            inverse, points, constants = map(np.array, polynomials.zeros())
            q, q_prime, rate = tangent(moving, xp)
        found = Spectrum(xp, inverse, q, q_prime, constants, points, rate)
        if working == most or found.is_known(wanted):
            return found
        working = min(most, 2 * working)


def tangent(moving: Moving, arithmetic: Arithmetic) -> tuple[Values, Values, Any]:
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
