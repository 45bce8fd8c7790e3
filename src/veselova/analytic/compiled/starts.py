"""The whole motion of a start with n = 2, 3 or 4, from its numbers to its states, compiled: what
analytic.motion.ensemble does with arrays.
"""

from __future__ import annotations

import math
import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.compiled.compiler import Record, compiled, compiling
from veselova.analytic.compiled.panels import set_motion_on_panels
from veselova.analytic.compiled.rooms import (
    Limits,
    Results,
    Times,
    fit,
    fit_series,
    room_type,
)
from veselova.analytic.compiled.spectra import Found, difference, found_in, set_spectrum
from veselova.analytic.compiled.states import set_motion
from veselova.analytic.compiled.time_maps import set_ranges
from veselova.analytic.compiled.tori import COUNTS, set_modes_of, set_periods

__all__ = ["Reach", "states_of"]

Array = NDArray[np.float64]


class _Rooms(threading.local):
    """The numbers of one motion, in each thread, by genus."""

    def __init__(self) -> None:
        self.of = {genus: np.empty(1, room_type(genus)) for genus in (1, 2, 3)}


_rooms = _Rooms()


class Reach(NamedTuple):
    """The constants of analytic.motion.torus_stack and ensemble that bound what is served."""

    binary_digits: float
    narrowest: float
    narrowest_cut: float
    narrowest_gap: float
    cancellation: float
    rate_rounding: float
    per_wave: float
    spare: float


@compiled()
def _set_sorted(start: Array, room: Record) -> None:
    """Fill A, q and q̇ along axes of falling A, in a row each, and the places of body axes."""
    n, places = start.shape[1], room.motion.places
    for axis in range(n):
        place = 0
        for other in range(n):
            a, b = start[0, other], start[0, axis]
            if a > b or (a == b and other < axis):
                place += 1
        places[axis] = place
        for k in range(3):
            room.sorted[k, 0, place] = start[k, axis]


@compiled()
def _is_moderate(A: Array, q: Array, q_dot: Array, most: float) -> bool:
    """torus_stack.known_starts."""
    total, of_A, speed = 0.0, 0.0, 0.0
    for k in range(A.size):
        if k and not A[k - 1] > A[k]:
            return False
        size = abs(math.log2(A[k])) if A[k] > 0 else np.inf
        total += size
        of_A = max(of_A, size)
        size = abs(math.log2(abs(q[k]))) if abs(q[k]) > 0 else np.inf
        if not size < most:
            return False
        if not abs(q_dot[k]) < np.inf:
            return False
        speed = max(speed, abs(q_dot[k]))
    return total < most and of_A < most and speed > 0 and abs(math.log2(speed)) < most


@compiled()
def _set_layout(layout: Record, found: Found, room: Record) -> None:
    """Fill where a start lies on its torus: TorusStack.on_cuts and signs."""
    motion, tables = room.motion, room.tables
    genus = tables.frequencies.size
    for s in range(genus):
        motion.below[s] = difference(found.spheroconic[0], s, tables.points, 2 * s + 1)
        motion.above[s] = difference(tables.points, 2 * s + 2, found.spheroconic[0], s)
        motion.increasing[s] = found.increasing[0, s]
        motion.base[s] = tables.base[s]
    for k in range(genus + 1):
        place = layout.of_I.places[k]
        motion.signs[k] = found.signs[0, k]
        # along sn, which has the sign of the angle
        if place % 2 == 1 and not found.increasing[0, (place - 1) // 2]:
            motion.signs[k] = -found.signs[0, k]
        motion.A[k] = 1 / found.inverse[0, 0, k]


@compiled()
def _set_torus(start: Array, reach: Reach, layouts: Any, room: Record) -> tuple[int, int, float]:
    """Fill the periods of one start and where it lies; return the order of branch points, the place
    of its number of nodes, −1 for what is left out, and the scale of dt/dτ₁.
    """
    _set_sorted(start, room)
    A, q, q_dot = room.sorted[0], room.sorted[1], room.sorted[2]
    if not _is_moderate(A[0], q[0], q_dot[0], reach.binary_digits):
        return 0, -1, 0.0
    found = found_in(room.found)
    set_spectrum(A, q, q_dot, found, 0)
    if not found.known[0]:
        return 0, -1, 0.0
    torus, tables, motion = room.torus, room.tables, room.motion
    apart = (reach.narrowest, reach.narrowest_cut, reach.narrowest_gap)
    order, place, scale = set_periods(found, 0, apart, reach.cancellation, torus, tables)
    if place >= 0:
        _set_layout(layouts[order], found, room)
        motion.off, motion.rate_rounding, motion.phase_error = 0.0, reach.rate_rounding, 0.0
        motion.time_rate, motion.unit = found.time_rate[0], A[0, start.shape[1] - 1]
    return order, place, scale


@compiled()
def _by_modes(
    starts: Array,
    frames: Array,
    layouts: Any,
    times: Times,
    reach: Reach,
    limits: Limits,
    rooms: Any,
    results: Results,
) -> None:
    """Fill the states of starts, and which of them are right, by Fourier time maps."""
    room = rooms[0]
    for i in range(starts.shape[0]):
        results.served[i] = False
        order, place, scale = _set_torus(starts[i], reach, layouts, room)
        if place < 0:
            continue
        rows, off = set_modes_of(room.tables, place, scale, reach.per_wave, reach.spare)
        if rows == 0:
            continue
        room.motion.off = off
        fitted = fit(room, starts.shape[2] - 1, COUNTS[place], rows)
        set_ranges(fitted.modes, fitted.values)
        results.served[i] = set_motion(
            room.motion, frames[i], layouts[order], times, limits, room, fitted, results, i
        )


@compiled()
def _by_panels(
    starts: Array,
    frames: Array,
    layouts: Any,
    times: Times,
    reach: Reach,
    limits: Limits,
    rooms: Any,
    results: Results,
) -> None:
    """Fill the states of starts, and which of them are right, by panels."""
    room = rooms[0]
    for i in range(starts.shape[0]):
        results.served[i] = False
        order, place, scale = _set_torus(starts[i], reach, layouts, room)
        if place < 0:
            continue
        series = fit_series(room, starts.shape[2] - 1, COUNTS[place])
        results.served[i] = set_motion_on_panels(
            room.motion, frames[i], layouts[order], times, limits, scale, room, series, results, i
        )


@compiling
def states_of(
    layouts: Any,
    reach: Reach,
    limits: Limits,
    starts: Array,
    frames: Array,
    times: Times,
    results: Results,
) -> None:
    """Fill the states of N starts (N, 3, n), which are A, q and q̇, at the times.

    - layouts: of all orders of branch points, by ``_set_points``
    - frames: (N, n, n) at the start, columns; (N, 1, 1) and NaN for natural ones
    """
    genus = starts.shape[2] - 1
    fill = _by_panels if genus == 3 else _by_modes
    fill(starts, frames, layouts, times, reach, limits, _rooms.of[genus], results)
