"""What belongs to a hyperelliptic curve with real branch points, in doubles or in balls: periods,
quasi-periods, Thomae's values, the Abel–Jacobi map and its inverse.

λ^{k−1}dλ/w is a combination of the nodal differentials with rational coefficients. Its periods are
therefore those of the nodal differentials times an exact matrix, and need no quadrature of their
own.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.hyperelliptic import BranchPoint, Curve
from veselova.analytic.curve.interval import Interval
from veselova.analytic.curve.nodal_forms import (
    difference_product,
    monomials,
    powers,
    second_kind,
)
from veselova.analytic.curve.path_forms import FormsAtEnd, FormsAtInfinity
from veselova.analytic.curve.periods import Periods
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.mechanics.core.budget import checkpoint, iterate
from veselova.mechanics.core.errors import InvalidInput, Unsolved

__all__ = ["CurveValues"]


class CurveValues:
    """The data of a ``RealCurve`` in one arithmetic; methods of one in balls are called within it.

    ``coarse``: the data in doubles, from which inversions in balls start.
    """

    def __init__(
        self, curve: RealCurve, arithmetic: Any, coarse: CurveValues | None = None
    ) -> None:
        self.curve = curve
        self.arithmetic = arithmetic
        self._coarse = coarse
        self._known: dict[int, tuple[Interval, Values]] = {}

    @cached_property
    def periods(self) -> Periods:
        """Return the period data of the nodal differentials in μ."""
        xp = self.arithmetic
        betas = self.curve.betas
        differences = np.array([[xp.number(b - a) for b in betas] for a in betas])
        points = np.array([xp.number(b) for b in betas])
        last = 2 * self.curve.genus
        origins = tuple(
            BranchPoint("c" if j % 2 == 0 and j < last else "I", j) for j in range(last + 1)
        )
        return Periods(Curve(xp, points, differences, origins))

    @cached_property
    def inversion(self) -> AbelJacobi[Periods]:
        """Return the Abel–Jacobi map on the real torus of the cuts."""
        return AbelJacobi(self.periods, self._coarse.inversion if self._coarse else None)

    @cached_property
    def cancellation(self) -> float:
        """Return how much larger than a normalised integral the sums may be that it is a difference
        of: of order one, but where three β's or more are close together.
        """
        periods = self.periods
        return float(max(np.max(periods.cancellation), np.max(periods.conjugate_cancellation)))

    @cached_property
    def cycles(self) -> tuple[Values, Values]:
        """Return ∮ λ^{k−1}dλ/w over a_s, and over b_s without the factor i, (g, g), columns s."""
        xp = self.arithmetic
        scale = xp.sqrt(xp.number(self.curve.square_of_scale))
        rows = xp.array(monomials(self.curve)) * (-2 * scale if self.curve.reverses else 2 * scale)
        return xp.product(rows, self.periods.cycles), xp.product(
            rows, self.periods.conjugate_cycles
        )

    @cached_property
    def normalized_differentials(self) -> Values:
        """Return c, (g, g): v_j = Σ_k c_jk λ^{k−1}dλ/w has ∮_{a_s} v_j = δ_js."""
        return np.asarray(self.arithmetic.inverse(self.cycles[0]))

    @cached_property
    def quasi_periods(self) -> tuple[Values, Values, Values, Values]:
        """Return ω, ω', η, η' in ν, ω and η without the factor i."""
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
        interval = self.periods.interval(number)
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

    def image(self, point: Fraction | complex, w: complex) -> Values:
        """Return ∫ of the normalised differentials from the last branch point to (λ, w), (g,),
        modulo the lattice.

        On cuts and gaps the sign of w names the sheet (over gaps of its imaginary part, or of what
        it has), elsewhere the nearer root. Raises InvalidInput for w = 0.
        """
        xp, curve = self.arithmetic, self.curve
        T = self.periods.riemann_matrix
        zero = 0 * T[0]
        if curve.is_even and point == curve.points[-1]:
            return np.asarray(xp.complex_array(zero, zero))
        mu = curve.to_mu(point)
        number = -1 if mu[1] else curve.place(mu[0])
        if 0 <= number < 2 * curve.genus:
            part = self.from_left_end(number, mu[0])
            epsilon, delta = curve.halves[number]
            on_cut = number % 2 == 1
            named = (w.real or w.imag) if on_cut else (w.imag or w.real)
            if named == 0 and mu[0] not in curve.betas:
                raise InvalidInput(("w",), "a number other than 0, whose sign names the sheet", "0")
            sheet = -1 if named < 0 else 1
            along, across = (sheet * part, zero) if on_cut else (zero, -sheet * part)
            return np.asarray(xp.complex_array(delta + along, T @ epsilon + across))
        j, part, v = self.from_nearest_end(mu)
        # v = w·(e−λ)^{−g−1} but for a positive factor, where e went to infinity: phases say which.
        angle = cmath.phase(w)
        if curve.is_even:
            angle -= (curve.genus + 1) * cmath.phase(complex(curve.points[-1] - point))
        sign = 1 if math.cos(angle - cmath.phase(v)) >= 0 else -1
        if j is None:
            return np.asarray(sign * part)
        epsilon, delta = curve.halves[j]
        return np.asarray(xp.complex_array(delta + zero, T @ epsilon) + sign * part)

    def from_left_end(self, number: int, mu: Fraction) -> Values:
        """Return a⁻¹∫ p dμ/(2√|R|) from β_number to a point of the interval that begins there,
        (g,).
        """
        xp = self.arithmetic
        periods = self.periods
        if number not in self._known:
            self._known[number] = self._series_on(number)
        interval, series = self._known[number]
        psi = interval.points.angle(*self._distances(number, mu), True)
        orders = xp.array(list(range(1, series.shape[1])))
        sines = xp.sine_sums(np.ascontiguousarray((series[:, 1:] / orders).T[None]))
        # a term left out of the density is integrated over no more than π
        left_out = xp.pi * periods.truncation(interval, series)
        sums = sines(np.array([[psi]]))[0]
        return np.asarray(
            periods.inverse_cycles @ xp.add_error(psi * series[:, 0] + sums, left_out)
        )

    def _series_on(self, number: int) -> tuple[Interval, Values]:
        """Return [β_number, β_{number+1}], and the cosine coefficients of the forms there, without
        their sign; those of a cut are known.
        """
        periods, s = self.periods, number // 2
        interval = periods.interval(number)
        if number % 2 == 0:
            return interval, periods.series(interval)
        return interval, (-1) ** (periods.genus - s - 1) * periods.cut_series[s]

    def _distances(self, number: int, mu: Fraction) -> tuple[Any, Any]:
        """Return the distances of a point from both ends of the interval [β_j, β_{j+1}]."""
        lower, upper = self.curve.betas[number : number + 2]
        return self.arithmetic.number(mu - lower), self.arithmetic.number(upper - mu)

    def from_nearest_end(self, mu: tuple[Fraction, Fraction]) -> tuple[int | None, Values, complex]:
        """Return (j, a⁻¹∫ p dμ/(2v), v) from the nearest β_j, None for infinity, straight to a
        complex μ; the integral is (g,).

        The sheet is that of the returned v, which is v up to a positive factor.
        """
        xp = self.arithmetic
        betas = self.curve.betas
        centre = (betas[0] + betas[-1]) / 2
        far = (mu[0] - centre) ** 2 + mu[1] ** 2 > (betas[-1] - betas[0]) ** 2
        squares = [(mu[0] - b) ** 2 + mu[1] ** 2 for b in betas]
        j = None if far else squares.index(min(squares))
        start = centre if j is None else betas[j]
        try:
            target = xp.complex_number(mu[0] - start, mu[1])
        except OverflowError:
            reason = "a point is too far from the branch points for doubles"
            raise Unsolved("beyond-floats", reason) from None
        form = (FormsAtInfinity if j is None else FormsAtEnd)(
            xp,
            below=[xp.number(b - start) for b in betas[: 0 if j is None else j]],
            above=[xp.number(b - start) for b in betas[0 if j is None else j + 1 :]],
            zeros=[xp.number(zero - start) for zero in self.curve.zeros],
        )
        root = xp.complex_root(target, False)
        end = 1 / root if j is None else root
        parts = xp.integrals([partial(form, k) for k in range(self.curve.genus)], end)
        return j, self.periods.inverse_cycles @ parts, form.direction(end)

    def invert(self, z: Values) -> tuple[Values, Values]:
        """Return λ, one on each cut, and the angles ψ, (N, g), at points z (N, g) of the real
        torus.
        """
        psi = self.inversion.invert(z)
        roots = zip(*self.periods.roots_on_cuts(psi), strict=True)
        columns = [
            self._lambda(2 * s + 1, below * below, above * above)
            for s, (below, above) in enumerate(roots)
        ]
        return np.stack(columns, axis=1), psi

    def _lambda(self, number: int, below: Values, above: Values) -> Values:
        """Return λ at distances in μ from both ends of the interval [β_j, β_{j+1}], each from the
        nearer one: ν−ν_j = (λ−b_j)ν/(e−b_j) where there are 2g+2 branch points.
        """
        xp, curve = self.arithmetic, self.curve
        unit = xp.number(curve.root_of_unit**2)
        found = []
        for j, offset in ((number, unit * below), (number + 1, -unit * above)):
            b = curve.points[curve.order[j]]
            if curve.is_even:
                offset = (
                    offset * xp.number(curve.points[-1] - b) / (xp.number(curve.nus[j]) + offset)
                )
            elif curve.reverses:
                offset = -offset
            found.append(xp.number(b) + offset)
        return np.asarray(np.where(below <= above, *found))

    def torus(self, points: Sequence[Sequence[Fraction]], up: NDArray[np.bool_]) -> Values:
        """Return z (N, g) of points μ (N, g), one on each cut; ``up``: whether μ increases."""
        psi = [
            [
                cut.points.angle(*self._distances(2 * s + 1, mu), bool(up[i, s]))
                for s, (cut, mu) in enumerate(zip(self.periods.cuts, row, strict=True))
            ]
            for i, row in enumerate(points)
        ]
        return self.inversion.map(np.array(psi).reshape(-1, self.curve.genus))
