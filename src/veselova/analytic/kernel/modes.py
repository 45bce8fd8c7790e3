"""The time map as a Fourier series on the torus (section 7): any time costs the same.

F_m = scale · det_ks[ ∮ φ_s (a⁻¹du)_k cos 2πm·G_s(ψ) dψ ],   Ω = f/F_0,
t = F_0 τ₁ + S(z) − S(z⁰),   S(z) = Σ_m F_m/(π m·f) sin 2πm·z   over one of each m and −m
"""

from typing import Any, NamedTuple

import numpy as np

from .abel import converged, invert, set_cut_phases
from .arithmetic import (
    EPSILON,
    cos,
    dot,
    jit,
    middle,
    number,
    pi,
    positive,
    sin,
    size,
    turns,
    zeros,
    zeros2,
    zeros3,
    zeros4,
)
from .linear import eliminate
from .rate import NEUMANN, set_weights

#: Derived: modes below this part of F_0 are left out, in EPSILON.
LEAST = 1.0

#: Calibrated: nodes of the integrals beyond those of the angle series and of the modes.
SPARE_NODES = 16

#: Method: the box of modes that is tried first; it is doubled until the modes fit.
FIRST_SIDE = 10


class Modes(NamedTuple):
    """The modes of one torus.

    - orders: (M, g) integers; amplitudes: (M,) F_m/(π m·f); slopes: (M,) 2F_m
    - high, low: (g,) Ω, cycles per unit of time, and what it is rounded by
    - at_start: (1,) S(z⁰)
    - reach: (1,) double, Σ|amplitudes|/F_0
    - blur: (1,) double, the error of S in EPSILON, in squares: Σ |amplitudes| (1 + 2π|m|), and
      F_0/(π m·f)
    """

    orders: Any
    amplitudes: Any
    slopes: Any
    high: Any
    low: Any
    at_start: Any
    reach: Any
    blur: Any


@jit
def set_powers(c: Any, d: Any, cosines: Any, sines: Any) -> Any:
    """Fill the real and imaginary parts of (c + id)^m, m = 0, 1, …"""
    a, b = number(1), 0 * c
    for m in range(cosines.size):
        cosines[m], sines[m] = a, b
        a, b = middle(a * c - b * d), middle(b * c + a * d)


@jit
def set_waves(torus: Any, s: Any, cosines: Any, sines: Any) -> Any:
    """Fill cos and sin of 2πm G_sk(ψ_j), m = 0…M, (g, M+1, J)."""
    g, most, count = cosines.shape
    z, powers = zeros(g), zeros2(2, most)
    for j in range(count):
        set_cut_phases(torus.angles, s, pi * (2 * j + 1) / (2 * count), z)
        for k in range(g):
            set_powers(cos(2 * pi * z[k]), sin(2 * pi * z[k]), powers[0], powers[1])
            for m in range(most):
                cosines[k, m, j], sines[k, m, j] = powers[0, m], powers[1, m]


@jit
def set_row(m: Any, last: Any, cosines: Any, sines: Any, row: Any) -> Any:
    """Fill the wave (2, J) of m_1 … m_last: cos and sin of 2π Σ_{k≤last} m_k G_k(ψ_j)."""
    for j in range(row.shape[1]):
        row[0, j], row[1, j] = number(1), 0 * row[1, j]
    for k in range(last):
        c, d, negative = cosines[k, abs(m[k])], sines[k, abs(m[k])], m[k] < 0
        for j in range(row.shape[1]):
            a, b, e = row[0, j], row[1, j], -d[j] if negative else d[j]
            row[0, j], row[1, j] = a * c[j] - b * e, b * c[j] + a * e


class Box(NamedTuple):
    """What the determinants of a box of modes |m_k| ≤ M are made of.

    - weights: (g, g, J) of ``set_weights``; cosines, sines: (g, g, M+1, J) of ``set_waves``
    - rows: (g, R, 2, J) waves of m_1 … m_{g−1}, filled where ``known`` (R,) says so
    - wave: (J,), matrix: (g, g), unused: (g,) room
    """

    weights: Any
    cosines: Any
    sines: Any
    rows: Any
    known: Any
    wave: Any
    matrix: Any
    unused: Any


@jit
def make_box(torus: Any, side: Any) -> Any:
    """Return the box of modes |m_k| ≤ side."""
    g = torus.z.size
    count = torus.angles.counts.max() + 2 * side + SPARE_NODES
    weights, rows = zeros3(g, g, count), (2 * side + 1) ** (g - 1)
    cosines, sines = zeros4(g, g, side + 1, count), zeros4(g, g, side + 1, count)
    for s in range(g):
        set_weights(torus, s, weights[s])
        set_waves(torus, s, cosines[s], sines[s])
    return Box(
        weights,
        cosines,
        sines,
        zeros4(g, rows, 2, count),
        np.zeros(rows, np.bool_),
        zeros(count),
        zeros2(g, g),
        zeros(g),
    )


@jit
def coefficient(box: Any, m: Any) -> Any:
    """Return det_ks[Σ_j w_skj cos 2πm·G_s(ψ_j)]."""
    g, count, side = m.size, box.wave.size, box.cosines.shape[2] - 1
    place = 0
    for k in range(g - 1):
        place = place * (2 * side + 1) + m[k] + side
    if not box.known[place]:
        box.known[place] = True
        for s in range(g):
            set_row(m, g - 1, box.cosines[s], box.sines[s], box.rows[s, place])
    last, negative = abs(m[g - 1]), m[g - 1] < 0
    for s in range(g):
        a, b = box.rows[s, place]
        c, d = box.cosines[s, g - 1, last], box.sines[s, g - 1, last]
        for j in range(count):
            box.wave[j] = a[j] * c[j] + b[j] * d[j] if negative else a[j] * c[j] - b[j] * d[j]
        for k in range(g):
            box.matrix[k, s] = dot(box.weights[s, k], box.wave, count)
    return eliminate(box.matrix, box.unused)


@jit
def find_modes(box: Any, mean: Any, orders: Any, values: Any) -> Any:
    """Fill the modes above LEAST, grown from zero through neighbours ±e_k and e_k − e_{k+1}, one of
    each m and −m, and their determinants; return their number, −1 where the box and −2 where
    ``orders`` (most, g) and ``values`` (most,) are too small.

    mean: the determinant of m = 0.
    """
    g, side = orders.shape[1], box.cosines.shape[2] - 1
    width = 2 * side + 1
    seen = np.zeros(width**g, np.bool_)
    m = np.zeros(g, np.int64)
    found, visited, start = 0, 0, 0
    for _ in range(g):
        start = start * width + side
    seen[start] = True
    while visited <= found:  # the first one visited is zero
        for direction in range(4 * g - 2):
            for k in range(g):
                m[k] = orders[visited - 1, k] if visited > 0 else 0
            axis, by = direction // 2, 1 if direction % 2 == 0 else -1
            if axis < g:
                m[axis] += by
            else:
                m[axis - g] += by
                m[axis - g + 1] -= by
            first = 0
            for k in range(g - 1, -1, -1):
                if m[k] != 0:
                    first = m[k]
            index = 0
            for k in range(g):
                if first < 0:
                    m[k] = -m[k]
                if abs(m[k]) > side:
                    return -1
                index = index * width + m[k] + side
            if seen[index]:
                continue
            seen[index] = True
            value = coefficient(box, m)
            if size(value) > LEAST * EPSILON * size(mean):
                if found == values.size:
                    return -2
                for k in range(g):
                    orders[found, k] = m[k]
                values[found] = value
                found += 1
        visited += 1
    return found


@jit
def sum_modes(modes: Any, z: Any, cosines: Any, sines: Any) -> Any:
    """Return S(z) and its derivative by τ₁; room (g, M+1)."""
    g = z.size
    for k in range(g):
        set_powers(cos(2 * pi * z[k]), sin(2 * pi * z[k]), cosines[k], sines[k])
    value, slope = 0 * z[0], 0 * z[0]
    for i in range(modes.amplitudes.size):
        a, b = cosines[0, modes.orders[i, 0]], sines[0, modes.orders[i, 0]]
        for k in range(1, g):
            order = modes.orders[i, k]
            c, d = cosines[k, abs(order)], sines[k, abs(order)]
            if order < 0:
                d = -d
            a, b = a * c - b * d, b * c + a * d
        value = value + modes.amplitudes[i] * b
        slope = slope + modes.slopes[i] * a
    return value, slope


@jit
def make_modes(torus: Any, high: Any, low: Any, side: Any, most: Any) -> Any:
    """Return the modes |m_k| ≤ side, ``most`` of them at most; ``reach`` is negative where they do
    not suffice. high, low (g,): Ω.
    """
    g, mean = torus.z.size, torus.mean[0]
    orders, values, found = np.zeros((most, g), np.int64), zeros(most), 0
    if torus.time[0] != NEUMANN:
        box_side = min(FIRST_SIDE, side)
        while True:
            box = make_box(torus, box_side)
            found = find_modes(box, mean / torus.scale[0], orders, values)
            if found != -1 or box_side == side:
                break
            box_side = min(2 * box_side, side)
    count = max(found, 0)
    amplitudes, slopes = zeros(count), zeros(count)
    reach, blur = 0.0, 0.0
    for i in range(count):
        frequency, longest = 0 * mean, 0
        for k in range(g):
            frequency = frequency + orders[i, k] * torus.frequencies[k]
            longest = max(longest, abs(orders[i, k]))
        slopes[i] = 2 * values[i] * torus.scale[0]
        amplitudes[i] = slopes[i] / (2 * pi * frequency)
        reach += size(amplitudes[i])
        blur += (size(amplitudes[i]) * (1 + 6.3 * longest)) ** 2
        blur += (size(mean) / (3.14 * size(frequency))) ** 2
    at_start, doubles = zeros(1), np.zeros((2, 1))
    doubles[0, 0], doubles[1, 0] = reach / size(mean), np.sqrt(blur)
    if found < 0:
        doubles[0, 0] = -1.0
    modes = Modes(orders[:count], amplitudes, slopes, high, low, at_start, doubles[0], doubles[1])
    room = mode_room(modes)
    at_start[0] = sum_modes(modes, torus.z, room[0], room[1])[0]
    return modes


@jit
def mode_room(modes: Any) -> Any:
    """Return room for the harmonics that ``sum_modes`` takes, (2, g, M+1)."""
    g, most = modes.orders.shape[1], 1
    for i in range(modes.amplitudes.size):
        for k in range(g):
            most = max(most, abs(modes.orders[i, k]) + 1)
    return zeros3(2, g, most)


@jit
def set_phases(torus: Any, modes: Any, time: Any, delta: Any, target: Any) -> Any:
    """Fill z (g,) at τ₁ = t/F_0 + δ, modulo two, the period of the frame."""
    for k in range(target.size):
        uniform = turns(modes.high[k], modes.low[k], time)
        target[k] = torus.z[k] + uniform + torus.frequencies[k] * delta


@jit
def find_time(torus: Any, modes: Any, time: Any, target: Any, cosines: Any, sines: Any) -> Any:
    """Return τ₁ − t/F_0 at a time, and fill z: Newton's method in a bracket. Fill z with
    infinity where that does not converge.
    """
    g, mean = target.size, torus.mean[0]
    high = number(1) * modes.reach[0] * 2 + 0 * mean
    low, delta, last, fastest = -high, 0 * mean, 1.0, 0.0
    for k in range(g):
        fastest = max(fastest, size(torus.frequencies[k]))
    for _ in range(100):
        set_phases(torus, modes, time, delta, target)
        value, slope = sum_modes(modes, target, cosines, sines)
        value, slope = mean * delta + value - modes.at_start[0], slope + mean
        change = middle(value / slope)
        step = size(change) * fastest
        if converged(step, last):
            delta = middle(delta - change)
            set_phases(torus, modes, time, delta, target)
            return delta
        if positive(value):
            high = delta
        else:
            low = delta
        new = middle(delta - change)
        inside = size(new - low) <= size(high - low) and size(high - new) <= size(high - low)
        if inside and step <= last:
            delta, last = new, min(step, 1.0)
        else:  # a bisection says nothing of convergence
            delta, last = (low + high) / 2, 1.0
    target[0] = number(np.inf)
    return delta


@jit
def jump(torus: Any, modes: Any, times: Any, tau: Any, psi: Any, room: Any) -> Any:
    """Fill τ₁ (T,) and ψ modulo 4π (T, g) at times of any order; return how many failed."""
    harmonics, failed = mode_room(modes), 0
    for t in range(times.size):
        delta = find_time(torus, modes, times[t], room.target, harmonics[0], harmonics[1])
        if not size(room.target[0]) < np.inf:
            failed += 1
            continue
        tau[t] = times[t] / torus.mean[0] + delta
        for k in range(psi.shape[1]):
            psi[t, k] = 2 * pi * room.target[k]
        failed += 0 if invert(torus.angles, room.target, psi[t], room) else 1
    return failed
