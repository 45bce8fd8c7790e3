"""Motions in a separable potential in closed form: quadratures inverted in real angles, then
position and velocity.

The sum over k points is on a curve whose genus may be larger: no Jacobian, but the map ψ ↦ z is all
the same a diffeomorphism of the torus (Liouville), and is inverted as in
analytic.curve.periods.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.base import Attitude
from veselova.analytic.curve.periods import AbelInDoubles
from veselova.analytic.kernel import elliptic
from veselova.analytic.kernel.frame import set_orthogonal
from veselova.analytic.separable.curve import SeparableStart, SeparatedCut, moving_axes
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["SeparableMotion", "SeparatedPeriods"]

Array = NDArray[np.float64]

#: The kernel's text, for arrays.
_set_orthogonal = getattr(set_orthogonal, "py_func", set_orthogonal)

#: Budget: nodes to begin with, and where a cut is too near another root.
_FEWEST_NODES = 16
_MOST_NODES = 8192

#: Derived: a series is complete when its last two coefficients are below this part of the largest.
_RESOLVED = 1e-15


class SeparatedPeriods:
    """The period data of the cuts of a separable motion, in double precision."""

    def __init__(self, cuts: Sequence[SeparatedCut]) -> None:
        self.cuts, self.genus = cuts, len(cuts)

    @property
    def narrowest_gap(self) -> float:
        """Return the least gap between neighbouring cuts against the wider of both."""
        pairs = ((a, b, float(b.ends[0] - a.ends[1])) for a, b in itertools.pairwise(self.cuts))
        ratios = (x / (x + max(c.interval[elliptic.WIDTH] for c in (a, b))) for a, b, x in pairs)
        return float(min(ratios, default=1.0))

    def points(self, phi: Array) -> Array:
        """Return λ_s at angles (N, g)."""
        cuts = enumerate(self.cuts)
        return np.array([float(x.ends[0]) + x.roots(phi[:, s])[0] ** 2 for s, x in cuts]).T

    def forms(self, s: int, phi: Array) -> Array:
        """Return du_k/dψ = ±p_k dλ/(2√R dψ) on cut s, shape (g, N): p_g = Π(λ−ζ_l) with ζ_l
        mid-gap, p_k = p_g/(λ−ζ_k).
        """
        g = self.genus
        cut = self.cuts[s]
        below, above = cut.roots(phi) ** 2
        factors = []
        for l in range(g - 1):
            middle = (self.cuts[l].ends[1] + self.cuts[l + 1].ends[0]) / 2
            # λ−ζ_l from the end of the cut that faces the gap.
            factors.append(
                below + float(cut.ends[0] - middle)
                if s > l
                else -(above + float(middle - cut.ends[1]))
            )
        one = np.ones_like(phi)
        products = [np.prod([one, *factors[:k], *factors[k + 1 :]], axis=0) for k in range(g - 1)]
        products.append(np.prod([one, *factors], axis=0))
        return np.asarray((-1) ** (g - s - 1) * np.array(products) / (2 * cut.speed(phi)))

    @cached_property
    def cut_series(self) -> tuple[Array, ...]:
        """Return, per cut, the cosine coefficients of du_k/dφ (signs included), shape (g, N_s)."""
        return tuple(self.cosine_coefficients(partial(self.forms, s)) for s in range(self.genus))

    def cosine_coefficients(self, function: Callable[[Array], Array]) -> Array:
        """Return the cosine coefficients of even functions of an angle, (K, M), from their values
        (K, N) at angles (N,).

        Raises Unsolved where they do not fall to rounding.
        """
        from scipy.fft import dct  # slow to load

        count = _FEWEST_NODES
        while count <= _MOST_NODES:
            checkpoint()
            nodes = np.pi * (2 * np.arange(count) + 1) / (2 * count)
            coefficients = dct(function(nodes), type=2) / count
            coefficients[:, 0] /= 2
            size = np.max(np.abs(coefficients), axis=1, keepdims=True)
            if np.all(np.abs(coefficients[:, -2:]) <= _RESOLVED * size):
                significant = np.flatnonzero(
                    np.any(np.abs(coefficients) > _RESOLVED / 4 * size, axis=0)
                )
                return np.asarray(coefficients[:, : max(2, int(significant[-1]) + 2)])
            count *= 2
        raise Unsolved(
            "separatrix",
            "a turning point is nearly a double root: the series of its angle does not end",
        )

    @cached_property
    def inverse_cycles(self) -> Array:
        """Return a⁻¹, of a (g, g)."""
        return np.linalg.inv(np.stack([2 * np.pi * s[:, 0] for s in self.cut_series], axis=1))

    @property
    def frequencies(self) -> Array:
        """Return f = a⁻¹e_g, cycles per unit of τ."""
        return self.inverse_cycles[:, -1]

    @cached_property
    def inversion(self) -> AbelInDoubles:
        """Return the map from angles to phases."""
        series = [self.inverse_cycles @ x for x in self.cut_series]
        return AbelInDoubles(series, self.narrowest_gap)

    @cached_property
    def series_truncation(self) -> Array:
        """Return what the angle series leave out of z_k, about, shape (g,)."""
        left_out = sum(_RESOLVED * np.max(np.abs(series), axis=1) for series in self.cut_series)
        return np.asarray(np.abs(self.inverse_cycles) @ left_out)


class SeparableMotion:
    """The motion of one start on its torus; elliptic angles φ_s as in SeparatedCut, of any sign,
    increasing in time.

    Axes along which nothing moves are left out of all but ``attitude``: ``start`` is the start
    among the others. Raises Unsolved as ``moving_axes`` does, and where an angle series does not
    end.
    """

    def __init__(self, start: SeparableStart) -> None:
        self._dimension = len(start.q)
        self.start, self.cuts, self.axes = moving_axes(start)
        start = self.start
        self.periods = SeparatedPeriods(self.cuts)
        self.inversion = self.periods.inversion
        self.angles = np.array([_angle(cut, start, s) for s, cut in enumerate(self.cuts)])
        self._own: dict[int, tuple[int, bool]] = {}
        for s, cut in enumerate(self.cuts):
            for axis, lower in zip(cut.axes, (True, False), strict=True):
                if axis is not None:
                    self._own[axis] = s, lower
        self._ends = np.zeros((len(self.cuts), len(start.q), 1), dtype=bool)
        for i, (s, _) in self._own.items():
            self._ends[s, i] = True
        moving = enumerate(zip(start.q, start.q_dot, strict=True))
        signs = np.array([self._sign(i, x, v) for i, (x, v) in moving])
        distances = ([float(abs(x - y)) for y in start.inverse if y != x] for x in start.inverse)
        self._norms = signs / np.sqrt(np.array([np.prod(row) for row in distances]))

    def _sign(self, axis: int, position: Any, velocity: Any) -> int:
        """Return the constant sign of q_i against its root, which passes zero upwards at a lower
        end, downwards at an upper.

        Where λ_s is at that end to all its digits q_i counts as zero, and what it does next is what
        its velocity says.
        """
        if axis not in self._own:
            return 1 if position > 0 else -1
        s, lower = self._own[axis]
        if (self.cuts[s].below if lower else self.cuts[s].above) == 0:
            return (1 if velocity > 0 else -1) * (1 if lower else -1)
        return (1 if position > 0 else -1) * (1 if self.angles[s] >= 0 or not lower else -1)

    def attitude(self, phi: Array) -> Attitude:
        """Return q and, as its normals, the unit tangents m_1 … m_g of the coordinate lines, with
        (q', m_s), at angles (N, g).

        (m_s)_i = q_i y_s/(λ_s−I_i), y_s = √(|Φ(λ_s)|/Π_{j≠s}|λ_s−λ_j|); the root of a cut's own end
        carries a sign, so that all are analytic in φ and change sign with φ_s → φ_s + 2π as they do
        in time. The last are axes along which nothing moves.
        """
        roots, between = self._roots(phi)
        lines, q = np.empty_like(roots), np.empty(roots.shape[1:])
        # I_i is at place 2i, as on a curve with one root in each gap
        places = 2 * np.arange(len(q))
        doubled = np.repeat(roots, 2, axis=1)
        _set_orthogonal(places, self._norms, doubled, between, lines, q)
        along = self._components(phi, roots, between)
        return self._among_all_axes(q.T, lines.transpose(2, 1, 0), along, self.periods.points(phi))

    def _roots(self, phi: Array) -> tuple[Array, Array]:
        """Return √|λ_s−I_i| (g, n, N), signed where I_i ends cut s, and √|λ_s−λ_j|, one for s = j,
        (g, g, N), each from the end of the cut that faces the other.
        """
        g, count, inverse = len(self.cuts), len(phi), self.start.inverse
        roots, between = np.empty((g, len(inverse), count)), np.ones((g, g, count))
        for s, cut in enumerate(self.cuts):
            below, above = cut.roots(phi[:, s]) ** 2
            for i, x in enumerate(inverse):
                lower = below + float(cut.ends[0] - x) if i <= s else above + float(x - cut.ends[1])
                roots[s, i] = np.sqrt(lower)
            for axis, root in zip(cut.axes, cut.roots(phi[:, s]), strict=True):
                if axis is not None:
                    roots[s, axis] = root
            for j, other in enumerate(self.cuts[s + 1 :], s + 1):
                gap = float(other.ends[0] - cut.ends[1])
                distance = above + gap + other.roots(phi[:, j])[0] ** 2
                between[s, j] = between[j, s] = np.sqrt(distance)
        return roots, between

    def _among_all_axes(self, q: Array, lines: Array, components: Array, points: Array) -> Attitude:
        n = self._dimension
        g = len(self.cuts)
        count = q.shape[0]
        still = [i for i in range(n) if i not in self.axes]
        position = np.zeros((count, n))
        normals = np.zeros((count, n, n - 1))
        along = np.zeros((count, n - 1))
        position[:, self.axes], normals[:, self.axes, :g], along[:, :g] = q, lines, components
        normals[:, still, range(g, n - 1)] = 1.0
        return Attitude(position, normals, along, points)

    def _components(self, phi: Array, roots: Array, between: Array) -> Array:
        """Return (q', m_s) = λ_s'/(2y_s) = √R/(y_sΠ|λ_s−λ_j|), without the roots of the ends that
        are I's, which are in √R and in y_s.
        """
        rest = np.prod(np.where(self._ends, 1.0, roots), axis=1) * np.prod(between, axis=1)
        moving = [cut.moving_root(phi[:, s]) for s, cut in enumerate(self.cuts)]
        return np.asarray((np.array(moving) / rest).T)

    def rate(self, phi: Array) -> Array:
        """Return dt/dτ = √(λ_1…λ_g) at angles (N, g), (N,)."""
        return np.asarray(np.sqrt(np.prod(self.periods.points(phi), axis=1)))

    @cached_property
    def mean_rate(self) -> tuple[float, int]:
        """Return its mean F_0 over the torus, det of the means of √λ du_k over det a, and how many
        terms the series of these have.
        """
        periods, terms, means = self.periods, 0, []
        for s, cut in enumerate(self.cuts):

            def weighted(phi: Array, s: int = s, cut: SeparatedCut = cut) -> Array:
                point = float(cut.ends[0]) + cut.roots(phi)[0] ** 2
                return np.asarray(periods.forms(s, phi) * np.sqrt(point))

            series = periods.cosine_coefficients(weighted)
            terms = max(terms, series.shape[1])
            means.append(2 * np.pi * series[:, 0])
        return float(np.linalg.det(periods.inverse_cycles @ np.stack(means, axis=1))), terms

    def turning(self, phi: Array) -> Array:
        """Return (dm_1/dτ, m_2) for n = 3, shape (N,).

        From A⁻¹m_s = λ_sm_s + σ_sq it is [σ_1(q',m_2) + σ_2(q',m_1)]/(λ_2−λ_1); σ_s = Σ
        I_iq_i²y_s/(λ_s−I_i) = −y_s, a product: the sum has no digit left where I's are nearly
        equal. It is zero where m_2 is an axis.
        """
        if len(self.cuts) == 1:
            return np.zeros(len(phi))
        roots, between = self._roots(phi)
        y = np.prod(roots, axis=1) / np.prod(between, axis=1)
        crossed = np.sum(y.T * self._components(phi, roots, between)[:, ::-1], axis=1)
        return np.asarray(-crossed / between[0, 1] ** 2)


def _angle(cut: SeparatedCut, start: SeparableStart, s: int) -> float:
    """Return φ_s in (−π, π] at the start: negative where λ_s decreases, and λ_s' = 2Σ
    q_iq_i'/(λ−I_i)/Σ q_i²/(λ−I_i)².
    """
    if cut.below == 0 or cut.above == 0:  # from an end there is one way, and λ_s may be I_i
        return float(elliptic.angle(cut.below, cut.above, True, cut.interval))
    point = start.spheroconic[s]
    slope = sum(
        x * v / (point - I) for x, v, I in zip(start.q, start.q_dot, start.inverse, strict=True)
    )
    return float(elliptic.angle(cut.below, cut.above, bool(slope >= 0), cut.interval))
