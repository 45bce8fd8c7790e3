"""The shortest geodesic between two points: one equation for Jacobi's constant.

    Θ(g) = J_L − J_C = 0,   s = S_L + S_C

L turns at most once, since two turning points are conjugate; C goes one way. By reflections and an
exchange |β₁| ≥ |β₂|, β₁ ≤ 0, 0 ≤ ω₁ ≤ 90°. Then β₂ is met first by exactly one geodesic for each
ω₂ (Itoh and Kiyohara, 2004), whose azimuth grows with ω₂: of four sectors between the directions
of the umbilics, signs of Θ at g → 0 tell which. In each Θ has one zero, either on the way without
a turn or after one; g = X₁z(2−z) is smooth at both ends.

Points of the middle ellipse and umbilics are moved by NUDGE, and K₁, K₂ are at least ROUND: far
below rounding, and then there is no special case, on spheroids and the sphere neither.
"""

from math import exp, log, sqrt
from typing import Any, NamedTuple

from veselova.analytic.kernel.arithmetic import EPSILON
from veselova.analytic.kernel.compiler import jit

from .arithmetic import FARTHEST, LAST_STEP, LEAST, enclose, midpoint, size
from .integrals import between, circling, turning

#: Method: z at which a sign is taken for that at zero, if Θ is so much of its terms.
SMALL, CERTAIN = 1e-16, 1e-12


class Ends(NamedTuple):
    """Two ends in the normal form: θ₁ ≤ θ₂ of the coordinate that turns, |θ₁| ≥ |θ₂|.

    - is_beta: whether β turns; s1, s2: sin θ; X1: K cos²θ₁; rise: X₂−X₁
    - n1, d1, n2, d2: sine and cosine of the other coordinate's θ; around: whether it passes ±90°
    """

    is_beta: Any
    s1: Any
    s2: Any
    X1: Any
    rise: Any
    n1: Any
    d1: Any
    n2: Any
    d2: Any
    around: Any


class Orbit(NamedTuple):
    """The two integrals at one z.

    - theta, slope: Θ and dΘ/dz; terms: J_L + J_C, J_C: of the other; length: S_L + S_C
    - G: ∂J_L/∂g − ∂J_C/∂g at fixed t, added: Σ|·|
    - g, width: g and K−g; q1: X₁−g
    """

    theta: Any
    slope: Any
    terms: Any
    J_C: Any
    length: Any
    G: Any
    added: Any
    g: Any
    width: Any
    q1: Any


@jit
def over_ends(shape: Any, ends: Any, z: Any, rest: Any, turned: Any) -> Any:
    """Return the integrals at g = X₁z(2−z), with a turn of L at its lower end or without; rest:
    1−z.
    """
    K, other = (shape.K2, shape.K1) if ends.is_beta else (shape.K1, shape.K2)
    g, q1 = ends.X1 * z * (1 + rest), ends.X1 * rest * rest
    width = K * ends.s1 * ends.s1 + q1
    form = turning(shape, ends.is_beta, g, width)
    n1, d1 = sqrt(K) * ends.s1, sqrt(q1)
    n2, d2 = sqrt(K) * ends.s2, sqrt(q1 + ends.rise)
    d1, d2 = (d1 if size(n1) > 0 else 1 + d1), (d2 if size(n2) > 0 else 1 + d2)
    if turned:
        J, S, G = between(form, -1.0, 0.0, n1, d1)
        j, s, h = between(form, -1.0, 0.0, n2, d2)
        J, S, G = J + j, S + s, G + h
    else:
        J, S, G = between(form, n1, d1, n2, d2)
    form = circling(shape, not ends.is_beta, g)
    if ends.around:
        J_C, S_C, G_C = between(form, ends.n1, ends.d1, 1.0, 0.0)
        j, s, h = between(form, -1.0, 0.0, ends.n2, ends.d2)
        J_C, S_C, G_C = J_C + j, S_C + s, G_C + h
    else:
        J_C, S_C, G_C = between(form, ends.n1, ends.d1, ends.n2, ends.d2)
    # t of the ends moves with g: ± (dJ/dψ) t/(2(K−g)) dg/dz
    X2 = ends.X1 + ends.rise
    h1 = pace(shape, ends.is_beta, ends.X1, other) * ends.s1 * sqrt(K * ends.X1)
    h2 = pace(shape, ends.is_beta, X2, other) * ends.s2 * sqrt(K) * ends.X1
    rest2 = q1 + ends.rise
    h2 = h2 * rest / sqrt(rest2) if rest2 > 0 else h2 / sqrt(ends.X1)
    slope = (G - G_C) * 2 * ends.X1 * rest
    if width > 0:
        slope = slope + (h2 + h1 if turned else h2 - h1) / width
    added = size(G) + size(G_C)
    return Orbit(J - J_C, slope, J + J_C, J_C, S + S_C, G - G_C, added, g, width, q1)


@jit
def pace(shape: Any, is_beta: Any, X: Any, other: Any) -> Any:
    """Return dJ/dψ where X is K cos²θ."""
    square = shape.A2 - X if is_beta else shape.A2 + X
    return sqrt(square / (X * (X + other)))


@jit
def begins_below(shape: Any, ends: Any, turned: Any) -> Any:
    """Return whether Θ < 0 for g → 0."""
    found = over_ends(shape, ends, SMALL, 1.0, turned)
    if size(found.theta) < CERTAIN * size(found.terms):
        found = over_ends(shape, ends, LEAST, 1.0, turned)
    return found.theta < 0


STRAIGHT, TURNED, ALONG = 0, 1, 2


@jit
def find(shape: Any, ends: Any) -> Any:
    """Return the zero of Θ as z and 1−z, each to its own digits, and whether it is STRAIGHT,
    TURNED, or ALONG the ellipse to which L shrinks at z = 1.
    """
    kind = STRAIGHT
    found = over_ends(shape, ends, 1.0, 0.0, False)
    if found.theta < 0:
        kind = TURNED
        found = over_ends(shape, ends, 1.0, 0.0, True)
        if found.theta >= 0:
            return ALONG, 1.0, 0.0
    sign = 1 if kind == STRAIGHT else -1
    # sign·Θ increases from below zero at z = 0; the bracket is one of y = log z/(1−z)
    low, high, y, z, rest = -FARTHEST, FARTHEST, FARTHEST, 1.0, 0.0
    for turn in range(200):
        if turn > 0:
            found = over_ends(shape, ends, z, rest, kind == TURNED)
        value, slope = sign * found.theta, sign * found.slope
        if size(value) <= EPSILON * size(found.terms):
            break
        if value > 0:
            high = y
        else:
            low = y
        step = value / slope if slope > 0 else 2.0
        good = z - step > z / 8 and rest + step > rest / 8
        if good:
            if rest + step < 0.5:
                new_z, new_rest = 1 - (rest + step), rest + step
            else:
                new_z, new_rest = z - step, 1 - (z - step)
            y = log(new_z / new_rest)
            good = low < y < high
            last = size(step) < LAST_STEP * size(min(new_z, new_rest))
        if not good:
            # towards z = 0 Θ is like log z
            before = high if value > 0 else low
            y, last = low, False
            if slope > 0 and turn > 0:
                y = before - value / (slope * z * rest)
            if not low < y < high:
                # most zeros are far from the end of the range
                y = max((low + high) / 2, 2 * min(high, 0.0) - 6.0) if turn > 0 else -1.0
            new_z, new_rest = 1 / (1 + exp(-y)), 1 / (1 + exp(y))
        z, rest = midpoint(new_z), midpoint(new_rest)
        if last or high - low <= EPSILON * size(high):
            break
    z, rest = enclose(shape, ends, kind, z, rest)
    return kind, z, rest
