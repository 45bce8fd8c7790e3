"""The tables of one torus of genus one or two from the spectrum of its start, compiled: what
analytic.motion.torus_stack and analytic.motion.ensemble do with arrays.

Each function repeats formulas of the one that it names; tests hold both together. Arrays whose
lengths differ from torus to torus are parts of longer ones.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.compiled.attitudes import ASPECT, Torus, set_cut
from veselova.analytic.compiled.compiler import compiled
from veselova.analytic.compiled.forms import set_forms
from veselova.analytic.compiled.mode_coefficients import set_coefficients
from veselova.analytic.compiled.spectra import Found, difference
from veselova.analytic.compiled.time_maps import largest, powers
from veselova.analytic.curve.periods import EXTRA_NODES

__all__ = ["BOXES", "COUNTS", "Tables", "new_tables", "part", "set_modes_of", "set_periods"]

Array = NDArray[np.float64]

_EPSILON, _NATS = float(DOUBLE.epsilon), float(DOUBLE.nats)

#: Method: numbers of nodes on a cut; who needs more is left out.
COUNTS = (12, 16, 20, 24, 30, 36, 48, 64)

#: Method: largest |m_k| of the boxes of modes that are tried, the first of them by the number of
#: nodes; who needs more is left out.
BOXES = (12, 18, 28, 42)
_FIRST_BOXES = (0, 0, 1, 1, 2, 2, 2, 2)

#: Budget: nodes of the integrals for modes.
_MOST_NODES = 400

#: Derived: the cosines of the series at nodes: cos(πi/2N), i < 4N, for each of the counts.
_COSINES = np.zeros((len(COUNTS), 4 * COUNTS[-1]))
for _row, _count in zip(_COSINES, COUNTS, strict=True):
    _row[: 4 * _count] = np.cos(np.arange(4 * _count) * (math.pi / (2 * _count)))


class Tables(NamedTuple):
    """Numbers of one torus, and room for them: flat arrays, of which ``part`` takes what is used.

    - points: (2, 2g+1) the branch points to thirty digits
    - inverse, means: (g, g) a⁻¹, and the integrals of dt/dτ₁
    - frequencies, base: (g,) f, and roundings of the start besides those of its angles
    - mean: (1,) F_0
    - psi, below, forms, weights, G: at nodes
    - of_cuts, series, values: of the forms on cuts, of angles, and modes of dt/dτ₁
    - the others: room of ``set_coefficients``
    """

    points: Any
    inverse: Any
    means: Any
    frequencies: Any
    base: Any
    mean: Any
    psi: Any
    below: Any
    forms: Any
    weights: Any
    G: Any
    of_cuts: Any
    series: Any
    values: Any
    harmonics: Any
    powers: Any
    rows: Any
    columns: Any
    sizes: Any
    widest: Any


def new_tables(genus: int) -> Tables:
    """Return room for the numbers of a torus."""
    pairs, terms, rows = genus * genus, COUNTS[-1], BOXES[-1] + 1
    lengths = (
        genus,
        genus,
        1,
        _MOST_NODES,
        _MOST_NODES,
        genus * _MOST_NODES,
        pairs * _MOST_NODES,
        pairs * _MOST_NODES,
        pairs * terms,
        pairs * terms,
        rows * (2 * rows - 1),
        2 * terms,
        4 * rows * _MOST_NODES,
        2 * _MOST_NODES,
        4 * rows * (2 * rows - 1),
        2,
    )
    shapes = (2, 2 * genus + 1), (genus, genus), (genus, genus), *lengths, (2, 2)
    return Tables._make(np.empty(shape) for shape in shapes)


@compiled(inline=True)
def part(flat: Array, rows: int, columns: int) -> Array:
    """Return the beginning of a flat array as a matrix."""
    return flat[: rows * columns].reshape(rows, columns)


@compiled(inline=True)
def _cube(flat: Array, genus: int, length: int) -> Array:
    """Return the beginning of a flat array in the shape (g, g, length)."""
    return flat[: genus * genus * length].reshape(genus, genus, length)


@compiled()
def _set_points(found: Found, i: int, points: Array, differences: Array) -> bool:
    """Fill the branch points; return whether c_2 < I_2: torus_stack.branch_points."""
    constants, inverse = found.constants[i], found.inverse[i]
    genus = constants.shape[1]
    lower = genus > 1 and constants[0, 1] < inverse[0, 1]
    for h in range(2):
        points[h, 0], points[h, 1] = constants[h, 0], inverse[h, 0]
        points[h, 2 * genus] = inverse[h, genus]
        if genus > 1:
            points[h, 2 if lower else 3] = constants[h, 1]
            points[h, 3 if lower else 2] = inverse[h, 1]
    for a in range(2 * genus + 1):
        for b in range(2 * genus + 1):
            differences[a, b] = difference(points, b, points, a)
    return bool(lower)


@compiled()
def _are_apart(differences: Array, narrowest: float, cut: float, gap: float) -> bool:
    """Return whether no branch points are too near each other: torus_stacks, ensemble._is_wide."""
    last = differences.shape[0] - 1
    for j in range(last):
        width = differences[j, j + 1]
        around = np.inf
        if j > 0:
            around = min(around, differences[j - 1, j])
        if j + 2 <= last:
            around = min(around, differences[j + 1, j + 2])
        least = cut if j % 2 == 1 else gap
        if not (width > narrowest and width / (width + around) > least):
            return False
    return True


@compiled()
def _set_series(forms: Array, cosines: Array, sign: float, series: Array) -> None:
    """Fill the cosine series of the forms on a cut, (g, N) each: Arithmetic.cosine_series."""
    genus, count = forms.shape
    for k in range(genus):
        for m in range(count):
            total, place = 0.0, m
            for j in range(count):
                total += forms[k, j] * cosines[place]
                place += 2 * m
                if place >= 4 * count:
                    place -= 4 * count
            series[k, m] = sign * total * (2 if m else 1) / count


@compiled()
def _set_inverse(series: Array, inverse: Array) -> None:
    """Fill a⁻¹ from the series of the forms, s before k: AngleSeries.inverse_cycles."""
    turn = 2 * math.pi
    if inverse.shape[0] == 1:
        inverse[0, 0] = 1 / (turn * series[0, 0, 0])
        return
    a, b = series[0, 0, 0], series[1, 0, 0]
    c, d = series[0, 1, 0], series[1, 1, 0]
    size = turn * (a * d - b * c)
    inverse[0, 0], inverse[0, 1] = d / size, -b / size
    inverse[1, 0], inverse[1, 1] = -c / size, a / size


@compiled()
def _set_weights(
    tables: Tables, s: int, below: Array, forms: Array, weights: Array, genus: int
) -> None:
    """Fill the weights w_k of cut s, (g, J): TorusFunction.weights."""
    count = below.size
    end, unit = tables.points[0, 2 * s + 1], tables.points[0, 2 * s + 2]
    sign = 1.0 if (genus - s) % 2 == 1 else -1.0
    for j in range(count):
        factor = sign * math.sqrt((end + below[j]) / unit) * (2 * math.pi / count)
        for k in range(genus):
            total = 0.0
            for l in range(genus):
                total += tables.inverse[k, l] * forms[l, j]
            weights[k, j] = total * factor


@compiled()
def _set_nodes(psi: Array) -> None:
    for j in range(psi.size):
        psi[j] = (2 * j + 1) * math.pi / (2 * psi.size)


@compiled()
def _place_of_count(torus: Torus) -> int:
    """Fill the constants of cuts; return which count of nodes serves, and how many there are where
    none does: Periods.count_nodes.
    """
    needed = 0.0
    for s in range(torus.cuts.shape[0]):
        set_cut(torus.differences, s, torus.cuts[s])
        needed = max(needed, math.ceil(_NATS / (math.pi * torus.cuts[s, ASPECT])) + EXTRA_NODES)
    place = 0
    while place < len(COUNTS) and COUNTS[place] < needed:
        place += 1
    return place


@compiled()
def _determinant(matrix: Array) -> float:
    if matrix.shape[0] == 1:
        return float(matrix[0, 0])
    return float(matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])


@compiled()
def set_periods(
    found: Found,
    i: int,
    narrowest: tuple[float, float, float],
    most_cancellation: float,
    torus: Torus,
    tables: Tables,
) -> tuple[bool, int, float]:
    """Fill the periods of a start, its angle series, and F_0; return whether c_2 < I_2, the place
    of the number of nodes, −1 for what is left out, and the scale of dt/dτ₁.
    """
    lower = _set_points(found, i, tables.points, torus.differences)
    genus = tables.frequencies.size
    if not _are_apart(torus.differences, *narrowest):
        return lower, -1, 0.0
    place = _place_of_count(torus)
    if place == len(COUNTS):
        return lower, -1, 0.0
    count = COUNTS[place]
    psi = tables.psi[:count]
    _set_nodes(psi)
    below = part(tables.below, genus, count)
    forms = _cube(tables.forms, genus, count)
    of_cuts, series = _cube(tables.of_cuts, genus, count), _cube(tables.series, genus, count)
    for s in range(genus):
        set_forms(torus.differences, s, torus.cuts[s], psi, below[s], forms[s])
        sign = 1.0 if (genus - s) % 2 == 1 else -1.0
        _set_series(forms[s], _COSINES[place], sign, of_cuts[s])
    _set_inverse(of_cuts, tables.inverse)
    scale = found.time_rate[i]
    for s in range(genus):
        scale *= math.sqrt(found.spheroconic[i, 0, s] / tables.points[0, 2 * s + 2])
        weights = part(tables.weights, genus, count)
        _set_weights(tables, s, below[s], forms[s], weights, genus)
        for k in range(genus):
            total = 0.0
            for j in range(count):
                total += weights[k, j]
            tables.means[k, s] = total
    scale = 1 / scale
    tables.mean[0] = scale * _determinant(tables.means)
    for k in range(genus):
        tables.frequencies[k] = tables.inverse[k, genus - 1]
        tables.base[k] = 0.0
        for l in range(genus):
            size = 0.0
            for s in range(genus):
                for m in range(count):
                    size += abs(of_cuts[s, l, m])
            tables.base[k] += abs(tables.inverse[k, l]) * size
        for s in range(genus):
            for m in range(count):
                total = 0.0
                for l in range(genus):
                    total += tables.inverse[k, l] * of_cuts[s, l, m]
                series[k, s, m] = total
    if not largest(tables.base) < most_cancellation:
        return lower, -1, 0.0
    for k in range(genus):
        tables.base[k] *= _EPSILON
    return lower, place, scale


@compiled()
def _pace(series: Array, cosines: Array) -> float:
    """Return the most radians that 2πm·z with all |m_k| ≤ 1 turns by one of any ψ_s:
    AngleMaps.paces.
    """
    genus, count = series.shape[0], series.shape[2]
    result = 0.0
    for s in range(genus):
        for i in range(2 * count + 1):
            total = 0.0
            for k in range(genus):
                slope, place = 0.0, 0
                for m in range(count):
                    slope += series[k, s, m] * cosines[place]
                    place += i
                    if place >= 4 * count:
                        place -= 4 * count
                total += abs(slope)
            result = max(result, total)
    return 2 * math.pi * result


@compiled(fast=True)
def _sine_sum(series: Array, sines: Array) -> float:
    """Return Σ_m series·sin mψ/m, m ≥ 1."""
    total = 0.0
    for m in range(1, series.size):
        total += series[m] * sines[m] / m
    return total


@compiled()
def _set_columns(torus: Torus, tables: Tables, count: int, nodes: int) -> None:
    """Fill the weights and G at nodes: torus_stack.columns_at_nodes."""
    genus = tables.frequencies.size
    series, harmonics = _cube(tables.series, genus, count), part(tables.harmonics, 2, count)
    weights, G = _cube(tables.weights, genus, nodes), _cube(tables.G, genus, nodes)
    psi, below = tables.psi[:nodes], tables.below[:nodes]
    forms = part(tables.forms, genus, nodes)
    _set_nodes(psi)
    for s in range(genus):
        set_forms(torus.differences, s, torus.cuts[s], psi, below, forms)
        _set_weights(tables, s, below, forms, weights[s], genus)
        for j in range(nodes):
            powers(psi[j], count - 1, harmonics[0], harmonics[1])
            for k in range(genus):
                G[s, k, j] = _sine_sum(series[k, s], harmonics[1])
            G[s, s, j] += psi[j] / (2 * math.pi)


@compiled()
def _fits(values: Array) -> bool:
    """ModeTables.fits."""
    rows, columns = values.shape
    for j in range(columns):
        if values[rows - 1, j] != 0:
            return False
    if columns > 1:
        for i in range(rows):
            if values[i, 0] != 0 or values[i, columns - 1] != 0:
                return False
    return True


@compiled()
def set_modes_of(
    torus: Torus, tables: Tables, place: int, scale: float, per_wave: float, spare: float
) -> tuple[int, float]:
    """Fill the modes of dt/dτ₁; return the number of rows of their box, 0 for what is left out, and
    by how much each mode is off: ensemble._tables.
    """
    genus, count = tables.frequencies.size, COUNTS[place]
    pace = _pace(_cube(tables.series, genus, count), _COSINES[place])
    for box in range(_FIRST_BOXES[place], len(BOXES)):
        rows = BOXES[box] + 1
        nodes = math.ceil(per_wave * (count + pace * BOXES[box]) + spare)
        if not nodes <= _MOST_NODES:
            break
        _set_columns(torus, tables, count, nodes)
        columns = 2 * rows - 1 if genus == 2 else 1
        values = part(tables.values, rows, columns)
        off = set_coefficients(
            _cube(tables.weights, genus, nodes),
            _cube(tables.G, genus, nodes),
            scale / tables.mean[0],
            values,
            tables.powers[: 4 * rows * nodes].reshape(2, 2, rows, nodes),
            part(tables.rows, 2, nodes),
            tables.columns[: 4 * rows * (2 * rows - 1)].reshape(2, 2, rows, 2 * rows - 1),
            tables.sizes,
            tables.widest,
        )
        if _fits(values):
            return rows, off
    return 0, 0.0
