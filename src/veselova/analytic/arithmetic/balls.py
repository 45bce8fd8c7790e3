"""Ball arithmetic: every number is an interval, midpoint ± radius, that holds the exact value.

The numbers are Arb's, through python-flint, whose precision is one global of the process. Work in
balls goes inside ``with balls(digits):``, which sets the precision, keeps other threads out, and
nests.

Fourier sums are products of matrices. Modes m = (m', k) with the same leading entries m' are one
row: Σ_k c_k e^{2πi k z_g} of all rows is one product, and so are the Σ_j w_j e^{2πi m'·z_j} e^{2πi
k z_jg} of all k.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from contextlib import AbstractContextManager
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache, reduce
from typing import Any, Literal

import flint
import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import checkpoint, iterate
from veselova.mechanics.core.decimals import precision

__all__ = [
    "LAST_COEFFICIENTS",
    "Balls",
    "SumsOverPoints",
    "Values",
    "balls",
    "doublings",
    "interval_step",
    "is_shown",
    "least_square",
    "sums_over_modes",
]

Integers = NDArray[np.int64]

#: Arrays of balls.
Values = NDArray[Any]

#: Calibrated: coefficients at the end of a series that show how far it has fallen; _TAIL times
#: their sum is taken for what it leaves out where that is not bounded.
LAST_COEFFICIENTS = 3
_TAIL = 4

#: Derived: guard digits within the working precision.
_GUARD = 6

#: Budget: entries of an array that are computed between two checkpoints.
_AT_ONCE = 1000

#: Budget: exponentials of Fourier sums in memory at once, and rows of modes between two
#: checkpoints.
_EXPONENTIALS = 1_000_000
_ROWS = 30

#: Derived: Newton's steps double the digits from those of a double, but for what they lose.
_FIRST_DIGITS = 12
_LOST_DIGITS = 2

#: Derived: part of the slope at an approximate root that is certain next to it.
_SLOPE = 0.5


def _entrywise(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function of every entry, with checkpoints: at many digits an array takes seconds."""
    of_entries = np.frompyfunc(function, 1, 1)

    def apply(values: Any) -> Any:
        if isinstance(values, flint.arb):
            return function(values)
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


class Balls:
    """Real balls with at least the given number of decimal digits, in arrays: functions act
    entrywise, and that of a ball holds all its values there.

    certified: whether bounds of every truncation are to be added to radii
    """

    exp = staticmethod(_method("exp"))
    log = staticmethod(_method("log"))
    sin = staticmethod(_method("sin"))
    cos = staticmethod(_method("cos"))
    atan = staticmethod(_method("atan"))
    #: Radicands are known to be nonnegative; their balls may reach below zero.
    sqrt = staticmethod(_entrywise(lambda x: flint.arb(x).nonnegative_part().sqrt()))
    #: The floor of the midpoint: a choice of branch, made the same way wherever the ball lies.
    floor = staticmethod(np.frompyfunc(lambda x: flint.arb(x).mid().floor(), 1, 1))
    #: The exact midpoints, and exact lower bounds of positive values and upper ones of all sizes.
    midpoints = staticmethod(np.frompyfunc(lambda x: flint.arb(x).mid(), 1, 1))
    at_least = staticmethod(np.frompyfunc(lambda x: flint.arb(x).lower(), 1, 1))
    upper_bound = staticmethod(np.frompyfunc(lambda x: flint.arb(x).abs_upper(), 1, 1))
    #: Balls around zero that hold the values; which balls lie in the interior of their partners.
    zero_ball = staticmethod(np.frompyfunc(lambda x: flint.arb(0, flint.arb(x).abs_upper()), 1, 1))
    contained_in = staticmethod(np.frompyfunc(lambda x, y: y.contains_interior(x), 2, 1))

    def __init__(self, digits: int, certified: bool) -> None:
        self.digits = digits
        #: The natural logarithm of the precision.
        self.nats = digits * math.log(10)
        self.certified = certified
        self._bits = math.ceil((digits + _GUARD) * math.log2(10))
        self._entered: list[AbstractContextManager[None]] = []
        with self:
            self.pi: Any = flint.arb.pi()
            self.epsilon: Any = flint.arb(10) ** -digits

    def __enter__(self) -> Balls:
        block = precision(self._bits)
        block.__enter__()
        self._entered.append(block)
        return self

    def __exit__(self, *_: object) -> None:
        self._entered.pop().__exit__(None, None, None)

    def number(self, value: Any) -> Any:
        """Return a ball that holds a rational or a decimal, that of a float exactly, or the given
        ball.
        """
        if isinstance(value, (Fraction, Decimal)):
            return flint.arb(flint.fmpq(*value.as_integer_ratio()))
        if isinstance(value, np.generic):
            value = value.item()
        return flint.arb(value)

    def array(self, values: Any) -> Values:
        """Return an array of balls from nested sequences or an array of numbers of any kind."""
        given = np.array(values, dtype=object)
        result = np.empty(given.size, dtype=object)
        result[:] = [self.number(value) for value in given.ravel().tolist()]
        return result.reshape(given.shape)

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
        return values + self.zero_ball(bound)

    def at(self, digits: int) -> Balls:
        """Return the ball arithmetic of other digits."""
        return balls(digits, self.certified)

    def nodes(self, count: int) -> Values:
        """Return the midpoints π(2i+1)/2N of (0, π): with them the trapezoidal rule over a full
        period, by symmetry.
        """
        return np.asarray((2 * np.arange(count) + 1) * self.pi / (2 * count))

    def multiples(self, psi: Values, count: int) -> tuple[Values, Values]:
        """Return cos mψ and sin mψ, m = 0…count−1, with a last axis for m: powers of e^{iψ}."""
        first = np.asarray(_complex(self.cos(psi), self.sin(psi))).reshape(-1, 1)
        cosines, sines = self.exponentials(np.arange(count)[:, None], first)
        return cosines.T.reshape(*psi.shape, count), sines.T.reshape(*psi.shape, count)

    def cosine_series(self, values: Values) -> Values:
        """Return the c_km with Σ_m c_km cos mψ = value at the N ``nodes`` ψ, shape (..., K, N) as
        values.
        """
        count = values.shape[-1]
        # cos m(2j+1)x, x = π/2N, is the real part of e^{−imx} times a root of unity of order 2N
        shifts = self.turns(self.array(list(range(count))) / (-4 * count))
        result = np.empty((values.size // count, count), dtype=object)
        for row, out in zip(values.reshape(-1, count), result, strict=True):
            checkpoint()
            transform = flint.acb.dft([*row.tolist(), *[0] * count])[:count]
            out[:] = _real(np.array(transform, dtype=object) * shifts)
        result = result * 2 / count
        result[:, 0] = result[:, 0] / 2
        return np.asarray(result.reshape(values.shape))

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
_turn = _entrywise(lambda x: flint.acb(x.cos_pi(), x.sin_pi()))
_conjugate = np.frompyfunc(flint.acb.conjugate, 1, 1)
_real = np.frompyfunc(operator.attrgetter("real"), 1, 1)
_imaginary = np.frompyfunc(operator.attrgetter("imag"), 1, 1)


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
    return np.asarray(
        reduce(operator.mul, factors or [np.full((len(exponents), len(bases)), flint.acb(1))])
    )


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


def doublings(digits: int) -> list[int]:
    """Return the digits of Newton's steps from a root in doubles to the one before the last."""
    half = math.ceil(digits / 2) + _LOST_DIGITS
    return [*doublings(half), half] if half > _FIRST_DIGITS else []


def interval_step(
    value: Values, slope: Values, bend: Any, arithmetic: Balls
) -> tuple[Values, Values]:
    """Return what takes approximate roots to balls that hold them, and balls around zero that hold
    the distances.

    ``bend``: how much slopes change with the root, at most. Of a slope half has to be certain as
    far as a root may be, which is shown where the distance times the bend is below the other half.
    """
    reach = arithmetic.zero_ball(value / (_SLOPE * slope))
    return np.asarray(value / arithmetic.add_error(slope, reach * bend)), np.asarray(reach)


def is_shown(reach: Values, slope: Values, bend: Any, arithmetic: Balls) -> bool:
    """Return whether half of the slopes is certain as far as that."""
    rest = arithmetic.zero_ball((1 - _SLOPE) * arithmetic.at_least(slope))
    return bool(arithmetic.contained_in(reach * bend, rest).all())


def least_square(rows: list[list[int]]) -> int:
    """Return the least square of a length in a reduced basis of the lattice that g integer rows
    span: at most 2^(g−1) times that of any vector.
    """
    reduced = flint.fmpz_mat(rows).lll().tolist()
    return min(sum(int(x) ** 2 for x in row) for row in reduced)


def sums_over_modes(
    kind: Literal["cosines", "sines"],
    modes: Integers,
    coefficients: Values,
    turns: Values,
    arithmetic: Any,
) -> Values:
    """Return Σ c_m cos 2πm·z or Σ c_m sin 2πm·z at turns e^{2πiz} (N, g), shape (N,), for modes (M,
    g) and coefficients (M,).
    """
    xp = arithmetic
    rows, which = np.unique(modes[:, :-1], axis=0, return_inverse=True)
    last = modes[:, -1]
    highest = int(np.max(np.abs(last), initial=0))
    # c_k and c_−k go with the same cosine, and with opposite sines
    even = np.full((len(rows), highest + 1), xp.number(0), dtype=object)
    odd = even.copy()
    np.add.at(even, (which.ravel(), np.abs(last)), coefficients)
    np.add.at(odd, (which.ravel(), np.abs(last)), coefficients * np.sign(last))
    result = np.full(len(turns), xp.number(0), dtype=object)
    step = max(1, _EXPONENTIALS // max(1, len(rows) + highest))
    for first in iterate(range(0, len(turns) if len(modes) else 0, step)):
        points = turns[first : first + step]
        cosines, sines = xp.exponentials(np.arange(highest + 1)[:, None], points[:, -1:])
        real, imaginary = xp.product(even, cosines), xp.product(odd, sines)
        x, y = xp.exponentials(rows, points[:, :-1])
        parts = x * real - y * imaginary if kind == "cosines" else y * real + x * imaginary
        result[first : first + step] = np.sum(parts, axis=0)
    return result


class SumsOverPoints:
    """Sums over turns e^{2πiz} (J, g) with weights (K, J), balls, for modes of entries up to
    ``highest``.
    """

    def __init__(self, turns: Values, weights: Values, highest: int, arithmetic: Any) -> None:
        self._xp, self._weights, self._leading = arithmetic, weights, turns[:, :-1]
        last = arithmetic.exponentials(np.arange(highest + 1)[:, None], turns[:, -1:])
        self._last = tuple(part.T for part in last)
        #: Σ_j w_kj cos(m'·z_j) cos(k z_jg) and the same with sines, (K, highest+1) each, by m'.
        self._rows: dict[tuple[int, ...], tuple[Values, Values]] = {}

    def cosines(self, modes: Integers) -> Values:
        """Return Σ_j w_kj cos 2πm·z_j for modes (M, g), shape (M, K)."""
        leading = list(map(tuple, modes[:, :-1].tolist()))
        missing = [row for row in dict.fromkeys(leading) if row not in self._rows]
        for first in iterate(range(0, len(missing), _ROWS)):
            self._add(missing[first : first + _ROWS])
        result = np.empty((len(modes), len(self._weights)), dtype=object)
        for place, (row, k) in enumerate(zip(leading, modes[:, -1].tolist(), strict=True)):
            even, odd = self._rows[row]
            result[place] = even[:, k] - odd[:, k] if k >= 0 else even[:, -k] + odd[:, -k]
        return result

    def _add(self, rows: list[tuple[int, ...]]) -> None:
        """Form the sums of some rows."""
        modes = np.array(rows, dtype=np.int64).reshape(len(rows), -1)
        shape = (len(rows), *self._weights.shape)
        sums = []
        for part, last in zip(self._xp.exponentials(modes, self._leading), self._last, strict=True):
            weighted = (part[:, None, :] * self._weights).reshape(-1, shape[2])
            sums.append(self._xp.product(weighted, last).reshape(*shape[:2], -1))
        self._rows.update(zip(rows, zip(*sums, strict=True), strict=True))
