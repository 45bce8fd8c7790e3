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
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.theta.characteristic import Characteristic
from veselova.mechanics.core.errors import InvalidInput

__all__ = ["RealCurve"]

Array = NDArray[np.float64]

#: Derived: what rounding to a double moves a number by, relative to it.
_ROUNDING = Fraction(1, 2**52)

#: The nearest two β's over the span of all: below it products of elliptic integrals leave the range
#: of a double.
_SMALLEST_GAP = Fraction(1, 10**100)


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
        if gap < _SMALLEST_GAP * (self.betas[-1] - self.betas[0]):
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
    def zeros(self) -> tuple[Fraction, ...]:
        """Return ζ_1 … ζ_{g−1}, the midpoints of the inner gaps."""
        betas = self.betas
        return tuple((a + b) / 2 for a, b in zip(betas[2:-1:2], betas[3::2], strict=True))

    @cached_property
    def halves(self) -> list[tuple[Array, Array]]:
        """Return [ε, δ] of each β, entries 0 and ½."""
        found = (Characteristic.of_branch_point(j, self.genus) for j in range(2 * self.genus + 1))
        return [(np.array(c.epsilon) / 2, np.array(c.delta) / 2) for c in found]

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Return the number of the branch point b that each β is."""
        numbers = range(2 * self.genus + 1)
        return tuple(reversed(numbers)) if self.reverses else tuple(numbers)

    @cached_property
    def square_of_scale(self) -> Fraction:
        """Return c², exact."""
        square = self.root_of_unit ** (2 - 4 * self.genus)
        if self.is_even:
            *finite, last = self.points
            square /= math.prod((last - b for b in finite), start=Fraction(1))
        return square

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

    def place(self, mu: Fraction) -> int:
        """Return the number of the interval [β_j, β_{j+1}] that holds μ, −1 below β_0 and 2g above
        β_2g.
        """
        return max(sum(mu > beta for beta in self.betas) - 1, 0 if mu == self.betas[0] else -1)
