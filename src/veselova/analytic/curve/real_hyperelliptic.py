"""A hyperelliptic curve with real branch points, brought to w² = −Π(μ−β_j), j = 0 … 2g, whose
bounded ovals lie over the cuts.

    w² = −Π_{2g+1}(λ−b_j)     ν = λ
    w² = +Π_{2g+1}(λ−b_j)     ν = −λ
    w² = +Π_{2g+2}(λ−b_j)     ν = 1/(e−λ), e the last branch point, which goes to infinity
    w² = −Π_{2g+2}(λ−b_j)     ν = 1/(λ−e), e the last branch point

and μ = (ν−c)/s, where the β's are between −2 and 2: neither powers nor products of differences
leave the range of a double. Differences of β's are products and quotients of exact differences, so
that near branch points keep their digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.hyperelliptic import BranchPoint, Curve
from veselova.analytic.curve.interval import Interval
from veselova.analytic.curve.periods import Periods
from veselova.mechanics.core.errors import InvalidInput, Unsolved
from veselova.mechanics.core.exact_input import over_common_denominator

__all__ = ["SMALLEST_GAP", "RealCurve"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Budget: nodes of Gauss' rule on a path, at first and at most, and the relative change at which it
#: has converged.
_FEWEST_NODES = 32
_MOST_NODES = 1024
_QUADRATURE = 1e-13

#: The nearest two β's over the span of all: below it products of elliptic integrals leave the range
#: of a double.
SMALLEST_GAP = Fraction(1, 10**100)


@dataclass(frozen=True)
class RealCurve:
    """The curve w² = sign·Π(λ−b_j) of distinct rationals b_j, increasing, and its data in the
    coordinate μ; ``path`` is where messages find the b_j.
    """

    points: tuple[Fraction, ...]
    sign: int
    path: tuple[str | int, ...] = ("branch_points",)

    def __post_init__(self) -> None:
        gap = min(after - before for before, after in pairwise(self.betas))
        if gap < SMALLEST_GAP * (self.betas[-1] - self.betas[0]):
            moved = ", the largest moved to infinity," if self.is_even else ""
            raise InvalidInput(
                self.path,
                f"differences of neighbours{moved} of at least 1e-100 of their span",
                "a smaller one",
            )

    @property
    def genus(self) -> int:
        """Return g."""
        return (len(self.points) - 1) // 2

    @property
    def is_even(self) -> bool:
        """Return whether there are 2g+2 branch points."""
        return len(self.points) % 2 == 0

    @property
    def reverses(self) -> bool:
        """Return whether μ decreases with λ."""
        return (self.sign > 0) != self.is_even

    @cached_property
    def nus(self) -> tuple[Fraction, ...]:
        """Return the finite branch points in ν, increasing, exact."""
        *finite, last = self.points if self.is_even else (*self.points, Fraction(0))
        values = [1 / (last - b) for b in finite] if self.is_even else finite
        return tuple(-b for b in reversed(values)) if self.reverses else tuple(values)

    @cached_property
    def centre(self) -> Fraction:
        """Return c of μ = (ν−c)/s."""
        return (self.nus[0] + self.nus[-1]) / 2

    @cached_property
    def root_of_unit(self) -> Fraction:
        """Return √s, the power of 2 for which half the span is between ½s and 4s."""
        half = (self.nus[-1] - self.nus[0]) / 2
        exponent = half.numerator.bit_length() - half.denominator.bit_length()
        return Fraction(2) ** (exponent // 2)

    @cached_property
    def betas(self) -> tuple[Fraction, ...]:
        """Return β_0 < … < β_{2g}, exact."""
        return tuple((nu - self.centre) / self.root_of_unit**2 for nu in self.nus)

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Return the number of the branch point b that each β is."""
        numbers = range(2 * self.genus + 1)
        return tuple(reversed(numbers)) if self.reverses else tuple(numbers)

    @cached_property
    def periods(self) -> Periods:
        """Return the period data of the nodal differentials in μ."""
        betas = self.betas
        g = self.genus
        # integers over one denominator: their quotients are correctly rounded
        whole, common = over_common_denominator(betas)
        differences = np.array([[(b - a) / common for b in whole] for a in whole])
        origins = tuple(
            BranchPoint("c" if j % 2 == 0 and j < 2 * g else "I", j) for j in range(2 * g + 1)
        )
        return Periods(Curve(DOUBLE, np.array([float(b) for b in betas]), differences, origins))

    @cached_property
    def inversion(self) -> AbelJacobi[Periods]:
        """Return the Abel–Jacobi map on the real torus of the cuts."""
        return AbelJacobi(self.periods)

    @cached_property
    def scale(self) -> float:
        """Return the factor c of λ^{k−1}dλ/w = c·(λ^{k−1}|ν|^{g−1}) dμ/v, without |ν|^{g−1} where
        ν = ±λ.
        """
        root = _square_root(self.square_of_scale)
        return -root if self.reverses else root

    @cached_property
    def square_of_scale(self) -> Fraction:
        """Return c², exact."""
        square = self.root_of_unit ** (2 - 4 * self.genus)
        if self.is_even:
            *finite, last = self.points
            square /= math.prod((last - b for b in finite), start=Fraction(1))
        return square

    def nu(self, number: int, below: Array, above: Array) -> Array:
        """Return ν at distances in μ from both ends of the interval [β_number, β_{number+1}], from
        the nearer end.
        """
        unit = float(self.root_of_unit**2)
        left = float(self.nus[number]) + unit * below
        right = float(self.nus[number + 1]) - unit * above
        return np.where(below <= above, left, right)

    def to_lambda(self, nu: Array) -> Array:
        """Return λ at ν."""
        nu = -nu if self.reverses else nu
        return np.asarray(float(self.points[-1]) - 1 / nu if self.is_even else nu)

    def weights(self, nu: Array, highest: int) -> Array:
        """Return c·λ^k, times |ν|^{g−1} for 2g+2 branch points, k = 0 … highest, (highest+1, …):
        the forms λ^k dλ/w over dμ/v.
        """
        point = self.to_lambda(nu)
        common = self.scale * (np.abs(nu) ** (self.genus - 1) if self.is_even else np.ones_like(nu))
        return np.stack([common * point**k for k in range(highest + 1)])

    def integrals(self, number: int, highest: int) -> Array:
        """Return ∫ λ^k dλ/|w| over the interval [β_number, β_{number+1}], upwards in μ, k = 0 …
        highest.
        """
        interval = Interval(self.periods.curve, number)
        # Powers are entire: they take some nodes more than the forms themselves.
        nodes = DOUBLE.nodes(self.periods.node_count(interval) + 2 * highest + 4)
        below, above = interval.distances(nodes)
        measure, of_gaps = interval.measure(below, above)
        density = measure / np.prod(of_gaps, axis=-2)
        weights = self.weights(self.nu(number, below, above), highest)
        return np.asarray(2 * np.pi * np.mean(weights * density, axis=-1))

    def monomial_integrals(self, number: int, highest: int, in_nu: bool = False) -> Array:
        """Return ∫ μ^k dμ/√|R| over the interval [β_number, β_{number+1}], k = 0 … highest.

        ``in_nu``: the same in ν.
        """
        interval = Interval(self.periods.curve, number)
        nodes = DOUBLE.nodes(self.periods.node_count(interval) + 2 * highest + 4)
        below, above = interval.distances(nodes)
        measure, of_gaps = interval.measure(below, above)
        point = self.periods.curve.branch_points[number] + below
        if in_nu:
            measure = measure * _square_root(self.root_of_unit ** (2 - 4 * self.genus))
            point = self.nu(number, below, above)
        powers = point ** np.arange(highest + 1)[:, None]
        return np.asarray(
            2 * np.pi * np.mean(powers * measure / np.prod(of_gaps, axis=-2), axis=-1)
        )

    def quasi_periods(self, in_nu: bool = True) -> tuple[Complex, Complex, Complex, Complex]:
        """Return ω, ω', η, η', half the periods of du_k = x^{k−1}dx/y and −dr_k over a_s and b_s,
        (g, g), y² = 4Π(x−x_j), where x is ν, or else μ.

        dr_k = Σ_{j=k}^{2g−k} (j+1−k) m_{j+1+k} x^j dx/4y for y² = Σ m_i x^i (Baker): differentials
        of the second kind.
        """
        g = self.genus
        m = 4 * np.poly(np.array([float(b) for b in (self.nus if in_nu else self.betas)]))[::-1]
        kinds = np.zeros((2 * g, 2 * g))
        kinds[:g, :g] = np.eye(g)
        for k in range(1, g + 1):
            for j in range(k, 2 * g + 1 - k):
                kinds[g + k - 1, j] = -(j + 1 - k) * m[j + 1 + k] / 4
        over = [
            kinds @ self.monomial_integrals(number, 2 * g - 1, in_nu) for number in range(2 * g)
        ]
        # y = 2iv on cuts; on gaps v is i√|R| as in the b-periods of the first kind.
        a = np.stack([(-1) ** (g - s) * over[2 * s - 1] for s in range(1, g + 1)], axis=1) / 2j
        b = (
            np.cumsum(
                np.stack([(-1) ** (g - s + 1) * over[2 * s] for s in range(g)], axis=1), axis=1
            )
            / 2
        )
        first = np.asarray(a, dtype=complex)
        second = np.asarray(b, dtype=complex)
        return first[:g], second[:g], first[g:], second[g:]

    def cycles(self, highest: int) -> tuple[Array, Array]:
        """Return ∮ λ^k dλ/w over a_s, and over b_s without the factor i, (highest+1, g), k = 0 …
        highest.
        """
        g = self.genus
        over = [2 * self.integrals(number, highest) for number in range(2 * g)]
        a = np.stack([(-1) ** (g - s) * over[2 * s - 1] for s in range(1, g + 1)], axis=1)
        gaps = np.stack([(-1) ** (g - s + 1) * over[2 * s] for s in range(g)], axis=1)
        return a, np.cumsum(gaps, axis=1)

    def angles(self, points: Sequence[Sequence[Fraction]], increasing: NDArray[np.bool_]) -> Array:
        """Return the elliptic angles of points μ (N, g), one on each cut, negative on
        the way back.
        """
        found = np.empty((len(points), self.genus))
        for s, interval in enumerate(self.periods.cuts):
            lower = self.betas[2 * s + 1]
            upper = self.betas[2 * s + 2]
            for i, row in enumerate(points):
                distances = float(row[s] - lower), float(upper - row[s])
                found[i, s] = interval.points.angle(*distances, bool(increasing[i, s]))
        return found

    def to_mu(self, point: Fraction | complex) -> tuple[Fraction, Fraction]:
        """Return the real and the imaginary part of μ at λ, exact."""
        real, imaginary = (
            (point, Fraction(0))
            if isinstance(point, Fraction)
            else (Fraction(point.real), Fraction(point.imag))
        )
        if self.is_even:
            real = self.points[-1] - real
            square = real * real + imaginary * imaginary
            real, imaginary = real / square, imaginary / square
        if self.reverses:
            real, imaginary = -real, -imaginary
        unit = self.root_of_unit**2
        return (real - self.centre) / unit, imaginary / unit

    def real_matrix(self) -> Array:
        """Return T of the Riemann matrix iT."""
        return self.periods.riemann_matrix

    @staticmethod
    def complex_array(real: Array, imaginary: Array) -> Complex:
        """Return complex numbers of real and imaginary parts."""
        return np.asarray(real + 1j * imaginary)

    def place(self, mu: Fraction) -> int:
        """Return the number of the interval [β_j, β_{j+1}] that holds μ, −1 below β_0 and 2g above
        β_2g.
        """
        return max(sum(mu > beta for beta in self.betas) - 1, 0 if mu == self.betas[0] else -1)

    def from_left_end(self, number: int, points: Sequence[Fraction]) -> Array:
        """Return a⁻¹∫ p dμ/(2√|R|) from β_number to points of the interval that begins there, (N,
        g).
        """
        interval = Interval(self.periods.curve, number)
        lower = self.betas[number]
        upper = self.betas[number + 1]
        psi = np.array(
            [interval.points.angle(float(mu - lower), float(upper - mu), True) for mu in points]
        )
        forms = interval.forms(*interval.distances(DOUBLE.nodes(self.periods.node_count(interval))))
        series = DOUBLE.cosine_series(forms)
        orders = np.arange(1, series.shape[1])
        integrals = (
            psi[:, None] * series[:, 0] + np.sin(psi[:, None] * orders) / orders @ series[:, 1:].T
        )
        return np.asarray(integrals @ self.periods.inverse_cycles.T)

    def from_nearest_end(
        self, mu: tuple[Fraction, Fraction]
    ) -> tuple[int | None, Complex, complex]:
        """Return (j, a⁻¹∫ p dμ/(2v), v) from the nearest β_j, None for infinity, straight to a
        complex μ; the integral is (g,).

        The sheet is that of the returned v, which is v up to a positive factor.
        """
        try:
            target = complex(*map(float, mu))
        except OverflowError:
            reason = "a point is too far from the branch points for doubles"
            raise Unsolved("beyond-floats", reason) from None
        betas = self.periods.curve.branch_points
        zeros = (betas[2:-1:2] + betas[3::2]) / 2
        centre = (betas[0] + betas[-1]) / 2
        radius = (betas[-1] - betas[0]) / 2
        if math.hypot(target.real - centre, target.imag) > 2 * radius:
            # t = (μ−c)^{−1/2}: v = i t^{−2g−1} Π√(1+(c−β)t²), and each root stays away from its
            # branch line.
            end = 1 / np.sqrt(complex(target - centre))
            powers = np.full(self.genus, 2)
            powers[-1] = 0

            def over_t(t: Complex) -> Complex:
                square = (t * t)[:, None]
                forms = (
                    _without_each(np.asarray(1 + square * (centre - zeros), dtype=complex))
                    * t ** powers[:, None]
                )
                return np.asarray(
                    1j * forms / np.prod(np.sqrt(1 + square * (centre - betas)), axis=1)
                )

            # its phase alone names the sheet: powers of far points leave the range of a double
            turn = (end / abs(end)) ** (-2 * self.genus - 1)
            v = 1j * turn * np.prod(np.sqrt(1 + end**2 * (centre - betas)))
            return None, self.periods.inverse_cycles @ _integral(over_t, end), complex(v)
        j = int(np.argmin(np.abs(target - betas)))
        start = betas[j]
        below = betas[:j]
        above = betas[j + 1 :]
        # x = √(μ−β_j): v² = −x² Π_{<}(μ−β) Π_{>}(μ−β), and each root below stays away from its
        # branch line.
        unit = 1j if len(above) % 2 == 0 else 1.0
        end = np.sqrt(complex(target - start))

        def roots(x: Complex) -> Complex:
            at = (start + x * x)[:, None]
            return np.asarray(
                unit * np.prod(np.sqrt(at - below), axis=1) * np.prod(np.sqrt(above - at), axis=1),
                dtype=complex,
            )

        def over_x(x: Complex) -> Complex:  # dμ/(2v) = dx/(v/x)
            return np.asarray(
                _without_each(np.asarray((start + x * x)[:, None] - zeros, dtype=complex))
                / roots(x)
            )

        v = end * roots(np.array([end]))[0]
        return j, self.periods.inverse_cycles @ _integral(over_x, end), complex(v)


def _square_root(value: Fraction) -> float:
    """Return the root of a positive number, correctly rounded but for its last bit, 0 or infinity
    beyond the range of doubles.
    """
    exponent = (value.numerator.bit_length() - value.denominator.bit_length()) // 2
    try:
        return math.ldexp(math.sqrt(value / Fraction(4) ** exponent), exponent)
    except OverflowError:
        return math.inf


def _without_each(factors: Complex) -> Complex:
    """Return the products of factors (N, g−1) without the k-th, k < g, and of all of
    them, (g, N).
    """
    count = factors.shape[1]
    products = [np.prod(np.delete(factors, k, axis=1), axis=1) for k in range(count)]
    return np.stack([*products, np.prod(factors, axis=1)])


def _integral(integrand: Callable[[Complex], Complex], end: complex) -> Complex:
    """Return the integrals from 0 straight to ``end`` of functions (g, N), by Gauss' rule with
    twice the nodes until it stays.
    """
    previous = None
    size = _FEWEST_NODES
    while size <= _MOST_NODES:
        nodes, weights = np.polynomial.legendre.leggauss(size)
        total = integrand(np.asarray(end * (nodes + 1) / 2, dtype=complex)) @ weights * end / 2
        if previous is not None and np.max(np.abs(total - previous)) <= _QUADRATURE * np.max(
            np.abs(total)
        ):
            return np.asarray(total)
        previous = total
        size = 2 * size
    raise Unsolved(
        "narrow-gap", "the path to a point passes too near a branch point for its quadrature"
    )
