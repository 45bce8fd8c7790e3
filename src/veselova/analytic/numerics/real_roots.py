"""Polynomials with rational coefficients, lists lowest first: arithmetic, and roots
to many digits.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from fractions import Fraction

from veselova.mechanics.core.errors import Unsolved

__all__ = [
    "NEAR",
    "Polynomial",
    "monic",
    "product",
    "quotient",
    "remainder",
    "roots",
    "total",
    "trim",
    "value",
]

Polynomial = list[Fraction]

#: Numbers nearer than this, relative to those around, count as one: roots have more digits.
NEAR = Fraction(1, 10**40)

#: Derived: digits of the roots, and more where they are asked for.
_DIGITS = 77


def monic(roots: Sequence[Fraction]) -> Polynomial:
    """Return Π(λ − root)."""
    result: Polynomial = [Fraction(1)]
    for root in roots:
        result = total([[Fraction(0), *result], [-root * c for c in result]])
    return result


def total(parts: Sequence[Sequence[Fraction]]) -> Polynomial:
    """Return the sum."""
    return [
        sum(column, Fraction()) for column in itertools.zip_longest(*parts, fillvalue=Fraction())
    ]


def product(a: Sequence[Fraction], b: Sequence[Fraction]) -> Polynomial:
    """Return the product."""
    return total([[Fraction(0)] * i + [c * d for d in b] for i, c in enumerate(a)])


def quotient(polynomial: Polynomial, root: Fraction) -> Polynomial:
    """Return the quotient by λ − root."""
    quotient = []
    carry = Fraction()
    for c in reversed(polynomial[1:]):
        carry = carry * root + c
        quotient.append(carry)
    return quotient[::-1]


def remainder(polynomial: Polynomial, monic: Polynomial) -> Polynomial:
    """Return the remainder of a division by a monic polynomial."""
    rest = list(polynomial)
    degree = len(monic) - 1
    while len(rest) > degree:
        lead = rest.pop()
        for i in range(degree):
            rest[len(rest) - degree + i] -= lead * monic[i]
    return rest


def trim(polynomial: Polynomial) -> Polynomial:
    """Return the polynomial without leading zeros."""
    while len(polynomial) > 1 and polynomial[-1] == 0:
        polynomial = polynomial[:-1]
    return polynomial


def value(polynomial: Polynomial, x: Fraction) -> Fraction:
    """Return the value at x."""
    result = Fraction()
    for c in reversed(polynomial):
        result = result * x + c
    return result


def roots(polynomial: Polynomial, further: int = 0) -> list[tuple[Fraction, Fraction]]:
    """Return (Re, Im ≥ 0) of the roots of an exact polynomial, real ones and one of each pair, to
    77 digits and ``further`` ones.

    Each is isolated by Arb: two real roots however near each other are two, and no pair of complex
    ones. Raises Unsolved (``clustered-roots``) for multiple roots, and for those that are nearer
    than NEAR.
    """
    from veselova.analytic.arithmetic.balls import balls  # loads python-flint

    with balls(_DIGITS + further, False) as arithmetic:
        found = arithmetic.polynomial_roots(polynomial)
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
