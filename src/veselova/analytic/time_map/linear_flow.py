"""The linear flow on the torus, phases reduced without losing digits however far out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.double_double import exact_product

__all__ = ["LinearFlow"]

Array = NDArray[np.float64]


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
        product, error = exact_product(x[:, None], self.rates)
        return np.asarray(self.start + (np.fmod(product, 2.0) + error))
