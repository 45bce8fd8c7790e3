"""One cut or gap of the curve in the elliptic angle of its four nearest branch points
(analytic.curve.elliptic_angle).

All other branch points then lie at distance K' from the real v-axis or farther, so sums over ψ =
πv/K converge like e^(−2πN K'/K) however closely branch points cluster: a closing gap costs
log(1/gap).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.curve.elliptic_angle import FAR, FourPoints
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.numerics.jacobi_elliptic import Jacobi

__all__ = ["Interval"]

#: Budget: genera with their intervals of which layouts are kept.
_MOST_KEPT = 1024


@dataclass(frozen=True)
class Interval:
    """The interval [b_j, b_{j+1}], a cut for odd j and a gap for even j; λ runs over it as ψ runs
    from 0 to π.

    Points are along the last axis: sums over them are in pairs, which rounds less.
    Of one curve in doubles it may be S intervals j, side by side: what is said of one then has a
    first axis for them.
    """

    curve: Curve
    left: int | tuple[int, ...]

    @cached_property
    def points(self) -> FourPoints:
        """Return the interval with its neighbours b_0 and b_3."""
        j = self.left
        last = 2 * self.curve.genus
        if isinstance(j, tuple):
            around = np.array([FAR, *np.diagonal(self.curve.differences, 1).tolist(), FAR])
            return FourPoints(
                self.curve.arithmetic, *(around[np.array(j) + k, None] for k in range(3))
            )
        width = self.curve.width
        before = width(j - 1) if j > 0 else None
        after = width(j + 1) if j + 2 <= last else None
        return FourPoints(self.curve.arithmetic, before, width(j), after)

    @cached_property
    def _layout(self) -> _Layout:
        return _layout(self.curve.genus, self.left)

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
        """Return |λ−b_i| for all i, (..., 2g+1, N), from λ−b_1 = ``below`` and b_2−λ = ``above``:
        sums of positive terms.
        """
        layout = self._layout
        stretches = self.curve.differences[..., layout.rows, layout.columns]
        return np.asarray(
            stretches[..., None]
            + np.where(layout.on_left, below[..., None, :], above[..., None, :])
        )

    def measure(self, below: Values, above: Values) -> tuple[Values, Values]:
        """Return (m, r): dλ/(2√|R|) = m/Π_l r_l dψ: m (..., N), and r_l, l = 1…g−1, (..., g−1, N),
        gap l's root.
        """
        xp = self.curve.arithmetic
        g = self.curve.genus
        # The four nearest went into the substitution.
        roots = xp.sqrt(
            np.where(self._layout.nearest, xp.number(1), self.to_branch_points(below, above))
        )
        outer = roots[..., 0, :] * roots[..., 1, :] * roots[..., 2 * g, :]
        return self.points.density / outer, roots[..., 2:-1:2, :] * roots[..., 3::2, :]

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
        j = cast("int", self.left)
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
        j = cast("int", self.left)
        outside = [d[i, j] - left for i in range(j - 1)] + [
            d[j + 1, i] - right for i in range(j + 3, 2 * self.curve.genus + 1)
        ]
        return self.points.density / math.prod(self.curve.arithmetic.sqrt(x) for x in outside)

    def to_midpoints(self, below: Values, above: Values) -> Values:
        """Return λ−ζ_l, l = 1…g−1, shape (..., g−1, N), with ζ_l the midpoint of gap l."""
        layout = self._layout
        inner = np.arange(self.curve.genus - 1)
        of_end = self.curve.midpoints[..., layout.nearer_end, inner]
        return (
            np.where(layout.is_below, below[..., None, :], -above[..., None, :]) - of_end[..., None]
        )

    def forms(self, below: Values, above: Values) -> Values:
        """Return |du_k/dψ| with the sign of the nodal polynomial, k = 1…g, shape (..., g, N):
        holomorphic forms p_k dλ/(2√|R|).

        p_g = Π(λ−ζ_l) over the midpoints ζ_l of all inner gaps, and p_k = p_g/(λ−ζ_k) for k < g.
        Each λ−ζ_l is divided by the root of its own gap's ends, so every factor is of order one at
        any genus.
        """
        common, of_gaps = self.measure(below, above)
        numerators = self.to_midpoints(below, above)
        factors = numerators / of_gaps
        one = np.ones_like(below)[..., None, :]
        lower = np.cumprod(np.concatenate([one, factors], axis=-2), axis=-2)
        upper = np.cumprod(np.concatenate([one, factors[..., ::-1, :]], axis=-2), axis=-2)[
            ..., ::-1, :
        ]
        omitted = lower[..., :-1, :] * upper[..., 1:, :] / of_gaps
        return np.asarray(
            common[..., None, :] * np.concatenate([omitted, lower[..., -1:, :]], axis=-2)
        )


@dataclass(frozen=True)
class _Layout:
    """Where branch points and midpoints of gaps lie as seen from intervals [b_j, b_{j+1}]; axes as
    those of their points.

    - rows, columns: (..., 2g+1): b_i is as far from the nearer end as these two are from each
      other
    - on_left: (..., 2g+1, 1): whether b_i is b_j or below
    - nearest: (..., 2g+1, 1): whether b_i is an end or next to one
    - nearer_end: (..., g−1): the end nearer to the midpoint of gap l
    - is_below: (..., g−1, 1): whether that end is b_j
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    on_left: NDArray[np.bool_]
    nearest: NDArray[np.bool_]
    nearer_end: NDArray[np.intp]
    is_below: NDArray[np.bool_]


@lru_cache(_MOST_KEPT)
def _layout(genus: int, left: int | tuple[int, ...]) -> _Layout:
    j = np.array(left)[..., None]
    i = np.arange(2 * genus + 1)
    inner = np.arange(genus - 1)
    on_left = i <= j
    is_below = inner < j // 2
    arrays = (
        np.where(on_left, i, j + 1),
        np.where(on_left, j, i),
        on_left,
        (i >= j - 1) & (i <= j + 2),
    )
    ends = np.where(is_below, j, j + 1)
    for array in (*arrays, ends, is_below):
        array.setflags(write=False)  # they serve every curve of this genus
    rows, columns, left_ones, nearest = arrays
    return _Layout(
        rows, columns, left_ones[..., None], nearest[..., None], ends, is_below[..., None]
    )
