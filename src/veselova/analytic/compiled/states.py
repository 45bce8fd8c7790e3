"""The states of many motions with n = 2 and 3, start by start, compiled: what
analytic.motion.ensemble does with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.attitude.frame import STEP
from veselova.analytic.attitude.sensitivity_sampling import BETWEEN
from veselova.analytic.compiled.attitudes import angle, attitude, set_own_roots, set_torus
from veselova.analytic.compiled.compiler import Record, compiled
from veselova.analytic.compiled.rooms import (
    Fitted,
    Limits,
    Panel,
    Results,
    Times,
    fit,
    room_type,
)
from veselova.analytic.compiled.spectra import rounded_product
from veselova.analytic.compiled.time_maps import (
    error,
    excess,
    find_tau1,
    invert,
    largest,
    phases,
    predict,
    set_modes,
    set_ranges,
    solve,
)

__all__ = ["set_motion", "states"]

Array = NDArray[np.float64]

#: Derived: the rounding of a double, and 2π.
_EPSILON = float(DOUBLE.epsilon)
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
    terms, columns = fitted.series.shape[2], fitted.values.shape[1]
    place = 3
    for k in range(2):
        for s in range(2):
            for m in range(terms):
                fitted.series[k, s, m] = numbers[place]
                place += 1
    for mode in panel.modes:
        fitted.values[mode // columns, mode % columns] = numbers[place]
        place += 1


@compiled()
def _determinant(matrix: Array) -> float:
    """Return the determinant of two or three rows."""
    if matrix.shape[0] == 2:
        return float(matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])
    total = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        total += matrix[0, i] * (matrix[1, j] * matrix[2, k] - matrix[1, k] * matrix[2, j])
    return total


@compiled()
def _set_rotation(motion: Record, frame: Array, room: Record, certain: float) -> bool:
    """Fill ℜ of (orth); return whether its signs are certain: _Motions._rotation, is_certain."""
    genus = room.components.size
    for k in range(genus):
        for j in range(genus):
            room.rotation[k, j] = 0.0
    if not math.isnan(frame[0, 0]):
        for k in range(genus):
            for j in range(genus):
                for axis in range(genus + 1):
                    entry = room.first[motion.places[axis], k + 1]
                    room.rotation[k, j] += entry * frame[axis, j + 1]
        return True
    least, most = np.inf, 0.0
    in_body = room.frames[0]
    for k in range(genus):
        size = abs(room.components[k])
        least, most = min(least, size), max(most, size)
        room.rotation[k, k] = -1.0 if room.components[k] < 0 else 1.0
    for a in range(genus + 1):
        in_body[a, 0] = room.first[motion.places[a], 0]
        for k in range(genus):
            in_body[a, k + 1] = room.first[motion.places[a], k + 1] * room.rotation[k, k]
    if _determinant(in_body) < 0:
        room.rotation[0, 0] *= -1
    return bool(least > certain * most)


@compiled()
def _set_start(
    motion: Record, frame: Array, layout: Record, room: Record, fitted: Fitted, limits: Limits
) -> bool:
    """Fill the angles, phases and attitude at the start; return whether its signs are certain."""
    torus, genus = room.torus, room.angles.size
    for a in range(genus + 1):
        torus.signs[a] = motion.signs[a]
    set_torus(torus, layout)
    series = fitted.series
    for s in range(genus):
        room.angles[s] = angle(
            motion.below[s], motion.above[s], motion.increasing[s], torus.cuts[s]
        )
        for k in range(genus):
            for m in range(1, series.shape[2]):
                fitted.of_sines[k, s, m] = series[k, s, m] / m
    phases(room.angles, series, fitted.of_sines, series.shape[2], room.start, room.slopes)
    for k in range(genus):
        rounding = motion.base[k]
        for s in range(genus):
            rounding += abs(room.slopes[k, s]) * abs(room.angles[s]) * _EPSILON
        room.of_start[k] = limits.start_phase * _EPSILON + rounding
        room.of_rates[k] = motion.rate_rounding * abs(room.tables.frequencies[k])
    set_own_roots(torus, room.angles)
    attitude(torus, layout, room.first, room.components)
    return _set_rotation(motion, frame, room, limits.certain)


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
    series, of_sines, step = fitted.series, fitted.of_sines, room.steps
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
def _set_ends(layout: Record, room: Record) -> None:
    """Fill the attitudes at the ends of steps along each phase: _Motions.at. So small a step moves
    the roots along their slopes.
    """
    torus, genus = room.torus, room.psi.size
    own, slopes, here = torus.own, torus.own_slopes, room.own
    for i in range(own.size):
        here[i] = own[i]
    for k in range(genus):
        for s in range(genus):
            room.unit[s] = 1.0 if s == k else 0.0
        solve(room.slopes, room.unit, room.inverse[k])
        room.steps[k] = STEP / max(1.0, largest(room.inverse[k]))
        for s in range(genus):
            step = room.inverse[k, s] * room.steps[k]
            for i in range(2 * s + 1, 2 * s + 3):
                own[i] = here[i] + step * slopes[i]
        attitude(torus, layout, room.frames[k + 1], room.along[k + 1])


@compiled()
def _slopes(room: Record, frequencies: Array) -> tuple[float, float, float]:
    """Return how fast the frame moves along the motion, with the rates, and with the phases:
    _Motions._error.
    """
    n = frequencies.size + 1
    along, by_rates, together = 0.0, 0.0, 0.0
    for a in range(n):
        for b in range(n):
            straight, sizes, squares = 0.0, 0.0, 0.0
            for k in range(n - 1):
                change = room.frames[k + 1, a, b] - room.frames[0, a, b]
                quotient = BETWEEN * (change / room.steps[k])
                straight += quotient * frequencies[k]
                sizes += abs(quotient * frequencies[k])
                squares += quotient * quotient
            along, by_rates = max(along, abs(straight)), max(by_rates, sizes)
            together = max(together, squares)
    return along, by_rates, math.sqrt(together)


@compiled()
def _set_state(motion: Record, room: Record, q_dot: Array, frame: Array) -> None:
    """Fill q̇ and the frame along body axes from the attitude: _Motions.at and _time_rate."""
    n = room.torus.q.size
    at_start, here = 0.0, 0.0
    for a in range(n):
        at_start += motion.A[a] * room.first[a, 0] * room.first[a, 0]
        here += motion.A[a] * room.frames[0, a, 0] * room.frames[0, a, 0]
    rate = motion.time_rate * math.sqrt(at_start / here)
    for axis in range(n):
        a = motion.places[axis]
        frame[axis, 0] = room.frames[0, a, 0]
        speed = 0.0
        for k in range(n - 1):
            speed += room.frames[0, a, k + 1] * room.along[0, k] * rate
            total = 0.0
            for j in range(n - 1):
                total += room.frames[0, a, j + 1] * room.rotation[j, k]
            frame[axis, k + 1] = total
        q_dot[axis] = speed


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
    frequencies, mean, genus = room.tables.frequencies, room.tables.mean[0], room.psi.size
    modes = fitted.modes
    if not largest(frequencies) / mean * largest(times.doubles) < limits.most_cycles:
        return False
    reach, steady = set_modes(modes, fitted.values, frequencies)
    if not steady or not _set_start(motion, frame, layout, room, fitted, limits):
        return False
    at_start = excess(modes, room.start, fitted.values.shape[0])[0]
    rounding = motion.rate_rounding
    phase = limits.phase * _EPSILON + 2 * motion.phase_error
    evaluation = max(limits.evaluation, 3.0 * genus + 3.0) * _EPSILON
    elapsed, along, by_rates, together, age = 0.0, 0.0, 0.0, 0.0, 0
    for row in range(room.past.shape[0]):
        room.past[row, 0] = -np.inf
    for j in range(times.doubles.size):
        time, rest = times.doubles[j], times.remainders[j]
        for k in range(genus):
            rate = frequencies[k] / mean
            product, error_of_it = rounded_product(time, rate)
            room.uniform[k] = room.start[k] + np.fmod(product, 2.0) + (error_of_it + rest * rate)
        delta, slope, found, good = _find_angles(time, at_start, reach, room, fitted)
        if not found:
            return False
        set_own_roots(room.torus, room.psi)
        attitude(room.torus, layout, room.frames[0], room.along[0])
        # where prediction is that good, sensitivities hardly change from time to time
        age = age + 1 if good else 0
        if age % _SAMPLED == 0:
            _set_ends(layout, room)
            along, by_rates, together = _slopes(room, frequencies)
        _set_state(motion, room, results.q_dot[i, j], results.frame[i, j])
        tau1 = time / mean + delta
        elapsed = max(elapsed, abs(tau1))
        results.tau1[i, j] = tau1
        # what moves along waits for the largest |τ₁|
        results.slopes[i, j] = along * max(1.0, 1 / slope)
        results.error[i, j] = rounding * abs(tau1) * by_rates + phase * together + evaluation
    of_map, drift = error(
        modes, frequencies, elapsed, room.of_start, room.of_rates, motion.off, reach
    )
    for j in range(times.doubles.size):
        lag = abs(times.doubles[j]) / mean * (rounding + drift) + of_map
        total = limits.safety * (results.error[i, j] + lag * results.slopes[i, j])
        if not total < limits.largest_error:
            return False
        results.error[i, j] = total
        results.tau1[i, j] *= math.sqrt(motion.unit)
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
