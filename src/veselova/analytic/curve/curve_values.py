"""What belongs to a hyperelliptic curve with real branch points: periods, quasi-periods, the
Abel–Jacobi map and its inverse.

λ^{k−1}dλ/w is a combination of the nodal differentials with rational coefficients. Its periods are
therefore those of the nodal differentials times an exact matrix, and need no quadrature of their
own. To many digits, working digits are added until every number has those asked for.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from functools import cache, cached_property, partial
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import Balls, Values, balls
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.kernel_text import DOUBLES
from veselova.analytic.curve.periods import AbelJacobi, Periods
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.analytic.kernel import elliptic
from veselova.mechanics.core.budget import checkpoint, iterate
from veselova.mechanics.core.decimals import Decimals, Later, Pair, decimal_pair
from veselova.mechanics.core.errors import InvalidInput, Unsolved
from veselova.mechanics.results.toolkit import QUASI_PERIODS

__all__ = ["CurveDigits", "CurveValues"]

#: Calibrated: working digits beyond those asked for, attempts, each with twice as many of them, and
#: digits of the midpoints beyond those asked for.
_SPARE = 10
_ATTEMPTS = 6
_SHOWN = 3

#: Calibrated: roundings of a Riemann matrix in doubles, twice the most seen on 400 curves, over
#: what its sums add up; nodes of an interval, and the error over the matrix, up to which doubles
#: serve.
_ROUNDED, _FEW_NODES, _MOST_ROUNDED = 6.0, 64, 1e-14

#: Where radii are compared, whatever the caller's context of decimals.
_COMPARED = Context(traps=[])


class CurveValues:
    """The data of a ``RealCurve`` in balls; call them within theirs."""

    def __init__(self, curve: RealCurve, arithmetic: Balls) -> None:
        self.curve, self.arithmetic = curve, arithmetic

    @cached_property
    def periods(self) -> Periods:
        """Return the period data of the nodal differentials in μ."""
        xp, betas = self.arithmetic, [flint.fmpq(*b.as_integer_ratio()) for b in self.curve.betas]
        differences = np.array([[xp.number(b - a) for b in betas] for a in betas])
        return Periods(Curve(xp, np.array([xp.number(b) for b in betas]), differences))

    @cached_property
    def inversion(self) -> AbelJacobi:
        """Return the Abel–Jacobi map on the real torus of the cuts."""
        return AbelJacobi(self.periods)

    @cached_property
    def cycles(self) -> tuple[Values, Values]:
        """Return ∮ λ^{k−1}dλ/w over a_s, and over b_s without the factor i, (g, g), columns s."""
        xp, curve, periods = self.arithmetic, self.curve, self.periods
        scale = xp.sqrt(xp.number(curve.square_of_scale)) * (-2 if curve.reverses else 2)
        rows = xp.array(curve.monomials()) * scale
        return xp.product(rows, periods.cycles), xp.product(rows, periods.conjugate_cycles)

    @cached_property
    def normalized_differentials(self) -> Values:
        """Return c, (g, g): v_j = Σ_k c_jk λ^{k−1}dλ/w has ∮_{a_s} v_j = δ_js."""
        return np.asarray(self.arithmetic.inverse(self.cycles[0]))

    @cached_property
    def quasi_periods(self) -> tuple[Values, Values, Values, Values]:
        """Return ω, ω', η, η' in ν, ω and η without the factor i."""
        xp, g = self.arithmetic, self.curve.genus
        kinds = xp.array(self.curve.second_kind())
        integrals = np.stack([self._monomial_integrals(j) for j in range(2 * g)], axis=1)
        over = xp.product(kinds, integrals) / 2
        # y = 2iv on cuts, so that ω and η are 1/2i times a real number
        signs = (-1) ** (g - np.arange(g))
        a, b = over[:, 1::2] * signs, np.cumsum(-over[:, ::2] * signs, axis=1)
        return a[:g], b[:g], a[g:], b[g:]

    def _monomial_integrals(self, number: int) -> Values:
        """Return ∫ ν^k dν/√Π|ν−ν_j| over the interval [β_number, β_{number+1}], k = 0 … 2g−1."""
        checkpoint()
        xp, curve = self.arithmetic, self.curve
        orders = np.arange(2 * curve.genus)
        interval = self.periods.intervals[number]
        # Powers are entire: they take some nodes more than the forms themselves.
        count = self.periods.node_count(interval) + 4 * curve.genus + 2
        below, above = interval.distances(xp.nodes(count))
        unit = xp.number(curve.unit)
        left, right = (xp.number(curve.nus[j]) for j in (number, number + 1))
        powers = (left + unit * below) ** orders[:, None]
        means = np.sum(interval.density(below, above) * powers, axis=1) / count
        if xp.certified:
            before, after = interval.ends_of_strip
            farthest = max(abs(left - unit * before), abs(right + unit * after)) ** orders
            largest = interval.bound_density_in_strip() * farthest
            means = xp.add_error(means, xp.bound_tail(largest, interval.decay, 2 * count))
        root = xp.sqrt(xp.number(curve.unit ** (1 - 2 * curve.genus)))
        return np.asarray(2 * xp.pi * root * means)

    def image(self, point: Fraction | complex, w: complex) -> Values:
        """Return the real and imaginary parts, (g, 2), of ∫ of the normalised differentials from
        the last branch point to (λ, w), modulo the lattice.

        On cuts and gaps the sign of w names the sheet (over gaps of its imaginary part, or of what
        it has), elsewhere the nearer root. Raises InvalidInput for w = 0.
        """
        curve, T = self.curve, self.periods.riemann_matrix
        zero = 0 * T[0]
        if curve.is_even and point == curve.points[-1]:
            return np.stack([zero, zero], axis=1)
        mu = curve.to_mu(point)
        number = -1 if mu[1] else curve.place(mu[0])
        if 0 <= number < 2 * curve.genus:
            on_cut = number % 2 == 1
            named = (w.real or w.imag) if on_cut else (w.imag or w.real)
            if named == 0 and mu[0] not in curve.betas:
                raise InvalidInput(("w",), "a number other than 0, whose sign names the sheet", "0")
            part = (-1 if named < 0 else 1) * self._from_left_end(number, mu[0])
            found = np.stack([part, zero] if on_cut else [zero, -part], axis=1)
        else:
            number, part, v = self._from_nearest_end(mu)
            # v = w·(e−λ)^{−g−1} but for a positive factor, where e went to infinity: phases say
            # which.
            angle = cmath.phase(w)
            if curve.is_even:
                angle -= (curve.genus + 1) * cmath.phase(complex(curve.points[-1] - point))
            found = part if math.cos(angle - cmath.phase(v)) >= 0 else -part
        if number < 0:
            return found
        epsilon, delta = curve.halves[number]
        return np.asarray(found + np.stack([delta + zero, T @ epsilon], axis=1))

    def _from_left_end(self, number: int, mu: Fraction) -> Values:
        """Return a⁻¹∫ p dμ/(2√|R|) from β_number to a point of the interval that begins there,
        (g,).
        """
        xp, periods, s = self.arithmetic, self.periods, number // 2
        interval = periods.intervals[number]
        on_cut = number % 2 == 1
        series = (
            self.curve.alternating[s] * periods.cut_series[s] if on_cut else periods.gap_series[s]
        )
        psi = interval.angle(*self._distances(number, mu), True)
        orders = xp.array([1, *range(1, series.shape[1])])
        sums = series @ (xp.multiples(np.array([psi]), len(orders))[1][0] / orders)
        # a term left out of the density is integrated over no more than π
        left_out = xp.pi * periods.truncation(interval, series)
        return np.asarray(
            periods.inverse_cycles @ xp.add_error(psi * series[:, 0] + sums, left_out)
        )

    def _distances(self, number: int, mu: Any) -> tuple[Any, Any]:
        """Return the distances of a point from both ends of the interval [β_j, β_{j+1}]."""
        lower, upper = self.curve.betas[number : number + 2]
        return self.arithmetic.number(mu - lower), self.arithmetic.number(upper - mu)

    def _from_nearest_end(self, mu: tuple[Fraction, Fraction]) -> tuple[int, Values, complex]:
        """Return (j, a⁻¹∫ p dμ/(2v), v) from the nearest β_j, −1 for infinity, straight to a
        complex μ; the real and imaginary parts of the integral are (g, 2).

        The sheet is that of the returned v, which is v up to a positive factor.
        """
        xp, betas = self.arithmetic, self.curve.betas
        centre = (betas[0] + betas[-1]) / 2
        far = (mu[0] - centre) ** 2 + mu[1] ** 2 > (betas[-1] - betas[0]) ** 2
        squares = [(mu[0] - b) ** 2 + mu[1] ** 2 for b in betas]
        j = -1 if far else squares.index(min(squares))
        start = centre if j < 0 else betas[j]
        others = [xp.number(b - start) for i, b in enumerate(betas) if i != j]
        zeros = [xp.number(zero - start) for zero in self.curve.zeros]
        form = partial(_form_at_infinity if j < 0 else _form_at_end, others)
        root = flint.acb(xp.number(mu[0] - start), xp.number(mu[1])).sqrt()
        end = 1 / root if j < 0 else root
        parts = [
            flint.acb.integral(lambda *at, k=k: form(zeros[:k] + zeros[k + 1 :], *at)[0], 0, end)
            for k in range(self.curve.genus)
        ]
        found = self.periods.inverse_cycles @ np.array([[x.real, x.imag] for x in parts])
        v = form(zeros, end, False)[1]
        return j, found, complex(v / abs(v))

    def invert(self, z: Values, by_doubles: bool = False) -> tuple[Values, Values]:
        """Return λ, one on each cut, and the signs of w there, (N, g), at points z (N, g) of the
        real torus; ``by_doubles``: those of angles that are found in doubles.
        """
        if by_doubles:
            nearest = self.inversion.in_doubles.invert(z.astype(np.float64))
            psi = self.arithmetic.array(nearest)
        else:
            psi = self.inversion.invert(z)
        roots = zip(*self.periods.roots_on_cuts(psi), strict=True)
        columns = [
            self._lambda(2 * s + 1, below * below, above * above)
            for s, (below, above) in enumerate(roots)
        ]
        upwards = np.where(self.arithmetic.sin(psi) < 0, -1, 1)
        return np.stack(columns, axis=1), upwards * self.curve.alternating

    def _lambda(self, number: int, below: Values, above: Values) -> Values:
        """Return λ at distances in μ from both ends of the interval [β_j, β_{j+1}], each from the
        nearer one: ν−ν_j = (λ−b_j)ν/(e−b_j) where there are 2g+2 branch points.
        """
        xp, curve = self.arithmetic, self.curve
        unit = xp.number(curve.unit)
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

    def torus(self, points: NDArray[Any], up: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return z (N, g) in doubles of points μ (N, g), one on each cut; ``up``: whether μ
        increases.
        """
        psi = np.empty(points.shape)
        intervals = [cut.scale.astype(np.float64) for cut in self.periods.cuts]
        for i, s in np.ndindex(points.shape):
            below, above = map(float, self._distances(2 * s + 1, points[i, s]))
            psi[i, s] = elliptic.angle(below, above, bool(up[i, s]), intervals[s])
        return self.inversion.in_doubles.at(psi)[0]


def _form_at_end(others: list[Any], zeros: list[Any], x: Any, analytic: bool) -> tuple[Any, Any]:
    """Return Π(μ−ζ) dμ/(2v dx) and v at x = √(μ−β_j): v² = −x² Π_{<}(μ−β) Π_{>}(μ−β).

    others, zeros: the other β's and some ζ's, counted from β_j. Where a root is not ``analytic``
    the first is not finite: each stays away from its branch line.
    """
    checkpoint()
    square = x * x
    roots = [(b - square if b > 0 else square - b).sqrt(analytic=analytic) for b in others]
    root = math.prod(roots, start=flint.acb(1))
    if sum(b > 0 for b in others) % 2 == 0:
        root *= flint.acb(0, 1)
    return math.prod((square - zero for zero in zeros), start=1 / root), x * root


def _form_at_infinity(
    others: list[Any], zeros: list[Any], t: Any, analytic: bool
) -> tuple[Any, Any]:
    """Return the same in t = (μ−c)^{−1/2} from infinity: v = i t^{−2g−1} Π√(1−(β−c)t²)."""
    checkpoint()
    square, genus = t * t, len(others) // 2
    roots = ((1 - square * b).sqrt(analytic=analytic) for b in others)
    root = math.prod(roots, start=flint.acb(1))
    form = flint.acb(0, 1) / root * square ** (genus - 1 - len(zeros))
    v = flint.acb(0, 1) * root / t ** len(others)
    return math.prod((1 - square * zero for zero in zeros), start=form), v


class CurveDigits:
    """One curve to ``digits`` digits, with radii, proven where ``certified``.

    Radii are below 10^−digits: of T and of images absolutely, or of their largest entry where that
    is above 1; of periods by the largest of their row, of coefficients by that of their column, of
    branch points by the largest of all.
    """

    def __init__(self, curve: RealCurve, digits: int, certified: bool) -> None:
        self._curve, self._digits, self._certified = curve, digits, certified
        self._at = cache(lambda working: CurveValues(curve, balls(working, certified)))

    @cached_property
    def of_curve(self) -> Decimals:
        """Return what belongs to the curve itself, each computed when it is first asked for."""
        made: dict[str, tuple[Callable[[CurveValues], Values], Any, int]] = {
            "riemann_matrix": (lambda fine: fine.periods.riemann_matrix, None, 1),
            "a_periods": (lambda fine: fine.cycles[0], 1, 0),
            "b_periods": (lambda fine: fine.cycles[1], 1, 0),
            "normalized_differentials": (lambda fine: fine.normalized_differentials, 0, 0),
        }
        for i, name in enumerate(QUASI_PERIODS):
            made[name] = (lambda fine, i=i: fine.quasi_periods[i], 1, 0)  # type: ignore[misc]
        return self._decimals({name: partial(self._find, *how) for name, how in made.items()})

    def riemann_matrix(self) -> tuple[NDArray[np.float64], float]:
        """Return T (g, g) in doubles, and what its entries may be off by: from doubles where these
        keep it to 1e-14, else from balls.
        """
        with suppress(OverflowError), np.errstate(all="ignore"):
            periods = CurveValues(self._curve, DOUBLES).periods
            if max(map(periods.node_count, periods.intervals)) <= _FEW_NODES:
                T, gaps = periods.riemann_matrix, np.diff(periods.conjugate_cycles, prepend=0)
                added = np.cumsum(np.abs(gaps), axis=1) + np.abs(periods.cycles) @ np.abs(T)
                off = float(np.max(np.abs(periods.inverse_cycles) @ added)) * DOUBLES.epsilon
                if _ROUNDED * off <= _MOST_ROUNDED * float(np.max(T)):
                    return T, _ROUNDED * off
        T, radii = (x["riemann_matrix"] for x in (self.of_curve.midpoints, self.of_curve.radii))
        return T.astype(np.float64), float(np.max(radii)) + float(np.max(T)) * DOUBLES.epsilon

    def abel(self, points: Sequence[Fraction | complex], sheets: Sequence[complex]) -> Decimals:
        """Return ``abel``, (N, g, 2): real and imaginary parts of the images of points."""
        places = list(zip(points, sheets, strict=True))

        def compute(fine: CurveValues) -> Values:
            images = [fine.image(*place) for place in iterate(places)]
            return np.array(images, dtype=object).reshape(-1, self._curve.genus, 2)

        return self._decimals({"abel": partial(self._find, compute, (1, 2), 1)})

    def invert(self, z: Sequence[Sequence[Fraction]]) -> Decimals:
        """Return ``points`` λ and the ``signs`` of w, (N, g), at points z of the real torus."""
        size = Decimal(max(abs(b) for b in self._curve.points).__ceil__() or 1)

        def compute(fine: CurveValues) -> Values:
            return np.stack(fine.invert(fine.arithmetic.array(z)))

        both = zip(*self._find(compute, None, size), strict=True)
        return self._decimals(dict(zip(("points", "signs"), both, strict=True)))

    def in_doubles(self, compute: Callable[[CurveValues], Values]) -> NDArray[np.float64]:
        """Return what a curve in balls gives, rounded."""
        fine = self._at(self._digits + _SPARE)
        with fine.arithmetic:
            return compute(fine).astype(np.float64)

    def _decimals(self, pairs: dict[str, Pair | Callable[[], Pair]]) -> Decimals:
        """Return numbers by name, of which the first is bounded."""
        both = Later(pairs, 0), Later(pairs, 1)
        return Decimals(self._digits, self._certified, *both, (next(iter(pairs)),))

    def _find(self, compute: Callable[[CurveValues], Values], axes: Any, least: Any) -> Pair:
        """Return the midpoints and radii of what a curve in balls gives, with enough digits; radii
        are compared with the largest midpoint along ``axes``, or with ``least``.

        Raises Unsolved (``no-digit-left``) where the most working digits do not suffice.
        """
        digits = self._digits
        for attempt in range(_ATTEMPTS):
            working = digits + _SPARE * 2**attempt
            fine = self._at(working)
            # a ball that should be away from zero may hold it
            with fine.arithmetic, suppress(ZeroDivisionError), localcontext(_COMPARED):
                middle, radius = decimal_pair(compute(fine), digits + _SHOWN)
                size = np.max(np.abs(middle), axis=axes, keepdims=True, initial=least)
                if np.all(radius <= size * Decimal(10) ** -digits):
                    return middle, radius
        reason = f"{digits} digits were not reached with {working} working digits"
        raise Unsolved("no-digit-left", reason)
