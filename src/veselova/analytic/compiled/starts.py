"""The whole motion of a start with n = 2 or 3, from its numbers to its states, compiled: what
analytic.motion.ensemble does with arrays.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.compiled.compiler import compiled
from veselova.analytic.compiled.spectra import Found, difference, new_found, set_spectrum
from veselova.analytic.compiled.states import (
    Limits,
    Motions,
    Panel,
    Results,
    Room,
    Times,
    new_room,
    set_motion,
)
from veselova.analytic.compiled.time_maps import Modes, set_ranges
from veselova.analytic.compiled.tori import (
    BOXES,
    COUNTS,
    Tables,
    new_tables,
    part,
    set_modes_of,
    set_periods,
)

__all__ = ["Reach", "Starts", "states_of"]

Array = NDArray[np.float64]


class Starts(NamedTuple):
    """N starts along sorted axes, all (N, n): A, q, q̇, the place of each body axis among sorted
    ones; frames (N, n, n), NaN for natural ones; and the layouts of curves with c_2 > I_2 and c_2 <
    I_2.
    """

    A: Any
    q: Any
    q_dot: Any
    places: Any
    frames: Any
    of_I: Any
    of_c: Any


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
def _set_layout(given: Motions, found: Found, tables: Tables, i: int) -> None:
    """Fill where a start lies on its torus: TorusStack.on_cuts and signs."""
    genus = tables.frequencies.size
    for s in range(genus):
        given.below[i, s] = difference(found.spheroconic[i], s, tables.points, 2 * s + 1)
        given.above[i, s] = difference(tables.points, 2 * s + 2, found.spheroconic[i], s)
        given.increasing[i, s] = found.increasing[i, s]
        given.base[i, s] = tables.base[s]
    for k in range(genus + 1):
        place = given.of_I.places[k]
        given.signs[i, k] = found.signs[i, k]
        # along sn, which has the sign of the angle
        if place % 2 == 1 and not found.increasing[i, (place - 1) // 2]:
            given.signs[i, k] = -found.signs[i, k]
        given.A[i, k] = 1 / found.inverse[i, 0, k]


@compiled(inline=True)
def _fit(room: Room, genus: int, terms: int, rows: int, columns: int) -> Room:
    """Return the room with the lengths of the tables of one torus."""
    modes, box = room.modes, rows * columns
    return Room(
        room.torus,
        Modes(
            part(modes.amplitudes.reshape(modes.amplitudes.size), rows, columns),
            part(modes.doubled.reshape(modes.doubled.size), rows, columns),
            modes.first[:rows],
            modes.last[:rows],
            modes.counted.reshape(modes.counted.size)[:box].reshape(rows, columns),
            part(modes.cosines.reshape(modes.cosines.size), 2, max(rows, columns)),
            part(modes.sines.reshape(modes.sines.size), 2, max(rows, columns)),
        ),
        room.of_sines.reshape(room.of_sines.size)[: genus * genus * terms].reshape(
            genus, genus, terms
        ),
        part(room.powers.reshape(room.powers.size), 2, terms + 1),
        room.angles,
        room.start,
        room.slopes,
        room.of_start,
        room.of_rates,
        room.first,
        room.components,
        room.rotation,
        room.uniform,
        room.z,
        room.psi,
        room.ends,
        room.inverse,
        room.unit,
        room.steps,
        room.frames,
        room.along,
        room.chebyshev,
        room.numbers,
    )


@compiled()
def _start(
    starts: Starts,
    i: int,
    found: Found,
    tables: Tables,
    given: Motions,
    reach: Reach,
    times: Times,
    limits: Limits,
    room: Room,
    results: Results,
) -> bool:
    """Fill the states of one start; return whether they are right."""
    if not _is_moderate(starts.A[i], starts.q[i], starts.q_dot[i], reach.binary_digits):
        return False
    set_spectrum(starts.A, starts.q, starts.q_dot, found, i)
    if not found.known[i]:
        return False
    apart = (reach.narrowest, reach.narrowest_cut, reach.narrowest_gap)
    lower, place, scale = set_periods(found, i, apart, reach.cancellation, room.torus, tables)
    if place < 0:
        return False
    rows, off = set_modes_of(room.torus, tables, place, scale, reach.per_wave, reach.spare)
    if rows == 0:
        return False
    genus, terms = tables.frequencies.size, COUNTS[place]
    columns = 2 * rows - 1 if genus == 2 else 1
    own = Motions(
        starts.of_I[1] if lower else starts.of_I[0],
        starts.of_c[1] if lower else starts.of_c[0],
        given.below,
        given.above,
        given.increasing,
        given.base,
        given.differences,
        given.signs,
        found.time_rate,
        given.unit,
        given.A,
        starts.places,
        starts.frames,
        tables.series[: genus * genus * terms].reshape(genus, genus, terms),
        part(tables.values, rows, columns),
        given.off,
        tables.frequencies,
        tables.mean,
        given.rate_rounding,
        given.phase_error,
        given.panel,
    )
    _set_layout(own, found, tables, i)
    given.off[i], given.rate_rounding[i], given.phase_error[i] = off, reach.rate_rounding, 0.0
    given.unit[i] = starts.A[i, genus]
    for a in range(2 * genus + 1):
        for b in range(2 * genus + 1):
            given.differences[i, a, b] = room.torus.differences[a, b]
    fitted = _fit(room, genus, terms, rows, columns)
    set_ranges(fitted.modes, own.values)
    return set_motion(own, i, times, limits, fitted, results)


@compiled()
def _starts(
    starts: Starts,
    found: Found,
    tables: Tables,
    given: Motions,
    reach: Reach,
    times: Times,
    limits: Limits,
    room: Room,
    results: Results,
) -> None:
    for i in range(starts.A.shape[0]):
        results.served[i] = _start(
            starts, i, found, tables, given, reach, times, limits, room, results
        )


def states_of(starts: Starts, times: Times, reach: Reach, limits: Limits, results: Results) -> None:
    """Fill the states of N starts at the times."""
    count, n = starts.A.shape
    genus, rows = n - 1, BOXES[-1] + 1
    none = np.empty(0)
    given = Motions(
        starts.of_I[0],
        starts.of_c[0],
        np.empty((count, genus)),
        np.empty((count, genus)),
        np.empty((count, genus), dtype=np.bool_),
        np.empty((count, genus)),
        np.empty((count, 2 * genus + 1, 2 * genus + 1)),
        np.empty((count, n)),
        none,
        np.empty(count),
        np.empty((count, n)),
        starts.places,
        starts.frames,
        np.empty((genus, genus, 1)),
        np.empty((1, 1)),
        np.empty(count),
        none,
        none,
        np.empty(count),
        np.empty(count),
        Panel(np.empty((0, 0)), none, none, np.empty(0, dtype=np.intp)),
    )
    room = new_room(genus, COUNTS[-1], rows, 2 * rows - 1 if genus == 2 else 1, (0, 0))
    _starts(
        starts, new_found(count, n), new_tables(genus), given, reach, times, limits, room, results
    )
