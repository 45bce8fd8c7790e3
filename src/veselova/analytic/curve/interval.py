"""One cut or gap of the curve in the elliptic angle of its four nearest branch points
(analytic.curve.elliptic_angle).

All other branch points then lie at distance K' from the real v-axis or farther, so sums over ψ =
πv/K converge like e^(−2πN K'/K) however closely branch points cluster: a closing gap costs
log(1/gap).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.curve.elliptic_angle import FourPoints
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.numerics.jacobi_elliptic import Jacobi

__all__ = ["Interval"]


@dataclass(frozen=True)
class Interval:
    """The interval [b_j, b_{j+1}], a cut for odd j and a gap for even j; λ runs over it as ψ runs
    from 0 to π.

    Points are along the last axis: sums over them are in pairs, which rounds less.
    """

    curve: Curve
    left: int

    @cached_property
    def points(self) -> FourPoints:
        """Return the interval with its neighbours b_0 and b_3."""
        j = self.left
        last = 2 * self.curve.genus
        width = self.curve.width
        before = width(j - 1) if j > 0 else None
        after = width(j + 1) if j + 2 <= last else None
        return FourPoints(self.curve.arithmetic, before, width(j), after)

    @property
    def jacobi(self) -> Jacobi:
        """Return the elliptic functions of this interval."""
        return self.points.jacobi

    def roots(self, psi: Values) -> tuple[Values, Values]:
        """Return √(λ−b_1) along sn and √(b_2−λ) along cn at angles ψ: signed, and each accurate
        relative to itself.
        """
        return self.points.roots(psi)

    def distances(self, psi: Values) -> tuple[Values, Values]:
        """Return λ−b_1 and b_2−λ at angles ψ."""
        below, above = self.roots(psi)
        return below * below, above * above

    def to_branch_points(self, below: Values, above: Values) -> Values:
        """Return |λ−b_i| for all i, (2g+1, N), from λ−b_1 = ``below`` and b_2−λ = ``above``: sums
        of positive terms.
        """
        j, d = self.left, self.curve.differences
        return np.concatenate([d[: j + 1, j, None] + below, d[j + 1, j + 1 :, None] + above])

    def measure(self, below: Values, above: Values) -> tuple[Values, Values]:
        """Return (m, r): dλ/(2√|R|) = m/Π_l r_l dψ: m (N,), and r_l, l = 1…g−1, (g−1, N), gap l's
        root.
        """
        xp = self.curve.arithmetic
        squares = self.to_branch_points(below, above)
        squares[max(self.left - 1, 0) : self.left + 3] = xp.number(1)  # the substitution has them
        roots = xp.sqrt(squares)
        outer = roots[0] * roots[1] * roots[-1]
        return self.points.density / outer, roots[2:-1:2] * roots[3::2]

    @cached_property
    def strip(self) -> Any:
        """Return πK'/2K, half the width of the strip about the real ψ-axis in which the forms are
        analytic.
        """
        return math.pi * self.jacobi.aspect / 2

    @cached_property
    def ends_of_strip(self) -> tuple[Any, Any]:
        """Return b_1−λ and λ−b_2 at the edge of that strip, at ψ = 0 and π.

        There |sn²v| = 1/k, so λ, a Möbius function of sn²v, runs on a circle about the interval
        that meets the real axis at sn² = −1/k and 1/k, between b_0 and b_1, and between b_2 and
        b_3.
        """
        before = self.points.before
        width = self.points.width
        square = 1 / self.curve.arithmetic.sqrt(self.jacobi.k_squared)
        if before is None:
            return width * square, width * (square - 1)
        left = width * before * square / (before + width * (1 + square))
        return left, width * (width + before) * (square - 1) / (before - width * (square - 1))

    def bound_in_strip(self) -> Values:
        """Return upper bounds of |du_k/dψ| in the strip of one interval, (g,).

        On that circle |λ−x| lies between its values on the real axis.
        """
        left, right = self.ends_of_strip
        j = self.left
        zeros = self.curve.midpoints
        factors = [
            max(abs(left + zeros[j, l]), abs(right - zeros[j + 1, l]))
            for l in range(zeros.shape[1])
        ]
        common = self.bound_density_in_strip()
        return np.array(
            [common * math.prod(factors[:l] + factors[l + 1 :]) for l in range(len(factors) + 1)],
            dtype=object,
        )

    def bound_density_in_strip(self) -> Any:
        """Return an upper bound of |dλ/dψ|/(2√|R|) in that strip."""
        left, right = self.ends_of_strip
        d = self.curve.differences
        j = self.left
        outside = [d[i, j] - left for i in range(j - 1)] + [
            d[j + 1, i] - right for i in range(j + 3, 2 * self.curve.genus + 1)
        ]
        return self.points.density / math.prod(self.curve.arithmetic.sqrt(x) for x in outside)

    def to_midpoints(self, below: Values, above: Values) -> Values:
        """Return λ−ζ_l, l = 1…g−1, shape (g−1, N), with ζ_l the midpoint of gap l, from the nearer
        end.
        """
        zeros, lower = self.curve.midpoints, self.left // 2
        return np.concatenate(
            [
                below - zeros[self.left, :lower, None],
                -above - zeros[self.left + 1, lower:, None],
            ]
        )

    def forms(self, below: Values, above: Values) -> Values:
        """Return |du_k/dψ| with the sign of the nodal polynomial, k = 1…g, shape (g, N):
        holomorphic forms p_k dλ/(2√|R|).

        p_g = Π(λ−ζ_l) over the midpoints ζ_l of all inner gaps, and p_k = p_g/(λ−ζ_k) for k < g.
        Each λ−ζ_l is divided by the root of its own gap's ends, so every factor is of order one at
        any genus.
        """
        common, of_gaps = self.measure(below, above)
        factors = self.to_midpoints(below, above) / of_gaps
        one = np.ones_like(below)[None]
        lower = np.cumprod(np.concatenate([one, factors]), axis=0)
        upper = np.cumprod(np.concatenate([one, factors[::-1]]), axis=0)[::-1]
        omitted = lower[:-1] * upper[1:] / of_gaps
        return np.asarray(common * np.concatenate([omitted, lower[-1:]]))
