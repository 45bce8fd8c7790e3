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
from collections.abc import Sequence
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
from veselova.analytic.curve.path_integrals import from_end, from_infinity, midpoints
from veselova.analytic.curve.periods import Periods
from veselova.mechanics.core.errors import InvalidInput, Unsolved
from veselova.mechanics.core.exact_input import over_common_denominator

__all__ = ["SMALLEST_GAP", "RealCurve"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Derived: what rounding to a double moves a number by, relative to it.
_ROUNDING = Fraction(1, 2**52)

#: The nearest two β's over the span of all: below it products of elliptic integrals leave the range
#: of a double.
SMALLEST_GAP = Fraction(1, 10**100)


class _PeriodsOfCurve(Periods):
    """Periods whose ill-conditioned angles have a remedy of their own."""

    without_angles = "invert_decimals serves with more digits"


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
        curve = Curve(DOUBLE, np.array([float(b) for b in betas]), differences, origins)
        return _PeriodsOfCurve(curve)

    @cached_property
    def inversion(self) -> AbelJacobi[Periods]:
        """Return the Abel–Jacobi map on the real torus of the cuts."""
        return AbelJacobi(self.periods)

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

    def lambda_between(self, number: int, below: Array, above: Array) -> Array:
        """Return λ at distances in μ from both ends of the interval [β_number, β_{number+1}], from
        the end that is nearer in λ.

        ν−ν_j = (λ−b_j)ν/(e−b_j) where there are 2g+2 branch points.
        """
        unit = float(self.root_of_unit**2)
        left, right = (self.points[self.order[j]] for j in (number, number + 1))
        from_left = unit * below
        from_right = -unit * above
        if self.is_even:
            nu = self.nu(number, below, above)
            from_left = from_left / nu * float(self.points[-1] - left)
            from_right = from_right / nu * float(self.points[-1] - right)
        elif self.reverses:
            from_left, from_right = -from_left, -from_right
        point: Array = np.where(
            np.abs(from_left) <= np.abs(from_right),
            float(left) + from_left,
            float(right) + from_right,
        )
        return np.asarray(np.clip(point, float(min(left, right)), float(max(left, right))))

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

    def mu_on_cut(self, s: int, point: Fraction | complex) -> Fraction | None:
        """Return μ of a point on cut s = 1 … g, None for any other.

        Beyond an end by a rounding of a double it counts as that end: doubles need not lie on a
        narrow cut.
        """
        if not isinstance(point, Fraction):
            return None
        for j in (2 * s - 1, 2 * s):
            end = self.points[self.order[j]]
            if abs(point - end) <= abs(end) * _ROUNDING:
                beyond = (point > end) == ((j % 2 == 0) != self.reverses)
                if beyond:
                    return self.betas[j]
        mu, _ = self.to_mu(point)
        return mu if self.betas[2 * s - 1] <= mu <= self.betas[2 * s] else None

    @cached_property
    def cancellation(self) -> float:
        """Return how much larger than a normalised integral the sums may be that it is a difference
        of: of order one, but where three β's or more are close together.
        """
        periods = self.periods
        return float(max(np.max(periods.cancellation), np.max(periods.conjugate_cancellation)))

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
        betas = self.betas
        differences = self.periods.curve.differences
        middle = (betas[0] + betas[-1]) / 2
        squares = [(mu[0] - b) ** 2 + mu[1] ** 2 for b in betas]
        far = (mu[0] - middle) ** 2 + mu[1] ** 2 > (betas[-1] - betas[0]) ** 2
        j = squares.index(min(squares))
        try:
            target = complex(float(mu[0] - (middle if far else betas[j])), float(mu[1]))
        except OverflowError:
            reason = "a point is too far from the branch points for doubles"
            raise Unsolved("beyond-floats", reason) from None
        if far:
            from_middle = (differences[0] + differences[-1]) / 2
            part, v = from_infinity(target, from_middle, midpoints(from_middle))
            return None, self.periods.inverse_cycles @ part, v
        part, v = from_end(target, j, differences[j], midpoints(differences[j]))
        return j, self.periods.inverse_cycles @ part, v
