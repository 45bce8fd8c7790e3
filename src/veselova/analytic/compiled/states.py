"""The states of many motions with n = 2 and 3, start by start, compiled: what
analytic.motion.ensemble does with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.attitude.frame import STEP
from veselova.analytic.attitude.sensitivity_sampling import BETWEEN
from veselova.analytic.compiled.attitudes import (
    Places,
    Torus,
    angle,
    attitude,
    new_torus,
    set_torus,
)
from veselova.analytic.compiled.compiler import compiled
from veselova.analytic.compiled.spectra import rounded_product
from veselova.analytic.compiled.time_maps import (
    Modes,
    error,
    excess,
    find_tau1,
    invert,
    largest,
    new_modes,
    phases,
    powers,
    set_modes,
    set_ranges,
    solve,
)

__all__ = [
    "Limits",
    "Motions",
    "Panel",
    "Places",
    "Results",
    "Room",
    "Times",
    "new_room",
    "set_motion",
    "states",
]

Array = NDArray[np.float64]

#: Derived: the rounding of a double.
_EPSILON = float(DOUBLE.epsilon)


class Motions(NamedTuple):
    """N motions on tori of one order; names as in ``TorusStack``, ``ModeTables`` and ``TimeMaps``.
    The tables of one of them at a time: series, values, frequencies, mean.

    - of_I, of_c: the layouts of the curve
    - below, above, increasing: (N, g) where the λ_s of the starts are on their cuts
    - base: (N, g) the start's roundings besides those of its angles
    - A: (N, n) sorted, in any unit
    - places: (N, n) of each body axis among sorted ones
    - frames: (N, n, n) at the start, sorted, NaN for the natural one
    - series: (g, g, M); values: (M+1, 2M+1), of genus one (M+1, 1)
    - panel: of which these are interpolated
    """

    of_I: Places
    of_c: Places
    below: Any
    above: Any
    increasing: Any
    base: Any
    differences: Any
    signs: Any
    time_rate: Any
    unit: Any
    A: Any
    places: Any
    frames: Any
    series: Any
    values: Any
    off: Any
    frequencies: Any
    mean: Any
    rate_rounding: Any
    phase_error: Any
    panel: Panel


class Panel(NamedTuple):
    """The tables of N motions by interpolation, as in analytic.motion.atlas; empty where each has
    its own.

    - coefficients: (D+1, L)
    - x: (N,) where each motion lies in the panel, from −1 to 1
    - scale: (N,) of F_0
    - modes: (K,) which of the box are interpolated
    """

    coefficients: Any
    x: Any
    scale: Any
    modes: Any


class Times(NamedTuple):
    """The doubles and remainders of a grid, (T,) each."""

    doubles: Any
    remainders: Any


class Limits(NamedTuple):
    """The constants of analytic.motion.ensemble."""

    certain: float
    phase: float
    start_phase: float
    evaluation: float
    safety: float
    largest_error: float
    most_cycles: float


class Results(NamedTuple):
    """The states: τ₁, error and how fast frames move along, (N, T), q̇ (N, T, n), frames (N, T, n,
    n), and which motions they are right for, (N,).
    """

    tau1: Any
    q_dot: Any
    frame: Any
    error: Any
    slopes: Any
    served: Any


class Room(NamedTuple):
    """Numbers of one motion: attitudes at ``ends``, z and slopes, of the start; the rotation."""

    torus: Torus
    modes: Modes
    of_sines: Any
    powers: Any
    angles: Any
    start: Any
    slopes: Any
    of_start: Any
    of_rates: Any
    first: Any
    components: Any
    rotation: Any
    uniform: Any
    z: Any
    psi: Any
    ends: Any
    inverse: Any
    unit: Any
    steps: Any
    frames: Any
    along: Any
    chebyshev: Any
    numbers: Any


def new_room(genus: int, terms: int, rows: int, columns: int, table: tuple[int, int]) -> Room:
    """Return room for the numbers of a motion."""
    n = genus + 1
    return Room(
        new_torus(genus),
        new_modes(rows, columns),
        np.empty((genus, genus, terms)),
        np.empty((2, terms + 1)),
        np.empty(genus),
        np.empty(genus),
        np.empty((genus, genus)),
        np.empty(genus),
        np.empty(genus),
        np.empty((n, n)),
        np.empty(genus),
        np.empty((genus, genus)),
        np.empty(genus),
        np.empty(genus),
        np.empty(genus),
        np.empty(genus),
        np.empty((genus, genus)),
        np.zeros(genus),
        np.empty(genus),
        np.empty((genus + 1, n, n)),
        np.empty((genus + 1, genus)),
        np.empty((2, table[0])),
        np.empty(table[1]),
    )


@compiled()
def _interpolate(given: Motions, i: int, room: Room) -> None:
    """Fill the tables of one motion: atlas._Panel.at, _stack."""
    panel = given.panel
    count, length = panel.coefficients.shape
    powers(
        math.acos(min(max(panel.x[i], -1.0), 1.0)), count - 1, room.chebyshev[0], room.chebyshev[1]
    )
    for j in range(length):
        room.numbers[j] = 0.0
    for k in range(count):
        factor = room.chebyshev[0, k]
        for j in range(length):
            room.numbers[j] += factor * panel.coefficients[k, j]
    given.frequencies[0], given.frequencies[1] = room.numbers[0], room.numbers[1]
    given.mean[0] = room.numbers[2] * panel.scale[i]
    terms, columns = given.series.shape[2], given.values.shape[1]
    place = 3
    for k in range(2):
        for s in range(2):
            for m in range(terms):
                given.series[k, s, m] = room.numbers[place]
                place += 1
    for mode in panel.modes:
        given.values[mode // columns, mode % columns] = room.numbers[place]
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
def _set_rotation(given: Motions, i: int, room: Room, certain: float) -> bool:
    """Fill ℜ of (orth); return whether its signs are certain: _Motions._rotation, is_certain."""
    genus = room.components.size
    frame = given.frames[i]
    if not math.isnan(frame[0, 0]):
        for k in range(genus):
            for j in range(genus):
                room.rotation[k, j] = 0.0
                for a in range(genus + 1):
                    room.rotation[k, j] += room.first[a, k + 1] * frame[a, j + 1]
        return True
    room.rotation.fill(0.0)
    least, most = np.inf, 0.0
    in_body = room.frames[0]
    for k in range(genus):
        size = abs(room.components[k])
        least, most = min(least, size), max(most, size)
        room.rotation[k, k] = -1.0 if room.components[k] < 0 else 1.0
    for a in range(genus + 1):
        in_body[a, 0] = room.first[given.places[i, a], 0]
        for k in range(genus):
            in_body[a, k + 1] = room.first[given.places[i, a], k + 1] * room.rotation[k, k]
    if _determinant(in_body) < 0:
        room.rotation[0, 0] *= -1
    return bool(least > certain * most)


@compiled()
def _set_start(given: Motions, i: int, room: Room, limits: Limits) -> bool:
    """Fill the angles, phases and attitude at the start; return whether its signs are certain."""
    torus, genus = room.torus, room.angles.size
    for a in range(2 * genus + 1):
        for b in range(2 * genus + 1):
            torus.differences[a, b] = given.differences[i, a, b]
    for a in range(genus + 1):
        torus.signs[a] = given.signs[i, a]
    set_torus(torus, given.of_I, given.of_c)
    series = given.series
    for s in range(genus):
        room.angles[s] = angle(
            given.below[i, s], given.above[i, s], given.increasing[i, s], torus.cuts[s]
        )
        for k in range(genus):
            for m in range(1, series.shape[2]):
                room.of_sines[k, s, m] = series[k, s, m] / m
    phases(room.angles, series, room.of_sines, room.powers, room.start, room.slopes)
    for k in range(genus):
        rounding = given.base[i, k]
        for s in range(genus):
            rounding += abs(room.slopes[k, s]) * abs(room.angles[s]) * _EPSILON
        room.of_start[k] = limits.start_phase * _EPSILON + rounding
        room.of_rates[k] = given.rate_rounding[i] * abs(given.frequencies[k])
    attitude(torus, given.of_I, given.of_c, room.angles, room.first, room.components)
    return _set_rotation(given, i, room, limits.certain)


@compiled()
def _set_ends(given: Motions, room: Room) -> None:
    """Fill the attitudes at angles ψ, and at the ends of steps along each phase: _Motions.at."""
    torus, genus = room.torus, room.psi.size
    attitude(torus, given.of_I, given.of_c, room.psi, room.frames[0], room.along[0])
    for k in range(genus):
        room.unit.fill(0.0)
        room.unit[k] = 1.0
        solve(room.slopes, room.unit, room.inverse[k])
        room.steps[k] = STEP / max(1.0, largest(room.inverse[k]))
        for s in range(genus):
            room.ends[s] = room.psi[s] + room.inverse[k, s] * room.steps[k]
        attitude(torus, given.of_I, given.of_c, room.ends, room.frames[k + 1], room.along[k + 1])


@compiled()
def _slopes(room: Room, frequencies: Array) -> tuple[float, float, float]:
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
def _set_state(given: Motions, i: int, room: Room, q_dot: Array, frame: Array) -> None:
    """Fill q̇ and the frame along body axes from the attitude: _Motions.at and _time_rate."""
    n = room.torus.q.size
    at_start, here = 0.0, 0.0
    for a in range(n):
        at_start += given.A[i, a] * room.first[a, 0] * room.first[a, 0]
        here += given.A[i, a] * room.frames[0, a, 0] * room.frames[0, a, 0]
    rate = given.time_rate[i] * math.sqrt(at_start / here)
    for axis in range(n):
        a = given.places[i, axis]
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
    given: Motions, i: int, times: Times, limits: Limits, room: Room, results: Results
) -> bool:
    """Fill the states of one motion; return whether they are right."""
    frequencies, mean, genus = given.frequencies, given.mean[0], room.psi.size
    last = largest(times.doubles)
    if not largest(frequencies) / mean * last < limits.most_cycles:
        return False
    reach, steady = set_modes(room.modes, given.values, frequencies)
    if not steady or not _set_start(given, i, room, limits):
        return False
    at_start = excess(room.modes, room.start, given.values.shape[0])[0]
    series, rounding = given.series, given.rate_rounding[i]
    evaluation = max(limits.evaluation, 3.0 * genus + 3.0) * _EPSILON
    elapsed = 0.0
    for j in range(times.doubles.size):
        time, rest = times.doubles[j], times.remainders[j]
        for k in range(genus):
            rate = frequencies[k] / mean
            product, error_of_it = rounded_product(time, rate)
            room.uniform[k] = room.start[k] + np.fmod(product, 2.0) + (error_of_it + rest * rate)
        delta, slope, found = find_tau1(
            room.modes, frequencies, room.uniform, at_start, reach, room.z
        )
        if not found or not invert(
            room.z, series, room.of_sines, room.powers, room.psi, room.slopes, room.unit, room.steps
        ):
            return False
        _set_ends(given, room)
        along, by_rates, together = _slopes(room, frequencies)
        _set_state(given, i, room, results.q_dot[i, j], results.frame[i, j])
        tau1 = time / mean + delta
        elapsed = max(elapsed, abs(tau1))
        results.tau1[i, j] = tau1
        # the part that moves along waits for the largest |τ₁|
        results.slopes[i, j] = along * max(1.0, 1 / slope)
        phase = limits.phase * _EPSILON + 2 * given.phase_error[i]
        results.error[i, j] = rounding * abs(tau1) * by_rates + phase * together + evaluation
    of_map, drift = error(
        room.modes, frequencies, elapsed, room.of_start, room.of_rates, given.off[i], reach
    )
    for j in range(times.doubles.size):
        lag = abs(times.doubles[j]) / mean * (rounding + drift) + of_map
        total = limits.safety * (results.error[i, j] + lag * results.slopes[i, j])
        if not total < limits.largest_error:
            return False
        results.error[i, j] = total
        results.tau1[i, j] *= math.sqrt(given.unit[i])
    return True


@compiled()
def _states(given: Motions, times: Times, limits: Limits, room: Room, results: Results) -> None:
    for i in range(given.unit.size):
        _interpolate(given, i, room)
        results.served[i] = set_motion(given, i, times, limits, room, results)


def states(given: Motions, times: Times, limits: Limits, results: Results) -> None:
    """Fill the states of N motions on one panel at the times."""
    genus, terms = given.series.shape[1:]
    rows, columns = given.values.shape
    panel = given.panel
    room = new_room(genus, terms, rows, columns, panel.coefficients.shape)
    which = np.zeros((rows, columns))
    which.ravel()[panel.modes] = 1.0
    set_ranges(room.modes, which)
    room.modes.counted[:] = which != 0
    room.modes.counted[0, columns // 2] = False
    _states(given, times, limits, room, results)
