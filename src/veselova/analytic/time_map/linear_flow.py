"""The linear flow on the torus, phases reduced without losing digits however far out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["LinearFlow"]

Array = NDArray[np.float64]

#: Derived: Veltkamp's constant 2²⁷+1 splits a double into two halves whose products are exact.
_SPLITTER = 134217729.0


@dataclass(frozen=True)
class LinearFlow:
    """z(x) = start + x·rates, x a time, (g,) each.

    Phases are taken modulo 2: the attitude has period 2 in z, everything else period 1.
    """

    start: Array
    rates: Array

    def phases(self, x: Array) -> Array:
        """Return z(x), (N, g), to one rounding of the reduced value.

        x·rate is formed exactly as a sum of two doubles (Dekker); fmod of the first is exact.
        """
        product = x[:, None] * self.rates
        (a, b), (c, d) = _halves(x[:, None]), _halves(self.rates)
        error = b * d - (((product - a * c) - b * c) - a * d)
        return np.asarray(self.start + (np.fmod(product, 2.0) + error))


def _halves(x: Array) -> tuple[Array, Array]:
    """Return x as a sum of two numbers of 26 bits."""
    part = _SPLITTER * x
    high = part - (part - x)
    return high, x - high
