"""Polynomials with rational coefficients, lists lowest first: arithmetic, and roots to many digits."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from veselova.mechanics.errors import Unsolved

__all__ = ["NEAR", "Polynomial", "monic", "product", "quotient", "remainder", "roots", "total", "trimmed", "value"]

Polynomial = list[Fraction]

#: Numbers nearer than this, relative to those around, count as one: roots have more digits.
NEAR = Fraction(1, 10**40)

#: Newton steps on the roots, from sixteen digits or from six where two are near each other; the bits kept in them.
_STEPS, _BITS = 12, 256


def monic(roots: Sequence[Fraction]) -> Polynomial:
    """Return Π(λ − root)."""
    result: Polynomial = [Fraction(1)]
    for root in roots:
        result = total([[Fraction(0), *result], [-root * c for c in result]])
    return result


def total(parts: Sequence[Sequence[Fraction]]) -> Polynomial:
    """Return the sum."""
    return [sum(column, Fraction()) for column in itertools.zip_longest(*parts, fillvalue=Fraction())]


def product(a: Sequence[Fraction], b: Sequence[Fraction]) -> Polynomial:
    """Return the product."""
    return total([[Fraction(0)] * i + [c * d for d in b] for i, c in enumerate(a)])


def quotient(polynomial: Polynomial, root: Fraction) -> Polynomial:
    """Return the quotient by λ − root."""
    quotient, carry = [], Fraction()
    for c in reversed(polynomial[1:]):
        carry = carry * root + c
        quotient.append(carry)
    return quotient[::-1]


def remainder(polynomial: Polynomial, monic: Polynomial) -> Polynomial:
    """Return the remainder of a division by a monic polynomial."""
    rest, degree = list(polynomial), len(monic) - 1
    while len(rest) > degree:
        lead = rest.pop()
        for i in range(degree):
            rest[len(rest) - degree + i] -= lead * monic[i]
    return rest


def trimmed(polynomial: Polynomial) -> Polynomial:
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


def roots(polynomial: Polynomial) -> list[tuple[Fraction, Fraction]]:
    """Return (Re, Im ≥ 0) of the roots of an exact polynomial, real ones and one of each pair: Newton from double precision."""
    if len(polynomial) == 1:
        return []
    largest = max(abs(c) for c in polynomial)
    roots = np.polynomial.polynomial.polyroots([float(c / largest) for c in polynomial])
    polished = [_polished(polynomial, complex(root)) for root in roots]
    for (a, b), (c, d) in itertools.combinations(polished, 2):
        if abs(a - c) + abs(b - d) <= NEAR * (1 + abs(a)):
            raise Unsolved("clustered-roots", "two roots of R could not be told apart: the motion is near a separatrix")
    return [(x, y) for x, y in polished if y >= 0]


def _polished(polynomial: Polynomial, root: complex) -> tuple[Fraction, Fraction]:
    x, y = Fraction(root.real), Fraction(root.imag)
    scale = 1 + abs(x)
    for _ in range(_STEPS):
        value, slope = (Fraction(), Fraction()), (Fraction(), Fraction())
        for c in reversed(polynomial):
            slope = _times(slope, (x, y))
            slope = slope[0] + value[0], slope[1] + value[1]
            value = _times(value, (x, y))
            value = value[0] + c, value[1]
        size = slope[0] ** 2 + slope[1] ** 2
        if not size:
            raise Unsolved("clustered-roots", "R has a double root: the motion is on a separatrix, or at rest in one coordinate")
        step = _times(value, (slope[0] / size, -slope[1] / size))
        x, y = _rounded(x - step[0]), _rounded(y - step[1])
        if abs(step[0]) + abs(step[1]) <= scale / 2 ** (_BITS - 16):
            break
    return x, y if abs(y) > NEAR * scale else Fraction(0)


def _times(a: tuple[Fraction, Fraction], b: tuple[Fraction, Fraction]) -> tuple[Fraction, Fraction]:
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _rounded(x: Fraction) -> Fraction:
    return Fraction(round(x * 2**_BITS), 2**_BITS)
