"""The states of one motion with n = 4 by Chebyshev panels of dt/dτ₁, compiled: what
analytic.time_map.panels does with arrays.

Panels are made one after the other, away from τ₁ = 0, and each serves the times in it. Beside the
time there are series of ψ_k − 2πz_k on it, from which the angles at a time take one step.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.compiled.angle_maps import invert, predict, set_phases
from veselova.analytic.compiled.attitudes import cut_roots
from veselova.analytic.compiled.compiler import Record, compiled
from veselova.analytic.compiled.frames import complete, set_start, set_state
from veselova.analytic.compiled.linear_equations import largest, solve
from veselova.analytic.compiled.rooms import NODES, Limits, Results, Series, Times
from veselova.analytic.compiled.spectra import exact_sum
from veselova.analytic.time_map import chebyshev_panels, panel_quadrature, panels

__all__ = ["set_motion_on_panels"]

Array = NDArray[np.float64]

#: Derived: the rounding of a double, and 2π.
_EPSILON = float(DOUBLE.epsilon)
_TURN = 2 * math.pi

_TAIL, _STALLED = chebyshev_panels.TAIL, chebyshev_panels.STALLED
_CONVERGED, _NOISE = chebyshev_panels.CONVERGED, panel_quadrature.NOISE_TAIL
_SHARED_ROUNDING, _OF_PHASES = panels.SHARED_ROUNDING, panels.TURN

#: Method: cycles of the fastest phase on a panel at first, at most; what is left of a panel that is
#: not resolved, at most; and in how many parts of a power of two lengths are whole, so that τ₁ at
#: borders is exact.
_CYCLES, _SHORTER, _PARTS = 1.75, 0.75, 8

#: Method: cycles of the fastest phase up to which panels serve, besides those for each time;
#: beyond, Fourier time maps cost less.
_FEW_CYCLES, _CYCLES_PER_TIME = 100.0, 0.5

#: Budget: panels that are tried, against those of the first length, besides a few; and steps of
#: Newton's method to a time.
_TRIED, _FEW_TRIED = 3, 20
_MOST_STEPS = 12

#: Method: nodes that predict the next one.
_PAST = 3

#: Chebyshev points of [0, 1], upwards, and the matrix from values there to coefficients.
_POINTS = (1 - np.cos(DOUBLE.nodes(NODES))) / 2
_TO_COEFFICIENTS = np.ascontiguousarray(DOUBLE.cosine_series(np.eye(NODES)).T[:, ::-1])


@compiled()
def _rate(room: Record, scale: float) -> float:
    """Return dt/dτ₁ at the angles: TimeRate.at."""
    result, points = scale, room.tables.points
    for s in range(room.psi.size):
        root = cut_roots(room.psi[s], room.torus.cuts[s])[0]
        result *= math.sqrt((points[0, 2 * s + 1] + root * root) / points[0, 2 * s + 2])
    return result


@compiled()
def _find_angles(room: Record, angles: Series, predicted: bool) -> bool:
    """Fill the angles at the phases, from the guess where there is one."""
    series, of_sines, step = angles.series, angles.of_sines, room.steps
    guess = room.guess[1:]
    if predicted and invert(
        room.z, series, of_sines, guess, room.psi, room.slopes, room.unit, step
    ):
        return True
    guess[0] = np.nan
    return invert(room.z, series, of_sines, guess, room.psi, room.slopes, room.unit, step)


@compiled(fast=True)
def _product(a: Array, b: Array) -> float:
    total = 0.0
    for k in range(b.size):
        total += a[k] * b[k]
    return total


@compiled()
def _set_nodes(left: float, length: float, scale: float, room: Record, angles: Series) -> bool:
    """Fill dt/dτ₁ and ψ_k − 2πz_k at the nodes of a panel; return whether all were found."""
    frequencies, genus = room.tables.frequencies, room.psi.size
    past = room.past[:_PAST, : 2 * genus + 1]
    for row in range(_PAST):
        past[row, 0] = -np.inf
    set_phases(room.start, frequencies, 1.0, left, 0.0, room.uniform)
    forward = 1.0 if length > 0 else -1.0
    for j in range(NODES):
        offset = length * _POINTS[j]
        for k in range(genus):
            room.z[k] = room.uniform[k] + offset * frequencies[k]
        predicted = predict(past, abs(offset), abs(length), room.guess[1:])
        if not _find_angles(room, angles, predicted):
            return False
        room.at_nodes[0, j] = _rate(room, scale)
        solve(room.slopes, frequencies, room.steps)
        row = past[j % _PAST]
        row[0] = abs(offset)
        for k in range(genus):
            room.at_nodes[k + 1, j] = room.psi[k] - _TURN * room.z[k]
            row[2 * k + 1] = room.at_nodes[k + 1, j]
            row[2 * k + 2] = forward * (room.steps[k] - _TURN * frequencies[k])
    return True


@compiled()
def _set_panel(left: float, length: float, scale: float, room: Record, angles: Series) -> float:
    """Fill the series on a panel, and the integral of dt/dτ₁ from its beginning; return the largest
    of the last coefficients of dt/dτ₁ against its mean, NaN where angles were not found.
    """
    if not _set_nodes(left, length, scale, room, angles):
        return np.nan
    for c in range(room.series.shape[0]):
        for m in range(NODES):
            room.series[c, m] = _product(_TO_COEFFICIENTS[m], room.at_nodes[c])
    rates, integral = room.series[0], room.integral
    integral[0], sign = 0.0, 1.0
    for m in range(1, NODES + 1):
        before = rates[m - 1] if m > 1 else 2 * rates[0]
        after = rates[m + 1] if m + 1 < NODES else 0.0
        integral[m] = (before - after) / (2 * m) * (length / 2)
        integral[0] += sign * integral[m]
        sign = -sign
    return float(largest(rates[NODES - 3 :]) / rates[0])


@compiled()
def _set_polynomials(x: float, values: Array) -> None:
    """Fill the Chebyshev polynomials at a point."""
    values[0], values[1] = 1.0, x
    for m in range(2, values.size):
        values[m] = 2 * x * values[m - 1] - values[m - 2]


@compiled()
def _find_place(target: float, whole: float, length: float, room: Record) -> tuple[float, bool]:
    """Return where, −1 … 1, the integral over a panel has a value, and whether that was found; the
    polynomials there are filled.
    """
    x, found = 2 * target / whole - 1, False
    for _ in range(_MOST_STEPS):
        x = min(max(x, -1.0), 1.0)
        _set_polynomials(x, room.polynomials)
        if found:
            break
        value = _product(room.polynomials, room.integral) - target
        step = value / (_product(room.polynomials, room.series[0]) * (length / 2))
        found = abs(step) <= _CONVERGED
        x -= step
    return x, found


@compiled()
def _whole(length: float) -> float:
    """Return the next smaller length of few bits."""
    unit = 2.0 ** math.floor(math.log2(length)) / _PARTS
    return float(math.floor(length / unit) * unit)


@compiled()
def _begin(panel: Record, size: float) -> None:
    """Begin at τ₁ = 0, where there is no panel yet, with a first length."""
    panel.size, panel.tried = size, 0
    panel.left, panel.length, panel.value, panel.rest = 0.0, 0.0, 0.0, 0.0
    panel.whole, panel.lost, panel.least, panel.most = 0.0, 0.0, 0.0, 0.0


@compiled()
def _advance(scale: float, most_tried: int, room: Record, angles: Series) -> bool:
    """Go on to the next panel, a shorter one where it is not resolved; return whether it is."""
    panel = room.panel
    panel.left += panel.length
    panel.value, lost = exact_sum(panel.value, panel.whole)
    panel.rest += lost
    swing = panel.value / room.tables.mean[0] - panel.left
    panel.least, panel.most = min(panel.least, swing), max(panel.most, swing)
    before, tail = np.inf, np.nan
    while True:
        tail = _set_panel(panel.left, panel.size, scale, room, angles)
        panel.tried += 1
        if tail <= _TAIL or _STALLED * before < tail <= _NOISE:
            break
        if panel.tried > most_tried or math.isnan(tail):
            return False
        before = tail
        panel.size = math.copysign(_whole(_SHORTER * abs(panel.size)), panel.size)
    panel.length, panel.whole = panel.size, 0.0
    for m in range(NODES + 1):
        panel.whole += room.integral[m]
    rounding = max(tail, _TAIL) / NODES + _EPSILON / 2
    panel.lost += rounding * abs(room.series[0, 0] * panel.length)
    return True


@compiled()
def _lag(motion: Record, time: float, tau1: float, room: Record) -> float:
    """Return by how much τ₁ may be off where dt/dτ₁ is its mean: ErrorBound._moved and
    ChebyshevTimeMap.error, with slow parts as far as they swing.
    """
    panel, mean = room.panel, room.tables.mean[0]
    elapsed, of_phases = abs(time) / mean, 0.0
    for k in range(room.psi.size):
        of_phases += room.of_start[k] + room.of_rates[k] * abs(tau1)
    own = elapsed * (motion.rate_rounding + _SHARED_ROUNDING) + 2 * panel.lost / mean
    return float(own + _OF_PHASES * min(panel.most - panel.least, elapsed) * of_phases)


@compiled()
def _set_at(time: float, rest: float, room: Record, angles: Series) -> tuple[float, float, bool]:
    """Fill the angles at a time of the panel; return τ₁, the slope of the time map, and whether
    they were found.
    """
    panel, frequencies = room.panel, room.tables.frequencies
    target = time - panel.value + (rest - panel.rest)
    x, found = _find_place(target, panel.whole, panel.length, room)
    offset = (x + 1) * (panel.length / 2)
    for k in range(room.psi.size):
        room.z[k] = room.uniform[k] + offset * frequencies[k]
        room.guess[k + 1] = _product(room.polynomials, room.series[k + 1])
    slope = _product(room.polynomials, room.series[0]) / room.tables.mean[0]
    return panel.left + offset, slope, found and _find_angles(room, angles, True)


@compiled()
def set_motion_on_panels(
    motion: Record,
    frame: Array,
    layout: Record,
    times: Times,
    limits: Limits,
    scale: float,
    room: Record,
    angles: Series,
    results: Results,
    i: int,
) -> bool:
    """Fill the states of one motion at increasing times, those after t = 0 and then those before;
    return whether they are right. ``scale`` is that of dt/dτ₁.
    """
    fastest, number = largest(room.tables.frequencies), times.doubles.size
    cycles = fastest / room.tables.mean[0] * largest(times.doubles)
    if not cycles < _FEW_CYCLES + _CYCLES_PER_TIME * number:
        return False
    if not set_start(motion, frame, layout, room, angles, limits):
        return False
    panel, most_tried = room.panel, int(_TRIED * cycles / _CYCLES) + _FEW_TRIED
    first = np.searchsorted(times.doubles, 0.0)
    for sign in (1, -1):
        _begin(panel, sign * _whole(_CYCLES / fastest))
        for j in range(first, number) if sign > 0 else range(first - 1, -1, -1):
            time = times.doubles[j]
            while panel.tried == 0 or sign * (time - panel.value) > sign * panel.whole:
                if not _advance(scale, most_tried, room, angles):
                    return False
            tau1, slope, found = _set_at(time, times.remainders[j], room, angles)
            if not found:
                return False
            set_state(motion, layout, limits, room, results, i, j, tau1, slope, True)
            lag = _lag(motion, time, tau1, room)
            if not complete(motion, limits, results, i, j, lag):
                return False
    return True
