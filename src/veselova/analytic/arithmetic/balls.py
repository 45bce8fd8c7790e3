"""Ball arithmetic: every number is an interval, midpoint ± radius, that holds the exact value.

The numbers are Arb's, through python-flint, whose precision is one global of the process. Work in
balls goes inside ``with balls(digits):``, which sets the precision, keeps other threads out, and
nests.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache, partial, reduce
from typing import Any, ClassVar

import flint
import numpy as np

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.enclosures import decimal_pair, precision
from veselova.tunings import MANY_NODES

__all__ = ["Balls", "balls", "least_square"]

#: Derived: guard digits within the working precision.
_GUARD = 6

#: Budget: entries of an array that are computed between two checkpoints.
_AT_ONCE = 1000


def _entrywise(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function of every entry, with checkpoints: at many digits an array takes seconds."""
    of_entries = np.frompyfunc(function, 1, 1)

    def apply(values: Any) -> Any:
        checkpoint()
        if np.size(values) <= _AT_ONCE:
            return of_entries(values)
        flat, result = np.ravel(values), np.empty(np.size(values), dtype=object)
        for first in range(0, flat.size, _AT_ONCE):
            checkpoint()
            result[first : first + _AT_ONCE] = of_entries(flat[first : first + _AT_ONCE])
        return result.reshape(np.shape(values))

    return apply


def _method(name: str) -> Callable[[Any], Any]:
    return _entrywise(lambda x: getattr(flint.arb(x), name)())


class Balls(Arithmetic):
    """Real balls with at least the given number of decimal digits; a function of a ball holds all
    its values there.
    """

    has_radii: ClassVar[bool] = True
    exp = staticmethod(_method("exp"))
    sin = staticmethod(_method("sin"))
    cos = staticmethod(_method("cos"))
    atan = staticmethod(_method("atan"))
    #: Radicands are known to be nonnegative; their balls may reach below zero.
    sqrt = staticmethod(_entrywise(lambda x: flint.arb(x).nonnegative_part().sqrt()))
    #: The floor of the midpoint: a choice of branch, made the same way wherever the ball lies.
    floor = staticmethod(np.frompyfunc(lambda x: flint.arb(x).mid().floor(), 1, 1))

    def __init__(self, digits: int, certified: bool) -> None:
        self.digits = digits
        self.certified = certified
        self._bits = math.ceil((digits + _GUARD) * math.log2(10))
        self._entered: list[AbstractContextManager[None]] = []
        with self:
            self.pi = flint.arb.pi()
            self.epsilon = flint.arb(10) ** -digits

    def __enter__(self) -> Balls:
        block = precision(self._bits)
        block.__enter__()
        self._entered.append(block)
        return self

    def __exit__(self, *_: object) -> None:
        self._entered.pop().__exit__(None, None, None)

    def number(self, value: Any) -> Any:
        """Return a ball that holds a rational or a decimal, that of a float or mpmath number
        exactly, or the given ball.
        """
        if isinstance(value, (Fraction, Decimal)):
            return flint.arb(flint.fmpq(*value.as_integer_ratio()))
        if isinstance(value, np.generic):
            value = value.item()
        return flint.arb(value)

    i: ClassVar[Any] = flint.acb(0, 1)

    def complex_number(self, real: Fraction, imaginary: Fraction) -> Any:
        """Return a complex ball that holds a number with rational parts."""
        return flint.acb(self.number(real), self.number(imaginary))

    def complex_array(self, real: Values, imaginary: Values) -> Values:
        """Return complex balls of real and imaginary parts."""
        return np.asarray(_complex(real, imaginary), dtype=object)

    @staticmethod
    def complex_root(x: Any, analytic: bool) -> Any:
        """Return the root with the positive real part; where it is to be ``analytic`` and may not
        be, it is not finite.
        """
        return x.sqrt(analytic=analytic)

    @staticmethod
    def parts(values: Values) -> tuple[Values, Values]:
        """Return the real and imaginary parts of complex balls."""
        return np.asarray(_real(values)), np.asarray(_imaginary(values))

    @staticmethod
    def integrals(integrands: Sequence[Callable[[Any, bool], Any]], end: Any) -> Values:
        """Return ∫ of functions from 0 straight to a complex ball, enclosed.

        They take (point, analytic); where the second is true they are not finite unless they are
        analytic on the ball.
        """

        def checked(integrand: Callable[[Any, bool], Any], point: Any, analytic: bool) -> Any:
            checkpoint()
            return integrand(point, analytic)

        zero = flint.acb(0)
        return np.array([flint.acb.integral(partial(checked, f), zero, end) for f in integrands])

    def quarter_period(self, complement: Any) -> Any:
        """Return K(k) for k'² = ``complement``, by the arithmetic–geometric mean."""
        return self.pi / 2 / flint.arb(1).agm(self.sqrt(complement))

    def inverse(self, matrix: Values) -> Values:
        """Return the inverse of a square matrix; raises ZeroDivisionError where the balls hold a
        singular one.
        """
        checkpoint()
        return self._array(_matrix(matrix).inv())

    def determinant(self, matrix: Values) -> Any:
        """Return the determinant of a square matrix."""
        checkpoint()
        return _matrix(matrix).det()

    def product(self, a: Values, b: Values) -> Values:
        """Return the matrix product."""
        checkpoint()
        return self._array(_matrix(a) * _matrix(b))

    def add_error(self, values: Any, bound: Any) -> Any:
        """Return the balls with their radii enlarged by |bound|."""
        return values + _zero_ball(bound)

    def at(self, digits: int) -> Balls:
        """Return the ball arithmetic of other digits."""
        return balls(digits, self.certified)

    def zero_ball(self, values: Values) -> Values:
        """Return balls around zero that hold the values."""
        return np.asarray(_zero_ball(values))

    def upper_bound(self, values: Values) -> Values:
        """Return exact upper bounds of |values|."""
        return np.asarray(_upper(values))

    def at_least(self, values: Values) -> Values:
        """Return exact lower bounds of positive values."""
        return np.asarray(_lower(values))

    def contained_in(self, inner: Values, outer: Values) -> Values:
        """Return which balls lie in the interior of their partners."""
        return np.asarray(_contained(inner, outer), dtype=bool)

    def midpoints(self, values: Values) -> Values:
        """Return the exact midpoints."""
        return np.asarray(_midpoint(values))

    def decimals(self, values: Values, digits: int) -> tuple[Values, Values]:
        """Return (midpoints rounded to so many significant digits, radii that cover the rounding),
        arrays of Decimal.
        """
        return decimal_pair(values, digits)

    def multiples(self, psi: Values, count: int) -> tuple[Values, Values]:
        """Return cos mψ and sin mψ, m = 0…count−1, with a last axis for m: powers of e^{iψ}."""
        first = self.complex_array(self.cos(psi), self.sin(psi)).reshape(-1, 1)
        cosines, sines = self.exponentials(np.arange(count)[:, None], first)
        return cosines.T.reshape(*psi.shape, count), sines.T.reshape(*psi.shape, count)

    def cosine_series(self, values: Values) -> Values:
        """Return the c_km with Σ_m c_km cos mψ = value at the N ``nodes`` ψ, shape (..., K, N) as
        values.

        Many nodes take one product of polynomials a row (Bluestein): w^{m(2j+1)} = w^{m²+m} w^{j²}
        w^{−(m−j)²}, w = e^{iπ/2N}.
        """
        count = values.shape[-1]
        if count < MANY_NODES:
            return super().cosine_series(values)
        order = np.arange(count)
        roots = self.turns(self.array(list(range(4 * count))) / (4 * count))
        chirp = roots[order**2 % (4 * count)]
        ends = roots[(order**2 + order) % (4 * count)]
        kernel = flint.acb_poly(_conjugate(chirp)[np.abs(np.arange(1 - count, count))].tolist())
        result = np.empty((values.size // count, count), dtype=object)
        for row, out in zip(values.reshape(-1, count), result, strict=True):
            checkpoint()
            product = flint.acb_poly((row * chirp).tolist()) * kernel
            out[:] = _real(np.array([product[m + count - 1] for m in order], dtype=object) * ends)
        result = result * 2 / count
        result[:, 0] = result[:, 0] / 2
        return np.asarray(result.reshape(values.shape))

    def turns(self, z: Values) -> Values:
        """Return e^{2πiz}, complex balls."""
        return np.asarray(_turn(2 * z))

    def exponentials(self, modes: Values, turns: Values) -> tuple[Values, Values]:
        """Return cos 2πm·z and sin 2πm·z, shape (M, N), for modes (M, g) and turns (N, g) =
        e^{2πiz}.

        A power comes from up to log₂|m| products in a row, each of which loses up to half a bit.
        """
        products = _products(modes, turns)
        return np.asarray(_real(products)), np.asarray(_imaginary(products))

    @staticmethod
    def _array(matrix: Any) -> Values:
        entries = np.fromiter(matrix.entries(), dtype=object, count=matrix.nrows() * matrix.ncols())
        return entries.reshape(matrix.nrows(), matrix.ncols())


_complex = np.frompyfunc(flint.acb, 2, 1)
_lower = np.frompyfunc(lambda x: flint.arb(x).lower(), 1, 1)
_contained = np.frompyfunc(lambda x, y: y.contains_interior(x), 2, 1)
_upper = np.frompyfunc(lambda x: flint.arb(x).abs_upper(), 1, 1)
_turn = _entrywise(lambda x: flint.acb(x.cos_pi(), x.sin_pi()))
_conjugate = np.frompyfunc(flint.acb.conjugate, 1, 1)
_real = np.frompyfunc(operator.attrgetter("real"), 1, 1)
_imaginary = np.frompyfunc(operator.attrgetter("imag"), 1, 1)
_zero_ball = np.frompyfunc(lambda bound: flint.arb(0, flint.arb(bound).abs_upper()), 1, 1)
_midpoint = np.frompyfunc(lambda x: flint.arb(x).mid(), 1, 1)


def _products(exponents: Values, bases: Values) -> Values:
    """Return Π_k w_k^{m_k}, shape (M, N), for exponents (M, g) and bases (N, g) of modulus one; w^m
    is w^{⌊m/2⌋} times the rest.
    """
    factors = []
    for column, base in zip(exponents.T, bases.T, strict=True):
        powers = [1 + 0 * base, base]
        for m in range(2, int(np.max(np.abs(column), initial=0)) + 1):
            checkpoint()
            powers.append(powers[m // 2] * powers[m - m // 2])
        # Inverses stand behind the powers, w⁻¹ last: a negative place counts from there.
        powers += [_conjugate(power) for power in powers[-int(np.min(column, initial=0)) : 0 : -1]]
        factors.append(np.stack(powers)[column.astype(np.int64)])
    return np.asarray(reduce(operator.mul, factors))


def _matrix(values: Values) -> Any:
    return flint.arb_mat(values.shape[0], values.shape[1], values.ravel().tolist())


@lru_cache(maxsize=64)
def balls(digits: int, certified: bool = True) -> Balls:
    """Return the ball arithmetic of the given digits; use it as a context manager around all work
    in it.

    ``certified``: truncations are bounded, otherwise estimated from the last terms of each series,
    which takes half of them.
    """
    return Balls(digits, certified)


def least_square(rows: list[list[int]]) -> int:
    """Return the least square of a length in a reduced basis of the lattice that g integer rows
    span: at most 2^(g−1) times that of any vector.
    """
    reduced = flint.fmpz_mat(rows).lll().tolist()
    return min(sum(int(x) ** 2 for x in row) for row in reduced)
