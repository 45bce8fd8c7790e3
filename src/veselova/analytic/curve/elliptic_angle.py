"""An interval in the elliptic angle of its ends and of one further point on either side.

On [b_1, b_2] with b_0 < b_1 and b_2 < b_3 (either may be infinite) substitute

    sn²v = (b_2−b_0)(λ−b_1) / ((b_2−b_1)(λ−b_0)),   k² = (b_2−b_1)(b_3−b_0) / ((b_3−b_1)(b_2−b_0)),
    dλ/√|Π_{0…3}(λ−b_i)| = 2dv/√((b_3−b_1)(b_2−b_0)),   ψ = πv/K.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.analytic.numerics.jacobi_elliptic import Jacobi

__all__ = ["FAR", "FourPoints"]

#: Derived: the distance of a neighbour at infinity among others: to all digits its ratios are one
#: and zero.
FAR = 1e300


@dataclass(frozen=True)
class FourPoints:
    """The widths b_1−b_0, b_2−b_1 and b_3−b_2; None for a neighbour at infinity, but not for both.

    In doubles they may be arrays (N, 1), for N intervals at once; a neighbour at infinity is then
    FAR away.
    """

    arithmetic: Arithmetic
    before: Any
    width: Any
    after: Any

    @cached_property
    def _shares(self) -> tuple[Any, Any, Any, Any]:
        """Return (b_1−b_0)/(b_2−b_0), (b_3−b_2)/(b_3−b_1), and what these leave of one; 1 and 0 for
        a neighbour at infinity.
        """
        # Ratios before products: the square of a width of 1e-200 is no float.
        one = self.arithmetic.number(1)
        (lower, below), (upper, above) = (
            (one, 0 * one) if x is None else (x / (x + self.width), self.width / (x + self.width))
            for x in (self.before, self.after)
        )
        return lower, upper, below, above

    @cached_property
    def jacobi(self) -> Jacobi:
        """Return the elliptic functions; k'² is a product of gap widths, never 1−k²."""
        lower, upper, rest_below, rest_above = self._shares
        return Jacobi(self.arithmetic, rest_below + rest_above * lower, lower * upper)

    @cached_property
    def density(self) -> Any:
        """Return (K/π)/√((b_3−b_1)(b_2−b_0)), the factor of dψ in dλ/(2√|Π(λ−b_i)|); without what
        is infinite.
        """
        factors = [
            self.width + neighbour
            for neighbour in (self.before, self.after)
            if neighbour is not None
        ]
        if isinstance(self.width, np.ndarray):
            factors = [np.where(factor < FAR, factor, 1.0) for factor in factors]
        root = math.prod(self.arithmetic.sqrt(factor) for factor in factors)
        return self.jacobi.quarter / self.arithmetic.pi / root

    def roots(self, psi: Values) -> tuple[Values, Values]:
        """Return √(λ−b_1) along sn and √(b_2−λ) along cn at angles ψ: signed, and each accurate
        relative to itself.
        """
        xp = self.arithmetic
        before = self.before
        width = self.width
        sn, cn, _ = self.jacobi(psi)
        root = xp.sqrt(width)
        if before is None:
            return root * sn, root * cn
        denominator = before + width * cn * cn
        return root * xp.sqrt(before / denominator) * sn, root * xp.sqrt(
            (width + before) / denominator
        ) * cn

    def squares(self, below: Any, above: Any) -> tuple[Any, Any]:
        """Return sn², cn² of the point with λ−b_1 = ``below`` and b_2−λ = ``above``."""
        # sn² : cn² = (b_2−b_0)(λ−b_1) : (b_1−b_0)(b_2−λ), and for b_0 = −∞ the first factors drop
        # out.
        above = above * self._shares[0]
        return below / (below + above), above / (below + above)

    def angle(self, below: Any, above: Any, increasing: bool) -> Any:
        """Return ψ in (−π, π] of such a point, on the way back negative: v = F(am v, k) =
        sn·R_F(cn², dn², 1).
        """
        xp = self.arithmetic
        squares = self.squares(xp.number(max(below, 0)), xp.number(max(above, 0)))
        # From the nearer end: at the other one R_F is singular, and v would lose half its digits.
        v = self._from_left(*squares) if squares[0] <= squares[1] else self._from_right(*squares)
        psi = xp.pi * v / self.jacobi.quarter
        return psi if increasing else -psi

    def angles(self, below: Values, above: Values, increasing: Values) -> Values:
        """Return the same for one point on each of many intervals, shape (N, 1)."""
        squares = self.squares(np.maximum(below, 0), np.maximum(above, 0))
        v = np.where(
            squares[0] <= squares[1], self._from_left(*squares), self._from_right(*squares)
        )
        psi = np.pi * v / self.jacobi.quarter
        return np.asarray(np.where(increasing, psi, -psi))

    def _from_left(self, sn_squared: Any, cn_squared: Any) -> Any:
        xp = self.arithmetic
        jacobi = self.jacobi
        dn_squared = jacobi.complement + jacobi.k_squared * cn_squared
        return xp.sqrt(sn_squared) * xp.carlson_rf(cn_squared, dn_squared, xp.number(1))

    def _from_right(self, sn_squared: Any, cn_squared: Any) -> Any:
        """sn(K−v) = cn/dn, cn(K−v) = k' sn/dn, dn(K−v) = k'/dn."""
        xp = self.arithmetic
        jacobi = self.jacobi
        dn_squared = jacobi.complement + jacobi.k_squared * cn_squared
        reflected = jacobi.complement / dn_squared
        return jacobi.quarter - xp.sqrt(cn_squared / dn_squared) * xp.carlson_rf(
            reflected * sn_squared, reflected, xp.number(1)
        )
