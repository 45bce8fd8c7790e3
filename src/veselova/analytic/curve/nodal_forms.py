"""Differentials on a curve with real branch points by its nodal ones, exactly: matrices of
rationals.

p_g = Π(μ−ζ_l) over the midpoints of the inner gaps, p_k = p_g/(μ−ζ_k). A polynomial of degree g−1
in μ is Σ_k M_k p_k: M_k is its value at ζ_k over p_k(ζ_k), and M_g its leading coefficient.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.mechanics.core.errors import Unsolved

__all__ = [
    "CurvePeriods",
    "difference_product",
    "legendre_residual",
    "monomials",
    "partitions",
    "powers",
    "second_kind",
]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Budget: partitions of branch points up to which Thomae's values are formed: those of genus 10.
_MOST_SUBSETS = 400_000

#: Rows of rationals.
Matrix = list[list[Fraction]]


@dataclass(frozen=True)
class CurvePeriods:
    """Periods of λ^{k−1}dλ/w, k = 1 … g: ``a`` (g, g) real, ``b`` (g, g) imaginary; column s
    belongs to the cycle a_s or b_s.
    """

    a: Array
    b: Complex


def _by_nodal_forms(
    zeros: Sequence[Fraction], values: Sequence[Fraction], leading: Fraction
) -> list[Fraction]:
    """Return M of the polynomial with the given values at the zeros."""
    found = [
        value / math.prod((zero - other for other in zeros if other != zero), start=Fraction(1))
        for zero, value in zip(zeros, values, strict=True)
    ]
    return [*found, leading]


def powers(curve: RealCurve) -> Matrix:
    """Return M (g, g) of μ^k, k = 0 … g−1."""
    zeros = curve.zeros
    last = curve.genus - 1
    return [
        _by_nodal_forms(zeros, [zero**k for zero in zeros], Fraction(int(k == last)))
        for k in range(curve.genus)
    ]


def monomials(curve: RealCurve) -> Matrix:
    """Return M (g, g) of λ^k dλ/w over c·dμ/v, k = 0 … g−1, c² = ``RealCurve.square_of_scale``.

    With 2g+2 branch points that is λ^k n^{g−1} = n^{g−1−k}(e n−1)^k, n = 1/(e−λ).
    """
    sign = -1 if curve.reverses else 1
    zeros = curve.zeros
    unit = sign * curve.root_of_unit**2
    at_zeros = [sign * curve.centre + unit * zero for zero in zeros]
    last = curve.genus - 1
    rows = []
    for k in range(curve.genus):
        if curve.is_even:
            e = curve.points[-1]
            values = [n ** (last - k) * (e * n - 1) ** k for n in at_zeros]
            leading = e**k * unit**last
        else:
            values = [n**k for n in at_zeros]
            leading = unit**last if k == last else Fraction(0)
        rows.append(_by_nodal_forms(zeros, values, leading))
    return rows


def second_kind(genus: int, branch_points: Sequence[Fraction]) -> Matrix:
    """Return the coefficients of ν^j dν/y, j = 0 … 2g−1, in du_k = ν^{k−1}dν/y, and in −dr_k =
    −Σ_{j=k}^{2g−k} (j+1−k) m_{j+1+k} ν^j dν/4y, (2g, 2g), for y² = 4Π(ν−ν_j) = Σ m_i ν^i.
    """
    m = [Fraction(4)]
    for b in branch_points:
        m = [x - b * y for x, y in zip([Fraction(0), *m], [*m, Fraction(0)], strict=True)]
    rows = [[Fraction(int(j == k)) for j in range(2 * genus)] for k in range(genus)]
    for k in range(1, genus + 1):
        row = [Fraction(0)] * (2 * genus)
        for j in range(k, 2 * genus + 1 - k):
            row[j] = -(j + 1 - k) * m[j + 1 + k] / 4
        rows.append(row)
    return rows


def difference_product(sizes: Sequence[Sequence[Any]], subset: Sequence[int]) -> Any:
    """Return Π_{i<j∈S}|β_i−β_j| Π_{i<j∉S}|β_i−β_j| from all |β_i−β_j|, numbers of one kind."""
    rest = [j for j in range(len(sizes)) if j not in subset]
    pairs = (*itertools.combinations(subset, 2), *itertools.combinations(rest, 2))
    return math.prod(sizes[i][j] for i, j in pairs)


def partitions(genus: int) -> list[tuple[int, ...]]:
    """Return the sets of g+1 among 2g+1 numbers; raises Unsolved where they are too many."""
    count = math.comb(2 * genus + 1, genus + 1)
    if count > _MOST_SUBSETS:
        reason = f"genus {genus} has {count} partitions, {_MOST_SUBSETS} are served"
        raise Unsolved("too-many-terms", reason)
    return list(itertools.combinations(range(2 * genus + 1), genus + 1))


def legendre_residual(omega: Array, omega_prime: Array, eta: Array, eta_prime: Array) -> float:
    """Return max |ωη'ᵀ − ω'ηᵀ ∓ ½πi| over the largest of both rows, or over ½π where that is more;
    ω and η without their factor i, (g, g) each.
    """
    first = np.max(np.abs(np.hstack([omega, omega_prime])), axis=1)[:, None]
    second = np.max(np.abs(np.hstack([eta, eta_prime])), axis=1)[:, None]
    found = (omega / first) @ (eta_prime / second).T - (omega_prime / first) @ (eta / second).T
    half = np.pi / 2 / first / second.T
    off = np.abs(np.abs(found) - half * np.eye(len(omega)))
    return float(np.max(off / np.maximum(1.0, half)))
