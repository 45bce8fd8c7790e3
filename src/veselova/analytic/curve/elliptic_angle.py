"""An interval in the elliptic angle of its ends and of one further point on either side.

On [b_1, b_2] with b_0 < b_1 and b_2 < b_3 (either may be infinite) substitute

    sn²v = (b_2−b_0)(λ−b_1) / ((b_2−b_1)(λ−b_0)),   k² = (b_2−b_1)(b_3−b_0) / ((b_3−b_1)(b_2−b_0)),
    dλ/√|Π_{0…3}(λ−b_i)| = 2dv/√((b_3−b_1)(b_2−b_0)),   ψ = πv/K.

Each elliptic function is accurate relative to itself for every modulus, which is given by both k²
and k'² = 1−k², products of differences of branch points: for a closing gap k'² is tiny and 1−k²
would be noise. A function of period 2K in v has period 2π in ψ. Gauss's transformation, κ =
(1−k')/(1+k'), keeps ψ: at the last modulus the functions are circular ones of ψ/2, and sums and
products of positive numbers lead back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values

__all__ = ["FourPoints", "Jacobi"]

#: Derived: k² of the last modulus, in the precision: what is neglected there is below any rounding.
_NEGLIGIBLE = 2.0**-24


@dataclass(frozen=True)
class Jacobi:
    """sn, cn, dn of modulus k, with K = K(k) and K' = K(k')."""

    arithmetic: Arithmetic
    k_squared: Any
    complement: Any

    @cached_property
    def quarter(self) -> Any:
        """Return K, the real quarter period; it grows like log(4/k')."""
        return self.arithmetic.quarter_period(self.complement)

    @cached_property
    def aspect(self) -> float:
        """Return K'/K, which sets how fast trigonometric sums in ψ converge; infinite for k = 0."""
        if not self.k_squared > 0:
            return math.inf
        return float(self.arithmetic.quarter_period(self.k_squared) / self.quarter)

    @cached_property
    def _scale(self) -> tuple[list[tuple[Any, Any, Any]], Any]:
        """Return k', κ and 1−κ of each transformation, and k² of the last modulus.

        There sn = sin ψ/2 and cn = cos ψ/2 to less than k² of themselves, by their Fourier series
        in the nome q < k²/8, and so is dn = 1.
        """
        xp = self.arithmetic
        square, root = self.k_squared, xp.sqrt(self.complement)
        levels = []
        while square > _NEGLIGIBLE * xp.epsilon:
            kappa = square / ((1 + root) * (1 + root))
            levels.append((root, kappa, 2 * root / (1 + root)))
            square, root = kappa * kappa, 2 * xp.sqrt(root) / (1 + root)
        return levels, square

    def __call__(self, psi: Values) -> tuple[Values, Values, Values]:
        """Return sn, cn, dn at v = Kψ/π for any real ψ; sn and cn have period 4π in ψ, and their
        signs say where.
        """
        xp = self.arithmetic
        levels, last = self._scale
        s, c, d = (
            xp.add_error(x, x * last) for x in (xp.sin(psi / 2), xp.cos(psi / 2), 0 * psi + 1)
        )
        for _, kappa, rest in reversed(levels):
            square = s * s
            common = 1 / (1 + kappa * square)
            s, c, d = (1 + kappa) * s * common, c * d * common, (c * c + rest * square) * common
        return s, c, d

    def angle(self, sn: Any, cn: Any) -> Any:
        """Return ψ in [0, π] from sn and cn, neither negative, accurate relative to itself."""
        xp = self.arithmetic
        levels, last = self._scale
        s, c = sn, cn
        for root, kappa, rest in levels:
            d = xp.sqrt(c * c + root * root * s * s)
            s, c = (
                2 * s / ((1 + kappa) * (1 + d)),
                2 * c / xp.sqrt((1 + d) * (rest + (1 + kappa) * d)),
            )
        psi = 2 * xp.atan(s / c) if s <= c else xp.pi - 2 * xp.atan(c / s)
        return xp.add_error(psi, 4 * psi * last)


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

    def distances(self, psi: Values) -> tuple[Values, Values]:
        """Return λ−b_1 and b_2−λ at angles ψ."""
        below, above = self.roots(psi)
        return below * below, above * above

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
