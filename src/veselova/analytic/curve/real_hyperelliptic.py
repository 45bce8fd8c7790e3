"""A hyperelliptic curve with real branch points, brought to w² = −Π(μ−β_j), j = 0 … 2g, whose
bounded ovals lie over the cuts.

    w² = −Π_{2g+1}(λ−b_j)     ν = λ
    w² = +Π_{2g+1}(λ−b_j)     ν = −λ
    w² = +Π_{2g+2}(λ−b_j)     ν = 1/(e−λ), e the last branch point, which goes to infinity
    w² = −Π_{2g+2}(λ−b_j)     ν = 1/(λ−e), e the last branch point

and μ = ν/u, where u is near the span of the ν's: products of differences do not leave the range of
a double. Differences of β's are products and quotients of exact differences, so that near branch
points keep their digits.

Its nodal differentials are p_k dμ/2v with p_g = Π(μ−ζ_l), ζ_l the midpoints of the inner gaps, and
p_k = p_g/(μ−ζ_k). A polynomial of degree g−1 in μ is Σ_k M_k p_k: M_k is its value at ζ_k over
p_k(ζ_k), and M_g its leading coefficient. All matrices of coefficients are of rationals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.curve.branch_points import product_over_poles
from veselova.analytic.curve.hyperelliptic import characteristics
from veselova.analytic.curve.moving_part import rationals
from veselova.mechanics.core.errors import InvalidInput

__all__ = ["RealCurve"]

Array = NDArray[np.float64]

#: Rows of rationals.
Matrix = list[list[Fraction]]

#: Derived: what rounding to a double moves a number by, relative to it.
_ROUNDING = Fraction(1, 2**52)

#: The nearest two β's over the span of all: below it products of elliptic integrals leave the range
#: of a double.
_SMALLEST_GAP = Fraction(1, 10**100)


@dataclass(frozen=True)
class RealCurve:
    """The curve w² = sign·Π(λ−b_j) of distinct rationals b_j, increasing, and its data in the
    coordinate μ.
    """

    points: tuple[Fraction, ...]
    sign: int

    def __post_init__(self) -> None:
        gap = min(after - before for before, after in pairwise(self.nus))
        if gap < _SMALLEST_GAP * (self.nus[-1] - self.nus[0]):
            moved = ", the largest moved to infinity," if self.is_even else ""
            raise InvalidInput(
                ("branch_points",),
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
    def unit(self) -> Fraction:
        """Return u of μ = ν/u, the power of 2 between half the span and twice the span."""
        span = self.nus[-1] - self.nus[0]
        exponent = span.numerator.bit_length() - span.denominator.bit_length()
        return Fraction(2) ** exponent

    @cached_property
    def betas(self) -> tuple[Fraction, ...]:
        """Return β_0 < … < β_{2g}, exact."""
        return tuple(nu / self.unit for nu in self.nus)

    @cached_property
    def zeros(self) -> tuple[Fraction, ...]:
        """Return ζ_1 … ζ_{g−1}, the midpoints of the inner gaps."""
        betas = self.betas
        return tuple((a + b) / 2 for a, b in zip(betas[2:-1:2], betas[3::2], strict=True))

    @cached_property
    def halves(self) -> Array:
        """Return [ε, δ] of each β, (2g+1, 2, g), entries 0 and ½."""
        return characteristics(self.genus)

    @property
    def alternating(self) -> NDArray[np.int64]:
        """Return the signs of w on the cuts where μ increases, (g,)."""
        return (-1) ** (np.arange(self.genus, 0, -1) - 1)

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Return the number of the branch point b that each β is."""
        numbers = range(2 * self.genus + 1)
        return tuple(reversed(numbers)) if self.reverses else tuple(numbers)

    @cached_property
    def square_of_scale(self) -> Fraction:
        """Return c² of c = dλ/w over λ^k n^{g−1} dμ/v, exact: u^{1−2g}, and with 2g+2 branch points
        more, n = 1/(e−λ).
        """
        square = self.unit ** (1 - 2 * self.genus)
        if self.is_even:
            *finite, last = self.points
            square /= math.prod((last - b for b in finite), start=Fraction(1))
        return square

    def monomials(self) -> Matrix:
        """Return M (g, g) of λ^k dλ/w over c·dμ/v, k = 0 … g−1.

        With 2g+2 branch points that is λ^k n^{g−1} = n^{g−1−k}(e n−1)^k, n = 1/(e−λ).
        """
        unit = -self.unit if self.reverses else self.unit
        at_zeros = [unit * zero for zero in self.zeros]
        last = self.genus - 1
        slopes = [math.prod(zero - x for x in self.zeros if x != zero) for zero in self.zeros]
        rows = []
        for k in range(self.genus):
            if self.is_even:
                e = self.points[-1]
                values = [n ** (last - k) * (e * n - 1) ** k for n in at_zeros]
                leading = e**k * unit**last
            else:
                values = [n**k for n in at_zeros]
                leading = unit**last if k == last else Fraction(0)
            found = [value / slope for value, slope in zip(values, slopes, strict=True)]
            rows.append([*found, leading])
        return rows

    def second_kind(self) -> NDArray[Any]:
        """Return the coefficients of ν^j dν/y, j = 0 … 2g−1, in du_k = ν^{k−1}dν/y, and in −dr_k =
        −Σ_{j=k}^{2g−k} (j+1−k) m_{j+1+k} ν^j dν/4y, (2g, 2g), for y² = 4Π(ν−ν_j) = Σ m_i ν^i.
        """
        g, m = self.genus, product_over_poles(rationals(self.nus)) * 4
        rows = np.zeros((2 * g, 2 * g), dtype=object)
        for k in range(1, g + 1):
            rows[k - 1, k - 1] = 1
            for j in range(k, 2 * g + 1 - k):
                rows[g + k - 1, j] = -(j + 1 - k) * m[j + 1 + k] / 4
        return rows

    def to_mu(self, point: Fraction | complex) -> tuple[Fraction, Fraction]:
        """Return the real and the imaginary part of μ at λ, exact."""
        real, imaginary = Fraction(point.real), Fraction(point.imag)
        if self.is_even:
            real = self.points[-1] - real
            square = real * real + imaginary * imaginary
            real, imaginary = real / square, imaginary / square
        unit = -self.unit if self.reverses else self.unit
        return real / unit, imaginary / unit

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

    def place(self, mu: Fraction) -> int:
        """Return the number of the interval [β_j, β_{j+1}] that holds μ, −1 below β_0 and 2g above
        β_2g.
        """
        return max(sum(mu > beta for beta in self.betas) - 1, 0 if mu == self.betas[0] else -1)
