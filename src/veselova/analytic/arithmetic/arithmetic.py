"""The one place that touches precision: the arithmetic in which the closed form is evaluated.

The formulas of this engine are written once, on NumPy arrays. In ``Double`` the entries are
float64; in ``Balls`` they are those of python-flint.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache, lru_cache, partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.trigonometric_sums import powers
from veselova.mechanics.core.errors import Unsolved

__all__ = [
    "DOUBLE",
    "LAST_COEFFICIENTS",
    "Arithmetic",
    "Double",
]

#: Arrays of one arithmetic: float64, or objects that hold its multiprecision numbers.
Values = NDArray[Any]

#: A sum of waves as a function of angles.
Sums = Callable[[Values], Values]

#: Budget: tables of cosine series in doubles that are kept, and the size of the largest: 32 MB at
#: most.
_MOST_KEPT = 64
_LARGEST_KEPT = 256

#: Calibrated: coefficients at the end of a series that show how far it has fallen; _TAIL times
#: their sum is taken for what it leaves out where that is not bounded.
LAST_COEFFICIENTS = 3
_TAIL = 4

#: Method: nodes of Gauss' rule on a part of a path.
_NODES = 32

#: Derived: the relative change at which a rule with twice as many nodes has converged.
_QUADRATURE = 1e-13

#: Budget: parts of a path. Beside branch points at a relative distance of d it has some log₂(1/d).
_MOST_PARTS = 2000


class Arithmetic(ABC):
    """Elementary functions, constants and small linear algebra at one precision. Functions act
    entrywise on arrays.
    """

    #: Whether numbers carry their own error, so that every truncation has to be added to it;
    #: whether that has to be a bound.
    has_radii: ClassVar[bool] = False
    certified: bool = False

    digits: int
    epsilon: Any
    pi: Any
    sqrt: Callable[[Any], Any]
    exp: Callable[[Any], Any]
    sin: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    atan: Callable[[Any], Any]
    floor: Callable[[Any], Any]
    #: The root with the positive real part of a complex number; whether it is to be analytic.
    complex_root: Callable[[Any, bool], Any]
    #: i, exactly.
    i: ClassVar[Any]

    @abstractmethod
    def number(self, value: Any) -> Any:
        """Return one number (Fraction, float, or a number of another arithmetic), rounded to this
        precision.
        """

    def array(self, values: Any) -> Values:
        """Return an array of numbers of this arithmetic from nested sequences or an array of any
        other.
        """
        given = np.array(values, dtype=object)
        result = np.empty(given.size, dtype=object)
        result[:] = [self.number(value) for value in given.ravel().tolist()]
        return result.reshape(given.shape)

    def complex_array(self, real: Values, imaginary: Values) -> Values:
        """Return complex numbers of real and imaginary parts."""
        return np.asarray(real + self.i * imaginary)

    @abstractmethod
    def inverse(self, matrix: Values) -> Values:
        """Return the inverse of a square matrix."""

    @abstractmethod
    def determinant(self, matrix: Values) -> Any:
        """Return the determinant of a square matrix."""

    @property
    def nats(self) -> float:
        """Return the natural logarithm of the precision, 10^digits."""
        return self.digits * math.log(10)

    def add_error(self, values: Any, bound: Any) -> Any:
        """Return the values with a truncation of at most ``bound`` noted in them; here nothing
        keeps such notes.
        """
        return values

    def nodes(self, count: int) -> Values:
        """Return the midpoints π(2i+1)/2N of (0, π): with them the trapezoidal rule over a full
        period, by symmetry.
        """
        return np.asarray((2 * np.arange(count) + 1) * self.pi / (2 * count))

    def sine_sums(self, coefficients: Values) -> Sums:
        """Return the function ψ (N, g) ↦ Σ_s Σ_m c_smk sin(mψ_s), m = 1…M, shape (N, K), for
        coefficients (g, M, K).
        """
        flat = coefficients.reshape(-1, coefficients.shape[2])
        count = coefficients.shape[1]

        def sums(psi: Values) -> Values:
            sines = self.multiples(psi, count + 1)[1][..., 1:]
            return self.product(sines.reshape(psi.shape[0], -1), flat)

        return sums

    def cosine_sums(self, coefficients: Values) -> Sums:
        """Return the function ψ (N, g) ↦ Σ_m c_smk cos(mψ_s), m = 0…M−1, shape (N, K, g), for
        coefficients (g, M, K).
        """

        def sums(psi: Values) -> Values:
            cosines = self.multiples(psi, coefficients.shape[1])[0]
            parts = [self.product(cosines[:, s], coefficients[s]) for s in range(psi.shape[1])]
            return np.stack(parts, axis=2)

        return sums

    @abstractmethod
    def multiples(self, psi: Values, count: int) -> tuple[Values, Values]:
        """Return cos mψ and sin mψ, m = 0…count−1, with a last axis for m."""

    def cosine_series(self, values: Values) -> Values:
        """Return the c_km with Σ_m c_km cos mψ = value at the N ``nodes`` ψ, shape (..., K, N) as
        values.
        """
        count = values.shape[-1]
        coefficients = self.product(values, self._exponentials(count)) * 2 / count
        coefficients[..., 0] = np.sum(values, axis=-1) / count
        return np.asarray(coefficients)

    def _exponentials(self, count: int) -> Values:
        """Return cos mψ at the N nodes, shape (N, N)."""
        table = self.cos(np.arange(4 * count) * (self.pi / (2 * count)))
        return np.asarray(table[np.outer(2 * np.arange(count) + 1, np.arange(count)) % (4 * count)])

    @staticmethod
    def bound_tail(largest: Any, decay: Any, count: int) -> Any:
        """Return 6 M ρ^N/(1−ρ), what a cosine series leaves out after N coefficients, and the
        aliases in those, at any real ψ.

        M bounds the function in a strip about the real axis, ρ = e^(−half its width): there |c_m| ≤
        2Mρ^m.
        """
        return 6 * largest * decay**count / (1 - decay)

    @staticmethod
    def estimate_tail(series: Values) -> Values:
        """Return what cosine series leave out judging by their last coefficients, shape (K,) for
        (K, N).
        """
        return np.asarray(_TAIL * np.sum(np.abs(series[:, -LAST_COEFFICIENTS:]), axis=1))

    def product(self, a: Values, b: Values) -> Values:
        """Return the matrix product."""
        return np.asarray(a @ b)

    @abstractmethod
    def quarter_period(self, complement: Any) -> Any:
        """Return K(k) for k'² = ``complement``."""


class Double(Arithmetic):
    """IEEE double precision through NumPy and SciPy."""

    digits = 15
    epsilon = float(np.finfo(float).eps)
    pi = float(np.pi)
    sqrt = staticmethod(np.sqrt)
    exp = staticmethod(np.exp)
    sin = staticmethod(np.sin)
    cos = staticmethod(np.cos)
    atan = staticmethod(np.arctan)
    floor = staticmethod(np.floor)
    i = 1j

    def _exponentials(self, count: int) -> Values:
        return _kept_waves(count) if count <= _LARGEST_KEPT else super()._exponentials(count)

    def number(self, value: Any) -> float:
        """Return the nearest double."""
        return float(value)

    def array(self, values: Any) -> Values:
        """Return a float64 array, entries correctly rounded."""
        return np.array(values, dtype=np.float64)

    def complex_number(self, real: Fraction, imaginary: Fraction) -> complex:
        """Return the nearest complex double; raises OverflowError beyond doubles."""
        return complex(float(real), float(imaginary))

    @staticmethod
    def complex_root(x: Any, analytic: bool) -> Any:
        """Return the root with the positive real part."""
        return np.sqrt(x)

    def integrals(self, integrands: Sequence[Callable[[Any, bool], Any]], end: complex) -> Values:
        """Return ∫ of functions from 0 straight to ``end``, by Gauss' rule on parts that are halved
        until both halves give what the whole gave; raises Unsolved (``narrow-gap``) beyond
        _MOST_PARTS.
        """
        nodes, weights = _gauss()

        def rule(start: complex, stop: complex) -> tuple[Values, Values]:
            x = start + (stop - start) * nodes
            values = np.stack([integrand(x, False) for integrand in integrands])
            terms = values * (weights * (stop - start))
            return np.sum(terms, axis=1), np.sum(np.abs(terms), axis=1)

        total, remaining = np.zeros(len(integrands), dtype=complex), [(0j, end, rule(0j, end)[0])]
        for _ in range(_MOST_PARTS):
            if not remaining:
                return total
            start, stop, whole = remaining.pop()
            middle = (start + stop) / 2
            (left, left_size), (right, right_size) = rule(start, middle), rule(middle, stop)
            if np.all(np.abs(left + right - whole) <= _QUADRATURE * (left_size + right_size)):
                total += left + right
            else:
                remaining += [(middle, stop, right), (start, middle, left)]
        raise Unsolved(
            "narrow-gap", "the path to a point passes too near a branch point for its quadrature"
        )

    def quarter_period(self, complement: Any) -> Any:
        """Return K(k) for k'² = ``complement``, entrywise."""
        from scipy.special import ellipkm1  # slow to load, and most motions do without

        return ellipkm1(complement)

    def multiples(self, psi: Values, count: int) -> tuple[Values, Values]:
        """Return cos mψ and sin mψ, m = 0…count−1, with a last axis for m."""
        found = np.moveaxis(powers(psi, max(count - 1, 1))[:count], 0, -1)
        return found.real, found.imag

    def inverse(self, matrix: Values) -> Values:
        """Return the inverse of a square matrix, or of each of a stack."""
        return np.asarray(np.linalg.inv(matrix))

    def determinant(self, matrix: Values) -> Any:
        """Return the determinant of a square matrix, or of each of a stack."""
        return np.linalg.det(matrix)


#: The double-precision arithmetic; it has no state, so one serves all.
DOUBLE = Double()


@cache
def _gauss() -> tuple[Values, Values]:
    """Return nodes and weights of Gauss' rule on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return (nodes + 1) / 2, weights / 2


_kept_waves = lru_cache(_MOST_KEPT)(partial(Arithmetic._exponentials, DOUBLE))
