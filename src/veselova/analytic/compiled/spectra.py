"""The spectra of many starts, start by start, compiled: what
analytic.spectrum.branch_points_batch does with arrays, to the last bit.

Each function repeats formulas of the one that it names, in the same order; a test compares bits.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.arithmetic.double_double import SPLITTER, DoubleDouble
from veselova.analytic.compiled.compiler import Record, compiled
from veselova.analytic.spectrum import secular_equation
from veselova.analytic.spectrum.branch_points_batch import CONTRADICTION, Spectra

__all__ = [
    "Found",
    "difference",
    "exact_sum",
    "found_in",
    "found_type",
    "rounded_product",
    "set_spectrum",
    "spectra_of",
]

Array = NDArray[np.float64]
Pair: TypeAlias = tuple[float, float]

_WIDE_BRACKET = secular_equation.WIDE_BRACKET
_LEAST_PART = float(secular_equation.LEAST_PART)
_FEW_STEPS, _FINE_STEPS = secular_equation.FEW_STEPS, secular_equation.FINE_STEPS
_FINE_SETTLED = secular_equation.FINE_SETTLED
_ROUNDINGS = secular_equation.ROUNDINGS * float(DOUBLE.epsilon)


class Found(NamedTuple):
    """The arrays of ``Spectra``, high and low parts along a first axis, and room for one start:
    position, velocity, scaled A, weights, a row along m_s, and the squares of q' along these.
    """

    energy: Any
    inverse: Any
    constants: Any
    spheroconic: Any
    increasing: Any
    time_rate: Any
    signs: Any
    known: Any
    position: Any
    velocity: Any
    scaled: Any
    weights: Any
    row: Any
    squares: Any


@compiled()
def exact_sum(a: float, b: float) -> Pair:
    """remainders.exact_sum."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@compiled()
def rounded_product(a: float, b: float) -> Pair:
    """double_double.exact_product."""
    product = a * b
    scaled = SPLITTER * a
    a_high = scaled - (scaled - a)
    scaled = SPLITTER * b
    b_high = scaled - (scaled - b)
    a_low, b_low = a - a_high, b - b_high
    return product, a_low * b_low - (
        ((product - a_high * b_high) - a_low * b_high) - a_high * b_low
    )


@compiled()
def _add(a: Pair, b: Pair) -> Pair:
    """DoubleDouble.__add__."""
    high, error = exact_sum(a[0], b[0])
    low, rest = exact_sum(a[1], b[1])
    error += low
    total = high + error
    error = (error - (total - high)) + rest
    result = total + error
    return result, error - (result - total)


@compiled()
def _subtract(a: Pair, b: Pair) -> Pair:
    """DoubleDouble.__sub__."""
    return _add(a, (-b[0], -b[1]))


@compiled()
def _multiply(a: Pair, b: Pair) -> Pair:
    """DoubleDouble.__mul__."""
    product, error = rounded_product(a[0], b[0])
    error += a[0] * b[1] + a[1] * b[0]
    total = product + error
    return total, error - (total - product)


@compiled()
def _divide(a: Pair, b: Pair) -> Pair:
    """DoubleDouble.__truediv__."""
    first = (a[0] / b[0], 0.0)
    rest = _subtract(a, _multiply(first, b))
    second = (rest[0] / b[0], 0.0)
    third = _subtract(rest, _multiply(second, b))[0] / b[0]
    return _add(_add(first, second), (third, 0.0))


@compiled()
def _root(a: Pair) -> Pair:
    """DoubleDouble.sqrt."""
    first = (math.sqrt(a[0]), 0.0)
    return _add(first, (_subtract(a, _multiply(first, first))[0] / (2 * first[0]), 0.0))


@compiled()
def _at(values: Array, i: int) -> Pair:
    return values[0, i], values[1, i]


@compiled()
def difference(a: Array, i: int, b: Array, j: int) -> float:
    """Return a_i − b_j of numbers of thirty digits, rounded."""
    return _subtract(_at(a, i), _at(b, j))[0]


@compiled()
def _set(values: Array, i: int, number: Pair) -> None:
    values[0, i], values[1, i] = number


@compiled()
def _dot(a: Array, b: Array) -> Pair:
    """Return the total of products."""
    result = _multiply(_at(a, 0), _at(b, 0))
    for i in range(1, a.shape[1]):
        result = _add(result, _multiply(_at(a, i), _at(b, i)))
    return result


@compiled()
def _weighted(scaled: Array, a: Array, b: Array) -> Pair:
    """Return the total of triple products."""
    result = _multiply(_multiply(_at(scaled, 0), _at(a, 0)), _at(b, 0))
    for i in range(1, a.shape[1]):
        term = _multiply(_multiply(_at(scaled, i), _at(a, i)), _at(b, i))
        result = _add(result, term)
    return result


@compiled()
def _project(vector: Array, along: Array, factor: Pair) -> None:
    """Take a multiple of another vector away."""
    for i in range(vector.shape[1]):
        _set(vector, i, _subtract(_at(vector, i), _multiply(_at(along, i), factor)))


@compiled()
def _secular(
    poles: Array, weights: Array, zero: int, from_low: bool, kappa: float, own: float
) -> Pair:
    """secular_equation._scaled_secular of doubles."""
    low, high = _at(poles, zero), _at(poles, zero + 1)
    other = _subtract(high, low)[0] - own
    rest, slope = kappa, 0.0
    for side in range(2):
        is_near = side == 0
        to_end = own if is_near else other
        below = is_near == from_low
        nearest, end, step = (zero, -1, -1) if below else (zero + 1, poles.shape[1], 1)
        for i in range(nearest + step, end, step):
            distance = _subtract(_at(poles, i), _at(poles, nearest))[0] * step
            inverse = 1 / (distance + to_end)
            term = weights[0, i] * inverse
            rest = rest + term if is_near else rest - term
            slope -= term * inverse
    near = weights[0, zero] if from_low else weights[0, zero + 1]
    far = weights[0, zero + 1] if from_low else weights[0, zero]
    value = near * other - far * own + own * other * rest
    return value, (other - own) * rest + own * other * slope - near - far


@compiled()
def _fine_secular(
    poles: Array, weights: Array, zero: int, from_low: bool, kappa: float, own: Pair
) -> Pair:
    """secular_equation._scaled_secular of numbers of thirty digits, rounded."""
    other = _subtract(_subtract(_at(poles, zero + 1), _at(poles, zero)), own)
    rest, slope = (kappa, 0.0), (0.0, 0.0)
    for side in range(2):
        is_near = side == 0
        to_end = own if is_near else other
        below = is_near == from_low
        nearest, end, step = (zero, -1, -1) if below else (zero + 1, poles.shape[1], 1)
        for i in range(nearest + step, end, step):
            distance = _subtract(_at(poles, i), _at(poles, nearest))
            distance = (distance[0] * step, distance[1] * step)
            inverse = _divide((1.0, 0.0), _add(distance, to_end))
            term = _multiply(_at(weights, i), inverse)
            rest = _add(rest, term) if is_near else _subtract(rest, term)
            slope = _subtract(slope, _multiply(term, inverse))
    near = _at(weights, zero if from_low else zero + 1)
    far = _at(weights, zero + 1 if from_low else zero)
    product = _multiply(own, other)
    value = _subtract(_multiply(near, other), _multiply(far, own))
    value = _add(value, _multiply(product, rest))
    derivative = _multiply(_subtract(other, own), rest)
    derivative = _add(derivative, _multiply(product, slope))
    return value[0], _subtract(_subtract(derivative, near), far)[0]


@compiled()
def _zero(poles: Array, weights: Array, zero: int, constant: float) -> tuple[Pair, bool]:
    """secular_equation.zeros_of_many, and its _distances."""
    low, high = _at(poles, zero), _at(poles, zero + 1)
    width = _subtract(high, low)[0]
    from_low = _secular(poles, weights, zero, True, constant, width / 2)[0] <= 0
    kappa = constant if from_low else -constant
    near = weights[0, zero] if from_low else weights[0, zero + 1]
    far = weights[0, zero + 1] if from_low else weights[0, zero]
    least, most = 0.0, width / 2
    own = min(width * near / (near + far), most)
    for step in range(_FEW_STEPS):
        value, derivative = _secular(poles, weights, zero, from_low, kappa, own)
        if value > 0:
            least = own
        elif value <= 0:
            most = own
        new = own - value / derivative if derivative < 0 else own
        slow = step % 4 == 3 and most > _WIDE_BRACKET * least
        if slow or not (derivative < 0 and least <= new <= most and new > 0):
            new = math.sqrt(most * max(least, most * _LEAST_PART))
        if value == 0:
            break
        change = abs(new - own)
        converged = not change > _ROUNDINGS * own
        own = new
        if converged:
            break
    fine = (own, 0.0)
    change = 0.0
    for _ in range(_FINE_STEPS):
        value, derivative = _fine_secular(poles, weights, zero, from_low, kappa, fine)
        change = value / derivative
        fine = _subtract(fine, (change, 0.0))
    converged = abs(change) <= _FINE_SETTLED * fine[0] and 0 < fine[0] < width
    return (_add(low, fine) if from_low else _subtract(high, fine)), converged


@compiled()
def set_spectrum(A: Array, q: Array, q_dot: Array, found: Found, i: int) -> None:
    """Fill the numbers of one start, along sorted axes: Spectra._of_sorted."""
    n = A.shape[1]
    unit = (A[i, n - 1], 0.0)
    position, velocity, scaled, row = found.position, found.velocity, found.scaled, found.row
    inverse, spheroconic = found.inverse[i], found.spheroconic[i]
    for k in range(n):
        _set(position, k, (q[i, k], 0.0))
        _set(velocity, k, (q_dot[i, k], 0.0))
    size = _dot(position, position)
    _project(velocity, position, _divide(_dot(position, velocity), size))
    for k in range(n):
        _set(scaled, k, _divide((A[i, k], 0.0), unit))
        _set(inverse, k, _divide(unit, (A[i, k], 0.0)))
    weight = _weighted(scaled, position, position)
    energy_weight = _divide(_multiply(weight, unit), size)
    length = _root(size)
    # what slides stands in the row
    for k in range(n):
        _set(row, k, _at(velocity, k))
    _project(row, position, _divide(_weighted(scaled, position, velocity), weight))
    speed = _weighted(scaled, row, row)
    rate = _root(speed)
    for k in range(n):
        _set(position, k, _divide(_at(position, k), length))
        _set(velocity, k, _divide(_at(velocity, k), rate))
        found.signs[i, k] = np.sign(position[0, k])
        _set(found.weights, k, _multiply(_at(position, k), _at(position, k)))
    known = True
    for s in range(n - 1):
        zero, converged = _zero(inverse, found.weights, s, 0.0)
        _set(spheroconic, s, zero)
        known &= converged
    for s in range(n - 1):
        for k in range(n):
            gap = _subtract(_at(spheroconic, s), _at(inverse, k))
            _set(row, k, _divide(_at(position, k), gap))
        product = _dot(row, velocity)
        along = _divide(product, _root(_dot(row, row)))
        _set(found.squares, s, _multiply(along, along))
        found.increasing[i, s] = product[0] >= 0
    squares = found.squares
    total = _divide(_at(squares, 0), _at(spheroconic, 0))
    for s in range(1, n - 1):
        total = _add(total, _divide(_at(squares, s), _at(spheroconic, s)))
    known &= abs(_subtract(total, (1.0, 0.0))[0]) < CONTRADICTION
    _set(found.constants[i], 0, (0.0, 0.0))
    for s in range(n - 2):
        zero, converged = _zero(spheroconic, squares, s, 1.0)
        _set(found.constants[i], s + 1, zero)
        known &= converged
    energy = _divide(_multiply(_multiply(speed, unit), energy_weight), (2.0, 0.0))
    for k in range(n):
        energy = _divide(energy, (A[i, k], 0.0))
    found.energy[i], found.time_rate[i], found.known[i] = energy[0], rate[0], known


@compiled()
def _spectra(A: Array, q: Array, q_dot: Array, found: Found) -> None:
    for i in range(A.shape[0]):
        set_spectrum(A, q, q_dot, found, i)


def found_type(n: int, count: int = 1) -> np.dtype[Any]:
    """Return the record of the spectra of so many starts, of which ``found_in`` makes arrays."""
    fields = [
        ("energy", float, (count,)),
        ("inverse", float, (count, 2, n)),
        ("constants", float, (count, 2, n - 1)),
        ("spheroconic", float, (count, 2, n - 1)),
        ("increasing", np.int8, (count, n - 1)),
        ("time_rate", float, (count,)),
        ("signs", float, (count, n)),
        ("known", np.int8, (count,)),
        *((name, float, (2, n)) for name in ("position", "velocity", "scaled", "weights", "row")),
        ("squares", float, (2, n - 1)),
    ]
    return np.dtype(fields, align=True)


@compiled(inline=True)
def found_in(room: Record) -> Found:
    """Return the arrays of a record."""
    return Found(
        room.energy[:],
        room.inverse[:],
        room.constants[:],
        room.spheroconic[:],
        room.increasing[:],
        room.time_rate[:],
        room.signs[:],
        room.known[:],
        room.position[:],
        room.velocity[:],
        room.scaled[:],
        room.weights[:],
        room.row[:],
        room.squares[:],
    )


def spectra_of(A: Array, q: Array, q_dot: Array) -> Spectra:
    """Return what ``Spectra.of`` returns."""
    axes = np.argsort(-A, axis=1, kind="stable")
    A, q, q_dot = (np.ascontiguousarray(np.take_along_axis(x, axes, axis=1)) for x in (A, q, q_dot))
    count, n = A.shape
    record = np.empty(1, found_type(n, count))
    found = Found(*(record[name][0] for name in Found._fields))
    _spectra(A, q, q_dot, found)

    def pairs(values: Array) -> DoubleDouble:
        return DoubleDouble(values[:, 0], values[:, 1])

    return Spectra(
        axes,
        A[:, -1],
        found.energy,
        pairs(found.inverse),
        pairs(found.constants),
        pairs(found.spheroconic),
        found.increasing.view(np.bool_),
        found.time_rate,
        found.signs,
        found.known.view(np.bool_),
    )
