"""Fourier coefficients of functions on the torus, determinants of one-variable integrals, by rows.

    F_m = scale · det_ks[ ∮ φ_s (a⁻¹du)_k cos 2πm·G_s(ψ) dψ ],   sin where the row is odd in ψ

    RATE   Π_s φ_s, φ_s of ``rate_factor``
    k ≥ 1  (q',n_{k+1}) = Π_s φ_s · norm, φ_s = √|λ_s−c_{k+1}|, signed on the cut that c_{k+1} ends
    ODD    ± ρ/det a⁻¹ of ``rate``, for genus 2: with φ_s = √λ_s √|λ_s−c_2|, signed on the cut that
           c_2 ends, its rows are φ_s dλ/(2w) and ½ φ_s dλ/(λ(λ−c_2))

The sum over s in ρ = y_2 y_γ c_2 Σ_s λ_s'/(2λ_s(λ_s−c_2)) has λ_1−λ_2 as its denominator, as the
measure of the torus has it as a factor. A root that is signed on a cut changes sign with ψ_s → ψ_s
+ 2π: the m_s of its modes are halves of odd numbers. The root of the lower end is odd in ψ_s.

A row of modes has one m_1 … m_{g−1} and all m_g. With α = 2πΣ_{k<g} m_kG_k and β = 2πG_g,
cos(α ± mβ) = cos α cos mβ ∓ sin α sin mβ, so that two sums serve m_g = ±m. Modes are m + h with
integers m and halves h_k, 0 or ½.
"""

from typing import Any, NamedTuple

import numpy as np

from .arithmetic import assign, cos, dots, eliminate, jit, jit_making, pi, sin, sqrt
from .elliptic import roots
from .periods import set_forms_at_nodes
from .rate import rate_factor

#: Which function, beside the numbers k of components.
RATE, ODD = 0, -1


@jit
def place_of(torus: Any, which: Any) -> Any:
    """Return the place of the branch point that a function's roots belong to, −1 for none."""
    return -1 if which == RATE else torus.of_c[1 if which == ODD else which]


@jit
def set_parities(torus: Any, which: Any, halves: Any, odd: Any) -> Any:
    """Fill whether the m_s are halves of odd numbers (g,), and which rows are odd in ψ on which
    cuts (g, g); return the phase of the series in cycles: of cos 2π(m·z + turn).
    """
    g, c = halves.size, place_of(torus, which)
    for s in range(g):
        halves[s] = c in (2 * s + 1, 2 * s + 2)
        for k in range(g):
            odd[k, s] = c == 2 * s + 1
        if which == ODD:
            odd[1, s] = c != 2 * s + 1
    if which == ODD:  # one odd factor in each product, or none and two
        return -0.25 if c % 2 == 0 else 0.0
    return -0.25 if c % 2 == 1 and c > 0 else 0.0


@jit
def set_weights(torus: Any, which: Any, s: Any, room: Any, weights: Any) -> Any:
    """Turn a⁻¹du/dψ_s at J nodes, (g, J), to (2π/J) times the rows of the determinant. Room: that
    of ``set_forms_at_nodes``.
    """
    g, count = weights.shape
    factors, below, forms = room
    if which == ODD:
        set_forms_at_nodes(torus.d, s, torus.cuts, factors, below, forms)
    for i in range(count):
        psi = pi * (2 * i + 1) / (2 * count)
        if which == ODD:
            first, second = odd_factors(torus, s, psi)
            weights[0, i] = first * forms[0, i] * (2 * pi / count)
            weights[1, i] = second * forms[0, i] * (2 * pi / count)
            continue
        if which == RATE:
            low, _ = roots(psi, torus.cuts[s])
            factor = rate_factor(torus.points, torus.time[0], s, low * low)
        else:
            factor = root_to(torus, s, psi, torus.of_c[which])
        for k in range(g):
            weights[k, i] = weights[k, i] * factor * (2 * pi / count)


@jit
def root_to(torus: Any, s: Any, psi: Any, j: Any) -> Any:
    """Return √|λ_s−b_j|, signed where b_j ends the cut."""
    low, high = roots(psi, torus.cuts[s])
    if j <= 2 * s + 1:
        return low if j == 2 * s + 1 else sqrt(torus.d[j, 2 * s + 1] + low * low)
    return high if j == 2 * s + 2 else sqrt(torus.d[2 * s + 2, j] + high * high)


@jit
def odd_factors(torus: Any, s: Any, psi: Any) -> Any:
    """Return what the form dλ/(2w) of cut s has as factors in the two rows of ODD."""
    c = torus.of_c[1]
    first = root_to(torus, s, psi, np.int64(0)) * root_to(torus, s, psi, c)
    second = 1.0
    for j in range(1, 5):
        if j != c:
            second = second * root_to(torus, s, psi, j)
    # dλ is along both roots of the cut's ends; on the cut of c_2 the one of c_2 falls out. The sign
    # is that of λ−c_2 and of the products of two odd factors: c_2 is b_2 or b_3.
    return first, second if s == 0 or c == 2 else -second


@jit
def set_peaks(torus: Any, peaks: Any) -> Any:
    """Fill bounds of |(q',n_k)| for k = 2 …, and of the odd part of the rate after them."""
    g = torus.psi.size
    for k in range(peaks.size):
        if k == g - 1:
            A = torus.points[torus.of_I[g]] / torus.points[torus.of_I[0]]
            most = torus.scale[0]
            for s in range(g):
                most = most * rate_factor(
                    torus.points, torus.time[0], s, torus.d[2 * s + 1, 2 * s + 2]
                )
            spread = torus.d[torus.of_I[0], torus.of_I[g]] / torus.points[torus.of_I[0]]
            peaks[k] = abs(torus.tilt[0] * most * spread / (2 * sqrt(A)))
            continue
        c, peak = torus.of_c[k + 1], abs(torus.norms_c[k + 1])
        for s in range(g):
            far = 2 * s + 2 if c <= 2 * s + 1 else 2 * s + 1
            peak = peak * sqrt(abs(torus.d[min(c, far), max(c, far)]))
        peaks[k] = peak


@jit_making
def sizes_of(torus: Any, which: Any) -> Any:
    """Return what determinants are multiplied with, the unit of the integral over τ₁, and the
    largest value of the function, to which coefficients are accurate.
    """
    g = torus.z.size
    if which == RATE:
        return torus.scale[0], torus.mean[0], torus.mean[0]
    peaks = np.zeros(g)
    set_peaks(torus, peaks)
    if which != ODD:
        return torus.norms_c[which], peaks[which - 1], peaks[which - 1]
    # tilt dt/dτ₁/√(c_2λ_1λ_2) det a⁻¹
    scale = torus.tilt[0] * torus.scale[0] / sqrt(torus.points[torus.of_c[1]])
    for s in range(g):
        scale = scale / sqrt(torus.points[2 * s + 2])
    return scale * eliminate(torus.inverse.copy(), np.zeros(g)), torus.mean[0], peaks[g - 1]


#: Calibrated: nodes of the integrals beyond those that the steepest mode and the series take.
SPARE_NODES = 8

#: Budget: cosines of the phases in a box, 32 MB: next to a separatrix, where phases are steep.
MOST_COSINES = 4_000_000

#: Method: values of |m_g| in succession without a coefficient that counts, which end a row.
QUIET = 2

#: What is known of a row: where it begins among the modes, how many it has, and the first m_g.
PLACE, COUNT, FIRST = 0, 1, 2


class Box(NamedTuple):
    """What the determinants of a box of modes |m_k| ≤ M are made of.

    - weights: (g, g, J) of ``set_weights``; halves: (g,) 2h; odd: (g, g) rows that are odd in ψ
    - cosines, sines: (g, g, M+1, J) of 2π(m+h) G_sk(ψ_j)
    - wave: (6, J), two of a row on one cut; real, imaginary: (g, g, J), weights times them
    - matrices: (2, g, g), unused: (g,) room
    """

    weights: Any
    halves: Any
    odd: Any
    cosines: Any
    sines: Any
    wave: Any
    real: Any
    imaginary: Any
    matrices: Any
    unused: Any


@jit
def node_count(angles: Any, side: Any) -> Any:
    """Return how many nodes hold the integrals of modes |m_k| ≤ side: those of weights, half the
    terms of the angle series, and of the phases 2π m·G_s, whose slope is at most 2π side Σ_m |g_m|
    along an axis, half of that along each at a corner.
    """
    g, most = angles.counts.size, 0.0
    for s in range(g):
        steepest, together = 0.0, 0.0
        for k in range(g):
            steep = 0.0
            for m in range(angles.slopes.shape[2]):
                steep = steep + abs(angles.slopes[k, s, m])
            steepest, together = max(steepest, steep), together + steep
        slope = 2 * pi * side * max(steepest, together / 2)
        most = max(most, slope + angles.counts[s] / 2)
    return int(most) + SPARE_NODES


@jit
def fits(angles: Any, side: Any) -> Any:
    """Return whether a box of modes |m_k| ≤ side is within MOST_COSINES."""
    return angles.counts.size**2 * (side + 1) * node_count(angles, side) <= MOST_COSINES


@jit_making
def make_box(torus: Any, which: Any, side: Any) -> Any:
    """Return the box of modes |m_k| ≤ side of one function."""
    g, count = torus.z.size, node_count(torus.angles, side)
    weights = np.zeros((g, g, count))
    cosines, sines = np.zeros((g, g, side + 1, count)), np.zeros((g, g, side + 1, count))
    halves, odd = np.zeros(g, np.int64), np.zeros((g, g), np.bool_)
    set_parities(torus, which, halves, odd)
    wave, real, imaginary = np.zeros((6, count)), np.zeros((g, g, count)), np.zeros((g, g, count))
    factors = np.zeros((3, g))
    for s in range(g):  # what is room for rows is room for nodes before
        set_waves(torus.angles, s, halves, (wave, real[s]), weights[s], cosines[s], sines[s])
        set_weights(torus, which, s, (factors, wave[0], imaginary[s]), weights[s])
    room = wave, real, imaginary, np.zeros((2, g, g)), np.zeros(g)
    return Box(weights, halves, odd, cosines, sines, *room)


@jit
def set_waves(
    angles: Any, s: Any, halves: Any, room: Any, slopes: Any, cosines: Any, sines: Any
) -> Any:
    """Fill a⁻¹du/dψ_s (g, J) and cos and sin of 2π(m+h) G_sk(ψ_j), m = 0…M, (g, M+1, J). Room:
    (6, J), and zeros (g, J).
    """
    g, most, count = cosines.shape
    rows, z = room
    wave, now, first = rows[:2], rows[2:4], rows[4:]
    for j in range(count):
        # cos ψ and sin ψ by ψ−π/2, which is rounded less
        wave[0, j] = -sin(pi * (2 * j + 1 - count) / (2 * count))
        wave[1, j] = cos(pi * (2 * j + 1 - count) / (2 * count))
        now[0, j], now[1, j] = 1.0, 0.0
    for m in range(angles.counts[s]):
        for k in range(g):
            slope, sine = angles.slopes[k, s, m], 2 * pi * angles.sines[k, s, m]
            for j in range(count):
                slopes[k, j] = slopes[k, j] + slope * now[0, j]
                z[k, j] = z[k, j] + sine * now[1, j]
        turn_on(wave[0], wave[1], now[0], now[1], now[0], now[1])
    for k in range(g):
        for j in range(count):
            first[0, j], first[1, j] = cos(z[k, j]), sin(z[k, j])
            cosines[k, 0, j] = 1.0
        # ψ apart: roundings of a phase are m times as large in that of m
        if k == s:
            turn_on(wave[0], wave[1], first[0], first[1], first[0], first[1])
        if halves[k] != 0:
            for j in range(count):
                half = z[k, j] / 2 + (pi * (2 * j + 1) / (4 * count) if k == s else 0.0)
                cosines[k, 0, j], sines[k, 0, j] = cos(half), sin(half)
        for m in range(1, most):
            turn_on(
                first[0], first[1], cosines[k, m - 1], sines[k, m - 1], cosines[k, m], sines[k, m]
            )


@jit
def turn_on(c: Any, d: Any, a: Any, b: Any, cosines: Any, sines: Any) -> Any:
    """Fill the real and imaginary parts of (c + id)(a + ib), all (J,)."""
    for j in range(c.size):
        x, y = a[j], b[j]
        cosines[j] = x * c[j] - y * d[j]
        sines[j] = y * c[j] + x * d[j]


@jit
def begin_row(box: Any, row: Any) -> Any:
    """Fill the weights times cos α and sin α of a row m_1 … m_{g−1}."""
    g, count = row.size + 1, box.wave.shape[1]
    a, b = box.wave[0], box.wave[1]
    for s in range(g):
        for j in range(count):
            a[j], b[j] = 1.0, 0.0
        for k in range(g - 1):
            half = box.halves[k]
            place = row[k] if row[k] >= 0 else -row[k] - half
            c, d = box.cosines[s, k, place], box.sines[s, k, place]
            if row[k] + half > 0:
                turn_on(c, d, a, b, a, b)
            elif row[k] < 0:  # a turn back, of the number's conjugate
                turn_on(c, d, b, a, b, a)
        for k in range(g):
            weights, real, imaginary = box.weights[s, k], box.real[s, k], box.imaginary[s, k]
            for j in range(count):
                real[j], imaginary[j] = weights[j] * a[j], weights[j] * b[j]


@jit
def set_row(box: Any, row: Any, near: Any, least: Any, values: Any) -> Any:
    """Fill the determinants (2M+1,) of a row, m_g = −M … M, outward from zero until none is above
    ``least`` beyond |m_g| = ``near``, zero elsewhere.
    """
    g, side, count = row.size + 1, values.size // 2, box.wave.shape[1]
    half = box.halves[g - 1]
    begin_row(box, row)
    values[:] = 0.0
    quiet = 0
    for m in range(side + 1 - half):
        for s in range(g):
            c, d = box.cosines[s, g - 1, m], box.sines[s, g - 1, m]
            for k in range(g):
                if box.odd[k, s]:
                    x, y = dots(box.imaginary[s, k], c, box.real[s, k], d, count)
                    y = -y
                else:
                    x, y = dots(box.real[s, k], c, box.imaginary[s, k], d, count)
                box.matrices[0, k, s], box.matrices[1, k, s] = x - y, x + y
        quiet += 1
        for i in range(2):
            value = eliminate(box.matrices[i], box.unused)
            if abs(value) > least:
                values[side - m - half if i else side + m], quiet = value, 0
        if quiet >= QUIET and m > near:
            return


@jit
def set_neighbour(row: Any, direction: Any, halves: Any, other: Any) -> Any:
    """Fill the row (g−1,) in direction ±e_k or ±(e_k − e_{k+1}), or its opposite, whose first
    number m+h that is not zero is positive.
    """
    count = row.size
    axis, by = direction // 2, 1 if direction % 2 == 0 else -1
    assign(row, other)
    if axis < count:
        other[axis] += by
    else:
        other[axis - count] += by
        other[axis - count + 1] -= by
    first = 0
    for k in range(count - 1, -1, -1):
        if 2 * other[k] + halves[k] != 0:
            first = 2 * other[k] + halves[k]
    if first < 0:
        for k in range(count):
            other[k] = -other[k] - halves[k]


@jit_making
def find_rows(box: Any, least: Any, most: Any) -> Any:
    """Return the number of rows that have determinants above ``least``, the rows (R, g−1), one of
    each ±(m+h), their ``spans`` (R, 3), and the determinants, zero where they do not count.

    Rows are looked at from zero on through neighbours of those that count. The number is −1 where
    the box is too small, −2 where there are more than ``most`` determinants.
    """
    axes, side = box.unused.size - 1, box.cosines.shape[2] - 1
    width = 2 * side + 1
    size = width**axes
    rows, spans = np.zeros((size, axes), np.int64), np.zeros((size, 3), np.int64)
    values = np.zeros(min(most, size * width))
    queue, near = np.zeros((size + 1, axes), np.int64), np.zeros(size + 1, np.int64)
    seen, line = np.zeros(size, np.bool_), np.zeros(width)
    found = set_rows(box, least, rows, spans, values, (queue, near, seen, line))
    return found, rows, spans, values


@jit
def set_rows(box: Any, least: Any, rows: Any, spans: Any, values: Any, room: Any) -> Any:
    """Fill what ``find_rows`` returns; return their number."""
    queue, near, seen, line = room
    axes, side, width = box.unused.size - 1, line.size // 2, line.size
    seen[seen.size // 2] = True
    waiting, looked, found, used = 1, 0, 0, 0
    halved = 0  # of the row zero all modes are there, where it is no opposite of its own
    for k in range(axes):
        halved += box.halves[k]
    low = 0 if halved > 0 else side + 1 - box.halves[axes]
    while looked < waiting:
        row = queue[looked]
        set_row(box, row, near[looked], least, line)
        first, last, peak = width, -1, 0
        for i in range(low if looked == 0 else 0, width):
            if line[i] != 0:
                first, last = min(first, i), i
                peak = i - side if abs(line[i]) > abs(line[side + peak]) else peak
        looked += 1
        if last < 0 and looked > 1:
            continue
        if last >= 0:
            if first == 0 or last >= width - 1 - box.halves[axes]:
                return -1
            if used + last + 1 - first > values.size:
                return -2
            assign(row, rows[found])
            spans[found, PLACE], spans[found, COUNT] = used, last + 1 - first
            spans[found, FIRST] = first - side
            for i in range(first, last + 1):
                values[used] = line[i]
                used += 1
            found += 1
        for direction in range(4 * axes - 2 if axes > 0 else 0):
            other = queue[waiting]
            set_neighbour(row, direction, box.halves, other)
            index = 0
            for k in range(axes):
                if abs(other[k]) > side:
                    return -1
                index = index * width + other[k] + side
            if not seen[index]:
                seen[index] = True
                near[waiting] = abs(peak) + 1
                waiting += 1
    return found
