"""The linear flow on the torus, phases reduced without losing digits however far out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.precision import Values
from veselova.analytic.twofold import exact_product, halves

__all__ = ["LinearFlow"]

Array = NDArray[np.float64]


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

    @cached_property
    def _halves(self) -> tuple[Array, Array]:
        return halves(self.rates)

    def advance(self, x: Array) -> Array:
        """Return x·(rates + rests) modulo 2, shape (N, g), to one rounding of the reduced value.

        x·rate is formed exactly as a sum of two doubles (Dekker); fmod of the first is exact.
        """
        product, error = exact_product(x[:, None], self.rates, self._halves)
        return np.asarray(np.fmod(product, 2.0) + (error + x[:, None] * self.rests))

    def phases(self, x: Array) -> Array:
        """Return z(x), reduced as ``advance`` is."""
        return self.start + self.advance(x)
