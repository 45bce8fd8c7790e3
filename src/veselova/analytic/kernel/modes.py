"""Integrals along the orbit as Fourier series on the torus (section 7): any time costs the same.

∫ φ dτ₁ = F_0 τ₁ + S(z) − S(z⁰),   S(z) = Σ_m F_m/(π m·f) sin 2π(m·z + turn)   over one of each m
and −m, F_m of ``coefficients``. The time map is that of the rate, Ω = f/F_0; with an area constant
S has a series for the odd part of the rate too. The components (q',n_k) have no mean.
"""

from typing import Any, NamedTuple

import numpy as np

from .abel import abel, approach, invert
from .arithmetic import EPSILON, cos, jit, jit_making, jit_sum, largest, pi, sin, turns
from .coefficients import (
    COUNT,
    FIRST,
    ODD,
    PLACE,
    RATE,
    find_rows,
    fits,
    make_box,
    set_parities,
    sizes_of,
)
from .frame import set_frame
from .rate import NEUMANN, even_rate, tilted
from .torus import make_room

#: Budget: largest |m_k| and number of modes, by genus.
SIDES = (0, 512, 512, 64, 40, 20)
MOST_MODES = (0, 512, 40_000, 200_000, 400_000, 400_000)

#: Derived: modes below this part of F_0 are left out, in EPSILON.
LEAST = 1.0

#: Calibrated: how far a mode may pull τ₁ in a unit of m·f: beyond, few digits of it are left.
SLOW = 1e10

#: What ``reach`` is where modes are too many, and where one is SLOW.
INSUFFICIENT, RESONANT = -1.0, -2.0

#: Calibrated: the box of modes that is tried first, in terms of the longest angle series, and what
#: it is widened by until the modes fit.
FIRST_SIDE, WIDER = 0.75, 1.4

#: Method: the modes that give a first guess: those that move the fastest phase by this, in cycles.
COARSE = 1e-8

#: Derived: cycles of the fastest phase up to which a step of Newton's method is short, so that two
#: slopes make a curvature; the square of a last step, times a short one before it, with coarse
#: modes and with all.
NEAR, GUESSED, FOUND = 0.02, 1e-9, EPSILON / 64


class Modes(NamedTuple):
    """The modes of one function, in rows of one m_1 … m_{g−1}.

    - rows: (R, g−1) integers; spans: (2, R, 3) of ``coefficients``, of large modes and of all
    - halves: (g,) twice what is added to m; turn: (1,) cycles
    - used: (2,) rows up to the last one that has modes; sides: (g,) largest |m_k|
    - amplitudes: (M,) F_m/(π m·f); slopes: (M,) 2F_m
    - high, low: (g,) Ω, cycles per unit of time, and what it is rounded by
    - at_start: (2,) S(z⁰), of large modes and of all: τ₁ is zero at t = 0, to all digits
    - reach: (1,) double, Σ|amplitudes|/unit, which is F_0 or the largest value of a component
    - sway: (1,) double, by how much phases, and roundings of m·f, move S, in squares:
      Σ |amplitudes| (1 + 2π|m| + Σ|m_k f_k|/|m·f|)
    - blur: (1,) double, the error of S in EPSILON, in squares: ``sway``, and unit/(π m·f)
    - harmonics: (2, g, 2M+1) room of ``sum_modes``: one thread at a time
    """

    rows: Any
    spans: Any
    halves: Any
    turn: Any
    used: Any
    sides: Any
    amplitudes: Any
    slopes: Any
    high: Any
    low: Any
    at_start: Any
    reach: Any
    sway: Any
    blur: Any
    harmonics: Any


LARGE, ALL = 0, 1


@jit
def set_harmonics(z: Any, cosines: Any, sines: Any) -> Any:
    """Fill cos and sin of 2πmz, m = −M … M, (2M+1,)."""
    c, d, half = cos(2 * pi * z), sin(2 * pi * z), cosines.size // 2
    a, b = 1.0, 0.0
    cosines[half], sines[half] = a, b
    for m in range(1, half + 1):
        a, b = a * c - b * d, b * c + a * d
        cosines[half + m], sines[half + m] = a, b
        cosines[half - m], sines[half - m] = a, -b


@jit_sum
def sum_row(amplitudes: Any, slopes: Any, cosines: Any, sines: Any, a: Any, b: Any) -> Any:
    """Return Σ amplitude·sin(φ_j + φ) and Σ slope·cos(φ_j + φ), where a, b = cos φ, sin φ."""
    value, slope = 0.0, 0.0
    for j in range(amplitudes.size):
        value += amplitudes[j] * (cosines[j] * b + sines[j] * a)
        slope += slopes[j] * (cosines[j] * a - sines[j] * b)
    return value, slope


@jit
def sum_modes(modes: Any, which: Any, z: Any) -> Any:
    """Return S(z) and its derivative by τ₁, over LARGE modes or ALL."""
    cosines, sines, spans = modes.harmonics[0], modes.harmonics[1], modes.spans[which]
    last, half = z.size - 1, cosines.shape[1] // 2
    value, slope = 0.0, 0.0
    if modes.used[which] == 0:
        return value, slope
    base = 2 * pi * modes.turn[0]
    for k in range(z.size):
        set_harmonics(z[k], cosines[k], sines[k])
        base = base + pi * modes.halves[k] * z[k]
    cosine, sine = cos(base), sin(base)
    for i in range(modes.used[which]):
        count = spans[i, COUNT]
        if count == 0:
            continue
        a, b = cosine, sine
        for k in range(last):
            c, d = cosines[k, half + modes.rows[i, k]], sines[k, half + modes.rows[i, k]]
            a, b = a * c - b * d, b * c + a * d
        place, first = spans[i, PLACE], spans[i, FIRST] + half
        at, of = slice(first, first + count), slice(place, place + count)
        waves = cosines[last, at], sines[last, at]
        part, rise = sum_row(modes.amplitudes[of], modes.slopes[of], *waves, a, b)
        value, slope = value + part, slope + rise
    return value, slope


@jit_making
def make_modes(torus: Any, which: Any, high: Any, low: Any, side: Any, most: Any) -> Any:
    """Return the modes |m_k| ≤ side of a function, ``most`` of them at most; ``reach`` is
    INSUFFICIENT or RESONANT where they do not serve. high, low (g,): Ω.
    """
    g, found, values = torus.z.size, 0, np.zeros(0)
    scale, unit, peak = sizes_of(torus, which)
    rows, spans = np.zeros((0, g - 1), np.int64), np.zeros((0, 3), np.int64)
    halves, odd, turn = np.zeros(g, np.int64), np.zeros((g, g), np.bool_), np.zeros(1)
    turn[0] = set_parities(torus, which, halves, odd)
    if (which != RATE or torus.time[0] != NEUMANN) and scale != 0:
        box_side = min(int(FIRST_SIDE * largest(torus.angles.counts)) + 1, side)
        found, least = -1, LEAST * EPSILON * abs(peak / scale)
        while fits(torus.angles, box_side):
            box = make_box(torus, which, box_side)
            found, rows, spans, values = find_rows(box, least, most)
            if found != -1 or box_side == side:
                break
            box_side = min(int(WIDER * box_side) + 1, side)
    count = max(found, 0)
    total = spans[count - 1, PLACE] + spans[count - 1, COUNT] if count > 0 else 0
    slopes = np.zeros(total)
    for i in range(total):
        slopes[i] = 2 * values[i] * scale
    given = rows[:count], spans[:count], slopes, halves, turn, high, low
    modes = modes_of(given, torus.frequencies, torus.z, unit, peak)
    if found < 0:
        modes.reach[0] = INSUFFICIENT
    if which == ODD and count > 0:
        settle_sign(torus, modes)
    return modes


@jit_making
def modes_of(given: Any, frequencies: Any, z: Any, unit: Any, peak: Any) -> Any:
    """Return the modes of known coefficients, ``reach`` RESONANT where one is SLOW.

    - given: ``rows``, ``spans`` (R, 3) of all modes, ``slopes``, ``halves``, ``turn``, ``high``
      and ``low`` of ``Modes``
    - frequencies, z: (g,) f and z⁰; unit, peak: F_0, or the largest value of a component
    """
    rows, spans, slopes, halves, turn, high, low = given
    g, count = z.size, rows.shape[0]
    used, sides = np.zeros(2, np.int64), np.zeros(g, np.int64)
    both, sizes = np.zeros((2, count, 3), np.int64), np.zeros(slopes.size)
    both[ALL], used[ALL] = spans, count
    reach, sway, blur, first = np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(2)
    set_sides(rows, spans, sides)
    harmonics = np.zeros((2, g, 2 * int(largest(sides)) + 1))
    known = rows, both, halves, turn, used, sides, sizes, slopes, high, low
    modes = Modes(*known, first, reach, sway, blur, harmonics)
    slow = set_amplitudes(modes, frequencies, unit)
    blur[0] = sway[0]
    if count > 0:
        blur[0] += abs(peak) ** 2 * left_out_of(frequencies, sides, halves)
    sway[0], blur[0] = np.sqrt(sway[0]), np.sqrt(blur[0])
    if slow:
        reach[0] = RESONANT
    for which in (LARGE, ALL):
        first[which] = sum_modes(modes, which, z)[0]
    return modes


@jit_making
def settle_sign(torus: Any, modes: Any) -> Any:
    """Turn the odd part of the rate about where it has not the sign that it has at the ψ of a
    quarter of periods where it is largest.
    """
    g, place = torus.z.size, make_room(torus.z.size)
    psi, best, summed = np.zeros(g), 0.0, 0.0
    for i in range(4**g):
        rest = i
        for k in range(g):
            psi[k] = pi * (rest % 4) / 2 + pi / 4 * (k + 1) / (g + 1)
            rest //= 4
        set_frame(torus, psi, place, place.frame, place.velocity)
        value = -tilted(torus, place.frame) * even_rate(torus, psi)
        if abs(value) > abs(best):
            best = value
            abel(torus.angles, psi, place.z, place.slopes)
            summed = sum_modes(modes, ALL, place.z)[1]
    if -best * summed > 0:
        for values in (modes.at_start, modes.slopes, modes.amplitudes):
            values *= -1.0


@jit
def set_sides(rows: Any, spans: Any, sides: Any) -> Any:
    """Fill the largest |m_k| (g,) of rows."""
    last = sides.size - 1
    for i in range(rows.shape[0]):
        for k in range(last):
            sides[k] = max(sides[k], abs(rows[i, k]))
        first = spans[i, FIRST]
        sides[last] = max(sides[last], abs(first), abs(first + spans[i, COUNT] - 1))


@jit
def set_amplitudes(modes: Any, frequencies: Any, mean: Any) -> Any:
    """Fill what follows from the slopes: amplitudes, the spans of large ones, reach, and the square
    of sway. Return whether a mode is SLOW.
    """
    g, fastest, slow = frequencies.size, largest(frequencies), False
    for i in range(modes.used[ALL]):
        pace, longest, several, spread = modes.halves[g - 1] * frequencies[g - 1] / 2, 0, 0, 0.0
        for k in range(g - 1):
            several += 1 if 2 * modes.rows[i, k] + modes.halves[k] != 0 else 0
            pace = pace + (modes.rows[i, k] + modes.halves[k] / 2) * frequencies[k]
            longest = max(longest, abs(modes.rows[i, k]))
            spread += (1 + abs(modes.rows[i, k])) * abs(frequencies[k])
        place, first, last = modes.spans[ALL, i, PLACE], -1, -1
        for j in range(modes.spans[ALL, i, COUNT]):
            m, slope = modes.spans[ALL, i, FIRST] + j, modes.slopes[place + j]
            if slope == 0:
                continue
            frequency = pace + m * frequencies[g - 1]
            amplitude = slope / (2 * pi * frequency)
            modes.amplitudes[place + j] = amplitude
            modes.reach[0] += abs(amplitude / mean)
            cancelled = (spread + (1 + abs(m)) * abs(frequencies[g - 1])) / abs(frequency)
            swayed = 1 + 6.3 * max(longest, abs(m))
            modes.sway[0] += (abs(amplitude) * (swayed + cancelled)) ** 2
            pull = 2 * abs(slope / mean) * max(longest, abs(m)) * fastest
            together = (several > 0 and 2 * m + modes.halves[g - 1] != 0) or several > 1
            slow = slow or (together and pull > SLOW * abs(frequency))
            if abs(amplitude) * fastest > COARSE * abs(mean):
                first, last = j if first < 0 else first, j
        if first >= 0:
            modes.used[LARGE] = i + 1
            modes.spans[LARGE, i, PLACE] = place + first
            modes.spans[LARGE, i, COUNT] = last + 1 - first
            modes.spans[LARGE, i, FIRST] = modes.spans[ALL, i, FIRST] + first
    return slow


@jit
def left_out_of(frequencies: Any, sides: Any, halves: Any) -> Any:
    """Return Σ 1/(π m·f)² over modes |m_k| ≤ sides_k + 1 of which there is one of each m and −m: by
    what coefficients that are off by a part of the unit, or left out, move the integral.
    """
    last, total, count, halved = sides.size - 1, 0.0, 1, halves[sides.size - 1]
    for k in range(last):
        count *= 2 * sides[k] + 3
        halved += halves[k]
    pace, width = frequencies[last], 2 * sides[last] + 3
    for i in range(count if halved > 0 else count // 2 + 1):
        rest, first = i, (halves[last] / 2 - sides[last] - 1) * pace
        for k in range(last):
            m = rest % (2 * sides[k] + 3) - sides[k] - 1 + halves[k] / 2
            first = first + m * frequencies[k]
            rest //= 2 * sides[k] + 3
        middle = halved == 0 and i == count // 2
        total += inverse_squares(first, pace, width // 2 if middle else width)
    return total / (pi * pi * (2 if halved > 0 else 1))


@jit_sum
def inverse_squares(first: Any, step: Any, count: Any) -> Any:
    """Return Σ_{i<count} 1/(first + i step)²."""
    total = 0.0
    for i in range(count):
        x = first + i * step
        total += 1 / max(x * x, 1e-300)
    return total


@jit_making
def no_modes(g: Any) -> Any:
    """Return the modes of zero."""
    rows, none, zeros = np.zeros((0, g - 1), np.int64), np.zeros((0, 3), np.int64), np.zeros(g)
    given = rows, none, np.zeros(0), np.zeros(g, np.int64), np.zeros(1), zeros, zeros
    return modes_of(given, zeros, zeros, 1.0, 1.0)


@jit
def refine(
    f: Any, mean: Any, modes: Any, odd: Any, which: Any, uniform: Any, guess: Any, z: Any
) -> Any:
    """Return δ = τ₁ − t/F_0 over ALL or LARGE modes, those of the odd part included, the curvature
    S''/2 in units of the slope, and the cycles of the fastest phase that it was found over: one
    where it was not, infinity without convergence. Fill z (g,), ``uniform`` + fδ. guess: the same
    three.

    Newton's method in a bracket; after a short step with the parabola through two slopes.
    """
    delta, bend, last = guess
    most, fastest = 2 * (modes.reach[0] + odd.reach[0]), largest(f)
    low, high, change, before = -most, most, 0.0, mean
    enough = FOUND if which == ALL else GUESSED
    for turn in range(100):
        for k in range(f.size):
            z[k] = uniform[k] + f[k] * delta
        value, slope = sum_modes(modes, which, z)
        value, slope = mean * delta + value - modes.at_start[which], slope + mean
        if odd.used[which] > 0:
            more, rise = sum_modes(odd, which, z)
            value, slope = value + more - odd.at_start[which], slope + rise
        if turn > 0:
            bend = (before - slope) / (2 * slope * change) if last < NEAR else 0.0
        change = value / slope
        step = abs(change) * fastest
        change = change + bend * change * change
        new = delta - change
        if slope > 0 and step * step * last < enough:
            for k in range(f.size):
                z[k] = uniform[k] + f[k] * new
            return new, bend, last
        if value > 0:
            high = delta
        else:
            low = delta
        inside = slope > 0 and low <= new <= high
        delta, before = new if inside else (low + high) / 2, slope
        # a bisection says nothing of convergence, and a long step little
        last = step if inside and step < NEAR else 1.0
    return delta, 0.0, np.inf


@jit
def jump(
    torus: Any, modes: Any, odd: Any, times: Any, tau: Any, psi: Any, z_of: Any, room: Any
) -> Any:
    """Fill τ₁ (T,), ψ modulo 4π and z modulo two (T, g) at times of any order; return how many
    failed. odd: modes of the odd part, if there are any; (0, 0) for no z.
    """
    failed, f, mean = 0, torus.frequencies, torus.mean[0]
    uniform, z = room.step, room.target
    for t in range(times.size):
        for k in range(z.size):  # modulo two, the period of the frame
            uniform[k] = torus.z[k] + turns(modes.high[k], modes.low[k], times[t])
        delta, bend, last = 0.0, 0.0, 1.0
        for which in (LARGE, ALL):
            guess = (delta, bend, min(last, 1.0))
            delta, bend, last = refine(f, mean, modes, odd, which, uniform, guess, z)
        tau[t] = times[t] / mean + delta
        for k in range(z.size):
            psi[t, k] = 2 * pi * z[k]
            if z_of.size > 0:
                z_of[t, k] = z[k]
        approach(torus.angles, z, psi[t], room)
        if not (last < np.inf and invert(torus.angles, z, psi[t], room)):
            failed += 1
    return failed


@jit
def set_integrals(modes: Any, z: Any, values: Any) -> Any:
    """Fill S(z) − S(z⁰) at z (T, g)."""
    for t in range(z.shape[0]):
        values[t] = sum_modes(modes, ALL, z[t])[0] - modes.at_start[ALL]
