"""The arithmetic of the closed form over mpmath: digits that share nothing with FLINT's balls."""

from __future__ import annotations

import decimal
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import flint
import mpmath
import numpy as np
from mpmath.libmp import from_rational

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.mechanics.core.enclosures import rational

__all__ = ["Extended"]

#: Guard digits: sums of a few hundred terms and products of 2g+1 factors lose two or three.
_GUARD = 6


class Extended(Arithmetic):
    """Multiprecision arithmetic through mpmath, with the given number of decimal digits (at least
    20).
    """

    def __init__(self, digits: int) -> None:
        self._context = mpmath.MPContext()
        self._context.dps = digits + _GUARD
        self.digits = digits
        self.epsilon = self._context.mpf(10) ** -digits
        self.pi = +self._context.pi
        for name in ("sqrt", "exp", "sin", "cos", "atan", "floor"):
            setattr(self, name, self._entrywise(getattr(self._context, name), 1))

    @staticmethod
    def _entrywise(function: Callable[..., Any], arguments: int) -> Callable[..., Any]:
        ufunc: Callable[..., Any] = np.frompyfunc(function, arguments, 1)
        return ufunc

    def number(self, value: Any) -> Any:
        """Return one number, rounded to this precision."""
        if isinstance(value, flint.arb):
            value = rational(value)
        if isinstance(value, (Fraction, decimal.Decimal)):
            return self._context.make_mpf(
                from_rational(*value.as_integer_ratio(), self._context.prec, "n")
            )
        return self._context.mpf(value.item() if isinstance(value, np.generic) else value)

    def multiples(self, psi: Values, count: int) -> tuple[Values, Values]:
        """Return cos mψ and sin mψ, m = 0…count−1, with a last axis for m."""
        angles = psi[..., None] * self.array(list(range(count)))
        return self.cos(angles), self.sin(angles)

    def quarter_period(self, complement: Any) -> Any:
        """Return K(k) for k'² = ``complement``."""
        return self.pi / 2 / self._context.agm(1, self._context.sqrt(complement))

    def inverse(self, matrix: Values) -> Values:
        """Return the inverse of a square matrix."""
        return np.array(
            self._context.inverse(self._context.matrix(matrix.tolist())).tolist(), dtype=object
        )

    def determinant(self, matrix: Values) -> Any:
        """Return the determinant of a square matrix."""
        return self._context.det(self._context.matrix(matrix.tolist()))
