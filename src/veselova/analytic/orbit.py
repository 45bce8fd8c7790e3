"""The linear flow on the torus, phases reduced without losing digits however far out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.precision import Values

__all__ = ["LinearFlow"]

Array = NDArray[np.float64]

#: Veltkamp's constant 2²⁷+1 splits a double into two halves whose products are exact.
_SPLITTER = 134217729.0


@dataclass(frozen=True)
class LinearFlow:
    """z(x) = start + x·(rates + rests), x a time; ``rests`` are the digits of the rates beyond double precision.

    Phases are taken modulo 2: the attitude has period 2 in z, everything else period 1.
    """

    start: Array
    rates: Array
    rests: Array

    @classmethod
    def of(cls, start: Array, rates: Values) -> LinearFlow:
        """Return the flow with rates given in any arithmetic: the part beyond a double goes to the rests."""
        leading = np.array([float(rate) for rate in rates])
        rests = np.array([float(rate - head) for rate, head in zip(rates, leading.tolist(), strict=True)])
        return cls(start, leading, rests)

    def advance(self, x: Array) -> Array:
        """Return x·(rates + rests) modulo 2, shape (N, g), to one rounding of the reduced value.

        x·rate is formed exactly as a sum of two doubles (Dekker); fmod of the first is exact.
        """
        product, error = _exact_product(x[:, None], self.rates)
        return np.asarray(np.fmod(product, 2.0) + (error + x[:, None] * self.rests))

    def phases(self, x: Array) -> Array:
        """Return z(x), reduced as ``advance`` is."""
        return self.start + self.advance(x)


def _exact_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Return (p, e) with a·b = p + e exactly, p the rounded product."""
    product = a * b
    a_high, b_high = _upper_half(a), _upper_half(b)
    a_low, b_low = a - a_high, b - b_high
    return product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


def _upper_half(x: Array) -> Array:
    scaled = _SPLITTER * x
    return np.asarray(scaled - (scaled - x))
