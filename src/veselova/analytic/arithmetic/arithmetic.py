"""The one place that touches precision: the arithmetic in which the closed form is evaluated.

The formulas of this engine are written once, on NumPy arrays, whose entries are float64 or
balls of python-flint.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "DOUBLE",
    "LAST_COEFFICIENTS",
    "Arithmetic",
    "powers",
]

#: Arrays of one arithmetic: float64, or objects that hold its multiprecision numbers.
Values = NDArray[Any]

#: Calibrated: coefficients at the end of a series that show how far it has fallen; _TAIL times
#: their sum is taken for what it leaves out where that is not bounded.
LAST_COEFFICIENTS = 3
_TAIL = 4


class Arithmetic:
    """Elementary functions, constants and small linear algebra: here in IEEE doubles through NumPy
    and SciPy, and in ``Balls`` at any precision. Functions act entrywise on arrays.
    """

    #: Whether numbers carry their own error, to which bounds of every truncation are to be added.
    certified: bool = False

    digits: int = 15
    epsilon: Any = float(np.finfo(float).eps)
    pi: Any = math.pi
    sqrt: Callable[[Any], Any] = staticmethod(np.sqrt)
    exp: Callable[[Any], Any] = staticmethod(np.exp)
    log: Callable[[Any], Any] = staticmethod(np.log)
    sin: Callable[[Any], Any] = staticmethod(np.sin)
    cos: Callable[[Any], Any] = staticmethod(np.cos)
    atan: Callable[[Any], Any] = staticmethod(np.arctan)
    floor: Callable[[Any], Any] = staticmethod(np.floor)

    def number(self, value: Any) -> Any:
        """Return one number (Fraction, float, or a number of another arithmetic), rounded to this
        precision.
        """
        return float(value)

    def array(self, values: Any) -> Values:
        """Return an array of numbers of this arithmetic from nested sequences or an array of any
        other.
        """
        return np.array(values, dtype=np.float64)

    def inverse(self, matrix: Values) -> Values:
        """Return the inverse of a square matrix."""
        return np.asarray(np.linalg.inv(matrix))

    def determinant(self, matrix: Values) -> Any:
        """Return the determinant of a square matrix."""
        return np.linalg.det(matrix)

    def product(self, a: Values, b: Values) -> Values:
        """Return the matrix product."""
        return np.asarray(a @ b)

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

    def multiples(self, psi: Values, count: int) -> tuple[Values, Values]:
        """Return cos mψ and sin mψ, m = 0…count−1, with a last axis for m."""
        found = np.moveaxis(powers(psi, max(count - 1, 1))[:count], 0, -1)
        return found.real, found.imag

    def cosine_series(self, values: Values) -> Values:
        """Return the c_km with Σ_m c_km cos mψ = value at the N ``nodes`` ψ, shape (..., K, N) as
        values.
        """
        from scipy.fft import dct  # slow to load, and most motions do without

        coefficients = dct(values, type=2) / values.shape[-1]
        coefficients[..., 0] /= 2
        return np.asarray(coefficients)

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


#: The double-precision arithmetic; it has no state, so one serves all.
DOUBLE = Arithmetic()


def powers(angles: Values, count: int) -> Values:
    """Return e^{imφ}, m = 0 … count, for angles of any shape, m first.

    By doubling: the error is about mε, that of one rounding of the angle, and a product costs a
    tenth of a sine and a cosine.
    """
    result = np.empty((count + 1, *angles.shape), dtype=np.complex128)
    result[0] = 1
    np.cos(angles, out=result.real[1])
    np.sin(angles, out=result.imag[1])
    known = 1
    while known < count:
        more = min(known, count - known)
        np.multiply(result[1 : more + 1], result[known], out=result[known + 1 : known + more + 1])
        known += more
    return result
