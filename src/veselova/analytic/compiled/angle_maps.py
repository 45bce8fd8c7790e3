"""The maps between the angles and the phases of one torus, compiled: what analytic.curve.angle_maps
does with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.compiled.compiler import compiled
from veselova.analytic.compiled.linear_equations import largest, solve
from veselova.analytic.compiled.spectra import rounded_product
from veselova.analytic.curve import angle_maps

__all__ = ["invert", "phases", "predict", "set_phases"]

Array = NDArray[np.float64]

#: Derived: 2π.
_TURN = 2 * math.pi

_MOST_STEPS, _STALLED = angle_maps.MOST_STEPS, angle_maps.STALLED
_SMALL = angle_maps.CONVERGED * float(DOUBLE.epsilon)
_LONGEST_STEP = angle_maps.LONGEST_STEP

#: Method: the first steps from phases to angles, and their terms.
_FEW_STEPS, _FEW_TERMS = 2, 5

#: Derived: radians of a step whose square is below a rounding.
_LAST_STEP = 5e-9


@compiled(fast=True)
def _line(c: float, s: float, series: Array, of_sines: Array) -> tuple[float, float]:
    """Return Σ_m series·sin mψ/m and Σ_m series·cos mψ, m ≥ 1, from cos ψ and sin ψ; odd and even m
    by steps of two.
    """
    turn, rise = c * c - s * s, 2 * s * c
    even, odd = turn, rise
    a, b = 0.0, 0.0
    for m in range(1, series.size - 1, 2):
        a += of_sines[m] * s + of_sines[m + 1] * odd
        b += series[m] * c + series[m + 1] * even
        c, s = c * turn - s * rise, s * turn + c * rise
        even, odd = even * turn - odd * rise, odd * turn + even * rise
    if series.size % 2 == 0:
        a += of_sines[series.size - 1] * s
        b += series[series.size - 1] * c
    return a, b


@compiled(fast=True)
def _lines(
    c: float, s: float, first: Array, of_first: Array, last: Array, of_last: Array
) -> tuple[float, float, float, float]:
    """Return what ``_line`` does, of two series at once."""
    turn, rise = c * c - s * s, 2 * s * c
    even, odd = turn, rise
    a, b, x, y = 0.0, 0.0, 0.0, 0.0
    for m in range(1, first.size - 1, 2):
        a += of_first[m] * s + of_first[m + 1] * odd
        b += first[m] * c + first[m + 1] * even
        x += of_last[m] * s + of_last[m + 1] * odd
        y += last[m] * c + last[m + 1] * even
        c, s = c * turn - s * rise, s * turn + c * rise
        even, odd = even * turn - odd * rise, odd * turn + even * rise
    if first.size % 2 == 0:
        m = first.size - 1
        a += of_first[m] * s
        b += first[m] * c
        x += of_last[m] * s
        y += last[m] * c
    return a, b, x, y


@compiled()
def phases(psi: Array, series: Array, of_sines: Array, most: int, z: Array, slopes: Array) -> None:
    """Fill z and ∂z_k/∂ψ_s for angles, from the first terms of series (g, g, M) and of these over
    m: AngleMaps._phases and _slopes.
    """
    genus = psi.size
    for k in range(genus):
        z[k] = psi[k] / _TURN
    for s in range(genus):
        cosine, sine = math.cos(psi[s]), math.sin(psi[s])
        for k in range(0, genus, 2):
            first, of_first = series[k, s, :most], of_sines[k, s, :most]
            if k + 1 < genus:
                a, b, x, y = _lines(
                    cosine,
                    sine,
                    first,
                    of_first,
                    series[k + 1, s, :most],
                    of_sines[k + 1, s, :most],
                )
                z[k + 1] += x
                slopes[k + 1, s] = y + series[k + 1, s, 0]
            else:
                a, b = _line(cosine, sine, first, of_first)
            z[k] += a
            slopes[k, s] = b + series[k, s, 0]


@compiled()
def set_phases(
    start: Array, frequencies: Array, unit: float, way: float, rest: float, z: Array
) -> None:
    """Fill z⁰ + f·(way + rest)/unit, less a whole number of two cycles."""
    for k in range(z.size):
        rate = frequencies[k] / unit
        product, lost = rounded_product(way, rate)
        z[k] = start[k] + np.fmod(product, 2.0) + (lost + rest * rate)


@compiled()
def invert(
    z: Array,
    series: Array,
    of_sines: Array,
    guess: Array,
    psi: Array,
    slopes: Array,
    found: Array,
    step: Array,
) -> bool:
    """Fill the angles with these phases, and the slopes there; return whether it converged:
    AngleMaps.invert. Steps begin at 2πz and a guess besides; where that is NaN, the first of them
    take few terms. A last one leaves its square.
    """
    genus = z.size
    last, moved, first = np.inf, 0.0, 0
    for k in range(genus):
        psi[k] = _TURN * (z[k] - math.floor(z[k]))
    if math.isnan(guess[0]):
        first = _FEW_STEPS
    else:
        for k in range(genus):
            psi[k] += guess[k]
    for count in range(_MOST_STEPS):
        most = min(_FEW_TERMS, series.shape[2]) if count < first else series.shape[2]
        phases(psi, series, of_sines, most, found, slopes)
        size = 0.0
        for k in range(genus):
            found[k] -= z[k] - math.floor(z[k])
            size = max(size, abs(found[k]))
        if not size < np.inf:
            return False
        solve(slopes, found, step)
        longest = largest(step)
        for k in range(genus):
            psi[k] -= step[k] * min(1.0, _LONGEST_STEP / max(longest, _LONGEST_STEP))
        whole = most == series.shape[2]
        # each step is of the order of the square of the one before, which a lucky one only seems
        order = max(longest, moved**3)
        is_last = longest <= _LAST_STEP or longest**2 * order <= (_LAST_STEP * moved) ** 2
        if whole and (is_last or (last / 2 <= size <= _STALLED * _SMALL)):
            for k in range(genus):
                psi[k] += _TURN * math.floor(z[k])
            return True
        # a shortened step says nothing of the next one
        last = size if whole else np.inf
        moved = longest if whole and longest <= _LONGEST_STEP else 0.0
    return False


@compiled()
def predict(past: Array, time: float, longest: float, guess: Array) -> bool:
    """Fill δ, and ψ_k − 2πz_k, at a time from their values and slopes at earlier ones, by
    Hermite's polynomial; return whether these are near enough. A row of the past: time, and pairs.
    """
    for c in range(guess.size):
        guess[c] = 0.0
    count = past.shape[0]
    for i in range(count):
        distance, part, slope = time - past[i, 0], 1.0, 0.0
        if not 0 < distance < longest:
            return False
        for k in range(count):
            if k != i:
                inverse = 1 / (past[i, 0] - past[k, 0])
                part *= (time - past[k, 0]) * inverse
                slope += inverse
        part *= part
        for c in range(guess.size):
            rise = past[i, 2 * c + 2] - 2 * slope * past[i, 2 * c + 1]
            guess[c] += part * (past[i, 2 * c + 1] + distance * rise)
    for i in range(count):
        for c in range(guess.size):
            if not abs(guess[c] - past[i, 2 * c + 1]) < 1:
                return False
    return True
