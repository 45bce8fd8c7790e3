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

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.analytic.numerics.jacobi_elliptic import Jacobi

__all__ = ["FourPoints"]


@dataclass(frozen=True)
class FourPoints:
    """The widths b_1−b_0, b_2−b_1 and b_3−b_2; None for a neighbour at infinity, but not for
    both.
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
        neighbours = (x for x in (self.before, self.after) if x is not None)
        root = math.prod(self.arithmetic.sqrt(self.width + x) for x in neighbours)
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

    def angle(self, below: Any, above: Any, increasing: bool) -> Any:
        """Return ψ in (−π, π] of the point with λ−b_1 = ``below`` and b_2−λ = ``above``, on the way
        back negative.
        """
        xp = self.arithmetic
        # sn² : cn² = (b_2−b_0)(λ−b_1) : (b_1−b_0)(b_2−λ), and for b_0 = −∞ the first factors drop
        # out.
        below, above = xp.number(max(below, 0)), xp.number(max(above, 0)) * self._shares[0]
        whole = below + above
        psi = self.jacobi.angle(xp.sqrt(below / whole), xp.sqrt(above / whole))
        return psi if increasing else -psi
