"""The time map of one torus of genus one or two, compiled: what analytic.time_map.mode_tables does
with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.compiled.compiler import compiled
from veselova.analytic.compiled.linear_equations import largest
from veselova.analytic.time_map import mode_tables
from veselova.analytic.time_map.fourier import LEAST_SLOPE
from veselova.analytic.time_map.fourier_modes import SLOW

__all__ = [
    "Modes",
    "error",
    "excess",
    "find_tau1",
    "set_modes",
    "set_ranges",
]

Array = NDArray[np.float64]

#: Derived: the rounding of a double, and 2π.
_EPSILON = float(DOUBLE.epsilon)
_TURN = 2 * math.pi

_COARSE, _LEAST_SLOPE = mode_tables.COARSE, LEAST_SLOPE
_MOST_STEPS, _STANDING, _SLOW = mode_tables.MOST_STEPS, mode_tables.STANDING, SLOW

#: Derived: cycles of the fastest phase up to which a step of Newton's method is short, so that two
#: slopes make a curvature, and what the square of a last step may be, times a short one before it.
_NEAR = 0.02
_NEGLIGIBLE = 1e-18


class Modes(NamedTuple):
    """The modes of one torus in a box (M+1, 2M+1), of genus one (M+1, 1), and room for powers.

    - amplitudes, doubled: F_m/(F_0 π m·f) and 2F_m/F_0
    - first, last: (M+1,) the places of each row between which they are not zero
    - counted: (M+1, 2M+1) whether they, or ones beside them, count
    - cosines, sines: (2M+1,)
    """

    amplitudes: Any
    doubled: Any
    first: Any
    last: Any
    counted: Any
    cosines: Any
    sines: Any


@compiled()
def set_ranges(modes: Modes, values: Array) -> None:
    """Fill between which places of each row modes are not zero, and which count, by
    mode_tables._with_neighbours.
    """
    rows, columns = values.shape
    modes.counted.fill(False)
    for i in range(rows):
        modes.first[i], modes.last[i] = columns, 0
        for j in range(columns):
            if values[i, j] != 0:
                modes.first[i], modes.last[i] = min(modes.first[i], j), j + 1
                for a in range(max(i - 1, 0), min(i + 2, rows)):
                    modes.counted[a, j] = True
                for b in range(max(j - 1, 0), min(j + 2, columns)):
                    modes.counted[i, b] = True


@compiled()
def set_modes(modes: Modes, values: Array, frequencies: Array) -> tuple[float, bool]:
    """Fill the modes of a torus; return Σ|amplitudes| and whether none of them is slow:
    TimeMaps._amplitudes and has_slow_modes.
    """
    rows, columns = values.shape
    middle = (columns - 1) // 2
    second = frequencies[1] if frequencies.size > 1 else 0.0
    fastest = largest(frequencies)
    reach, steady = 0.0, True
    for i in range(rows):
        for j in range(modes.first[i], modes.last[i]):
            value = values[i, j]
            modes.amplitudes[i, j], modes.doubled[i, j] = 0.0, 2 * value
            if value != 0:
                pace = math.pi * (i * frequencies[0] + (j - middle) * second)
                modes.amplitudes[i, j] = value / pace
                reach += abs(value / pace)
                if i != 0 and j != middle:
                    pull = 4 * abs(value) * max(i, abs(j - middle)) * fastest
                    steady &= pull <= _SLOW * abs(pace) / math.pi
    return 2 * reach, steady


@compiled(fast=True)
def _row(
    amplitudes: Array, doubled: Array, cosines: Array, sines: Array, c: float, s: float
) -> tuple[float, float]:
    """Return Σ_j amplitude·sin(φ_j + φ) and Σ_j doubled·cos(φ_j + φ) along a part of a row."""
    value, slope = 0.0, 0.0
    for j in range(amplitudes.size):
        value += amplitudes[j] * (cosines[j] * s + sines[j] * c)
        slope += doubled[j] * (cosines[j] * c - sines[j] * s)
    return value, slope


@compiled()
def excess(modes: Modes, z: Array, most: int) -> tuple[float, float]:
    """Return the sum of the time map, and that of its slope, at z over |m_k| ≤ ``most``:
    TimeMaps._excess.
    """
    rows, columns = modes.amplitudes.shape
    middle = (columns - 1) // 2
    aside = min(middle, most)
    cosines, sines = modes.cosines, modes.sines
    angle = _TURN * z[z.size - 1]
    c, s = math.cos(angle), math.sin(angle)
    cosines[middle], sines[middle] = 1.0, 0.0
    a, b = 1.0, 0.0
    for m in range(1, aside + 1):
        a, b = a * c - b * s, b * c + a * s
        cosines[middle + m], sines[middle + m] = a, b
        cosines[middle - m], sines[middle - m] = a, -b
    angle = _TURN * z[0]
    c, s = math.cos(angle), math.sin(angle)
    a, b = 1.0, 0.0
    value, slope = 0.0, 0.0
    for i in range(min(rows - 1, most) + 1):
        first, last = max(modes.first[i], middle - aside), min(modes.last[i], middle + aside + 1)
        if first < last:
            part, rise = _row(
                modes.amplitudes[i, first:last],
                modes.doubled[i, first:last],
                cosines[first:last],
                sines[first:last],
                a,
                b,
            )
            value += part
            slope += rise
        a, b = a * c - b * s, b * c + a * s
    return value, slope


@compiled()
def find_tau1(
    modes: Modes,
    frequencies: Array,
    uniform: Array,
    at_start: float,
    reach: float,
    guess: float,
    z: Array,
) -> tuple[float, float, bool]:
    """Return δ = τ₁ − t/F_0, the slope there, and whether it converged; z is filled:
    TimeMaps.tau1. After a whole step the parabola through two slopes is taken. NaN is no guess.
    """
    genus = z.size
    fastest = largest(frequencies)
    low, high = -reach, reach
    delta = min(max(guess, low), high)
    if math.isnan(guess):
        value, slope = excess(modes, uniform, _COARSE)
        delta = -(value - at_start) / max(1 + slope, _LEAST_SLOPE)
        delta = min(max(delta, low), high)
    found, before, last = False, 0.0, np.inf
    for _ in range(_MOST_STEPS):
        for k in range(genus):
            z[k] = uniform[k] + delta * frequencies[k]
        value, slope = excess(modes, z, modes.amplitudes.shape[0])
        value += delta - at_start
        slope += 1
        step = value / slope
        size, earlier = abs(step) * fastest, abs(last) * fastest
        found = slope > 0 and size * size * min(earlier, 1.0) <= _NEGLIGIBLE
        if earlier <= _NEAR:
            step += step * step * (slope - before) / (2 * slope * -last)
        if found:
            delta -= step
            break
        if value > 0:
            high = delta
        else:
            low = delta
        before, last = slope, step
        delta -= step
        # half a bracket instead of a step is no sign of convergence
        if not (slope > 0 and low <= delta <= high):
            delta, last = (low + high) / 2, np.inf
    for k in range(genus):
        z[k] = uniform[k] + delta * frequencies[k]
    return delta, slope, found


@compiled()
def error(
    modes: Modes,
    frequencies: Array,
    elapsed: float,
    of_start: Array,
    of_rates: Array,
    off: float,
    reach: float,
) -> tuple[float, float]:
    """Return what the modes add to the error of τ₁, and what is to be multiplied with |τ₁|:
    TimeMaps.error.
    """
    rows, columns = modes.amplitudes.shape
    middle = (columns - 1) // 2
    genus = frequencies.size
    second = frequencies[1] if genus > 1 else 0.0
    of_all, first, last = 0.0, 0.0, 0.0
    for i in range(rows):
        begin, end = modes.first[i], modes.last[i]
        for k in range(max(i - 1, 0), min(i + 2, rows)):
            begin, end = min(begin, modes.first[k]), max(end, modes.last[k])
        for j in range(max(begin - 1, 0), min(end + 1, columns)):
            if modes.counted[i, j] and (i != 0 or j != middle):
                pace = math.pi * abs(i * frequencies[0] + (j - middle) * second)
                length = min(1 / max(pace, _STANDING), elapsed)
                of_all += length * length
                if modes.first[i] <= j < modes.last[i]:
                    shift = _TURN * modes.doubled[i, j] * length
                    first += shift * shift * (i * i)
                    last += shift * shift * ((j - middle) * (j - middle))
    total = off * (math.sqrt(of_all) + 1 / largest(frequencies))
    total += _EPSILON * min(reach, elapsed) + math.sqrt(first) * of_start[0]
    drift = math.sqrt(first) * of_rates[0]
    if genus > 1:
        total += math.sqrt(last) * of_start[1]
        drift += math.sqrt(last) * of_rates[1]
    return total, drift
