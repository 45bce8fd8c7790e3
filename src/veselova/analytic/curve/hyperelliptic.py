"""The hyperelliptic curve w² = R(λ) = −Π(λ−I_i) Π(λ−c_k), equation (Rad, printed 6.12), of genus g
= n−1, c_1 = 0 but for Neumann's system; and its cuts and gaps, each in the elliptic angle of its
four nearest branch points (analytic.curve.elliptic_angle).

All other branch points then lie at distance K' from the real v-axis or farther, so sums over ψ =
πv/K converge like e^(−2πN K'/K) however closely branch points cluster: a closing gap costs
log(1/gap).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.analytic.curve.branch_points import Spectrum
from veselova.analytic.curve.elliptic_angle import FourPoints

__all__ = ["Curve", "Interval"]

Kind = Literal["I", "c"]


@dataclass(frozen=True)
class Curve:
    """The branch points b_0 < b_1 < … < b_{2g} and all their differences, each rounded once from
    more digits.

    Cut s = 1…g is [b_{2s−1}, b_{2s}], where λ_s moves; gap s = 0…g−1 is [b_{2s}, b_{2s+1}].

    - differences: [i, j] is b_j − b_i
    - origins: of each b_j, whether it is an ``I`` or a ``c``, and the index of its sorted body axis
      (from 0), or of c_k, with c_1 at 0
    """

    arithmetic: Arithmetic
    branch_points: Values
    differences: Values
    origins: tuple[tuple[Kind, int], ...] = ()

    @classmethod
    def of(cls, spectrum: Spectrum, arithmetic: Arithmetic) -> Curve:
        """Return the curve of a spectrum, rounded to ``arithmetic``."""
        points = np.array([value for value, _, _ in spectrum.branch_points], dtype=object)
        with spectrum.arithmetic:
            differences = arithmetic.array(points - points[:, None])
        origins = tuple((kind, index) for _, kind, index in spectrum.branch_points)
        return cls(arithmetic, arithmetic.array(points), differences, origins)

    @property
    def genus(self) -> int:
        """Return g = n−1."""
        return (len(self.branch_points) - 1) // 2

    def places(self, kind: Kind) -> list[int]:
        """Return the indices j of the branch points of one kind."""
        return [self.origins.index((kind, i)) for i in range(self.genus + (kind == "I"))]

    @cached_property
    def midpoints(self) -> Values:
        """Return ζ_l − b_j, shape (2g+1, g−1), with ζ_l the midpoint of gap l = 1…g−1: the zeros of
        the nodal differentials.
        """
        even = np.arange(2, 2 * self.genus, 2)
        return (self.differences[:, even] + self.differences[:, even + 1]) / 2


@dataclass(frozen=True)
class Interval(FourPoints):
    """The interval [b_j, b_{j+1}], a cut for odd j and a gap for even j; λ runs over it as ψ runs
    from 0 to π.

    Points are along the last axis: sums over them are in pairs, which rounds less.
    """

    curve: Curve
    left: int

    @classmethod
    def of(cls, curve: Curve, left: int) -> Interval:
        """Return the interval that begins at b_left."""
        widths = [curve.differences[j, j + 1] for j in range(2 * curve.genus)]
        before, width, after = [None, *widths, None][left : left + 3]
        return cls(curve.arithmetic, before, width, after, curve, left)

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
        xp = self.arithmetic
        squares = self.to_branch_points(below, above)
        squares[max(self.left - 1, 0) : self.left + 3] = xp.number(1)  # the substitution has them
        roots = xp.sqrt(squares)
        outer = roots[0] * roots[1] * roots[-1]
        return self.density / outer, roots[2:-1:2] * roots[3::2]

    @cached_property
    def strip(self) -> Any:
        """Return πK'/2K, half the width of the strip about the real ψ-axis in which the forms are
        analytic.
        """
        return math.pi * self.jacobi.aspect / 2

    @property
    def decay(self) -> Any:
        """Return e^(−half of that): coefficients of the forms fall at least like its powers."""
        return self.arithmetic.exp(self.arithmetic.number(-self.strip))

    @cached_property
    def ends_of_strip(self) -> tuple[Any, Any]:
        """Return b_1−λ and λ−b_2 at the edge of that strip, at ψ = 0 and π.

        There |sn²v| = 1/k, so λ, a Möbius function of sn²v, runs on a circle about the interval
        that meets the real axis at sn² = −1/k and 1/k, between b_0 and b_1, and between b_2 and
        b_3.
        """
        before = self.before
        width = self.width
        square = 1 / self.arithmetic.sqrt(self.jacobi.k_squared)
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
        pairs = zip(left + zeros[j], right - zeros[j + 1], strict=True)
        factors = [max(abs(x), abs(y)) for x, y in pairs]
        omitted = [math.prod(factors[:l] + factors[l + 1 :]) for l in range(len(factors) + 1)]
        return np.asarray(np.array(omitted, dtype=object) * self.bound_density_in_strip())

    def bound_density_in_strip(self) -> Any:
        """Return an upper bound of |dλ/dψ|/(2√|R|) in that strip."""
        left, right = self.ends_of_strip
        d = self.curve.differences
        j = self.left
        outside = [d[i, j] - left for i in range(j - 1)] + [
            d[j + 1, i] - right for i in range(j + 3, 2 * self.curve.genus + 1)
        ]
        return self.density / math.prod(self.arithmetic.sqrt(x) for x in outside)

    def to_midpoints(self, below: Values, above: Values) -> Values:
        """Return λ−ζ_l, l = 1…g−1, shape (g−1, N), with ζ_l the midpoint of gap l, from the nearer
        end.
        """
        zeros, lower = self.curve.midpoints, self.left // 2
        from_left = below - zeros[self.left, :lower, None]
        from_right = -above - zeros[self.left + 1, lower:, None]
        return np.concatenate([from_left, from_right])

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
