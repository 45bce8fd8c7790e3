"""The Fourier coefficients of dt/dτ₁ on a torus of genus one or two, compiled: what
analytic.time_map.mode_tables does with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.compiled.compiler import compiled
from veselova.analytic.time_map.fourier import COLUMN_ROUNDING, SMALLEST_MODE

__all__ = ["set_coefficients", "set_harmonics"]

Array = NDArray[np.float64]

#: Derived: a whole turn.
_TURN = 2 * math.pi


@compiled()
def set_harmonics(values: Array, factor: float, cosines: Array, sines: Array) -> float:
    """Fill cos mφ and sin mφ, m = 0 … M, of φ = factor·values; return the largest |φ|:
    mode_tables._powers.
    """
    rows, nodes = cosines.shape
    widest = 0.0
    for j in range(nodes):
        angle = factor * values[j]
        widest = max(widest, abs(angle))
        cosines[0, j], sines[0, j] = 1.0, 0.0
        cosines[1, j], sines[1, j] = math.cos(angle), math.sin(angle)
    known = 1
    while known < rows - 1:
        for m in range(1, min(known, rows - 1 - known) + 1):
            for j in range(nodes):
                c, s = cosines[known, j], sines[known, j]
                cosines[known + m, j] = cosines[m, j] * c - sines[m, j] * s
                sines[known + m, j] = sines[m, j] * c + cosines[m, j] * s
        known *= 2
    return widest


@compiled(fast=True)
def _set_column(weights: Array, powers: Array, rows: Array, column: Array) -> float:
    """Fill Σ_j w_j cos(m·φ_j) for the modes of a box; return Σ_j w_j²: mode_tables._column;
    powers: (2, 2, M+1, J) cosines and sines of both phases.
    """
    count, nodes = powers.shape[2], powers.shape[3]
    middle = count - 1
    size = 0.0
    for j in range(nodes):
        size += weights[j] * weights[j]
    for m in range(count):
        for j in range(nodes):
            rows[0, j] = powers[0, 0, m, j] * weights[j]
            rows[1, j] = powers[0, 1, m, j] * weights[j]
        for k in range(count):
            cosine, sine = 0.0, 0.0
            for j in range(nodes):
                cosine += rows[0, j] * powers[1, 0, k, j]
                sine += rows[1, j] * powers[1, 1, k, j]
            column[m, middle + k] = cosine - sine
            column[m, middle - k] = cosine + sine
    return size


@compiled()
def _combine(columns: Array, sizes: Array, widest: Array, scale: float, values: Array) -> float:
    """Fill the coefficients that count, zero the others; return the largest of what they are off
    by: mode_tables.fourier_coefficients.
    """
    rows, count = values.shape
    middle = rows - 1
    largest = 0.0
    for a in range(rows):
        for b in range(count):
            value = columns[0, 0, a, b] * columns[1, 1, a, b]
            value = (value - columns[1, 0, a, b] * columns[0, 1, a, b]) * scale
            values[a, b] = 0.0
            if not abs(value) > SMALLEST_MODE:
                continue
            off = 0.0
            for s in range(2):
                x, y = columns[1 - s, 0, a, b], columns[1 - s, 1, a, b]
                turns = 1 + widest[s, 0] * a + widest[s, 1] * abs(b - middle)
                off += sizes[s] * turns * math.sqrt(x * x + y * y)
            off *= COLUMN_ROUNDING * abs(scale)
            if abs(value) > off and (a > 0 or b > middle):
                values[a, b] = value
                largest = max(largest, off)
    return largest


@compiled()
def _set_modes_of_one(
    weights: Array, G: Array, scale: float, values: Array, powers: Array
) -> float:
    """Fill the coefficients of genus one, and return the largest of what they are off by:
    mode_tables.fourier_coefficients.
    """
    rows, nodes = values.shape[0], weights.size
    widest = set_harmonics(G, _TURN, powers[0, 0], powers[0, 1])
    size, largest = 0.0, 0.0
    for j in range(nodes):
        size += weights[j] * weights[j]
    for m in range(rows):
        total = 0.0
        for j in range(nodes):
            total += weights[j] * powers[0, 0, m, j]
        off = COLUMN_ROUNDING * abs(scale) * math.sqrt(size) * (1 + widest * m)
        counts = abs(total * scale) > max(SMALLEST_MODE, off) and m > 0
        values[m, 0] = total * scale if counts else 0.0
        if counts:
            largest = max(largest, off)
    return largest


@compiled()
def set_coefficients(
    weights: Array,
    G: Array,
    scale: float,
    values: Array,
    powers: Array,
    rows: Array,
    columns: Array,
    sizes: Array,
    widest: Array,
) -> float:
    """Fill F_m/F_0 of a box, and return by how much each is off: mode_tables.form_tables.

    - weights, G: (g, g, J); scale: of dt/dτ₁ over its mean
    - values: (M+1, 2M+1), of genus one (M+1, 1)
    - powers, rows, columns, sizes, widest: room, (2, 2, M+1, J), (2, J), (2, 2, M+1, 2M+1), (2,)
      and (2, 2)
    """
    if weights.shape[0] == 1:
        off = _set_modes_of_one(weights[0, 0], G[0, 0], scale, values, powers)
    else:
        for s in range(2):
            sizes[s] = 0.0
            for k in range(2):
                widest[s, k] = set_harmonics(G[s, k], _TURN, powers[k, 0], powers[k, 1])
            for k in range(2):
                sizes[s] += _set_column(weights[s, k], powers, rows, columns[s, k])
            sizes[s] = math.sqrt(sizes[s])
        off = _combine(columns, sizes, widest, scale, values)
    return max(4 * SMALLEST_MODE, off / 2)
