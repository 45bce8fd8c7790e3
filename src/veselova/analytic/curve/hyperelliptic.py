"""The hyperelliptic curve w² = R(λ) = −Π(λ−I_i) Π(λ−c_k), equation (Rad, printed 6.12), of genus g
= n−1, c_1 = 0 but for Neumann's system; and its cuts and gaps, each in the elliptic angle of its
four nearest branch points.

On [b_1, b_2] with b_0 < b_1 and b_2 < b_3 (either may be infinite) substitute

    sn²v = (b_2−b_0)(λ−b_1) / ((b_2−b_1)(λ−b_0)),   k² = (b_2−b_1)(b_3−b_0) / ((b_3−b_1)(b_2−b_0)),
    dλ/√|Π_{0…3}(λ−b_i)| = 2dv/√((b_3−b_1)(b_2−b_0)),   ψ = πv/K.

Each elliptic function is accurate relative to itself for every modulus, which is given by both k²
and k'² = 1−k², products of differences of branch points: for a closing gap k'² is tiny and 1−k²
would be noise. A function of period 2K in v has period 2π in ψ. The elliptic functions are those of
``kernel.elliptic``.

All other branch points lie at distance K' from the real v-axis or farther, so sums over ψ converge
like e^(−2πN K'/K) however closely branch points cluster: a closing gap costs log(1/gap).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import Balls, Values
from veselova.analytic.curve.kernel_text import LEFT_OUT, text_over
from veselova.analytic.kernel import elliptic

__all__ = [
    "Curve",
    "Interval",
    "characteristics",
    "functions_of_attitude",
    "narrowest_gap",
]


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
    """The branch points b_0 < b_1 < … < b_{2g} and all their differences, balls, each rounded once
    from more digits.

    Cut s = 1…g is [b_{2s−1}, b_{2s}], where λ_s moves; gap s = 0…g−1 is [b_{2s}, b_{2s+1}].

    - differences: [i, j] is b_j − b_i
    """

    arithmetic: Balls
    branch_points: Values
    differences: Values

    @property
    def genus(self) -> int:
        """Return g = n−1."""
        return (len(self.branch_points) - 1) // 2

    @cached_property
    def midpoints(self) -> Values:
        """Return ζ_l − b_j, shape (2g+1, g−1), with ζ_l the midpoint of gap l = 1…g−1: the zeros of
        the nodal differentials.
        """
        even = np.arange(2, 2 * self.genus, 2)
        return (self.differences[:, even] + self.differences[:, even + 1]) / 2


@dataclass(frozen=True)
class Interval:
    """The interval [b_j, b_{j+1}], a cut for odd j and a gap for even j; λ runs over it as ψ runs
    from 0 to π. The kernel's text, with what it neglects in the radii.
    """

    curve: Curve
    left: int

    @property
    def _widths(self) -> list[Any]:
        """Return b_1−b_0, b_2−b_1 and b_3−b_2; None for a neighbour at infinity."""
        d, j, last = self.curve.differences, self.left, 2 * self.curve.genus
        return [d[i, i + 1] if 0 <= i < last else None for i in (j - 1, j, j + 1)]

    @cached_property
    def scale(self) -> Values:
        """Return the interval as the kernel has it."""
        xp, (before, width, after) = self.curve.arithmetic, self._widths
        text = text_over(xp)
        found = np.empty(text.ROOM, dtype=object)  # nothing reads the levels beyond the last
        ends = before is None, after is None
        text.set_interval(before, width, after, *ends, found)
        for place in (elliptic.WIDTH, elliptic.DENSITY):
            found[place] = xp.add_error(found[place], 4 * LEFT_OUT * xp.epsilon * found[place])
        return found

    @cached_property
    def square(self) -> Any:
        """Return k² = (b_2−b_1)(b_3−b_0) / ((b_3−b_1)(b_2−b_0))."""
        before, width, after = self._widths
        near = [x for x in (before, after) if x is not None]
        whole = sum(near, width) if len(near) > 1 else 1
        return width * whole / math.prod(x + width for x in near)

    @cached_property
    def aspect(self) -> float:
        """Return K'/K, which sets how fast trigonometric sums in ψ converge."""
        levels = round(self.scale[elliptic.LEVELS])
        last = self.scale[elliptic.SCALE + 2 * levels - 2] ** 2 if levels else self.square
        # K' = log 4/k at the last modulus
        log = float(self.curve.arithmetic.log(last))
        return float((math.log(16) - log) / (math.pi * 2.0**levels))

    def roots(self, psi: Values) -> tuple[Values, Values]:
        """Return √(λ−b_1) along sn and √(b_2−λ) along cn at angles ψ: signed, and each accurate
        relative to itself.
        """
        found: tuple[Values, Values] = text_over(self.curve.arithmetic).roots(psi, self.scale)
        return found

    def distances(self, psi: Values) -> tuple[Values, Values]:
        """Return λ−b_1 and b_2−λ at angles ψ."""
        below, above = self.roots(psi)
        return below * below, above * above

    def angle(self, below: Any, above: Any, increasing: bool) -> Any:
        """Return ψ in (−π, π] of the point with λ−b_1 = ``below`` and b_2−λ = ``above``, accurate
        relative to itself, on the way back negative.
        """
        xp = self.curve.arithmetic
        ends = (xp.number(max(x, 0)) for x in (below, above))
        psi = text_over(xp).angle(*ends, increasing, self.scale)
        return xp.add_error(psi, LEFT_OUT * xp.epsilon * psi)

    @property
    def strip(self) -> float:
        """Return πK'/2K, half the width of the strip about the real ψ-axis in which the forms are
        analytic.
        """
        return math.pi * self.aspect / 2

    @property
    def decay(self) -> Any:
        """Return e^(−half of that): coefficients of the forms fall at least like its powers."""
        xp = self.curve.arithmetic
        return xp.exp(xp.number(-self.strip))

    @cached_property
    def ends_of_strip(self) -> tuple[Any, Any]:
        """Return b_1−λ and λ−b_2 at the edge of that strip, at ψ = 0 and π.

        There |sn²v| = 1/k, so λ, a Möbius function of sn²v, runs on a circle about the interval
        that meets the real axis at sn² = −1/k and 1/k, between b_0 and b_1, and between b_2 and
        b_3.
        """
        before, width, _ = self._widths
        inverse = 1 / self.curve.arithmetic.sqrt(self.square)
        if before is None:
            return width * inverse, width * (inverse - 1)
        left = width * before * inverse / (before + width * (1 + inverse))
        return left, width * (width + before) * (inverse - 1) / (before - width * (inverse - 1))

    def bound_in_strip(self) -> Values:
        """Return upper bounds of |du_k/dψ| in the strip of one interval, (g,).

        On that circle |λ−x| lies between its values on the real axis.
        """
        left, right = self.ends_of_strip
        j = self.left
        zeros_of_forms = self.curve.midpoints
        pairs = zip(left + zeros_of_forms[j], right - zeros_of_forms[j + 1], strict=True)
        factors = [max(abs(x), abs(y)) for x, y in pairs]
        omitted = [math.prod(factors[:l] + factors[l + 1 :]) for l in range(len(factors) + 1)]
        return np.asarray(np.array(omitted, dtype=object) * self.bound_density_in_strip())

    def bound_density_in_strip(self) -> Any:
        """Return an upper bound of |dλ/dψ|/(2√|R|) in that strip."""
        return self.density(*(-x for x in self.ends_of_strip))

    def density(self, below: Any, above: Any) -> Any:
        """Return |dλ/dψ|/(2√|R|) at distances from both ends."""
        j, d, sqrt = self.left, self.curve.differences, self.curve.arithmetic.sqrt
        outside = [x + below for x in d[: max(j - 1, 0), j]]
        outside += [x + above for x in d[j + 1, j + 3 :]]
        return math.prod((1 / sqrt(x) for x in outside), start=self.scale[elliptic.DENSITY])

    def forms(self, psi: Values) -> tuple[Values, Values]:
        """Return λ−b_1 at angles ψ (N,), and |du_k/dψ| with the sign of the nodal polynomial,
        k = 1…g, (g, N).
        """
        below, above = self.distances(psi)
        g, text = self.curve.genus, text_over(self.curve.arithmetic)
        d, found = self.curve.differences, np.empty((g, len(below)), below.dtype)
        room = np.empty((2, g), dtype=object)
        text.set_forms(d, self.left, below, above, self.scale, room, found)
        return below, found
