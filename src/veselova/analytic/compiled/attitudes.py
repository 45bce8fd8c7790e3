"""The attitude of one torus from its angles, compiled: what analytic.numerics.jacobi_elliptic,
analytic.curve.elliptic_angle and analytic.attitude.frame_batch do with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.arithmetic.elliptic_integrals import (
    MOST_DUPLICATIONS,
    MOST_MEANS,
    NEAR,
    NEAR_MEAN,
)
from veselova.analytic.compiled.compiler import Record, compiled
from veselova.analytic.numerics.jacobi_elliptic import LARGEST_WAVE

__all__ = [
    "ASPECT",
    "DENSITY",
    "angle",
    "attitude",
    "cut_roots",
    "layout_type",
    "set_cut",
    "set_own_roots",
    "set_torus",
    "torus_type",
]

Array = NDArray[np.float64]

#: Derived: terms of theta series of a nome of at most e^(−π), as Jacobi has it.
_TERMS = max(1, math.ceil(math.sqrt(0.25 + DOUBLE.nats / math.pi) - 0.5))

#: Where the constants of a cut stand in their row: of FourPoints, of Jacobi, then four series.
_BEFORE, _WIDTH, _MODULUS, _COMPLEMENT, _QUARTER, DENSITY = range(6)
_TILT, _SN, _CN, _DN, ASPECT, _SERIES = range(6, 12)

#: Derived: numbers of such a row.
_ROW = _SERIES + 4 * (_TERMS + 1)


def torus_type(genus: int) -> np.dtype[Any]:
    """Return the record of what is known of one torus, with room for its numbers."""
    n, points = genus + 1, 2 * genus + 1
    return np.dtype(
        [
            ("cuts", float, (genus, _ROW)),
            ("differences", float, (points, points)),
            ("of_I", float, (genus, n)),
            ("of_c", float, (genus, genus)),
            ("signs", float, (n,)),
            ("ones", float, (genus,)),
            ("roots", float, (genus, points)),
            ("own", float, (points,)),
            ("own_slopes", float, (points,)),
            ("between", float, (genus, genus)),
            ("columns", float, (n,)),
            ("q", float, (n,)),
            ("v", float, (genus,)),
            ("position", float, (genus, n)),
            ("velocity", float, (genus, genus)),
        ],
        align=True,
    )


def layout_type(genus: int) -> np.dtype[Any]:
    """Return the record of a ``Layout`` of the I's and one of the c's, with the ends of cuts as
    arrays: the cut that each ends and the number of its other end, −1 where there is none.
    """

    def places(count: int) -> np.dtype[Any]:
        shapes: dict[str, tuple[int, ...]] = {
            "places": (count,),
            "sides": (genus, count),
            "beyond": (genus, count),
            "partners": (genus, max(1, genus - 1)),
            "ends": (count,),
            "mates": (count,),
        }
        return np.dtype([(name, np.int64, shape) for name, shape in shapes.items()], align=True)

    return np.dtype([("of_I", places(genus + 1)), ("of_c", places(genus))], align=True)


@compiled()
def _quarter(complement: float) -> float:
    """elliptic_integrals.quarter_period."""
    a = 1.0
    b = math.sqrt(complement)
    for _ in range(MOST_MEANS):
        if not abs(a - b) > NEAR_MEAN * a:
            break
        a, b = (a + b) / 2, math.sqrt(a * b)
    return math.pi / (a + b)


@compiled()
def _carlson(x: float, y: float, z: float) -> float:
    """elliptic_integrals.carlson_rf."""
    mean = (x + y + z) / 3
    for _ in range(MOST_DUPLICATIONS):
        if max(abs(x - mean), abs(y - mean), abs(z - mean)) <= NEAR * mean:
            break
        rx, ry, rz = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        shift = rx * ry + rx * rz + ry * rz
        x, y, z = (x + shift) / 4, (y + shift) / 4, (z + shift) / 4
        mean = (x + y + z) / 3
    X, Y = 1 - x / mean, 1 - y / mean
    Z = -X - Y
    e2, e3 = X * Y - Z * Z, X * Y * Z
    square = e2 * e2
    terms = -e2 / 10 + e3 / 14 + square / 24 - 3 * e2 * e3 / 44
    terms += -5 * square * e2 / 208 + 3 * e3 * e3 / 104 + square * e3 / 16
    return (1 + terms) / math.sqrt(mean)


@compiled()
def set_cut(differences: Array, s: int, row: Array) -> None:
    """Fill the constants of cut s: elliptic_angle.FourPoints, jacobi_elliptic.Jacobi."""
    j = 2 * s + 1
    before, width = differences[j - 1, j], differences[j, j + 1]
    lower, below = before / (before + width), width / (before + width)
    upper, above, root = 1.0, 0.0, math.sqrt(before + width)
    if j + 2 < differences.shape[0]:
        after = differences[j + 1, j + 2]
        root *= math.sqrt(after + width)
        upper, above = after / (after + width), width / (after + width)
    modulus, complement = below + above * lower, lower * upper
    quarter, conjugate = _quarter(complement), _quarter(modulus)
    is_direct = conjugate >= quarter
    nome = math.exp(-math.pi * max(conjugate / quarter, quarter / conjugate))
    row[_BEFORE], row[_WIDTH], row[_QUARTER] = before, width, quarter
    row[DENSITY] = quarter / math.pi / root
    row[_MODULUS], row[_COMPLEMENT] = modulus, complement
    row[ASPECT] = conjugate / quarter
    row[_TILT] = 0.0 if is_direct else quarter / conjugate
    terms = row[_SERIES:].reshape(4, _TERMS + 1)
    t2, t3, t4, sign, partial = 0.0, -1.0, -1.0, 1.0 - 2 * (_TERMS % 2), 0.0
    for m in range(_TERMS, -1, -1):
        odd, even = nome ** (m * (m + 1)), nome ** (m * m)
        partial += sign * odd
        terms[0, m], terms[1, m] = 2 * partial, 2 * sign * partial
        terms[2, m], terms[3, m] = even, sign * even
        t2 += 2 * odd
        t3 += 2 * even
        t4 += 2 * sign * even
        sign = -sign
    if not is_direct:
        t2, t4 = t4, t2
    row[_SN], row[_CN], row[_DN] = t3 / t2, t4 / t2, t4 / t3


@compiled()
def _sn_cn(psi: float, row: Array) -> tuple[float, float]:
    """Jacobi.__call__."""
    quarters = math.floor(psi / math.pi)
    offset = psi - quarters * math.pi
    turn = quarters % 4
    far = offset > math.pi / 2
    near_end = far != (turn % 2 == 1)
    z = (math.pi - offset if far else offset) / 2
    tilt = row[_TILT]
    terms = row[_SERIES:].reshape(4, _TERMS + 1)
    if tilt == 0:
        sine, cosine = math.sin(z), math.cos(z)
        wave = 2 - 4 * sine * sine
    else:
        y = z * tilt
        growth = math.exp(y)
        cosine = (growth + 1 / growth) / 2
        sine = math.sinh(y) if y < 1 else (growth - 1 / growth) / 2
        wave = min(2 + 4 * sine * sine, LARGEST_WAVE)
    z1, z2, z3, z4 = (
        terms[0, 0] + terms[0, 1] * wave,
        terms[1, 0] + terms[1, 1] * wave,
        terms[2, 0] + terms[2, 1] * wave,
        terms[3, 0] + terms[3, 1] * wave,
    )
    earlier, power = 2.0, wave
    for m in range(2, _TERMS + 1):
        earlier, power = power, wave * power - earlier
        z1 += terms[0, m] * power
        z2 += terms[1, m] * power
        z3 += terms[2, m] * power
        z4 += terms[3, m] * power
    z2 *= cosine
    if tilt != 0:
        z2, z4 = z4, z2
    s, c = row[_SN] * z1 * sine / z4, row[_CN] * z2 / z4
    if near_end:
        d = row[_DN] * z3 / z4
        s, c = c / d, math.sqrt(row[_COMPLEMENT]) * s / d
    return -s if turn >= 2 else s, -c if turn == 1 or turn == 2 else c


@compiled()
def cut_roots(psi: float, row: Array) -> tuple[float, float]:
    """FourPoints.roots."""
    before, width = row[_BEFORE], row[_WIDTH]
    sn, cn = _sn_cn(psi, row)
    rest = before + width * cn * cn
    below = math.sqrt(width) * math.sqrt(before / rest) * sn
    return below, math.sqrt(width) * math.sqrt((width + before) / rest) * cn


@compiled()
def angle(below: float, above: float, increasing: bool, row: Array) -> float:
    """FourPoints.angles."""
    below, above = max(below, 0.0), max(above, 0.0)
    above *= row[_BEFORE] / (row[_BEFORE] + row[_WIDTH])
    sn, cn = below / (below + above), above / (below + above)
    dn = row[_COMPLEMENT] + row[_MODULUS] * cn
    if sn <= cn:
        v = math.sqrt(sn) * _carlson(cn, dn, 1.0)
    else:
        reflected = row[_COMPLEMENT] / dn
        v = row[_QUARTER] - math.sqrt(cn / dn) * _carlson(reflected * sn, reflected, 1.0)
    psi = float(math.pi * v / row[_QUARTER])
    return psi if increasing else -psi


@compiled()
def _set_stretches(differences: Array, layout: Record, stretches: Array) -> None:
    """frame_batch.attitudes."""
    genus, count = stretches.shape
    for s in range(genus):
        for k in range(count):
            stretches[s, k] = 1.0
            if layout.beyond[s, k] < count:
                other = layout.places[layout.beyond[s, k]]
                stretches[s, k] = 1 / math.sqrt(abs(differences[layout.places[k], other]))


@compiled()
def set_torus(torus: Record, layout: Record) -> None:
    """Fill the constants of a torus."""
    for s in range(torus.cuts.shape[0]):
        set_cut(torus.differences, s, torus.cuts[s])
        torus.ones[s] = 1.0
        torus.between[s, s] = 1.0
    _set_stretches(torus.differences, layout.of_I, torus.of_I)
    _set_stretches(torus.differences, layout.of_c, torus.of_c)


@compiled()
def _orthogonal(
    torus: Record, layout: Record, stretches: Array, signs: Array, values: Array, matrix: Array
) -> None:
    """frame.orthogonal."""
    roots, own, columns, places = torus.roots, torus.own, torus.columns, layout.places
    genus, count = matrix.shape
    for k in range(count):
        product = signs[k]
        for s in range(genus):
            product *= roots[s, places[k]] * stretches[s, k]
        columns[k] = product
        values[k] = product * own[places[k]]
    for s in range(genus):
        row = 1.0
        for k in range(count):
            row *= roots[s, places[k]]
            if 1 <= k < genus:
                row /= torus.between[s, layout.partners[s, k - 1]]
        whole = row
        for k in range(count):
            if layout.ends[k] == s:
                whole *= own[places[k]]
        for k in range(count):
            if layout.ends[k] != s:
                near = roots[s, places[k]]
                entry = (values[k] / near) * (whole / near)
            elif layout.mates[k] < 0:
                entry = columns[k] * row
            else:
                entry = columns[k] * row * own[places[layout.mates[k]]]
            matrix[s, k] = layout.sides[s, k] * entry


@compiled()
def set_own_roots(torus: Record, psi: Array) -> None:
    """Fill √|λ_s − b| of the ends of cuts and their slopes by ψ_s: dλ/dψ is twice the
    product of the roots of all four distances and FourPoints.density.
    """
    own, slopes, differences = torus.own, torus.own_slopes, torus.differences
    own[0], slopes[0] = 1.0, 0.0
    for s in range(psi.size):
        j = 2 * s + 1
        own[j], own[j + 1] = cut_roots(psi[s], torus.cuts[s])
        outer = differences[j - 1, j] + own[j] * own[j]
        if j + 2 < own.size:
            outer *= differences[j + 1, j + 2] + own[j + 1] * own[j + 1]
        outer = math.sqrt(outer) * torus.cuts[s, DENSITY]
        slopes[j], slopes[j + 1] = own[j + 1] * outer, -own[j] * outer


@compiled()
def attitude(torus: Record, layout: Record, frame: Array, components: Array) -> None:
    """Fill q and the normals, columns, and q' along these, from the roots of the ends of cuts:
    frame_batch.attitudes.
    """
    genus = components.size
    own, roots, differences = torus.own, torus.roots, torus.differences
    for s in range(genus):
        j = 2 * s + 1
        for i in range(2 * genus + 1):
            if i < j:
                roots[s, i] = math.sqrt(differences[i, j] + own[j] * own[j])
            elif i > j + 1:
                roots[s, i] = math.sqrt(differences[j + 1, i] + own[j + 1] * own[j + 1])
            else:
                roots[s, i] = 1.0
    for s in range(genus):
        for j in range(s + 1, genus):
            above, below = own[2 * s + 2], own[2 * j + 1]
            between = differences[2 * s + 2, 2 * j + 1]
            torus.between[s, j] = math.sqrt(above * above + between + below * below)
            torus.between[j, s] = torus.between[s, j]
    _orthogonal(torus, layout.of_I, torus.of_I, torus.signs, torus.q, torus.position)
    _orthogonal(torus, layout.of_c, torus.of_c, torus.ones, torus.v, torus.velocity)
    for k in range(genus):
        place = (k + 1) % genus
        components[k] = torus.v[place]
        for i in range(genus + 1):
            total = 0.0
            for s in range(genus):
                total += torus.position[s, i] * torus.velocity[s, place]
            frame[i, k + 1] = total
    for i in range(genus + 1):
        frame[i, 0] = torus.q[i]
