"""The states of many motions with n = 2 and 3 by Fourier time maps, start by start, compiled:
what analytic.motion.ensemble does with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.compiled.angle_maps import invert, predict, set_phases
from veselova.analytic.compiled.compiler import Record, compiled, compiling
from veselova.analytic.compiled.frames import complete, set_start, set_state
from veselova.analytic.compiled.linear_equations import largest, solve
from veselova.analytic.compiled.rooms import (
    Fitted,
    Limits,
    Panel,
    Results,
    Times,
    fit,
    room_type,
)
from veselova.analytic.compiled.time_maps import (
    error,
    excess,
    find_tau1,
    set_modes,
    set_ranges,
)

__all__ = ["set_motion", "states"]

Array = NDArray[np.float64]

#: Derived: 2π.
_TURN = 2 * math.pi

#: Method: cycles of the fastest phase back to the first of the times that predict the next one;
#: cycles by which a good prediction is off, and the times in a row that have one sensitivity then.
_LONGEST_PAST = 0.5
_GOOD = 1e-6
_SAMPLED = 4


@compiled()
def _interpolate(panel: Panel, i: int, room: Record, fitted: Fitted) -> None:
    """Fill the tables of one motion: atlas._Panel.at, _stack."""
    count, length = panel.coefficients.shape
    numbers = panel.numbers
    angle = math.acos(min(max(panel.x[i], -1.0), 1.0))
    c, s, factor, rest = math.cos(angle), math.sin(angle), 1.0, 0.0
    for j in range(length):
        numbers[j] = 0.0
    for k in range(count):
        for j in range(length):
            numbers[j] += factor * panel.coefficients[k, j]
        factor, rest = factor * c - rest * s, rest * c + factor * s
    tables = room.tables
    tables.frequencies[0], tables.frequencies[1] = numbers[0], numbers[1]
    tables.mean[0] = numbers[2] * panel.scale[i]
    terms, columns = fitted.angles.series.shape[2], fitted.values.shape[1]
    place = 3
    for k in range(2):
        for s in range(2):
            for m in range(terms):
                fitted.angles.series[k, s, m] = numbers[place]
                place += 1
    for mode in panel.modes:
        fitted.values[mode // columns, mode % columns] = numbers[place]
        place += 1


@compiled()
def _from_guess(
    at_start: float, reach: float, room: Record, fitted: Fitted
) -> tuple[float, float, bool]:
    """Fill z and the angles from the uniform phases and a guess; return δ = τ₁ − t/F_0, the slope
    of the time map there, and whether all were found.
    """
    guess, frequencies = room.guess, room.tables.frequencies
    delta, slope, found = find_tau1(
        fitted.modes, frequencies, room.uniform, at_start, reach, guess[0], room.z
    )
    series, of_sines, step = fitted.angles.series, fitted.angles.of_sines, room.steps
    found = found and invert(
        room.z, series, of_sines, guess[1:], room.psi, room.slopes, room.unit, step
    )
    return delta, slope, found


@compiled()
def _find_angles(
    time: float, at_start: float, reach: float, room: Record, fitted: Fitted
) -> tuple[float, float, bool, bool]:
    """Fill z and the angles at a time as ``_from_guess`` does, by prediction where it serves;
    return what that does, and whether prediction was good. They become part of the past.
    """
    frequencies, mean, genus = room.tables.frequencies, room.tables.mean[0], room.psi.size
    guess, step, fastest = room.guess, room.steps, largest(frequencies)
    delta, slope, found = 0.0, 1.0, False
    if predict(room.past, time, _LONGEST_PAST * mean / fastest, guess):
        delta, slope, found = _from_guess(at_start, reach, room, fitted)
    if not found:
        for c in range(guess.size):
            guess[c] = np.nan
        delta, slope, found = _from_guess(at_start, reach, room, fitted)
    oldest = 0
    for row in range(1, room.past.shape[0]):
        if room.past[row, 0] < room.past[oldest, 0]:
            oldest = row
    past = room.past[oldest]
    past[0], past[1], past[2] = time, delta, (1 - slope) / (mean * slope)
    for k in range(genus):
        room.unit[k] = frequencies[k] / (mean * slope)
    solve(room.slopes, room.unit, step)
    good = abs(delta - guess[0]) * fastest < _GOOD
    for k in range(genus):
        past[2 * k + 3] = room.psi[k] - _TURN * room.z[k]
        past[2 * k + 4] = step[k] - _TURN * room.unit[k]
        good = good and abs(past[2 * k + 3] - guess[k + 1]) < _GOOD
    return delta, slope, found, good


@compiled()
def set_motion(
    motion: Record,
    frame: Array,
    layout: Record,
    times: Times,
    limits: Limits,
    room: Record,
    fitted: Fitted,
    results: Results,
    i: int,
) -> bool:
    """Fill the states of one motion; return whether they are right."""
    frequencies, mean = room.tables.frequencies, room.tables.mean[0]
    modes = fitted.modes
    if not largest(frequencies) / mean * largest(times.doubles) < limits.most_cycles:
        return False
    reach, steady = set_modes(modes, fitted.values, frequencies)
    if not steady or not set_start(motion, frame, layout, room, fitted.angles, limits):
        return False
    at_start = excess(modes, room.start, fitted.values.shape[0])[0]
    elapsed, age = 0.0, 0
    for row in range(room.past.shape[0]):
        room.past[row, 0] = -np.inf
    for j in range(times.doubles.size):
        time = times.doubles[j]
        set_phases(room.start, frequencies, mean, time, times.remainders[j], room.uniform)
        delta, slope, found, good = _find_angles(time, at_start, reach, room, fitted)
        if not found:
            return False
        # where prediction is that good, sensitivities hardly change from time to time
        age = age + 1 if good else 0
        tau1 = time / mean + delta
        set_state(motion, layout, limits, room, results, i, j, tau1, slope, age % _SAMPLED == 0)
        elapsed = max(elapsed, abs(tau1))
    of_map, drift = error(
        modes, frequencies, elapsed, room.of_start, room.of_rates, motion.off, reach
    )
    for j in range(times.doubles.size):
        lag = abs(times.doubles[j]) / mean * (motion.rate_rounding + drift) + of_map
        if not complete(motion, limits, results, i, j, lag):
            return False
    return True


@compiled()
def _states(
    motions: Any,
    panel: Panel,
    sizes: tuple[int, int],
    frame: Array,
    layout: Record,
    times: Times,
    limits: Limits,
    rooms: Any,
    results: Results,
) -> None:
    room = rooms[0]
    terms, rows = sizes
    fitted = fit(room, 2, terms, rows)
    modes, values = fitted.modes, fitted.values
    for a in range(rows):
        for b in range(values.shape[1]):
            values[a, b] = 0.0
    for mode in panel.modes:
        values[mode // values.shape[1], mode % values.shape[1]] = 1.0
    set_ranges(modes, values)
    for a in range(rows):
        for b in range(values.shape[1]):
            modes.counted[a, b] = values[a, b] != 0 and (a > 0 or b != rows - 1)
    for i in range(motions.size):
        motion = motions[i]
        for a in range(5):
            for b in range(5):
                room.torus.differences[a, b] = motion.differences[a, b]
        _interpolate(panel, i, room, fitted)
        results.served[i] = set_motion(
            motion, frame, layout, times, limits, room, fitted, results, i
        )


@compiling
def states(
    motions: Any,
    panel: Panel,
    sizes: tuple[int, int],
    layout: Record,
    times: Times,
    limits: Limits,
    results: Results,
) -> None:
    """Fill the states of N motions with n = 3 on one panel at the times; ``sizes`` are the numbers
    of terms of their series and of rows of their box.
    """
    frame = np.full((1, 1), np.nan)
    rooms = np.empty(1, room_type(2))
    _states(motions, panel, sizes, frame, layout, times, limits, rooms, results)
