"""The linear flow on the torus, phases reduced without losing digits however far out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.double_double import DoubleDouble, exact_product, halves

__all__ = ["LinearFlow"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Derived: bits of the largest rate that products with the orders of modes leave exact.
_COARSE_BITS = 30

#: Derived: what a combination that stands still moves by.
_STANDING = 1e-60


@dataclass(frozen=True)
class LinearFlow:
    """z(x) = start + x·(rates + rests), x a time; ``rests`` are the digits of the rates beyond
    double precision.

    Phases are taken modulo 2: the attitude has period 2 in z, everything else period 1.
    """

    start: Array
    rates: Array
    rests: Array

    @classmethod
    def of(cls, start: Array, rates: Values) -> LinearFlow:
        """Return the flow with rates given in any arithmetic: the part beyond a double goes to the
        rests.
        """
        leading = np.array([float(rate) for rate in rates])
        rests = np.array(
            [float(rate - head) for rate, head in zip(rates, leading.tolist(), strict=True)]
        )
        return cls(start, leading, rests)

    def with_combinations(self, orders: Integers) -> LinearFlow:
        """Return the flow of z and, after them, of the combinations m·z for integers m (K, g),
        whose rates keep all digits.

        None of them stands still: it moves by a 1e-60th of the fastest rate instead.
        """
        rates = (DoubleDouble(self.rates, self.rests) * orders).total()
        high = np.where(rates.high == 0, _STANDING * np.max(np.abs(self.rates)), rates.high)
        start = np.concatenate([self.start, orders @ self.start])
        rests = np.concatenate([self.rests, rates.low])
        return LinearFlow(start, np.concatenate([self.rates, high]), rests)

    def per(self, unit: float) -> LinearFlow:
        """Return z as a function of x·unit: the rates divided by it, to as many digits as two
        doubles have.
        """
        rates = self.rates / unit
        product, error = exact_product(rates, np.full_like(rates, unit))
        return LinearFlow(self.start, rates, (((self.rates - product) - error) + self.rests) / unit)

    def rates_of(self, orders: Integers) -> Array:
        """Return m·(rates + rests) for integers m (K, g), right to 1e-24 of the largest rate: small
        ones do not cancel.
        """
        quantum = np.ldexp(1.0, math.frexp(float(np.max(np.abs(self.rates))))[1] - _COARSE_BITS)
        coarse = np.rint(self.rates / quantum) * quantum
        return np.asarray(orders @ coarse + orders @ ((self.rates - coarse) + self.rests))

    @cached_property
    def _halves(self) -> tuple[Array, Array]:
        return halves(self.rates)

    def advance(self, x: Array) -> Array:
        """Return x·(rates + rests) modulo 2, shape (N, g), to one rounding of the reduced value.

        x·rate is formed exactly as a sum of two doubles (Dekker); fmod of the first is exact.
        """
        column = x[:, None]
        product, error = exact_product(column, self.rates, self._halves)
        error += column * self.rests
        return np.asarray(np.fmod(product, 2.0) + error)

    def phases(self, x: Array) -> Array:
        """Return z(x), reduced as ``advance`` is."""
        return self.start + self.advance(x)
