"""The start of one motion from doubles, in double-double arithmetic (pairs), and which starts are
served.

λ_s: zeros of Σ q_i²/(λ−I_i); c_k: zeros of 1 + Σ x_s²/(c−λ_s), x_s = (q', m_s). Each zero is a
pole plus a distance y from the nearer one: Newton's method in doubles on y times the function, then
twice in pairs. Differences of branch points are rounded once.
"""

from typing import Any, NamedTuple

import numpy as np

from .arithmetic import is_finite, jit, jit_making

#: Derived: the narrowest cut or gap whose products with others are doubles.
NARROWEST = 1e-140

#: Derived: the largest constant of Neumann's system, where the largest I is one: beyond, q' says
#: little of the directions of the frame in doubles.
LARGEST_CONSTANT = 1e30

#: Calibrated: the largest ratio of two A's; the frozen motions have some up to 7e8.
WIDEST = 1e9


class Start(NamedTuple):
    """What ``make_torus`` takes of a start, doubles or balls; axes by decreasing A.

    - d: (2g+1, 2g+1) b_j − b_i; points: (2g+1,) b_j, the largest I is 1
    - of_I: (n,) place of I_i among the b; of_c: (g,) that of c_k
    - signs: (n,) of the roots of ``frame``
    - on_cuts: (2, g) λ_s−b_{2s−1} and b_{2s}−λ_s; up: (g,) whether λ_s increases
    - rate: (1,) d(time)/dτ₁
    """

    d: Any
    points: Any
    of_I: Any
    of_c: Any
    signs: Any
    on_cuts: Any
    up: Any
    rate: Any


@jit
def add(a: Any, b: Any) -> Any:
    """Return a + b."""
    s = a[0] + b[0]
    t = s - a[0]
    e = (a[0] - (s - t)) + (b[0] - t)
    u = a[1] + b[1]
    v = u - a[1]
    f = (a[1] - (u - v)) + (b[1] - v)
    e += u
    h = s + e
    e = (e - (h - s)) + f
    r = h + e
    return r, e - (r - h)


@jit
def minus(a: Any, b: Any) -> Any:
    """Return a − b."""
    return add(a, (-b[0], -b[1]))


@jit
def times(a: Any, b: Any) -> Any:
    """Return ab."""
    p = a[0] * b[0]
    c, d = 134217729.0 * a[0], 134217729.0 * b[0]
    c, d = c - (c - a[0]), d - (d - b[0])
    e, f = a[0] - c, b[0] - d
    low = e * f - (((p - c * d) - e * d) - c * f) + (a[0] * b[1] + a[1] * b[0])
    r = p + low
    return r, low - (r - p)


@jit
def over(a: Any, b: Any) -> Any:
    """Return a/b."""
    x = a[0] / b[0]
    r = minus(a, times((x, 0.0), b))
    y = r[0] / b[0]
    z = minus(r, times((y, 0.0), b))[0] / b[0]
    return add(add((x, 0.0), (y, 0.0)), (z, 0.0))


@jit
def root(a: Any) -> Any:
    """Return √a."""
    x = np.sqrt(a[0])
    return add((x, 0.0), (minus(a, times((x, 0.0), (x, 0.0)))[0] / (2 * x), 0.0))


@jit
def total(a: Any, b: Any, c: Any) -> Any:
    """Return Σ a_i b_i c_i of arrays (n, 2)."""
    result = (0.0, 0.0)
    for i in range(a.shape[0]):
        result = add(
            result, times(times((a[i, 0], a[i, 1]), (b[i, 0], b[i, 1])), (c[i, 0], c[i, 1]))
        )
    return result


@jit
def zero_between(poles: Any, weights: Any, s: Any, constant: Any) -> Any:
    """Return the zero of constant + Σ w_i/(x−p_i) between p_s and p_{s+1} as a pair."""
    n = poles.shape[0]
    width = minus((poles[s + 1, 0], poles[s + 1, 1]), (poles[s, 0], poles[s, 1]))[0]
    middle = constant
    for i in range(n):
        gap = minus((poles[s, 0], poles[s, 1]), (poles[i, 0], poles[i, 1]))[0]
        middle += weights[i, 0] / (gap + width / 2)
    a, sign = (s, 1.0) if middle <= 0 else (s + 1, -1.0)
    pole = (poles[a, 0], poles[a, 1])
    # h(y) = σ y (constant + Σ w_i/(x−p_i)), x = p_a + σy: positive at y = 0, negative at width/2
    low, high, y = 0.0, width / 2, 0.25 * width
    for _ in range(80):
        rest, slope = constant, 0.0
        for i in range(n):
            if i != a:
                inverse = 1 / (minus(pole, (poles[i, 0], poles[i, 1]))[0] + sign * y)
                rest += weights[i, 0] * inverse
                slope -= sign * weights[i, 0] * inverse * inverse
        value, slope = weights[a, 0] + sign * y * rest, sign * (rest + y * slope)
        if value > 0:
            low = y
        else:
            high = y
        new = y - value / slope if slope < 0 else -1.0
        if not low < new < high:
            new = np.sqrt(max(low, 1e-20 * high) * high) if low < high / 4 else (low + high) / 2
        change, y = abs(new - y), new
        if change < 1e-13 * y:
            break
    pair = (y, 0.0)
    for _ in range(2):
        rest, slope = (constant, 0.0), 0.0
        signed = pair if sign > 0 else (-pair[0], -pair[1])
        for i in range(n):
            if i != a:
                distance = add(minus(pole, (poles[i, 0], poles[i, 1])), signed)
                term = over((weights[i, 0], weights[i, 1]), distance)
                rest, slope = add(rest, term), slope - sign * term[0] / distance[0]
        value = add((weights[a, 0], weights[a, 1]), times(signed, rest))
        pair = minus(pair, (value[0] / (sign * (rest[0] + pair[0] * slope)), 0.0))
    return add(pole, pair if sign > 0 else (-pair[0], -pair[1]))


@jit_making
def set_start(A: Any, q: Any, v: Any, start: Any) -> Any:
    """Fill a start from A (n,), decreasing, q and v (n,). Return False where branch points are
    nearer than 1e-13 of the largest.
    """
    n, g = A.size, A.size - 1
    one, a, I = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2))
    x, y, w = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2))
    for i in range(n):
        one[i, 0] = 1.0
        I[i] = over((A[n - 1], 0.0), (A[i], 0.0))
        a[i] = over((A[i], 0.0), (A[n - 1], 0.0))
        x[i, 0], y[i, 0] = q[i], v[i]
    qq = total(one, x, x)
    along = over(total(one, x, y), qq)
    for i in range(n):
        y[i] = minus((y[i, 0], y[i, 1]), times((x[i, 0], x[i, 1]), along))
        w[i] = over(times((x[i, 0], x[i, 1]), (x[i, 0], x[i, 1])), qq)
    qAq, vAv, qAv = total(a, x, x), total(a, y, y), total(a, x, y)
    rate2 = over(minus(times(vAv, qAq), times(qAv, qAv)), qAq)
    speed = root(rate2)
    start.rate[0] = 1 / speed[0]
    lam, squares = np.zeros((g, 2)), np.zeros((g, 2))
    for s in range(g):
        lam[s] = zero_between(I, w, s, 0.0)
        mixed, norm = (0.0, 0.0), (0.0, 0.0)
        for i in range(n):
            part = over((x[i, 0], x[i, 1]), minus((lam[s, 0], lam[s, 1]), (I[i, 0], I[i, 1])))
            mixed = add(mixed, times(part, (y[i, 0], y[i, 1])))
            norm = add(norm, times(part, part))
        start.up[s] = mixed[0] >= 0
        squares[s] = over(times(mixed, mixed), times(norm, rate2))
    b = np.zeros((2 * g + 1, 2))
    set_points(I, lam, squares, b, start.of_I, start.of_c)
    least = set_differences(b, lam, start.d, start.points, start.on_cuts)
    for i in range(n):
        lower, s = start.of_I[i] % 2 == 1, (start.of_I[i] - 1) // 2
        sign = 1.0 if start.up[s] or not lower else -1.0
        start.signs[i] = sign if q[i] >= 0 else -sign
    return least > 1e-13 * start.points[2 * g]


@jit
def set_points(I: Any, lam: Any, squares: Any, b: Any, of_I: Any, of_c: Any) -> Any:
    """Fill the branch points b (2g+1, 2): 0 = c_1, I_1, then c_{k+1} between λ_k and λ_{k+1}, on
    either side of I_{k+1}; and where each of them is.
    """
    n, g = I.shape[0], lam.shape[0]
    place, of_c[0] = 1, 0
    for i in range(n):
        c = (0.0, 0.0)
        if 1 <= i < g:
            c = zero_between(lam, squares, i - 1, 1.0)
        first = 1 <= i < g and minus(c, (I[i, 0], I[i, 1]))[0] < 0
        if first:
            b[place, 0], b[place, 1], of_c[i] = c[0], c[1], place
            place += 1
        b[place, 0], b[place, 1], of_I[i] = I[i, 0], I[i, 1], place
        place += 1
        if 1 <= i < g and not first:
            b[place, 0], b[place, 1], of_c[i] = c[0], c[1], place
            place += 1


@jit
def set_differences(b: Any, lam: Any, d: Any, points: Any, on_cuts: Any) -> Any:
    """Fill b_j, b_j − b_i, and λ_s less the ends of its cut; return the least b_{j+1} − b_j."""
    g, least = lam.shape[0], 1e300
    for i in range(2 * g + 1):
        points[i] = b[i, 0]
        for j in range(2 * g + 1):
            d[i, j] = minus((b[j, 0], b[j, 1]), (b[i, 0], b[i, 1]))[0]
        if i > 0:
            least = min(least, d[i - 1, i])
    for s in range(g):
        j = 2 * s + 1
        on_cuts[0, s] = max(minus((lam[s, 0], lam[s, 1]), (b[j, 0], b[j, 1]))[0], 0.0)
        on_cuts[1, s] = max(minus((b[j + 1, 0], b[j + 1, 1]), (lam[s, 0], lam[s, 1]))[0], 0.0)
    return least


@jit_making
def make_start(n: Any) -> Any:
    """Return room for a start in n dimensions."""
    g = n - 1
    return Start(
        np.zeros((2 * g + 1, 2 * g + 1)),
        np.zeros(2 * g + 1),
        np.zeros(n, np.int64),
        np.zeros(g, np.int64),
        np.zeros(n),
        np.zeros((2, g)),
        np.zeros(g, np.bool_),
        np.zeros(1),
    )


@jit_making
def begin(A: Any, q: Any, v: Any, order: Any, start: Any) -> Any:
    """Fill a start from A, q and q̇ (n,) along the body axes, and which of them has the k-th
    largest A; return whether it is one with branch points apart and no q_i = 0.
    """
    for i in range(A.size):
        place = i
        while place > 0 and A[order[place - 1]] < A[i]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = i
        if q[i] == 0:
            return False
    return set_start(A[order], q[order], v[order], start)


@jit
def is_wide(d: Any, points: Any, on_cuts: Any, rate: Any) -> Any:
    """Return whether the numbers of a start are finite, no cut or gap is so narrow that products of
    it with others are none, and no constant is too large.
    """
    wide = is_finite(points) and is_finite(rate)
    wide = wide and is_finite(on_cuts[0]) and is_finite(on_cuts[1])
    ends = points[0], points[points.size - 1]
    wide = wide and abs(ends[0]) < LARGEST_CONSTANT and abs(ends[1]) < LARGEST_CONSTANT
    for j in range(points.size - 1):
        wide = wide and d[j, j + 1] >= NARROWEST
    return wide


@jit
def is_proven(d: Any, points: Any, of_I: Any, on_cuts: Any, rate: Any) -> Any:
    """Return whether the estimates of errors were compared with true ones for such branch points;
    no array of the kernel is too short for them.
    """
    return is_wide(d, points, on_cuts, rate) and points[of_I[0]] * WIDEST >= 1
