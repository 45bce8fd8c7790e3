"""The tables of one torus of genus one to three from the spectrum of its start, compiled: what
analytic.motion.torus_stack and analytic.motion.ensemble do with arrays.

Each function repeats formulas of the one that it names; tests hold both together. Arrays whose
lengths differ from torus to torus are parts of longer ones.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.compiled.attitudes import ASPECT, set_cut
from veselova.analytic.compiled.compiler import Record, compiled
from veselova.analytic.compiled.forms import set_forms
from veselova.analytic.compiled.linear_equations import determinant, largest, set_inverse
from veselova.analytic.compiled.mode_coefficients import set_coefficients, set_harmonics
from veselova.analytic.compiled.spectra import Found, difference
from veselova.analytic.curve.periods import EXTRA_NODES

__all__ = ["BOXES", "COUNTS", "cube", "part", "set_modes_of", "set_periods", "tables_type"]

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


def tables_type(genus: int) -> np.dtype[Any]:
    """Return the record of the numbers of one torus; of flat arrays ``part`` takes what is used.

    - points: the branch points to thirty digits
    - inverse, means: a⁻¹, and the integrals of dt/dτ₁
    - frequencies, base: f, and roundings of the start besides those of its angles
    - mean: F_0
    - psi, below, forms, weights, G: at nodes
    - of_cuts, of_weights, series, values: of the forms and weights on cuts, of angles, and modes of
      dt/dτ₁
    - terms, harmonics: of one series, and of ψ or of phases at nodes
    - the others: room of ``set_coefficients``
    """
    pairs, terms, rows = genus * genus, COUNTS[-1], BOXES[-1] + 1 if genus < 3 else 1
    nodes = _MOST_NODES if genus < 3 else terms
    shapes: dict[str, tuple[int, ...]] = {
        "points": (2, 2 * genus + 1),
        "inverse": (genus, genus),
        "means": (genus, genus),
        "widest": (2, 2),
        "frequencies": (genus,),
        "base": (genus,),
        "mean": (1,),
        "psi": (nodes,),
        "below": (genus * terms,),
        "forms": (pairs * terms,),
        "weights": (pairs * nodes,),
        "G": (pairs * nodes,),
        "of_cuts": (pairs * terms,),
        "of_weights": (pairs * terms,),
        "series": (pairs * terms,),
        "values": (rows * (2 * rows - 1),),
        "terms": (terms,),
        "harmonics": (max(4 * rows, 2 * terms) * nodes,),
        "rows": (2 * nodes,),
        "columns": (4 * rows * (2 * rows - 1),),
        "sizes": (2,),
    }
    return np.dtype([(name, float, shape) for name, shape in shapes.items()], align=True)


@compiled(inline=True)
def part(flat: Array, rows: int, columns: int) -> Array:
    """Return the beginning of a flat array as a matrix."""
    return flat[: rows * columns].reshape(rows, columns)


@compiled(inline=True)
def cube(flat: Array, genus: int, length: int) -> Array:
    """Return the beginning of a flat array in the shape (g, g, length)."""
    return flat[: genus * genus * length].reshape(genus, genus, length)


@compiled()
def _set_points(found: Found, i: int, points: Array, differences: Array) -> int:
    """Fill the branch points; return the sum of 2^(s−2) over the s with c_s < I_s:
    torus_stack.branch_points.
    """
    constants, inverse = found.constants[i], found.inverse[i]
    genus, order = constants.shape[1], 0
    for s in range(1, genus):
        if constants[0, s] < inverse[0, s]:
            order += 1 << (s - 1)
    for h in range(2):
        points[h, 0], points[h, 1] = constants[h, 0], inverse[h, 0]
        points[h, 2 * genus] = inverse[h, genus]
        for s in range(1, genus):
            lower = (order >> (s - 1)) & 1
            points[h, 2 * s + 1 - lower] = constants[h, s]
            points[h, 2 * s + lower] = inverse[h, s]
    for a in range(2 * genus + 1):
        for b in range(2 * genus + 1):
            differences[a, b] = difference(points, b, points, a)
    return order


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


@compiled(fast=True)
def _sum(weights: Array, values: Array) -> float:
    total = 0.0
    for j in range(values.size):
        total += weights[j] * values[j]
    return total


@compiled()
def _set_series(values: Array, cosines: Array, sign: float, series: Array) -> None:
    """Fill the cosine series of functions on a cut, (g, N) each, from cos mψ at N nodes, (N, N):
    Arithmetic.cosine_series.
    """
    genus, count = values.shape
    for k in range(genus):
        for m in range(count):
            factor = sign * (2 if m else 1) / count
            series[k, m] = factor * _sum(values[k], cosines[m])


@compiled()
def _set_inverse(series: Array, cycles: Array, inverse: Array) -> None:
    """Fill a⁻¹ from the series of the forms, s before k, and the room of a:
    AngleSeries.inverse_cycles.
    """
    genus = inverse.shape[0]
    for s in range(genus):
        for l in range(genus):
            cycles[l, s] = 2 * math.pi * series[s, l, 0]
    set_inverse(cycles, inverse)


@compiled()
def _set_weights(
    tables: Record, s: int, below: Array, forms: Array, weights: Array, genus: int
) -> None:
    """Fill the weights w_k of cut s over the mean of a node, (g, N): TorusFunction.weights."""
    end, unit = tables.points[0, 2 * s + 1], tables.points[0, 2 * s + 2]
    sign = 1.0 if (genus - s) % 2 == 1 else -1.0
    for j in range(below.size):
        factor = sign * math.sqrt((end + below[j]) / unit)
        for k in range(genus):
            total = 0.0
            for l in range(genus):
                total += tables.inverse[k, l] * forms[l, j]
            weights[k, j] = total * factor


@compiled(inline=True)
def _harmonics(tables: Record, count: int, nodes: int) -> Any:
    """Return room for cos mψ and sin mψ at nodes, (2, N, J)."""
    return tables.harmonics[: 2 * count * nodes].reshape(2, count, nodes)


@compiled()
def _set_nodes(psi: Array, harmonics: Array) -> None:
    """Fill nodes and the harmonics there."""
    for j in range(psi.size):
        psi[j] = (2 * j + 1) * math.pi / (2 * psi.size)
    set_harmonics(psi, 1.0, harmonics[0], harmonics[1])


@compiled()
def _place_of_count(torus: Record) -> int:
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
def set_periods(
    found: Found,
    i: int,
    narrowest: tuple[float, float, float],
    most_cancellation: float,
    torus: Record,
    tables: Record,
) -> tuple[int, int, float]:
    """Fill the periods of a start, its angle series, and F_0; return the order of branch points,
    the place of the number of nodes, −1 for what is left out, and the scale of dt/dτ₁.
    """
    order = _set_points(found, i, tables.points, torus.differences)
    genus = tables.frequencies.size
    if not _are_apart(torus.differences, *narrowest):
        return order, -1, 0.0
    place = _place_of_count(torus)
    if place == len(COUNTS):
        return order, -1, 0.0
    count = COUNTS[place]
    psi, harmonics = tables.psi[:count], _harmonics(tables, count, count)
    _set_nodes(psi, harmonics)
    below, weights = part(tables.below, genus, count), part(tables.weights, genus, count)
    forms, of_weights = cube(tables.forms, genus, count), cube(tables.of_weights, genus, count)
    of_cuts, series = cube(tables.of_cuts, genus, count), cube(tables.series, genus, count)
    for s in range(genus):
        set_forms(torus.differences, s, torus.cuts[s], psi, below[s], forms[s])
        sign = 1.0 if (genus - s) % 2 == 1 else -1.0
        _set_series(forms[s], harmonics[0], sign, of_cuts[s])
    _set_inverse(of_cuts, tables.means, tables.inverse)
    scale = found.time_rate[i]
    for s in range(genus):
        scale *= math.sqrt(found.spheroconic[i, 0, s] / tables.points[0, 2 * s + 2])
        _set_weights(tables, s, below[s], forms[s], weights, genus)
        _set_series(weights, harmonics[0], 1.0, of_weights[s])
        for k in range(genus):
            tables.means[k, s] = 2 * math.pi * of_weights[s, k, 0]
    scale = 1 / scale
    tables.mean[0] = scale * determinant(tables.means)
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
        return order, -1, 0.0
    for k in range(genus):
        tables.base[k] *= _EPSILON
    return order, place, scale


@compiled()
def _pace(series: Array) -> float:
    """Return a bound of the radians that 2πm·z with all |m_k| ≤ 1 turns by one of any ψ_s:
    AngleMaps.paces, of which it is the sum of sizes.
    """
    genus, count = series.shape[0], series.shape[2]
    result = 0.0
    for s in range(genus):
        total = 0.0
        for k in range(genus):
            for m in range(count):
                total += abs(series[k, s, m])
        result = max(result, total)
    return 2 * math.pi * result


@compiled()
def _set_sums(series: Array, harmonics: Array, values: Array) -> None:
    """Fill Σ_m series·wave at nodes."""
    for j in range(values.size):
        values[j] = 0.0
    for m in range(series.size):
        factor = series[m]
        for j in range(values.size):
            values[j] += factor * harmonics[m, j]


@compiled()
def _set_columns(tables: Record, count: int, nodes: int) -> None:
    """Fill the weights and G at nodes from their series: torus_stack.columns_at_nodes."""
    genus = tables.frequencies.size
    series, of_weights = cube(tables.series, genus, count), cube(tables.of_weights, genus, count)
    weights, G = cube(tables.weights, genus, nodes), cube(tables.G, genus, nodes)
    psi, harmonics, terms = (
        tables.psi[:nodes],
        _harmonics(tables, count, nodes),
        tables.terms[:count],
    )
    _set_nodes(psi, harmonics)
    for s in range(genus):
        for k in range(genus):
            terms[0] = 0.0
            for m in range(1, count):
                terms[m] = series[k, s, m] / m
            _set_sums(terms, harmonics[1], G[s, k])
            for m in range(count):
                terms[m] = of_weights[s, k, m] * (2 * math.pi / nodes)
            _set_sums(terms, harmonics[0], weights[s, k])
        for j in range(nodes):
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
    tables: Record, place: int, scale: float, per_wave: float, spare: float
) -> tuple[int, float]:
    """Fill the modes of dt/dτ₁; return the number of rows of their box, 0 for what is left out, and
    by how much each mode is off: ensemble._tables.
    """
    genus, count = tables.frequencies.size, COUNTS[place]
    pace = _pace(cube(tables.series, genus, count))
    for box in range(_FIRST_BOXES[place], len(BOXES)):
        rows = BOXES[box] + 1
        nodes = math.ceil(per_wave * (count + pace * BOXES[box]) + spare)
        if not nodes <= _MOST_NODES:
            break
        _set_columns(tables, count, nodes)
        columns = 2 * rows - 1 if genus == 2 else 1
        values = part(tables.values, rows, columns)
        off = set_coefficients(
            cube(tables.weights, genus, nodes),
            cube(tables.G, genus, nodes),
            scale / tables.mean[0],
            values,
            tables.harmonics[: 4 * rows * nodes].reshape(2, 2, rows, nodes),
            part(tables.rows, 2, nodes),
            tables.columns[: 4 * rows * (2 * rows - 1)].reshape(2, 2, rows, 2 * rows - 1),
            tables.sizes,
            tables.widest,
        )
        if _fits(values):
            return rows, off
    return 0, 0.0
