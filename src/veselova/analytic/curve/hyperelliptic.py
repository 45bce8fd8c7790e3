"""The hyperelliptic curve w² = R(λ) = −Π(λ−I_i) Π(λ−c_k), equation (Rad, printed 6.12), of genus g
= n−1, c_1 = 0 but for Neumann's system; and its cuts and gaps, each in the elliptic angle of its
four nearest branch points.

On [b_1, b_2] with b_0 < b_1 and b_2 < b_3 (either may be infinite) substitute

    sn²v = (b_2−b_0)(λ−b_1) / ((b_2−b_1)(λ−b_0)),   k² = (b_2−b_1)(b_3−b_0) / ((b_3−b_1)(b_2−b_0)),
    dλ/√|Π_{0…3}(λ−b_i)| = 2dv/√((b_3−b_1)(b_2−b_0)),   ψ = πv/K.

Each elliptic function is accurate relative to itself for every modulus, which is given by both k²
and k'² = 1−k², products of differences of branch points: for a closing gap k'² is tiny and 1−k²
would be noise. A function of period 2K in v has period 2π in ψ. Gauss's transformation, κ =
(1−k')/(1+k'), keeps ψ and halves K'/K: at the last modulus the functions are circular ones of ψ/2,
and sums and products of positive numbers lead back.

All other branch points lie at distance K' from the real v-axis or farther, so sums over ψ converge
like e^(−2πN K'/K) however closely branch points cluster: a closing gap costs log(1/gap).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.analytic.curve.branch_points import Spectrum

__all__ = [
    "Curve",
    "FourPoints",
    "Interval",
    "characteristics",
    "functions_of_attitude",
    "narrowest_gap",
]

Kind = Literal["I", "c"]

#: Derived: k² of the last modulus, in the precision: what is neglected there is below any rounding.
_NEGLIGIBLE = 2.0**-24


@dataclass(frozen=True)
class FourPoints:
    """The widths b_1−b_0, b_2−b_1 and b_3−b_2; None for a neighbour at infinity, but not for
    both.
    """

    arithmetic: Arithmetic
    before: Any
    width: Any
    after: Any

    def _shares(self, neighbour: Any) -> tuple[Any, Any]:
        """Return what a neighbouring width and this one are of both; 1 and 0 for an infinite one.

        Ratios before products: the square of a width of 1e-200 is no float.
        """
        one = self.arithmetic.number(1)
        if neighbour is None:
            return one, 0 * one
        return neighbour / (neighbour + self.width), self.width / (neighbour + self.width)

    @cached_property
    def _moduli(self) -> tuple[Any, Any]:
        """Return k² and k'², a product of gap widths, never 1−k²."""
        (lower, below), (upper, above) = map(self._shares, (self.before, self.after))
        return below + above * lower, lower * upper

    @cached_property
    def _scale(self) -> tuple[list[tuple[Any, Any, Any]], Any]:
        """Return k', κ and 1−κ of each transformation, and k² of the last modulus.

        There sn = sin ψ/2, cn = cos ψ/2 and K = π/2 to less than k² of themselves, by their series
        in the nome q < k²/8, and so is dn = 1.
        """
        xp = self.arithmetic
        square, complement = self._moduli
        root = xp.sqrt(complement)
        levels = []
        while square > _NEGLIGIBLE * xp.epsilon:
            kappa = square / ((1 + root) * (1 + root))
            levels.append((root, kappa, 2 * root / (1 + root)))
            square, root = kappa * kappa, 2 * xp.sqrt(root) / (1 + root)
        return levels, square

    @cached_property
    def quarter(self) -> Any:
        """Return K, the real quarter period; it grows like log(4/k')."""
        levels, last = self._scale
        # 1+κ, of numbers whose roundings do not add up as those of κ do
        factors = (2 / (1 + root) for root, _, _ in levels)
        found = math.prod(factors, start=self.arithmetic.pi / 2)
        return self.arithmetic.add_error(found, found * last)

    @cached_property
    def aspect(self) -> float:
        """Return K'/K, which sets how fast trigonometric sums in ψ converge; infinite for k = 0."""
        levels, last = self._scale
        if not last > 0:
            return math.inf
        # K' = log 4/k at the last modulus
        return (math.log(16) - float(self.arithmetic.log(last))) / (math.pi * 2.0 ** len(levels))

    def functions(self, psi: Values) -> tuple[Values, Values, Values]:
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

    @cached_property
    def density(self) -> Any:
        """Return (K/π)/√((b_3−b_1)(b_2−b_0)), the factor of dψ in dλ/(2√|Π(λ−b_i)|); without what
        is infinite.
        """
        neighbours = (x for x in (self.before, self.after) if x is not None)
        root = math.prod(self.arithmetic.sqrt(self.width + x) for x in neighbours)
        return self.quarter / self.arithmetic.pi / root

    def roots(self, psi: Values) -> tuple[Values, Values]:
        """Return √(λ−b_1) along sn and √(b_2−λ) along cn at angles ψ: signed, and each accurate
        relative to itself.
        """
        sqrt, before, width = self.arithmetic.sqrt, self.before, self.width
        sn, cn, _ = self.functions(psi)
        below, above = sqrt(width) * sn, sqrt(width) * cn
        if before is None:
            return below, above
        denominator = before + width * cn * cn
        return below * sqrt(before / denominator), above * sqrt((width + before) / denominator)

    def distances(self, psi: Values) -> tuple[Values, Values]:
        """Return λ−b_1 and b_2−λ at angles ψ."""
        below, above = self.roots(psi)
        return below * below, above * above

    def angle(self, below: Any, above: Any, increasing: bool) -> Any:
        """Return ψ in (−π, π] of the point with λ−b_1 = ``below`` and b_2−λ = ``above``, accurate
        relative to itself, on the way back negative.
        """
        xp = self.arithmetic
        levels, last = self._scale
        # sn² : cn² = (b_2−b_0)(λ−b_1) : (b_1−b_0)(b_2−λ), and for b_0 = −∞ the first factors drop
        # out.
        below = xp.number(max(below, 0))
        above = xp.number(max(above, 0)) * self._shares(self.before)[0]
        s, c = (xp.sqrt(x / (below + above)) for x in (below, above))
        for root, kappa, rest in levels:
            d = xp.sqrt(c * c + root * root * s * s)
            s, c = (
                2 * s / ((1 + kappa) * (1 + d)),
                2 * c / xp.sqrt((1 + d) * (rest + (1 + kappa) * d)),
            )
        psi = 2 * xp.atan(s / c) if s <= c else xp.pi - 2 * xp.atan(c / s)
        psi = xp.add_error(psi, 4 * psi * last)
        return psi if increasing else -psi


def characteristics(genus: int) -> NDArray[np.float64]:
    """Return the theta characteristics [ε; δ] of b_0 … b_{2g}, (2g+1, 2, g), entries 0 and ½:
    η(b_0) = [0; ½…½], η(b_{2s−1}) = [½e_s; ½ from s on] (odd), η(b_{2s}) = [½e_s; ½ beyond s].
    """
    found = np.zeros((2 * genus + 1, 2, genus))
    for j, (epsilon, delta) in enumerate(found):
        if j > 0:
            epsilon[(j - 1) // 2] = 0.5
        delta[j // 2 :] = 0.5
    return found


def functions_of_attitude(
    of_I: Sequence[int], of_c: Sequence[int]
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the characteristics (C, 2, g) of the theta functions whose quotients are the attitude,
    that of the denominator, zero, first, and where among them the numerators stand: of q_1 … q_n,
    of v_k, and of (n_k)_i, η(I_i)+η(c_k) modulo one, with i before k; k runs over c_2 … c_g, c_1.
    of_I, of_c: the j of I_i and c_k among the branch points b_j.
    """
    own = characteristics(len(of_c))
    one, two = own[list(of_I)], own[[*of_c[1:], of_c[0]]]
    both = (one[:, None] + two) % 1
    numerators = np.concatenate([one, two, both.reshape(-1, *own.shape[1:])])
    functions, places = np.unique(numerators, axis=0, return_inverse=True)
    return np.concatenate([0 * own[:1], functions]), places.ravel() + 1


def narrowest_gap(differences: Values, has_first: bool) -> float:
    """Return the least gap that can close against the wider of its two cuts: how near a separatrix
    is; 1 without any. differences: [i, j] is b_j − b_i

    ``has_first``: whether the first gap may close, as in Neumann's system, and not between c_1 = 0
    and the least I.
    """
    widths = np.diagonal(differences, 1).tolist()
    first = 0 if has_first else 2
    sides = [(widths[j - 1] if j else 0, widths[j + 1]) for j in range(first, len(widths), 2)]
    gaps = zip(widths[first::2], sides, strict=True)
    return min((float(gap / (gap + max(near))) for gap, near in gaps), default=1.0)


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

    def measure(self, below: Values, above: Values) -> tuple[Values, Values]:
        """Return (m, r): dλ/(2√|R|) = m/Π_l r_l dψ: m (N,), and r_l, l = 1…g−1, (g−1, N), gap l's
        root.
        """
        xp, j, d = self.arithmetic, self.left, self.curve.differences
        # |λ−b_i| for all i, sums of positive terms
        squares = np.concatenate([d[: j + 1, j, None] + below, d[j + 1, j + 1 :, None] + above])
        squares[max(j - 1, 0) : j + 3] = xp.number(1)  # the substitution has them
        roots = xp.sqrt(squares)
        outer = roots[0] * roots[1] * roots[-1]
        return self.density / outer, roots[2:-1:2] * roots[3::2]

    @cached_property
    def strip(self) -> Any:
        """Return πK'/2K, half the width of the strip about the real ψ-axis in which the forms are
        analytic.
        """
        return math.pi * self.aspect / 2

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
        square = 1 / self.arithmetic.sqrt(self._moduli[0])
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
        j, d = self.left, self.curve.differences
        outside = [*(d[: max(j - 1, 0), j] - left), *(d[j + 1, j + 3 :] - right)]
        return self.density / math.prod(self.arithmetic.sqrt(x) for x in outside)

    def forms(self, below: Values, above: Values) -> Values:
        """Return |du_k/dψ| with the sign of the nodal polynomial, k = 1…g, shape (g, N):
        holomorphic forms p_k dλ/(2√|R|).

        p_g = Π(λ−ζ_l) over the midpoints ζ_l of all inner gaps, and p_k = p_g/(λ−ζ_k) for k < g.
        Each λ−ζ_l is divided by the root of its own gap's ends, so every factor is of order one at
        any genus.
        """
        common, of_gaps = self.measure(below, above)
        zeros, j = self.curve.midpoints, self.left
        # λ−ζ_l from the nearer end
        from_left, from_right = (
            below - zeros[j, : j // 2, None],
            zeros[j + 1, j // 2 :, None] + above,
        )
        factors = np.concatenate([from_left, -from_right]) / of_gaps
        one = np.ones_like(below)[None]
        lower = np.cumprod(np.concatenate([one, factors]), axis=0)
        upper = np.cumprod(np.concatenate([one, factors[::-1]]), axis=0)[::-1]
        omitted = lower[:-1] * upper[1:] / of_gaps
        return np.asarray(common * np.concatenate([omitted, lower[-1:]]))
