"""Many starts in doubles, each at a few times: the same functions as one motion, start after start.

A start that they do not serve is left out, for whoever solves it alone: among others where A's
coincide, directions are at rest, or a separatrix is near. Ω has no guard digits here.
"""

from typing import Any

import numpy as np

from .arithmetic import EPSILON, assign, eliminate, jit, jit_making, largest
from .coefficients import RATE
from .elliptic import DENSITY, roots
from .frame import LARGEST_ERROR, set_errors, set_frame, set_frames
from .modes import MOST_MODES, RESONANT, SIDES, jump, make_modes, no_modes
from .panels import PANELS, follow, make_walk, most_panels
from .rate import PHYSICAL
from .start import begin, is_proven, is_wide, make_start
from .torus import MOST_CYCLES, fastest_phase, is_far, is_regular, make_room, make_torus

#: Calibrated: a component of q' along a normal from which its sign is certain, relative to |q'|.
CERTAIN = 1e-9

#: Calibrated: cycles of the fastest phase that panels serve.
MOST_CYCLES_ON_PANELS = 3000.0

#: Budget: panels of one start, some fifty milliseconds; one alone has checkpoints between them.
MOST_PANELS = 300


@jit_making
def torus_of(start: Any, time: Any) -> Any:
    """Return the torus of a start; time (1,)."""
    flow = np.zeros(start.up.size)
    flow[start.up.size - 1] = 1.0
    return make_torus(start, time, flow)


@jit
def set_turn(torus: Any, order: Any, given: Any, body: Any, turn: Any, room: Any) -> Any:
    """Fill ℜ (g, g): (e_2 … e_n) = (n_2 … γ) ℜ at the start. Return whether its signs are certain.

    given: (n, n) the frame at the start, (1, 1) NaN for the natural one; body: (n, n) room
    """
    g = torus.z.size
    set_frame(torus, torus.psi, room, room.frame, room.velocity)
    natural, certain = not abs(given[0, 0]) < np.inf, True
    for k in range(g):
        for c in range(g):
            turn[k, c] = 0.0
            if not natural:
                for i in range(g + 1):
                    turn[k, c] += room.frame[i, k + 1] * given[order[i], c + 1]
        if natural:
            component = room.v[(k + 1) % g]
            turn[k, k] = -1.0 if component < 0 else 1.0
            # the sign of n_2, or of γ alone, is that of the determinant
            certain = certain and (k == 0 or abs(component) > CERTAIN * largest(room.v))
    if natural:
        for i in range(g + 1):
            for c in range(g + 1):
                body[order[i], c] = room.frame[i, c] * (turn[c - 1, c - 1] if c > 0 else 1.0)
        if eliminate(body, room.velocity) < 0:
            turn[0, 0] = -turn[0, 0]
    return certain


@jit_making
def walk_to(torus: Any, times: Any, tau: Any, psi: Any, off: Any, room: Any) -> Any:
    """Fill τ₁, ψ and what is left in t at increasing times by panels; return how many, 0 where they
    do not serve.
    """
    before, panels = 0, 0
    cycles = fastest_phase(torus) * max(abs(times[0]), abs(times[-1]))
    while before < times.size and times[before] < 0:
        before += 1
    for direction in (1, -1):
        count = times.size - before if direction > 0 else before
        if count == 0:
            continue
        order = np.zeros(count, np.int64)
        for i in range(count):
            order[i] = before + i if direction > 0 else before - 1 - i
        walk = make_walk(torus, direction, np.int64(0))
        ends = np.int64(0), np.int64(MOST_PANELS)  # no literals: ``follow`` is compiled once
        if follow(torus, walk, times, order, *ends, tau, psi, off, np.zeros((0, 0)), room) < count:
            return 0
        if walk.lost[PANELS] > most_panels(cycles):
            return 0
        panels += int(walk.lost[PANELS])
    return panels


@jit_making
def reach(torus: Any, times: Any, tau: Any, psi: Any, off: Any, room: Any) -> Any:
    """Fill τ₁, ψ and what is left in t at increasing times by the cheaper time map; return the
    number of panels or modes, 0 where neither serves.
    """
    g = torus.z.size
    cycles = fastest_phase(torus) * max(abs(times[0]), abs(times[-1]))
    if is_far(g, cycles, times.size):
        rates = torus.frequencies / torus.mean[0]
        modes = make_modes(torus, np.int64(RATE), rates, np.zeros(g), SIDES[g], MOST_MODES[g])
        if modes.reach[0] >= 0:
            odd, z = no_modes(g), np.zeros((0, 0))
            failed = jump(torus, modes, odd, times, tau, psi, z, room)
            served = cycles <= MOST_CYCLES and failed == 0
            off[:] = EPSILON * modes.blur[0]
            return modes.amplitudes.size + 1 if served else 0
        if modes.reach[0] == RESONANT:
            return 0
    return walk_to(torus, times, tau, psi, off, room) if cycles <= MOST_CYCLES_ON_PANELS else 0


@jit_making
def solve_starts(
    A: Any,
    q: Any,
    v: Any,
    given: Any,
    times: Any,
    remainders: Any,
    tau: Any,
    velocities: Any,
    frames: Any,
    errors: Any,
    served: Any,
) -> Any:
    """Fill the states of N starts at increasing times, and which of them are served.

    - A, q, v: (N, n); given: (N, n, n) frames at the start, columns; NaN, also (N, 1, 1), for the
      natural ones
    - times, remainders: (T,), what each time is rounded by
    - tau: (N, T) in units of the kernel; velocities: (N, T, n); frames: (N, T, n, n); errors (N, T)
    """
    n, count = A.shape[1], times.size
    start, room, time = make_start(n), make_room(n - 1), np.array([PHYSICAL])
    order = np.zeros(n, np.int64)
    turn, body = np.zeros((n - 1, n - 1)), np.zeros((n, n))
    psi, off, error = np.zeros((count, n - 1)), np.zeros(count), np.zeros((4, count))
    for i in range(A.shape[0]):
        served[i] = False
        if not begin(A[i], q[i], v[i], order, start):
            continue
        if not is_proven(start.d, start.points, start.of_I, start.on_cuts, start.rate):
            continue
        torus = torus_of(start, time)
        if not is_regular(torus):
            continue
        if not set_turn(torus, order, given[i], body, turn, room):
            continue
        if reach(torus, times, tau[i], psi, off, room) == 0:
            continue
        for t in range(count):
            off[t] += abs(remainders[t])
        set_frames(torus, psi, order, turn, frames[i], velocities[i], room)
        set_errors(torus, times, tau[i], psi, off, np.bool_(False), room, error)
        served[i] = True
        for t in range(count):
            errors[i, t] = error[0, t]
            served[i] = served[i] and error[0, t] <= LARGEST_ERROR


@jit_making
def set_actions(d: Any, of_c: Any, cuts: Any, counts: Any, actions: Any) -> Any:
    """Fill J_s = (1/2π)∮ |Π(λ−c_k)| dλ/(2√|R|) over cut s, (g,), a mean over its angle."""
    g = counts.size
    is_c = np.zeros(2 * g + 1, np.bool_)
    for k in of_c:
        is_c[k] = True
    for s in range(g):
        j, total = 2 * s + 1, 0.0
        for i in range(counts[s]):
            low, high = roots(np.pi * (2 * i + 1) / (2 * counts[s]), cuts[s])
            value = cuts[s, DENSITY]
            for b in range(2 * g + 1):
                distance = d[b, j] + low * low if b <= j else d[j + 1, b] + high * high
                if j - 1 <= b <= j + 2:  # in the density
                    value *= distance if is_c[b] else 1.0
                else:
                    value *= np.sqrt(distance) if is_c[b] else 1 / np.sqrt(distance)
            total += value
        actions[s] = total / counts[s]


@jit_making
def set_tori(
    A: Any,
    q: Any,
    v: Any,
    labels: Any,
    points: Any,
    constants: Any,
    rates: Any,
    means: Any,
    frequencies: Any,
    phases: Any,
    actions: Any,
) -> Any:
    """Fill the numbers of the tori of N starts (N, n), in units of the kernel.

    - labels, points: (N, 2g+1) of b_j, i+1 for the I of axis i and −k for c_k, k = 1, …; where a
      torus is not known, they stay as they are
    - constants: (N, n−2) c_2, …; rates: (N,) dt/dτ₁ at the start; means: (N,) F_0
    - frequencies, phases, actions: (N, g)
    """
    n = A.shape[1]
    start, order, time = make_start(n), np.zeros(n, np.int64), np.array([PHYSICAL])
    for i in range(A.shape[0]):
        if not begin(A[i], q[i], v[i], order, start):
            continue
        if not is_wide(start.d, start.points, start.on_cuts, start.rate):
            continue
        torus = torus_of(start, time)
        if not is_regular(torus):
            continue
        set_actions(torus.d, torus.of_c, torus.cuts, torus.angles.counts, actions[i])
        rates[i], means[i] = start.rate[0], torus.mean[0]
        assign(start.points, points[i])
        for k in range(n):
            labels[i, start.of_I[k]] = order[k] + 1
        for k in range(n - 1):
            labels[i, start.of_c[k]] = -k - 1
            frequencies[i, k], phases[i, k] = torus.frequencies[k], torus.z[k]
            if k > 0:
                constants[i, k - 1] = start.points[start.of_c[k]]
