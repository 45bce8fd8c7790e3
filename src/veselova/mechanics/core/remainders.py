"""Numbers as a double and the remainder that it leaves, a second double: 106 bits together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.exact_input import to_float

__all__ = ["exact_sum", "split", "split_grid"]

Array = NDArray[np.float64]

#: Bits of the leading parts of a step, whose products with whole numbers below 2²⁴ are exact.
_PART_BITS = 29

#: Points of a grid this much nearer to zero than its ends lose digits by cancellation, and are
#: formed as rationals.
_CANCELS = 1e-3


def exact_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return (s, e) with a + b = s + e exactly, s the rounded sum (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def split(numbers: Sequence[Fraction]) -> tuple[Array, Array]:
    """Return the nearest doubles (N,) and the remainders (N,), each rounded once."""
    doubles = np.array(to_float(numbers))
    pairs = zip(numbers, doubles.tolist(), strict=True)
    return doubles, np.array([float(number - Fraction(double)) for number, double in pairs])


def split_grid(start: Fraction, step: Fraction, count: int) -> tuple[Array, Array]:
    """Return start + k·step for k = 0 … count−1 < 2²⁴ as doubles and remainders, right to 1e-28 of
    each number.
    """
    k = np.arange(count, dtype=np.float64)
    coarse = _leading_part(step)
    middle = _leading_part(step - Fraction(coarse))
    (origin,), (rest,) = split([start])
    doubles, first = exact_sum(np.full(count, origin), k * coarse)
    doubles, second = exact_sum(doubles, k * middle)
    fine = float(step - Fraction(coarse) - Fraction(middle))
    doubles, remainders = exact_sum(doubles, (first + second) + (rest + k * fine))
    near_zero = np.flatnonzero(np.abs(doubles) < _CANCELS * np.max(np.abs(doubles[[0, -1]])))
    if near_zero.size:
        doubles[near_zero], remainders[near_zero] = split(
            [start + int(i) * step for i in near_zero]
        )
    return doubles, remainders


def _leading_part(number: Fraction) -> float:
    """Return a number rounded to _PART_BITS bits."""
    mantissa, exponent = math.frexp(float(number))
    return math.ldexp(round(math.ldexp(mantissa, _PART_BITS)), exponent - _PART_BITS)
