"""One cut or gap of the curve in the elliptic angle of its four nearest branch points.

On [b_1, b_2] with neighbours b_0 < b_1 and b_2 < b_3 (either may be infinite) substitute

    sn²v = (b_2−b_0)(λ−b_1) / ((b_2−b_1)(λ−b_0)),   k² = (b_2−b_1)(b_3−b_0) / ((b_3−b_1)(b_2−b_0)),
    dλ/√|Π_{0…3}(λ−b_i)| = 2dv/√((b_3−b_1)(b_2−b_0)).

All other branch points then lie at distance K' from the real v-axis or farther, so sums over ψ = πv/K converge like
e^(−2πN K'/K) however closely branch points cluster: a closing gap costs log(1/gap).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.curve import Curve
from veselova.analytic.elliptic import Jacobi
from veselova.analytic.precision import Values

__all__ = ["Interval"]


@dataclass(frozen=True)
class Interval:
    """The interval [b_j, b_{j+1}], a cut for odd j and a gap for even j; λ runs over it as ψ runs from 0 to π."""

    curve: Curve
    left: int

    @cached_property
    def _widths(self) -> tuple[Any, Any, Any]:
        """Return the widths (b_1−b_0, b_2−b_1, b_3−b_2), None for an infinite neighbour."""
        d, j, last = self.curve.differences, self.left, 2 * self.curve.genus
        return d[j - 1, j] if j > 0 else None, d[j, j + 1], d[j + 1, j + 2] if j + 2 <= last else None

    @cached_property
    def jacobi(self) -> Jacobi:
        """Return the elliptic functions of this interval; k'² is a product of gap widths, never 1−k²."""
        before, width, after = self._widths
        if before is None:
            return Jacobi(self.curve.arithmetic, width / (width + after), after / (width + after))
        if after is None:
            return Jacobi(self.curve.arithmetic, width / (width + before), before / (width + before))
        denominator = (width + after) * (width + before)
        return Jacobi(self.curve.arithmetic, width * (before + width + after) / denominator, before * after / denominator)

    @cached_property
    def density(self) -> Any:
        """Return (K/π)/√((b_3−b_1)(b_2−b_0)), the factor of dψ in dλ/(2√|Π(λ−b_i)|)."""
        before, width, after = self._widths
        factors = [width + neighbour for neighbour in (before, after) if neighbour is not None]
        product = factors[0] if len(factors) == 1 else factors[0] * factors[1]
        return self.jacobi.quarter / self.curve.arithmetic.pi / self.curve.arithmetic.sqrt(product)

    def nodes(self, count: int) -> Values:
        """Return ``count`` midpoints of (0, π): with them the trapezoidal rule over a full period, by symmetry."""
        xp = self.curve.arithmetic
        return xp.array([xp.pi * (2 * i + 1) / (2 * count) for i in range(count)])

    def distances(self, psi: Values) -> tuple[Values, Values, Values, Values]:
        """Return sn, cn (signed) and λ−b_1, b_2−λ (each accurate relative to itself) at angles ψ."""
        before, width, _ = self._widths
        sn, cn, _ = self.jacobi(psi)
        if before is None:
            return sn, cn, width * sn * sn, width * cn * cn
        denominator = before + width * cn * cn
        return sn, cn, width * before * sn * sn / denominator, width * (width + before) * cn * cn / denominator

    def squares(self, below: Any, above: Any) -> tuple[Any, Any]:
        """Return sn², cn² of the point with λ−b_1 = ``below`` and b_2−λ = ``above``, the inverse of ``distances``."""
        before, _, _ = self._widths
        # sn² : cn² = (b_2−b_0)(λ−b_1) : (b_1−b_0)(b_2−λ), and for b_0 = −∞ the first factors drop out.
        if before is not None:
            below, above = (before + self._widths[1]) * below, before * above
        return below / (below + above), above / (below + above)

    def from_branch_point(self, i: int, below: Values, above: Values) -> Values:
        """Return |λ−b_i|, from λ−b_1 = ``below`` and b_2−λ = ``above``: a sum of positive terms."""
        d, j = self.curve.differences, self.left
        return np.asarray(d[i, j] + below if i <= j else above + d[j + 1, i])

    def forms(self, below: Values, above: Values) -> Values:
        """Return |du_k/dψ| with the sign of the nodal polynomial, k = 1…g, shape (g, ...): holomorphic forms p_k dλ/(2√|R|).

        p_g = Π(λ−ζ_l) over the midpoints ζ_l of all inner gaps, and p_k = p_g/(λ−ζ_k) for k < g. Each λ−ζ_l is divided by
        the root of its own gap's ends, so every factor is of order one at any genus.
        """
        xp, g = self.curve.arithmetic, self.curve.genus
        one = 0 * below + 1

        def root_of(ends: list[int]) -> Values:
            result = one
            for i in ends:
                if not self.left - 1 <= i <= self.left + 2:  # the four nearest went into the substitution
                    result = result * self.from_branch_point(i, below, above)
            return np.asarray(xp.sqrt(result))

        zeros, j = self.curve.midpoints, self.left
        numerators = [(below - zeros[j, m]) if 2 * (m + 1) <= j else -(above + zeros[j + 1, m]) for m in range(g - 1)]
        roots = [root_of([2 * (m + 1), 2 * (m + 1) + 1]) for m in range(g - 1)]
        common = self.density / root_of([0, 1, 2 * g] if g > 0 else [0])
        factors = [numerator / root for numerator, root in zip(numerators, roots, strict=True)]
        before, after = [one], [one]
        for factor in factors:
            before.append(before[-1] * factor)
        for factor in reversed(factors):
            after.append(after[-1] * factor)
        after.reverse()
        lower = [common * before[k] * after[k + 1] / roots[k] for k in range(g - 1)]
        return np.stack([*lower, common * before[-1]])
