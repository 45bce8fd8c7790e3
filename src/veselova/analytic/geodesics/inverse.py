"""Two points of an ellipsoid, and the shortest geodesic between them with its Jacobi fields."""

from math import cos, sin, sqrt
from typing import Any, NamedTuple

from veselova.analytic.kernel.arithmetic import EPSILON
from veselova.analytic.kernel.compiler import jit

from .arithmetic import LOST, NEAR_UMBILIC, NUDGE, ROUND, size
from .coordinates import Place, axes
from .shortest import ALONG, TURNED, Ends, begins_below, find, over_ends, pace


class Path(NamedTuple):
    """A geodesic, in units of b.

    - length: s₁₂; v1, v2: unit tangents; gamma: Jacobi's constant A₂ − c
    - reduced: m₁₂; scale12, scale21: M₁₂, M₂₁; sure: whether these have their digits
    - kind: STRAIGHT, TURNED or ALONG
    """

    length: Any
    v1: Any
    v2: Any
    gamma: Any
    reduced: Any
    scale12: Any
    scale21: Any
    sure: Any
    kind: Any


class End(NamedTuple):
    """What the Jacobi fields take of one end.

    - p, q: sin ψ and cos ψ, negative before a turn; h: dJ/dψ; D: X+Y
    - u: √(X_C+g); rise: its derivative by the length of the geodesic
    """

    p: Any
    q: Any
    h: Any
    D: Any
    u: Any
    rise: Any


@jit
def end_of(shape: Any, is_beta: Any, orbit: Any, s: Any, q: Any, n: Any, d: Any, back: Any) -> Any:
    """Return an end: s: sin θ_L; q: X_L − g; n, d: sin θ_C and cos θ_C; back: of ψ < −90°."""
    K, other = (shape.K2, shape.K1) if is_beta else (shape.K1, shape.K2)
    X, X_C = q + orbit.g, other * d * d
    D = X + X_C
    square = shape.A2 + X_C if is_beta else shape.A2 - X_C
    rise = -other * n * d * sqrt((K + X_C) / square) / D
    width = orbit.width if orbit.width > 0 else 1.0
    cosine = sqrt(q / width)
    h = pace(shape, is_beta, X, other)
    return End(s * sqrt(K / width), -cosine if back else cosine, h, D, sqrt(X_C + orbit.g), rise)


@jit
def jacobi(orbit: Any, one: Any, two: Any, kind: Any) -> Any:
    """Return m₁₂, M₁₂ and M₂₁, and what roundings make of m₁₂.

    m₁₂ = u₁u₂Z: the variation within one family of constants gives Z, by ∂J/∂g.
    """
    if kind == ALONG:
        phi = orbit.J_C / one.h
        Z, by1, by2 = one.h * sin(phi), -cos(phi) / one.D, cos(phi) / two.D
        lost = one.h * (1 + phi)
    else:
        W = 2 * orbit.width * orbit.G
        Z = two.h * two.p * one.q - one.h * one.p * two.q + one.q * two.q * W
        along = one.q * two.q * orbit.width
        by2 = two.h * one.q * two.q + one.h * one.p * two.p - one.q * two.p * W
        by2 = by2 / (two.h * two.D) + along / (two.u * two.u * two.D)
        by1 = -two.h * one.p * two.p - one.h * one.q * two.q - one.p * two.q * W
        by1 = by1 / (one.h * one.D) - along / (one.u * one.u * one.D)
        lost = size(two.h * two.p * one.q) + size(one.h * one.p * two.q)
        lost = lost + size(one.q * two.q) * 2 * orbit.width * orbit.added
    m = one.u * two.u * Z
    M21 = one.u * (two.rise * Z + two.u * by2)
    M12 = -two.u * (one.rise * Z + one.u * by1)
    return m, M12, M21, EPSILON * one.u * two.u * lost


@jit
def combine(shape: Any, at: Any, north: Any, east: Any) -> Any:
    """Return the tangent with these components."""
    n, e = axes(shape, at)
    return north * n[0] + east * e[0], north * n[1] + east * e[1], north * n[2] + east * e[2]


@jit
def rise_of(s1: Any, c1: Any, s2: Any, c2: Any) -> Any:
    """Return c₂² − c₁² of two sines and cosines."""
    if size(s1) + size(s2) < size(c1) + size(c2):
        return (s1 - s2) * (s1 + s2)
    return (c2 - c1) * (c2 + c1)


@jit
def goes_back(one: Any, so: Any, co: Any) -> Any:
    """Return whether ω₂ < ω₁, both from 0° to 180°, of which near both ends cosines say nothing."""
    return one.so * co > one.co * so


@jit
def where_beta_turns(shape: Any, one: Any, two: Any) -> Any:
    """Return the ends of the sectors γ > 0; ω goes up, through 180° where ω₂ < 0."""
    X1 = shape.K2 * one.cb * one.cb
    rise = max(shape.K2 * rise_of(one.sb, one.cb, two.sb, two.cb), 0.0)
    around = two.so < 0
    n2, d2 = (two.co, -two.so) if around else (-two.co, two.so)
    return Ends(True, one.sb, two.sb, X1, rise, -one.co, one.so, n2, d2, around)


@jit
def where_omega_turns(shape: Any, one: Any, two: Any) -> Any:
    """Return the ends of the sectors γ < 0, whether they are those of the way back, and the sign of
    the way of ω. β goes up, or down through −90° where ω₂ < 0.
    """
    south, away = two.so < 0, abs(two.so)
    way = -1.0 if goes_back(one, away, two.co) else 1.0
    s1, s2, n1 = -way * one.co, -way * two.co, -one.sb if south else one.sb
    X1, X2 = shape.K1 * one.so * one.so, shape.K1 * away * away
    rise = shape.K1 * rise_of(one.co, one.so, two.co, two.so)
    if rise < 0 if s1 < 0 < s2 else s2 > 0:
        rise = max(-rise, 0.0)
        return Ends(False, -s2, -s1, X2, rise, -two.sb, two.cb, -n1, one.cb, south), True, way
    rise = max(rise, 0.0)
    return Ends(False, s1, s2, X1, rise, n1, one.cb, two.sb, two.cb, south), False, way


@jit
def over_sector(shape: Any, one: Any, two: Any, ends: Any, is_back: Any, way: Any) -> Any:
    """Return the path; is_back: whether the ends are those of the way back; way: the sign of that
    of ω where it turns.
    """
    kind, z, rest = find(shape, ends)
    turned = kind == TURNED
    orbit = over_ends(shape, ends, z, rest, turned)
    q1, q2 = orbit.q1, orbit.q1 + ends.rise
    first = end_of(shape, ends.is_beta, orbit, ends.s1, q1, ends.n1, ends.d1, turned)
    second = end_of(shape, ends.is_beta, orbit, ends.s2, q2, ends.n2, ends.d2, False)
    m, M12, M21, lost = jacobi(orbit, first, second, kind)
    near = min(first.D, second.D) < NEAR_UMBILIC * (shape.K1 + shape.K2)
    sure = lost < LOST * EPSILON and not near
    # components of the coordinate that turns, and of the other
    turning1, turning2 = sqrt(q1 / first.D), sqrt(q2 / second.D)
    circling1, circling2 = first.u / sqrt(first.D), second.u / sqrt(second.D)
    if turned:
        turning1 = -turning1
    if is_back:
        M12, M21 = M21, M12
        turning1, turning2, circling1, circling2 = turning2, turning1, circling2, circling1
    if ends.is_beta:
        v1 = combine(shape, one, turning1, circling1)
        v2 = combine(shape, two, turning2, circling2)
        return Path(orbit.length, v1, v2, orbit.g, m, M12, M21, sure, kind)
    side = -1.0 if ends.around else 1.0
    v1 = combine(shape, one, side * circling1, way * turning1)
    v2 = combine(shape, two, circling2, side * way * turning2)
    return Path(orbit.length, v1, v2, -orbit.g, m, M12, M21, sure, kind)


@jit
def mirror(vector: Any, signs: Any) -> Any:
    """Return the vector after reflections."""
    return vector[0] * signs[0], vector[1] * signs[1], vector[2] * signs[2]


@jit
def in_plane(shape: Any, one: Any, two: Any) -> Any:
    """Return the places, and cosine and sine, after a rotation of a spheroid that takes the first
    to y = 0: Θ would say little of opposite meridians.
    """
    if shape.K1 <= ROUND:
        x, y = two.co * one.co + two.so * one.so, two.so * one.co - two.co * one.so
        return Place(one.sb, one.cb, 0.0, 1.0), Place(two.sb, two.cb, y, x), one.co, one.so
    if shape.K2 <= ROUND:
        c, s = -one.sb, one.cb if one.so >= 0 else -one.cb
        other = two.cb if two.so >= 0 else -two.cb
        sine, cosine = two.sb * c - other * s, other * c + two.sb * s
        so = abs(two.so) if cosine >= 0 else -abs(two.so)
        first = Place(-1.0, 0.0, abs(one.so), one.co)
        return first, Place(sine, abs(cosine), so, two.co), c, s
    return one, two, 1.0, 0.0


@jit
def back_from_plane(shape: Any, v: Any, c: Any, s: Any) -> Any:
    """Return the vector before the rotation of ``in_plane``."""
    if shape.K2 <= ROUND:
        return v[0], v[1] * c - v[2] * s, v[1] * s + v[2] * c
    return v[0] * c - v[1] * s, v[0] * s + v[1] * c, v[2]


@jit
def reflected(at: Any, x: Any, y: Any, z: Any) -> Any:
    """Return the place after reflections by signs."""
    return Place(at.sb * z, at.cb, at.so * y, at.co * x)


@jit
def nudged(at: Any, is_back: Any) -> Any:
    """Return the place off the middle ellipse, on the side y < 0 where ``is_back``."""
    so = max(abs(at.so), NUDGE)
    return Place(at.sb, max(at.cb, NUDGE), -so if is_back else so, at.co)


@jit
def inverse(shape: Any, start: Any, stop: Any) -> Any:
    """Return the shortest path between two places, whatever they are, but for equal ones."""
    one, two = start, stop
    swap = size(two.sb) > size(one.sb)
    if size(two.sb) == size(one.sb):
        swap = two.cb < one.cb or (one.cb == two.cb == 0 and size(two.so) < size(one.so))
    if swap:
        one, two = two, one
    one, two, c, s = in_plane(shape, one, two)
    x, y, z = 1.0, 1.0, 1.0
    if one.sb > 0:
        z, one, two = -1.0, reflected(one, 1, 1, -1), reflected(two, 1, 1, -1)
    on_ellipse = one.cb == 0 or one.so == 0
    if (one.so < 0 and not on_ellipse) or (on_ellipse and two.so < 0):
        y, two = -1.0, reflected(two, 1, -1, 1)
    if one.co < 0:
        x, one, two = -1.0, reflected(one, -1, 1, 1), reflected(two, -1, 1, 1)
    back = two.so < 0 and two.cb > 0
    one, two = nudged(one, False), nudged(two, back)
    signs = x, y, z
    if back:
        ends = where_beta_turns(shape, one, two)
        east = not begins_below(shape, ends, True)
        if not east:
            one_, two_ = reflected(one, -1, 1, 1), reflected(two, -1, 1, 1)
            ends = where_beta_turns(shape, one_, two_)
            east = not begins_below(shape, ends, True)
            if east:
                one, two, signs = one_, two_, (-x, y, z)
    else:
        if goes_back(one, two.so, two.co):
            one, two = reflected(one, -1, 1, 1), reflected(two, -1, 1, 1)
            signs = -x, y, z
        ends = where_beta_turns(shape, one, two)
        east = begins_below(shape, ends, False)
    is_back, way = False, 1.0
    if not east:
        ends, is_back, way = where_omega_turns(shape, one, two)
    path = over_sector(shape, one, two, ends, is_back, way)
    v1 = back_from_plane(shape, mirror(path.v1, signs), c, s)
    v2 = back_from_plane(shape, mirror(path.v2, signs), c, s)
    if swap:
        v1, v2 = (-v2[0], -v2[1], -v2[2]), (-v1[0], -v1[1], -v1[2])
        M12, M21 = path.scale21, path.scale12
    else:
        M12, M21 = path.scale12, path.scale21
    return Path(path.length, v1, v2, path.gamma, path.reduced, M12, M21, path.sure, path.kind)
