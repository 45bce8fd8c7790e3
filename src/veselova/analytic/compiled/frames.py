"""The attitude and the velocity of one motion from its angles, compiled, and what the start fixes:
what analytic.motion.ensemble does with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.attitude.frame import STEP
from veselova.analytic.attitude.sensitivity_sampling import BETWEEN
from veselova.analytic.compiled.angle_maps import phases
from veselova.analytic.compiled.attitudes import angle, attitude, set_own_roots, set_torus
from veselova.analytic.compiled.compiler import Record, compiled
from veselova.analytic.compiled.linear_equations import determinant, largest, solve
from veselova.analytic.compiled.rooms import Limits, Results, Series

__all__ = ["complete", "set_start", "set_state"]

Array = NDArray[np.float64]

#: Derived: the rounding of a double.
_EPSILON = float(DOUBLE.epsilon)


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
    if determinant(in_body) < 0:
        room.rotation[0, 0] *= -1
    return bool(least > certain * most)


@compiled()
def set_start(
    motion: Record, frame: Array, layout: Record, room: Record, angles: Series, limits: Limits
) -> bool:
    """Fill the angles, phases and attitude at the start; return whether its signs are certain."""
    torus, genus = room.torus, room.angles.size
    for a in range(genus + 1):
        torus.signs[a] = motion.signs[a]
    set_torus(torus, layout)
    series = angles.series
    for s in range(genus):
        room.angles[s] = angle(
            motion.below[s], motion.above[s], motion.increasing[s], torus.cuts[s]
        )
        for k in range(genus):
            for m in range(1, series.shape[2]):
                angles.of_sines[k, s, m] = series[k, s, m] / m
    phases(room.angles, series, angles.of_sines, series.shape[2], room.start, room.slopes)
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
def _set_turning(room: Record, frequencies: Array) -> None:
    """Fill how fast the frame moves along the motion, with the rates, and with the phases:
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
    room.turning[0], room.turning[1], room.turning[2] = along, by_rates, math.sqrt(together)


@compiled()
def _set_frame(motion: Record, room: Record, q_dot: Array, frame: Array) -> None:
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
def set_state(
    motion: Record,
    layout: Record,
    limits: Limits,
    room: Record,
    results: Results,
    i: int,
    j: int,
    tau1: float,
    slope: float,
    sampled: bool,
) -> None:
    """Fill state j of motion i from the angles, their slopes, and the slope of the time map; of the
    error what does not move along. Unless sensitivities are ``sampled`` they are those before.
    """
    set_own_roots(room.torus, room.psi)
    attitude(room.torus, layout, room.frames[0], room.along[0])
    if sampled:
        _set_ends(layout, room)
        _set_turning(room, room.tables.frequencies)
    _set_frame(motion, room, results.q_dot[i, j], results.frame[i, j])
    along, by_rates, together = room.turning[0], room.turning[1], room.turning[2]
    results.tau1[i, j] = tau1
    # what moves along waits for the error of the time map
    results.slopes[i, j] = along * max(1.0, 1 / slope)
    phase = limits.phase * _EPSILON + 2 * motion.phase_error
    evaluation = max(limits.evaluation, 3.0 * room.psi.size + 3.0) * _EPSILON
    own = motion.rate_rounding * abs(tau1) * by_rates
    results.error[i, j] = own + phase * together + evaluation


@compiled()
def complete(motion: Record, limits: Limits, results: Results, i: int, j: int, lag: float) -> bool:
    """Add to an error what time that lags behind does, and put τ₁ in the units of the problem;
    return whether the error is small enough.
    """
    total = limits.safety * (results.error[i, j] + lag * results.slopes[i, j])
    results.error[i, j] = total
    results.tau1[i, j] *= math.sqrt(motion.unit)
    return bool(total < limits.largest_error)
