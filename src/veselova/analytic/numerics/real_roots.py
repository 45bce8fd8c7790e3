"""Roots of polynomials with rational coefficients, to many digits."""

from __future__ import annotations

import itertools
from typing import Any

from flint import fmpq

from veselova.analytic.arithmetic.balls import balls
from veselova.mechanics.core.errors import Unsolved

__all__ = ["NEAR", "roots"]

#: Numbers nearer than this, relative to those around, count as one: roots have more digits.
NEAR = fmpq(1, 10**40)

#: Derived: digits of the roots, and more where they are asked for.
_DIGITS = 77


def roots(polynomial: Any, further: int = 0) -> list[tuple[Any, Any]]:
    """Return (Re, Im ≥ 0) of the roots of FLINT's polynomial, real ones and one of each pair,
    FLINT's rationals, to 77 digits and ``further`` ones.

    Each is isolated by Arb: two real roots however near each other are two, and no pair of complex
    ones. Raises Unsolved (``clustered-roots``) for multiple roots, and for those that are nearer
    than NEAR.
    """
    with balls(_DIGITS + further, False):
        found = polynomial.complex_roots()
    if any(count > 1 for _, count in found):
        raise Unsolved(
            "clustered-roots",
            "R has a double root: the motion is on a separatrix, or at rest in one coordinate",
        )
    points = [(root.real.mid().fmpq(), root.imag.mid().fmpq()) for root, _ in found]
    for (a, b), (c, d) in itertools.combinations(points, 2):
        if abs(a - c) + abs(b - d) <= NEAR * (1 + abs(a)):
            raise Unsolved(
                "clustered-roots",
                "two roots of R could not be told apart: the motion is near a separatrix",
            )
    return [(x, y) for x, y in points if y >= 0]
