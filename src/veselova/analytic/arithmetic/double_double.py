"""Numbers of some thirty digits as sums of two doubles, entrywise on arrays: enough for narrow
gaps, at the speed of NumPy.

Every operation is built of sums and products whose rounding is known exactly (Knuth, Dekker), so it
is right to 2^−102 of its result, additions of either sign included. Entries have to stay within
1e±150 or so: the errors of products must be doubles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["DoubleDouble", "exact_product", "exact_sum"]

Array = NDArray[np.float64]

#: Derived: Veltkamp's constant 2²⁷+1 splits a double into two halves whose products are exact.
SPLITTER = 134217729.0


def exact_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return (s, e) with a + b = s + e exactly, s the rounded sum (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@dataclass(frozen=True)
class DoubleDouble:
    """The numbers high + low, of which high is the nearest double."""

    high: Array
    low: Array

    #: Arrays leave mixed operations to this class.
    __array_ufunc__ = None

    @classmethod
    def of(cls, value: Any) -> DoubleDouble:
        """Return doubles as such numbers."""
        if isinstance(value, DoubleDouble):
            return value
        high = np.asarray(value, dtype=np.float64)
        return cls(high, np.zeros_like(high))

    def __getitem__(self, index: Any) -> DoubleDouble:
        return DoubleDouble(self.high[index], self.low[index])

    def __neg__(self) -> DoubleDouble:
        return DoubleDouble(-self.high, -self.low)

    def __add__(self, other: Any) -> DoubleDouble:
        other = DoubleDouble.of(other)
        high, error = exact_sum(self.high, other.high)
        low, rest = exact_sum(self.low, other.low)
        high, error = _fast_two_sum(high, error + low)
        return DoubleDouble(*_fast_two_sum(high, error + rest))

    def __sub__(self, other: Any) -> DoubleDouble:
        return self + -DoubleDouble.of(other)

    def __mul__(self, other: Any) -> DoubleDouble:
        other = DoubleDouble.of(other)
        high, error = exact_product(self.high, other.high)
        return DoubleDouble(
            *_fast_two_sum(high, error + (self.high * other.low + self.low * other.high))
        )

    def __truediv__(self, other: Any) -> DoubleDouble:
        divisor = DoubleDouble.of(other)
        first = DoubleDouble.of(self.high / divisor.high)
        rest = self - first * divisor
        second = DoubleDouble.of(rest.high / divisor.high)
        return first + second + DoubleDouble.of((rest - second * divisor).high / divisor.high)

    def __rtruediv__(self, other: Any) -> DoubleDouble:
        return DoubleDouble.of(other) / self

    def sqrt(self) -> DoubleDouble:
        """Return the roots of positive numbers, by one step of Newton's method from that of the
        double.
        """
        first = DoubleDouble.of(np.sqrt(self.high))
        return first + (self - first * first).high / (2 * first.high)


def exact_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Return (p, e) with a·b = p + e exactly, p the rounded product."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    return product, a_low * b_low - (
        ((product - a_high * b_high) - a_low * b_high) - a_high * b_low
    )


def _halves(x: Array) -> tuple[Array, Array]:
    """Return (h, l) with x = h + l exactly, h of half as many bits."""
    scaled = SPLITTER * x
    high = scaled - (scaled - x)
    return high, x - high


def _fast_two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the same where |a| ≥ |b|."""
    total = a + b
    return total, b - (total - a)
