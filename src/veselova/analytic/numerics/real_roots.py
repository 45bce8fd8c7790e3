"""Roots of polynomials with rational coefficients, to many digits."""

from __future__ import annotations

import itertools
from fractions import Fraction
from typing import Any

from veselova.analytic.arithmetic.balls import balls
from veselova.mechanics.core.errors import Unsolved

__all__ = ["NEAR", "roots"]

#: Numbers nearer than this, relative to those around, count as one: roots have more digits.
NEAR = Fraction(1, 10**40)

#: Derived: digits of the roots, and more where they are asked for.
_DIGITS = 77


def roots(polynomial: Any, further: int = 0) -> list[tuple[Fraction, Fraction]]:
    """Return (Re, Im ≥ 0) of the roots of FLINT's polynomial, real ones and one of each pair, to
    77 digits and ``further`` ones.

    Each is isolated by Arb: two real roots however near each other are two, and no pair of complex
    ones. Raises Unsolved (``clustered-roots``) for multiple roots, and for those that are nearer
    than NEAR.
    """
    with balls(_DIGITS + further, False) as xp:
        found = [
            (xp.rational(root.real), xp.rational(root.imag), count)
            for root, count in polynomial.complex_roots()
        ]
    if any(count > 1 for _, _, count in found):
        raise Unsolved(
            "clustered-roots",
            "R has a double root: the motion is on a separatrix, or at rest in one coordinate",
        )
    for (a, b, _), (c, d, _) in itertools.combinations(found, 2):
        if abs(a - c) + abs(b - d) <= NEAR * (1 + abs(a)):
            raise Unsolved(
                "clustered-roots",
                "two roots of R could not be told apart: the motion is near a separatrix",
            )
    return [(x, y) for x, y, _ in found if y >= 0]
