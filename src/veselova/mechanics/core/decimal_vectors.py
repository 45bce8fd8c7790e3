"""Vectors of decimals, in the precision of the context."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction

__all__ = ["Vector", "cross", "dot", "of_rational", "times", "unit"]

Vector = tuple[Decimal, ...]


def of_rational(number: Fraction) -> Decimal:
    """Return a rational, rounded."""
    return Decimal(number.numerator) / Decimal(number.denominator)


def dot(a: Sequence[Decimal], b: Sequence[Decimal]) -> Decimal:
    """Return the scalar product."""
    return sum((x * y for x, y in zip(a, b, strict=True)), Decimal(0))


def times(a: Sequence[Decimal], b: Sequence[Decimal]) -> Vector:
    """Return the products of the entries."""
    return tuple(x * y for x, y in zip(a, b, strict=True))


def cross(a: Sequence[Decimal], b: Sequence[Decimal]) -> Vector:
    """Return the vector product."""
    return tuple(a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3))


def unit(vector: Sequence[Decimal]) -> Vector:
    """Return a vector over its length."""
    length = dot(vector, vector).sqrt()
    return tuple(x / length for x in vector)
