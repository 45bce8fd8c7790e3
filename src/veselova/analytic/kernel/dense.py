"""States at many times of a panel: Chebyshev series of their entries, and one sum of these a time.

The columns of a frame, q and n_2 … γ, turn smoothly where angles turn sharply, so a panel that
resolves dt/dτ₁ resolves them about as well. Times are taken by blocks, the orders of a table of
T_m(x) one below another.
"""

from typing import Any

import numpy as np

from .abel import converged
from .arithmetic import assign, jit, jit_making, pi
from .panels import (
    BEFORE,
    ELAPSED,
    FIRST_TAU,
    FIRST_TIME,
    LEFT,
    LENGTH,
    LOST,
    NEXT,
    OFF_BEFORE,
    OFF_LEFT,
    REST,
    next_panel,
)

#: Method: times that are taken at once: a table of polynomials stays in the nearest cache.
BLOCK = 64

#: Calibrated: times on a panel from which a cubic between knots is a better guess than a line.
MANY = 200


@jit
def set_polynomials(x: Any, count: Any, table: Any) -> Any:
    """Fill T_0 … T_M at x[:count], the order first."""
    for j in range(count):
        table[0, j], table[1, j] = 1.0, x[j]
    for m in range(2, table.shape[0]):
        before, last, row = table[m - 2], table[m - 1], table[m]
        for j in range(count):
            row[j] = 2 * x[j] * last[j] - before[j]


@jit
def sum_series(series: Any, count: Any, table: Any, sums: Any) -> Any:
    """Fill Σ_m c_m T_m at ``count`` places of a table."""
    terms = series.size
    for j in range(count):
        sums[j] = series[terms - 1] * table[terms - 1, j]
    top = (terms - 1) // 4 * 4
    for m in range(top, terms - 1):
        c, row = series[m], table[m]
        for j in range(count):
            sums[j] = sums[j] + c * row[j]
    for m in range(top - 4, -1, -4):  # four at once, the small ones first
        c0, c1, c2, c3 = series[m], series[m + 1], series[m + 2], series[m + 3]
        t0, t1, t2, t3 = table[m], table[m + 1], table[m + 2], table[m + 3]
        for j in range(count):
            small = c3 * t3[j] + c2 * t2[j]
            sums[j] = sums[j] + small + c1 * t1[j] + c0 * t0[j]


@jit
def begin(walk: Any, tau: Any, time: Any, z: Any, psi: Any, path: Any) -> Any:
    """Begin anew at a time, of which τ₁, z, ψ and the integrals of the path are known."""
    left = walk.left
    left[FIRST_TAU], left[FIRST_TIME] = tau, time
    for i in (LEFT, BEFORE, LENGTH, ELAPSED, OFF_LEFT, OFF_BEFORE):
        left[i] = 0.0
    walk.lost[LOST], walk.lost[REST], walk.known[0] = 0.0, 0.0, 0
    for given, place in ((z, walk.z), (psi, walk.psi), (psi, walk.right), (path, walk.path)):
        assign(given, place)


@jit
def on_panel(left: Any, times: Any, low: Any, high: Any) -> Any:
    """Return the part of times[low:high], from and to, that is on the panel of a walk, and not
    beyond.
    """
    end, forward = left[BEFORE] + left[ELAPSED], left[NEXT] > 0
    first, last = low, high
    while first < last:  # by halving
        i = (first + last) // 2
        beyond = times[i] - left[FIRST_TIME] - end
        if forward == ((beyond if forward else -beyond) > 0):
            last = i
        else:
            first = i + 1
    return (low, first) if forward else (first, high)


@jit
def locate(walk: Any, elapsed: Any, count: Any, x: Any, table: Any, sums: Any) -> Any:
    """Bring x[:count] to where t from the panel's left end is elapsed[:count], by Newton's method,
    and fill T_m there; return whether that converged. Room: sums (2, BLOCK), the second of which is
    dt/dτ₁ there, but for the last step.
    """
    rates, half, last, found = walk.series[0], walk.left[LENGTH] / 2, 1.0, False
    for _ in range(60):
        set_polynomials(x, count, table)
        if found:
            return True
        sum_series(walk.integral, count, table, sums[0])
        sum_series(rates, count, table, sums[1])
        worst = 0.0
        for j in range(count):
            new = x[j] - (sums[0, j] - elapsed[j]) / (sums[1, j] * half)
            if abs(new) > 1:
                new = 1.0 if new > 0 else -1.0
            worst = max(worst, abs(new - x[j]))
            x[j] = new
        found, last = converged(worst, last), min(worst, 1.0)
    return False


@jit
def set_knots(walk: Any, knots: Any, dense: Any, elapsed: Any, table: Any, sums: Any) -> Any:
    """Fill x, and dx from knot to knot, at uniform times on a panel, (2, BLOCK); those of a line
    where times are not ``dense``. Return whether that could be done.
    """
    x, slopes, last = knots[0], knots[1], knots.shape[1] - 1
    for j in range(last + 1):
        elapsed[j] = walk.left[ELAPSED] * (j / last)
        x[j], slopes[j] = 2 * (j / last) - 1, 2 / last
    found = not dense or locate(walk, elapsed, last + 1, x, table, sums)
    for j in range(last + 1 if dense else 0):
        slopes[j] = walk.left[ELAPSED] / last / (sums[1, j] * walk.left[LENGTH] / 2)
    return found


@jit
def set_between(knots: Any, elapsed: Any, pace: Any, count: Any, x: Any) -> Any:
    """Fill x[:count] by Hermite's cubics at elapsed[:count]; pace: knots in a unit of time."""
    for j in range(count):
        k = min(max(int(elapsed[j] * pace), 0), knots.shape[1] - 2)
        a, b, rise = knots[1, k], knots[1, k + 1], knots[0, k + 1] - knots[0, k]
        s = elapsed[j] * pace - k
        x[j] = knots[0, k] + s * (a + s * (3 * rise - 2 * a - b + s * (a + b - 2 * rise)))


@jit
def sum_states(
    torus: Any,
    walk: Any,
    x: Any,
    first: Any,
    stop: Any,
    table: Any,
    states: Any,
    psi: Any,
    off: Any,
    paths: Any,
) -> Any:
    """Fill τ₁ and the entries, ψ of a node nearby, what truncation leaves in t and the integrals of
    the path at the times from ``first`` to ``stop``, whose places are x.
    """
    count = stop - first
    g, nodes, half = psi.shape[1], walk.matrix.shape[0], walk.left[LENGTH] / 2
    start = walk.left[FIRST_TAU] + walk.left[LEFT]
    for j in range(count):
        states[0, first + j], off[first + j] = start + half * (1 + x[j]), walk.lost[LOST]
        node = nodes * (2 * j + 1) // (2 * count)
        advance = half * (1 + walk.table[2 * node + 1])
        for k in range(g):
            uniform = 2 * pi * torus.frequencies[k] * advance
            psi[first + j, k] = walk.values[1 + k, node] + uniform
    for i in range(1, states.shape[0]):
        sum_series(walk.series[g + i], count, table, states[i, first:stop])
    for k in range(walk.path.size):
        sum_series(walk.along[k], count, table, paths[k, first:stop])
        for j in range(first, stop):
            paths[k, j] = walk.path[k] + paths[k, j]


@jit_making
def follow_densely(
    torus: Any,
    walk: Any,
    times: Any,
    low: Any,
    high: Any,
    most: Any,
    states: Any,
    psi: Any,
    off: Any,
    paths: Any,
    room: Any,
) -> Any:
    """Fill τ₁, velocities and frames (1 + n + n², T), ψ at nodes nearby (T, g), what truncation
    leaves in t (T,) and integrals (K, T) at times[low:high], which go away from the walk's
    beginning in its direction.

    Return the part, from and to, that is left after ``most`` panels; (−1, −1) where panels do not
    serve.
    """
    left, nodes, used = walk.left, walk.matrix.shape[0], 0
    x, elapsed, table = np.zeros(BLOCK), np.zeros(BLOCK), np.zeros((nodes + 1, BLOCK))
    knots, sums = np.zeros((2, BLOCK)), np.zeros((2, BLOCK))
    while low < high:
        if left[LENGTH] != 0:
            start, stop = on_panel(left, times, low, high)
            if not set_knots(walk, knots, stop - start > MANY, elapsed, table, sums):
                return -1, -1
            for first in range(start, stop, BLOCK):
                count = min(BLOCK, stop - first)
                for j in range(count):
                    elapsed[j] = times[first + j] - left[FIRST_TIME] - left[BEFORE]
                set_between(knots, elapsed, (BLOCK - 1) / left[ELAPSED], count, x)
                if not locate(walk, elapsed, count, x, table, sums):
                    return -1, -1
                sum_states(torus, walk, x, first, first + count, table, states, psi, off, paths)
            low, high = (stop, high) if left[NEXT] > 0 else (low, start)
        if low == high or used == most:
            break
        if not next_panel(torus, walk, room):
            return -1, -1
        used += 1
    return low, high
