"""The time map on Chebyshev panels along the orbit: t(τ₁) = ∫ dt/dτ₁ and its inverse, any genus.

A panel is halved until the last coefficients of dt/dτ₁ fall below the working precision, and the
next one is longer where they are far below. A ``Walk`` goes from t = 0 in one direction, panel by
panel, and can be left and taken up again. It may begin at any time whose ψ is known, and have
series of states on its panels too.
"""

from typing import Any, NamedTuple

import numpy as np

from .abel import converged, invert
from .arithmetic import EPSILON, assign, jit, jit_making, largest, pi, solve
from .frame import set_entries, set_frame
from .rate import rate, tilted
from .series import (
    chebyshev,
    integrate,
    set_cosines,
    set_transform,
    tail,
    transform,
)

#: Calibrated: nodes of a panel: with more, panels are longer, and sums of states too.
NODES = 32

#: Calibrated: size of the last coefficients of a panel in EPSILON, and that below which the next
#: panel is longer.
RESOLVED, SPARE = 8.0, 2.0

#: Calibrated: what rounding may leave of them, in EPSILON, where shorter panels are no better.
STALLED = 1e3

#: Calibrated: by how much the last coefficients of states may be larger than those of dt/dτ₁.
LOOSER = 8.0

#: Method: cycles of the fastest phase in the first panel; what an unresolved one is shortened by,
#: and a resolved one lengthened.
FIRST, SHORTER, LONGER = 0.75, 0.7, 1.2

#: Method: how far a prediction may be from the last node, in radians.
FARTHEST = 3.0

#: Budget: cycles of the fastest phase in the shortest panel.
SHORTEST = 1e-9

#: Calibrated: how many panels a cycle of the fastest phase takes where rounding does not keep a
#: panel from being resolved, beside a first few.
PANELS_OF_A_CYCLE, FIRST_PANELS = 8.0, 300

#: Method: past nodes that predict the next one: a quintic polynomial by values and derivatives.
PAST = 3


class Walk(NamedTuple):
    """Where a walk along the orbit is, and its present panel.

    - left: (10,) τ₁ and t at the panel's left end, from the walk's beginning, its length, the time
      that it takes, the next length, and the longest that is tried; τ₁ and t at the beginning; by
      what the first two are rounded
    - lost: (4,) doubles: what truncation leaves in t at its end, the number of panels so far, its
      share, and the largest part of states that a panel leaves out
    - z, psi: (g,) phases and angles at the left end
    - right: (g,) angles at the right end
    - series: (R, N) of dt/dτ₁, ψ − 2πfτ, the entries of states and what ``path`` integrates;
      integral: (N+1,) of t
    - path: (K,) integrals of the components (q',n_k), and after them of the odd part of the rate,
      at the left end; along: (K, N+1) their series from there
    - past_tau: (PAST,), past_psi, past_slope: (PAST, g) the last nodes relative to the left end
    - table: (4N,), matrix: (N, N), values: (R, N)
    - directions, turn, rest: of ``set_entries``; directions: (0, 0) where states have no series
    """

    left: Any
    lost: Any
    z: Any
    psi: Any
    right: Any
    series: Any
    integral: Any
    path: Any
    along: Any
    past_tau: Any
    past_psi: Any
    past_slope: Any
    known: Any
    table: Any
    matrix: Any
    values: Any
    directions: Any
    turn: Any
    rest: Any


LEFT, BEFORE, LENGTH, ELAPSED, NEXT, LONGEST, FIRST_TAU, FIRST_TIME = 0, 1, 2, 3, 4, 5, 6, 7
OFF_LEFT, OFF_BEFORE = 8, 9
LOST, PANELS, REST, STATES = 0, 1, 2, 3


@jit_making
def make_walk(torus: Any, direction: Any, paths: Any) -> Any:
    """Return a walk that stands at t = 0, with so many integrals; direction: 1 or −1."""
    none = np.zeros((0, 0))
    return make_dense_walk(torus, direction, paths, none, none, none)


@jit_making
def make_dense_walk(
    torus: Any, direction: Any, paths: Any, directions: Any, turn: Any, rest: Any
) -> Any:
    """Return a walk with series of states, those of ``set_entries``, on its panels, and so many
    integrals of ``set_path``.
    """
    g, count, n = torus.z.size, NODES, directions.shape[0]
    rows = 1 + g + n + n * n + paths
    table, matrix, left = np.zeros(4 * count), np.zeros((count, count)), np.zeros(10)
    set_cosines(table)
    set_transform(matrix)
    left[NEXT] = direction * FIRST / largest(torus.frequencies)
    left[LONGEST] = 100 * left[NEXT]
    return Walk(
        left,
        np.zeros(4),
        torus.z.copy(),
        torus.psi.copy(),
        torus.psi.copy(),
        np.zeros((rows, count)),
        np.zeros(count + 1),
        np.zeros(paths),
        np.zeros((paths, count + 1)),
        np.zeros(PAST),
        np.zeros((PAST, g)),
        np.zeros((PAST, g)),
        np.zeros(1, np.int64),
        table,
        matrix,
        np.zeros((rows, count)),
        directions,
        turn,
        rest,
    )


@jit
def predict(walk: Any, tau: Any, psi: Any) -> Any:
    """Fill ψ (g,) at τ by Hermite's polynomial through the past nodes, with Lagrange's l_i:

        ψ = Σ_i l_i² (ψ_i (1 − 2(τ−τ_i) l_i'(τ_i)) + ψ_i' (τ−τ_i))

    Where ψ turns faster than they tell, it is that of the last node.
    """
    psi[:] = 0.0
    for i in range(walk.known[0]):
        ahead, lagrange, slope = tau - walk.past_tau[i], 1.0, 0.0
        for j in range(walk.known[0]):
            if j != i:
                over_width = 1 / (walk.past_tau[i] - walk.past_tau[j])
                lagrange = lagrange * (tau - walk.past_tau[j]) * over_width
                slope = slope + over_width
        square = lagrange * lagrange
        of_psi, of_slope = square * (1 - 2 * ahead * slope), square * ahead
        for k in range(psi.size):
            psi[k] += of_psi * walk.past_psi[i, k] + of_slope * walk.past_slope[i, k]
    for k in range(psi.size):
        if abs(psi[k] - walk.past_psi[0, k]) > FARTHEST:
            assign(walk.past_psi[0], psi)


@jit
def remember(walk: Any, tau: Any, psi: Any, slope: Any) -> Any:
    """Put a node before the past ones."""
    for i in range(PAST - 1, 0, -1):
        walk.past_tau[i] = walk.past_tau[i - 1]
        assign(walk.past_psi[i - 1], walk.past_psi[i])
        assign(walk.past_slope[i - 1], walk.past_slope[i])
    walk.past_tau[0] = tau
    assign(psi, walk.past_psi[0])
    assign(slope, walk.past_slope[0])
    walk.known[0] = min(walk.known[0] + 1, PAST)


@jit
def set_panel(torus: Any, walk: Any, length: Any, psi: Any, room: Any) -> Any:
    """Fill the series of the panel that begins at the walk's place; return whether all inversions
    converged.
    """
    g, count = psi.size, walk.matrix.shape[0]
    is_framed = walk.directions.size + walk.path.size > 0 or torus.tilt[0] != 0
    for i in range(count):
        j = count - 1 - i
        tau = length * (1 - walk.table[2 * i + 1]) / 2
        for k in range(g):
            room.target[k] = walk.z[k] + torus.frequencies[k] * tau
        if walk.known[0] > 0:
            predict(walk, tau, psi)
        elif i == 0:
            assign(walk.psi, psi)
        if not invert(torus.angles, room.target, psi, room):
            return False
        if is_framed:
            set_frame(torus, psi, room, room.frame, room.velocity)
        walk.values[0, j] = rate(torus, psi, room.frame)
        for k in range(g):
            walk.values[1 + k, j] = psi[k] - 2 * pi * torus.frequencies[k] * tau
            room.target[k] = torus.frequencies[k]
        solve(room.slopes, room.target, room.step)
        remember(walk, tau, psi, room.step)
        if walk.directions.size > 0:
            along = walk.directions, walk.turn, walk.rest
            set_entries(walk.values[0, j], *along, room, walk.values[1 + g :], j)
        set_path(torus, walk, walk.values[0, j], room, j)
    for k in range(walk.series.shape[0]):
        transform(walk.matrix, walk.values[k], walk.series[k])
    return True


@jit
def set_path(torus: Any, walk: Any, slowness: Any, room: Any, j: Any) -> Any:
    """Fill column j of what the path integrates: (q',n_k), and the odd part of the rate."""
    count, g = walk.path.size, room.v.size
    first = walk.values.shape[0] - count
    for k in range(count):
        if k < g - 1:
            walk.values[first + k, j] = room.v[k + 1]
        else:
            part = tilted(torus, room.frame)
            walk.values[first + k, j] = -slowness * part / (1 - part)


@jit
def left_out_of_path(walk: Any) -> Any:
    """Return the largest of the last coefficients of what the path integrates, against its largest
    value on the panel.
    """
    rows, count = walk.values.shape
    worst = 0.0
    for i in range(rows - walk.path.size, rows):
        peak = largest(walk.values[i])
        if peak > 0:
            worst = max(worst, tail(walk.series[i], count) / peak)
    return worst


@jit
def left_out(walk: Any, g: Any) -> Any:
    """Return the largest of the last coefficients of velocities, against the largest velocity, and
    of frames.
    """
    n, count = walk.directions.shape[0], walk.matrix.shape[0]
    fastest, velocities, frames = 0.0, 0.0, 0.0
    for i in range(1 + g, walk.series.shape[0] - walk.path.size):
        last = tail(walk.series[i], count)
        if i < 1 + g + n:
            velocities = max(velocities, last)
            fastest = max(fastest, largest(walk.values[i]))
        else:
            frames = max(frames, last)
    return max(frames, velocities / fastest if fastest > 0 else 0.0)


@jit
def place(rates: Any, integral: Any, span: Any, elapsed: Any, half: Any) -> Any:
    """Return x in [−1, 1] where an integral is ``elapsed``, from zero at −1 to ``span`` at 1:
    Newton's method in a bracket.

    rates: (N,) series of dt/dτ₁, of one sign; integral: (N+1,) that of t; half: dτ₁/dx
    """
    low, high, last, x = -1.0, 1.0, 1.0, 2 * (elapsed / span) - 1
    for _ in range(100):
        change = chebyshev(integral, integral.size, x) - elapsed
        change = change / (chebyshev(rates, rates.size, x) * half)
        new, step = x - change, abs(change)
        if converged(step, last):
            return min(max(new, -1.0), 1.0)
        if change > 0:
            high = x
        else:
            low = x
        inside = low < new < high
        x, last = new if inside else (low + high) / 2, min(step, 1.0) if inside else 1.0
    return x


@jit
def next_panel(torus: Any, walk: Any, room: Any) -> Any:
    """Move on by a panel; return False where none resolves the orbit."""
    g, count = torus.z.size, walk.matrix.shape[0]
    left, lost = walk.left, walk.lost
    # Kahan's sums: what is rounded at thousands of panels would add up
    for place, new, off in ((LEFT, LENGTH, OFF_LEFT), (BEFORE, ELAPSED, OFF_BEFORE)):
        before, part = left[place], left[new] - left[off]
        left[place] = before + part
        left[off] = (left[place] - before) - part
    if left[LENGTH] != 0:
        for k in range(walk.path.size):
            walk.path[k] = walk.path[k] + chebyshev(walk.along[k], count + 1, 1.0)
    for k in range(g):  # on by a panel, and back by whole periods of the frame
        walk.z[k] = walk.z[k] + torus.frequencies[k] * left[LENGTH]
        cycles = 2 * round(walk.z[k] / 2)
        walk.z[k] = walk.z[k] - cycles
        walk.psi[k] = walk.right[k] - 2 * pi * cycles
        for i in range(PAST):
            walk.past_psi[i, k] = walk.past_psi[i, k] - 2 * pi * cycles
    for i in range(PAST):
        walk.past_tau[i] = walk.past_tau[i] - left[LENGTH]
    length, previous, most = left[NEXT], 1e300, largest(torus.cancellation)
    while True:
        good = set_panel(torus, walk, length, room.angles, room)
        rest, states = tail(walk.series[0], count) / abs(walk.series[0, 0]), left_out(walk, g)
        rest = max(rest, max(states, left_out_of_path(walk)) / (LOOSER * most))
        # where rounding keeps a shorter panel from being better, it serves too
        near = previous / 4 < rest < STALLED * EPSILON
        if good and (rest < RESOLVED * EPSILON or near):
            break
        if not abs(length) * largest(torus.frequencies) >= SHORTEST:
            return False
        left[LONGEST] = length * 0.9
        length, previous = length * SHORTER, rest
        walk.known[0] = 0
    for k in range(g):
        end = chebyshev(walk.series[1 + k], count, 1.0)
        walk.right[k] = end + 2 * pi * torus.frequencies[k] * length
    left[LENGTH] = length
    left[ELAPSED] = integrate(walk.series[0], length / 2, walk.integral)
    for k in range(walk.path.size):
        row = walk.series.shape[0] - walk.path.size + k
        integrate(walk.series[row], length / 2, walk.along[k])
    left[NEXT] = length * LONGER if rest < SPARE * EPSILON else length
    if abs(left[NEXT]) > abs(left[LONGEST]):
        left[NEXT] = left[LONGEST]
    # the mean of dt/dτ₁ along the orbit is as far off as a⁻¹
    blur = EPSILON * (most - 1) / 2
    lost[LOST] += (rest + blur) * abs(left[ELAPSED])
    lost[PANELS] += 1.0
    lost[REST], lost[STATES] = rest, max(lost[STATES], states)
    return True


@jit
def follow(
    torus: Any,
    walk: Any,
    times: Any,
    order: Any,
    first: Any,
    most: Any,
    tau: Any,
    psi: Any,
    off: Any,
    paths: Any,
    room: Any,
) -> Any:
    """Fill τ₁ (T,), ψ modulo 4π (T, g), what truncation leaves in t (T,) and integrals (K, T) at
    times[order[first:]], which go away from zero in the walk's direction.

    Return the place in ``order`` reached after ``most`` panels, −1 where panels do not serve.
    """
    g, count = torus.z.size, walk.matrix.shape[0]
    left, used = walk.left, 0
    forward = left[NEXT] > 0
    for i in range(first, order.size):
        t = order[i]
        while True:
            elapsed = times[t] - left[FIRST_TIME] - left[BEFORE]
            beyond = elapsed - left[ELAPSED]
            if walk.lost[PANELS] > 0 and not (beyond if forward else -beyond) > 0:
                break
            if used == most:
                return i
            if not next_panel(torus, walk, room):
                return -1
            used += 1
        half = left[LENGTH] / 2
        x = place(walk.series[0], walk.integral, left[ELAPSED], elapsed, half)
        tau[t], off[t] = left[LEFT] + half * (1 + x), walk.lost[LOST]
        for k in range(walk.path.size):
            paths[k, t] = walk.path[k] + chebyshev(walk.along[k], count + 1, x)
        for k in range(g):
            advance = torus.frequencies[k] * half * (1 + x)
            room.target[k] = walk.z[k] + advance
            psi[t, k] = chebyshev(walk.series[1 + k], count, x) + 2 * pi * advance
        if not invert(torus.angles, room.target, psi[t], room):
            return -1
    return order.size


@jit
def most_panels(cycles: Any) -> Any:
    """Return how many panels so many cycles of the fastest phase take at most."""
    return FIRST_PANELS + PANELS_OF_A_CYCLE * cycles
