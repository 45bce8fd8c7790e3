"""A hyperelliptic curve with real branch points in ball arithmetic: periods, quasi-periods,
Thomae's values, the Abel–Jacobi map and its inverse.

λ^{k−1}dλ/w is a combination of the nodal differentials with rational coefficients. Its periods are
therefore those of the nodal differentials times an exact matrix, and need no quadrature of their
own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.balls import Balls
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.interval import Interval
from veselova.analytic.curve.nodal_forms import (
    difference_product,
    monomials,
    powers,
    second_kind,
)
from veselova.analytic.curve.periods import Periods
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.mechanics.core.budget import checkpoint, iterate

__all__ = ["CurveInBalls"]


class CurveInBalls:
    """The data of a ``RealCurve`` in one ball arithmetic, which its methods are called within."""

    def __init__(self, curve: RealCurve, arithmetic: Any) -> None:
        self.curve = curve
        self.arithmetic = arithmetic
        self._known: dict[int, tuple[Interval, Values]] = {}

    @cached_property
    def periods(self) -> Periods:
        """Return the period data of the nodal differentials in μ."""
        xp = self.arithmetic
        betas = self.curve.betas
        differences = np.array([[xp.number(b - a) for b in betas] for a in betas], dtype=object)
        points = np.array([xp.number(b) for b in betas], dtype=object)
        return Periods(Curve(xp, points, differences, self.curve.periods.curve.origins))

    @cached_property
    def inversion(self) -> AbelJacobi[Periods]:
        """Return the Abel–Jacobi map on the real torus of the cuts."""
        return AbelJacobi(self.periods, self.curve.inversion)

    @cached_property
    def cycles(self) -> tuple[Values, Values]:
        """Return ∮ λ^{k−1}dλ/w over a_s, and over b_s without the factor i, (g, g), columns s."""
        xp = self.arithmetic
        rows = xp.array(monomials(self.curve)) * (2 * self.scale)
        return xp.product(rows, self.periods.cycles), xp.product(
            rows, self.periods.conjugate_cycles
        )

    @cached_property
    def scale(self) -> Any:
        """Return ``RealCurve.scale``."""
        root = self.arithmetic.sqrt(self.arithmetic.number(self.curve.square_of_scale))
        return -root if self.curve.reverses else root

    @cached_property
    def normalized_differentials(self) -> Values:
        """Return c, (g, g): v_j = Σ_k c_jk λ^{k−1}dλ/w has ∮_{a_s} v_j = δ_js."""
        return np.asarray(self.arithmetic.inverse(self.cycles[0]))

    @cached_property
    def quasi_periods(self) -> tuple[Values, Values, Values, Values]:
        """Return ω, ω', η, η' of ``RealCurve.quasi_periods`` in ν, ω and η without the factor i."""
        xp = self.arithmetic
        g = self.curve.genus
        kinds = xp.array(second_kind(g, self.curve.nus))
        over = [
            xp.product(kinds, self._monomial_integrals(number)[:, None])[:, 0]
            for number in range(2 * g)
        ]
        half = xp.number(Fraction(1, 2))
        # y = 2iv on cuts, so that ω and η are 1/2i times a real number
        a = np.stack([-((-1) ** (g - s)) * over[2 * s - 1] * half for s in range(1, g + 1)], axis=1)
        gaps = np.stack([(-1) ** (g - s + 1) * over[2 * s] * half for s in range(g)], axis=1)
        b = np.cumsum(gaps, axis=1)
        return a[:g], b[:g], a[g:], b[g:]

    def _monomial_integrals(self, number: int) -> Values:
        """Return ∫ ν^k dν/√Π|ν−ν_j| over the interval [β_number, β_{number+1}], k = 0 … 2g−1."""
        checkpoint()
        xp = self.arithmetic
        curve = self.curve
        highest = 2 * curve.genus - 1
        interval = Interval(self.periods.curve, number)
        # Powers are entire: they take some nodes more than the forms themselves.
        count = self.periods.require_few_nodes(interval) + 2 * highest + 4
        below, above = interval.distances(xp.nodes(count))
        measure, of_gaps = interval.measure(below, above)
        unit = xp.number(curve.root_of_unit**2)
        left, right = (xp.number(curve.nus[j]) for j in (number, number + 1))
        nu = left + unit * below
        density = measure / np.prod(of_gaps, axis=0)
        powers = [density]
        for _ in range(highest):
            powers.append(powers[-1] * nu)
        means = np.sum(np.stack(powers), axis=1) / count
        if xp.certified:
            before, after = interval.ends_of_strip
            reach = max(abs(left - unit * before), abs(right + unit * after))
            largest = interval.bound_density_in_strip()
            decay = xp.exp(xp.number(-interval.strip))
            bounds = [
                xp.bound_tail(largest * reach**k, decay, 2 * count) for k in range(highest + 1)
            ]
            means = xp.add_error(means, np.array(bounds, dtype=object))
        factor = xp.number(curve.root_of_unit ** (2 - 4 * curve.genus))
        return np.asarray(2 * xp.pi * xp.sqrt(factor) * means)

    def thomae(self, subsets: Sequence[tuple[int, ...]]) -> Values:
        """Return |θ(0)|⁴ of Thomae's formula for sets of g+1 numbers of β's, (S,)."""
        xp = self.arithmetic
        g = self.curve.genus
        # the periods of μ^{k−1}dμ/v over whole cuts are twice those of the nodal differentials,
        # whose matrix of coefficients has a determinant of products of differences
        forms = xp.array(powers(self.curve))
        determinant = xp.determinant(xp.product(forms, self.periods.cycles))
        common = (determinant * xp.number(2**g) / (2 * xp.pi) ** g) ** 2
        sizes = np.abs(self.periods.curve.differences).tolist()
        products = [difference_product(sizes, subset) for subset in iterate(subsets)]
        return np.asarray(common * np.array(products, dtype=object))

    def real_matrix(self) -> Values:
        """Return T of the Riemann matrix iT."""
        return self.periods.riemann_matrix

    def complex_array(self, real: Values, imaginary: Values) -> Values:
        """Return complex balls of real and imaginary parts."""
        return np.asarray(self.arithmetic.complex_array(real, imaginary))

    def from_left_end(self, number: int, points: Sequence[Fraction]) -> Values:
        """Return a⁻¹∫ p dμ/(2√|R|) from β_number to points of its interval, (N, g)."""
        xp = self.arithmetic
        periods = self.periods
        lower = self.curve.betas[number]
        upper = self.curve.betas[number + 1]
        interval, series = self._series(number)
        psi = xp.array(
            [
                [interval.points.angle(xp.number(mu - lower), xp.number(upper - mu), True)]
                for mu in points
            ]
        )
        orders = xp.array(list(range(1, series.shape[1])))
        sines = xp.sine_sums(np.ascontiguousarray((series[:, 1:] / orders).T[None]))
        # a term left out of the density is integrated over no more than π
        left_out = xp.pi * periods.truncation(interval, series)
        integrals = xp.add_error(psi * series[:, 0] + sines(psi), left_out)
        return np.asarray(integrals @ periods.inverse_cycles.T)

    def _series(self, number: int) -> tuple[Interval, Values]:
        """Return the interval [β_j, β_{j+1}] and the cosine series of its forms, (g, N)."""
        if number not in self._known:
            interval = Interval(self.periods.curve, number)
            self._known[number] = interval, self.periods.series(interval)
        return self._known[number]

    def from_nearest_end(self, mu: tuple[Fraction, Fraction]) -> tuple[int | None, Values, complex]:
        """Return (j, a⁻¹∫ p dμ/(2v), v) from the nearest β_j, None for infinity, straight to μ.

        The substitutions are those of ``RealCurve.from_nearest_end``.
        """
        xp = self.arithmetic
        betas = self.curve.betas
        gaps = list(zip(betas[2:-1:2], betas[3::2], strict=True))
        centre = (betas[0] + betas[-1]) / 2
        far = (mu[0] - centre) ** 2 + mu[1] ** 2 > (betas[-1] - betas[0]) ** 2
        squares = [(mu[0] - b) ** 2 + mu[1] ** 2 for b in betas]
        j = None if far else squares.index(min(squares))
        start = centre if j is None else betas[j]
        target = xp.complex_number(mu[0] - start, mu[1])
        kind = _FormsAtInfinity if j is None else _FormsAtEnd
        form = kind(
            below=[xp.number(b - start) for b in betas[: 0 if j is None else j]],
            above=[xp.number(b - start) for b in betas[0 if j is None else j + 1 :]],
            zeros=[xp.number((a + b) / 2 - start) for a, b in gaps],
        )
        end = 1 / target.sqrt() if j is None else target.sqrt()
        parts = [xp.integral(partial(form, k), end) for k in range(self.curve.genus)]
        return j, self.periods.inverse_cycles @ np.array(parts, dtype=object), form.root(end)

    def invert(self, z: Values) -> tuple[Values, Values]:
        """Return λ, one on each cut, and the angles ψ, (N, g), at points z (N, g) of the real
        torus.
        """
        xp = self.arithmetic
        curve = self.curve
        psi = self.inversion.invert(z)
        below, above = self.periods.roots_on_cuts(psi)
        unit = xp.number(curve.root_of_unit**2)
        columns = []
        for s in range(curve.genus):
            left, right = (xp.number(curve.nus[j]) for j in (2 * s + 1, 2 * s + 2))
            lower = left + unit * below[s] * below[s]
            upper = right - unit * above[s] * above[s]
            columns.append(np.where(np.abs(below[s]) <= np.abs(above[s]), lower, upper))
        nu = np.stack(columns, axis=1)
        nu = -nu if curve.reverses else nu
        return np.asarray(xp.number(curve.points[-1]) - 1 / nu if curve.is_even else nu), psi


#: i, exactly.
_I = Balls.imaginary_unit


@dataclass(frozen=True)
class _Forms:
    """The nodal differentials as functions of a local parameter, at complex balls: differences of
    the other branch points, and of the zeros, from where it vanishes.
    """

    below: Sequence[Any]
    above: Sequence[Any]
    zeros: Sequence[Any]

    def _zeros_but(self, k: int) -> list[Any]:
        """Return the zeros of the form k, from 0: the last one has all."""
        return [zero for l, zero in enumerate(self.zeros) if l != k]


class _FormsAtEnd(_Forms):
    """dμ/(2v) p_k = p_k dx/(v/x), x = √(μ−β_j)."""

    def __call__(self, k: int, x: Any, analytic: bool) -> Any:
        """Return the form k at x, not finite where a root is not analytic."""
        square = x * x
        factors = [square - zero for zero in self._zeros_but(k)]
        return math.prod(factors, start=1 / self._roots(square, analytic))

    def _roots(self, square: Any, analytic: bool) -> Any:
        """Return v/x: each root below stays away from its branch line."""
        roots = [(square - b).sqrt(analytic=analytic) for b in self.below]
        roots += [(b - square).sqrt(analytic=analytic) for b in self.above]
        product = math.prod(roots, start=square**0)
        return product * _I if len(self.above) % 2 == 0 else product

    def root(self, x: Any) -> complex:
        """Return v/|v|."""
        return _direction(x * self._roots(x * x, False))


class _FormsAtInfinity(_Forms):
    """The same in t = (μ−c)^{−1/2}: v = i t^{−2g−1} Π√(1+(c−β)t²)."""

    def __call__(self, k: int, t: Any, analytic: bool) -> Any:
        """Return the form k at t, not finite where a root is not analytic."""
        square = t * t
        factors = [1 - square * zero for zero in self._zeros_but(k)]
        common = _I / self._roots(square, analytic)
        return math.prod(factors, start=common if k == len(self.zeros) else common * square)

    def _roots(self, square: Any, analytic: bool) -> Any:
        return math.prod(
            [(1 - square * b).sqrt(analytic=analytic) for b in self.above], start=square**0
        )

    def root(self, t: Any) -> complex:
        """Return v/|v|."""
        return _direction(_I * t ** -len(self.above) * self._roots(t * t, False))


def _direction(value: Any) -> complex:
    """Return the midpoint of a complex ball over its size."""
    return complex(value / abs(value))
