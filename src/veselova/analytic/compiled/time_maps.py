"""The time map of one torus of genus one or two, compiled: what analytic.time_map.mode_tables and
analytic.curve.angle_maps do with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.compiled.compiler import compiled
from veselova.analytic.curve import angle_maps
from veselova.analytic.time_map import mode_tables
from veselova.analytic.time_map.fourier import LEAST_SLOPE
from veselova.analytic.time_map.fourier_modes import SLOW

__all__ = [
    "Modes",
    "error",
    "excess",
    "find_tau1",
    "invert",
    "largest",
    "new_modes",
    "phases",
    "powers",
    "set_modes",
    "set_ranges",
    "solve",
]

Array = NDArray[np.float64]

#: Derived: the rounding of a double, and 2π.
_EPSILON = float(DOUBLE.epsilon)
_TURN = 2 * math.pi

_COARSE, _LEAST_SLOPE = mode_tables.COARSE, LEAST_SLOPE
_MOST_STEPS, _CONVERGED = mode_tables.MOST_STEPS, mode_tables.CONVERGED
_STANDING, _SLOW = mode_tables.STANDING, SLOW
_MOST_ANGLE_STEPS, _STALLED = angle_maps.MOST_STEPS, angle_maps.STALLED
_SMALL, _LONGEST_STEP = angle_maps.CONVERGED * _EPSILON, angle_maps.LONGEST_STEP


class Modes(NamedTuple):
    """The modes of one torus in a box (M+1, 2M+1), of genus one (M+1, 1), and room for powers.

    - amplitudes, doubled: F_m/(F_0 π m·f) and 2F_m/F_0
    - first, last: (M+1,) the places of each row between which they are not zero
    - counted: (M+1, 2M+1) whether they, or ones beside them, count
    - cosines, sines: (2, 2M+1)
    """

    amplitudes: Any
    doubled: Any
    first: Any
    last: Any
    counted: Any
    cosines: Any
    sines: Any


def new_modes(rows: int, columns: int) -> Modes:
    """Return room for the modes of a torus."""
    return Modes(
        np.zeros((rows, columns)),
        np.zeros((rows, columns)),
        np.zeros(rows, dtype=np.intp),
        np.zeros(rows, dtype=np.intp),
        np.zeros((rows, columns), dtype=np.bool_),
        np.empty((2, max(rows, columns))),
        np.empty((2, max(rows, columns))),
    )


@compiled()
def largest(values: Array) -> float:
    """Return the largest |x|."""
    result = 0.0
    for x in values:
        result = max(result, abs(x))
    return result


@compiled()
def powers(angle: float, highest: int, cosines: Array, sines: Array) -> None:
    """Fill cos mφ and sin mφ, m = 0 … highest, by doubling: mode_tables and angle_maps."""
    cosines[0], sines[0] = 1.0, 0.0
    if highest > 0:
        cosines[1], sines[1] = math.cos(angle), math.sin(angle)
    known = 1
    while known < highest:
        c, s = cosines[known], sines[known]
        for m in range(1, min(known, highest - known) + 1):
            cosines[known + m] = cosines[m] * c - sines[m] * s
            sines[known + m] = sines[m] * c + cosines[m] * s
        known *= 2


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
def _row(modes: Modes, i: int, first: int, last: int) -> tuple[float, float, float, float]:
    """Return Σ_j (amplitude, doubled)·(cos, sin) along a row, between two places."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for j in range(first, last):
        cosine, sine = modes.cosines[1, j], modes.sines[1, j]
        a += modes.amplitudes[i, j] * cosine
        b += modes.amplitudes[i, j] * sine
        c += modes.doubled[i, j] * cosine
        d += modes.doubled[i, j] * sine
    return a, b, c, d


@compiled()
def excess(modes: Modes, z: Array, most: int) -> tuple[float, float]:
    """Return the sum of the time map, and that of its slope, at z over |m_k| ≤ ``most``:
    TimeMaps._excess.
    """
    rows, columns = modes.amplitudes.shape
    middle = (columns - 1) // 2
    highest = min(rows - 1, most)
    cosines, sines = modes.cosines, modes.sines
    powers(_TURN * z[0], highest, cosines[0], sines[0])
    aside = min(middle, most)
    powers(_TURN * z[z.size - 1], aside, cosines[1, middle:], sines[1, middle:])
    for m in range(1, aside + 1):
        cosines[1, middle - m] = cosines[1, middle + m]
        sines[1, middle - m] = -sines[1, middle + m]
    value, slope = 0.0, 0.0
    for i in range(highest + 1):
        first = max(modes.first[i], middle - aside)
        last = min(modes.last[i], middle + aside + 1)
        a, b, c, d = _row(modes, i, first, last)
        value += a * sines[0, i] + b * cosines[0, i]
        slope += c * cosines[0, i] - d * sines[0, i]
    return value, slope


@compiled()
def find_tau1(
    modes: Modes, frequencies: Array, uniform: Array, at_start: float, reach: float, z: Array
) -> tuple[float, float, bool]:
    """Return δ = τ₁ − t/F_0, the slope there, and whether it converged; z is filled:
    TimeMaps.tau1.
    """
    genus = z.size
    fastest = largest(frequencies)
    value, slope = excess(modes, uniform, _COARSE)
    delta = -(value - at_start) / max(1 + slope, _LEAST_SLOPE)
    delta = min(max(delta, -reach), reach)
    found = False
    for _ in range(_MOST_STEPS):
        for k in range(genus):
            z[k] = uniform[k] + delta * frequencies[k]
        value, slope = excess(modes, z, modes.amplitudes.shape[0])
        value += delta - at_start
        slope += 1
        step = value / slope
        found = abs(step) * fastest <= _CONVERGED
        if not slope > 0:
            step = reach if value > 0 else -reach
        delta -= min(max(step, -reach), reach)
        if found:
            break
        reach /= 2
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


@compiled(fast=True)
def _line(of_sines: Array, series: Array, cosines: Array, sines: Array) -> tuple[float, float]:
    """Return Σ_m of_sines·sin mψ and Σ_m series·cos mψ, m ≥ 1."""
    phase, slope = 0.0, 0.0
    for m in range(1, series.size):
        phase += of_sines[m] * sines[m]
        slope += series[m] * cosines[m]
    return phase, slope


@compiled()
def phases(
    psi: Array, series: Array, of_sines: Array, room: Array, z: Array, slopes: Array
) -> None:
    """Fill z and ∂z_k/∂ψ_s for angles: AngleMaps._phases and _slopes; series (g, g, M) and these
    over m.
    """
    genus = psi.size
    for k in range(genus):
        z[k] = psi[k] / _TURN
    for s in range(genus):
        powers(psi[s], series.shape[2] - 1, room[0], room[1])
        for k in range(genus):
            phase, slope = _line(of_sines[k, s], series[k, s], room[0], room[1])
            z[k] += phase
            slopes[k, s] = slope + series[k, s, 0]


@compiled()
def solve(slopes: Array, right: Array, result: Array) -> None:
    """Fill the solution of one or two linear equations: angle_maps._solve."""
    if right.size == 1:
        result[0] = right[0] / slopes[0, 0]
        return
    a, b, c, d = slopes[0, 0], slopes[0, 1], slopes[1, 0], slopes[1, 1]
    inverse = 1 / (a * d - b * c)
    result[0] = (d * right[0] - b * right[1]) * inverse
    result[1] = (a * right[1] - c * right[0]) * inverse


@compiled()
def invert(
    z: Array,
    series: Array,
    of_sines: Array,
    room: Array,
    psi: Array,
    slopes: Array,
    found: Array,
    step: Array,
) -> bool:
    """Fill the angles with these phases, and the slopes there; return whether it converged:
    AngleMaps.invert.
    """
    genus = z.size
    last = np.inf
    for k in range(genus):
        psi[k] = _TURN * (z[k] - math.floor(z[k]))
    for _ in range(_MOST_ANGLE_STEPS):
        phases(psi, series, of_sines, room, found, slopes)
        size = 0.0
        for k in range(genus):
            found[k] -= z[k] - math.floor(z[k])
            size = max(size, abs(found[k]))
        if size <= _SMALL or (last / 2 <= size <= _STALLED * _SMALL):
            for k in range(genus):
                psi[k] += _TURN * math.floor(z[k])
            return True
        if not size < np.inf:
            return False
        last = size
        solve(slopes, found, step)
        longest = largest(step)
        for k in range(genus):
            psi[k] -= step[k] * min(1.0, _LONGEST_STEP / max(longest, _LONGEST_STEP))
    return False
