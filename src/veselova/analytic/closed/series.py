"""Fourier series on a torus as arrays, for any genus: of (q',n_k), of d(time)/dτ₁ and of its odd
part, with checkpoints between rows.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.kernel import modes
from veselova.analytic.kernel.coefficients import (
    COUNT,
    FIRST,
    ODD,
    RATE,
    fits,
    make_box,
    set_neighbour,
    set_parities,
    set_row,
    sizes_of,
)
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["ODD", "RATE", "Series", "series_of"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Method: the box of modes that is tried first; it is doubled until the modes fit.
_FIRST_SIDE = 10

#: Budget: the largest |m_k|; the most rows that are looked at: a minute at n = 6; and the most
#: modes of the odd part.
_LARGEST_SIDE, _MOST_ROWS, _MOST_MODES = 640, 1_000_000, 400_000

#: Calibrated: coefficients count from so many roundings on, ε of the largest value or what a corner
#: of the box has; and the most of that, in such ε, which is no mode.
_ABOVE_ROUNDING, _ROUNDING = 4.0, 64.0


class Series(NamedTuple):
    """2 Σ c cos 2π(M·z/2 + turn), one of each M and −M, without a mean.

    - orders: (K, g) M, doubled modes; coefficients: (K,) c, and what each is off by
    - turn: cycles
    """

    orders: NDArray[np.int64]
    coefficients: Array
    off: float
    turn: float


def series_of(torus: Any, which: int) -> Series:
    """Return the series of a function of ``kernel.coefficients``, its modes above rounding, in
    units where the largest I is one. Raises Unsolved (``too-many-modes``).
    """
    g = torus.z.size
    if which == ODD:  # of genus 2, and of either sign
        return _odd_series(torus)
    scale, _, peak = map(float, sizes_of(torus, which))
    turn = set_parities(torus, which, np.zeros(g, np.int64), np.zeros((g, g), np.bool_))
    least, side = _EPSILON * abs(peak / scale), _FIRST_SIDE
    while side <= _LARGEST_SIDE and fits(torus.angles, side):
        box = make_box(torus, which, side)
        corner = _corner(box, g - 1, side)
        # a larger corner has a mode, unless no box is large enough
        if corner < _ROUNDING * least or 4 * side > _LARGEST_SIDE:
            rounding = max(least, corner)
            found = _in_box(box, g - 1, side, _ABOVE_ROUNDING * rounding)
            if found is not None:
                return Series(found[0], scale * found[1], abs(scale) * rounding, float(turn))
        side *= 2
    raise Unsolved("too-many-modes", f"a Fourier series has modes beyond {side // 2}")


def _odd_series(torus: Any) -> Series:
    flow = torus.frequencies / torus.mean, np.zeros(torus.z.size)
    found = modes.make_modes(torus, ODD, *flow, _LARGEST_SIDE, _MOST_MODES)
    if found.reach[0] == modes.INSUFFICIENT:
        raise Unsolved("too-many-modes", f"a Fourier series has modes beyond {_LARGEST_SIDE}")
    spans = found.spans[modes.ALL]
    ends = [np.arange(first, first + count) for first, count in spans[:, [FIRST, COUNT]]]
    last = np.concatenate([*ends, np.empty(0, np.int64)])
    rows = np.repeat(found.rows, spans[:, COUNT], axis=0)
    orders = 2 * np.column_stack([rows, last]) + found.halves
    kept = found.slopes != 0
    coefficients = found.slopes[kept] / 2
    rounding = _EPSILON * float(np.max(np.abs(coefficients), initial=0.0))
    return Series(orders[kept], coefficients, rounding, float(found.turn[0]))


def _corner(box: Any, axes: int, side: int) -> float:
    """Return the largest determinant of a corner of the box, over the function's scale: of two,
    since modes e_k − e_{k+1} may reach far.
    """
    line = np.empty(2 * side + 1)
    set_row(box, np.full(axes, side), side, 0.0, line)
    sizes = np.abs(line)
    return float(min(np.max(sizes[:3]), np.max(sizes[-3:])))


def _in_box(box: Any, axes: int, side: int, least: float) -> tuple[NDArray[np.int64], Array] | None:
    """Return the doubled modes above ``least``, over the function's scale, None where they leave
    the box.

    A row has one m_1 … m_{g−1} and all m_g. Rows are looked at from zero on through neighbours of
    those that count.
    """
    line, zero = np.empty(2 * side + 1), (0,) * axes
    # of the row zero all modes are there where it is no opposite of its own
    low = 0 if np.any(box.halves[:axes]) else side + 1 - box.halves[axes]
    queue, seen = [(zero, 0)], {zero}
    orders, values = [np.empty((0, axes + 1), np.int64)], [np.empty(0)]
    for row, near in queue:  # it grows
        checkpoint("Fourier modes", len(orders))
        set_row(box, np.array(row, dtype=np.int64), near, least, line)
        if row == zero:
            line[:low] = 0.0
        last = np.flatnonzero(line)
        if last.size:
            if last[0] == 0 or last[-1] >= 2 * side - box.halves[axes]:
                return None
            ends = np.full((last.size, axes + 1), [*row, 0])
            ends[:, axes] = last - side
            orders.append(2 * ends + box.halves)
            values.append(line[last])
        elif row != zero:
            continue
        peak = abs(int(np.argmax(np.abs(line))) - side) if last.size else 0
        for direction in range(4 * axes - 2):
            beside = np.empty(axes, np.int64)
            set_neighbour(np.array(row), direction, box.halves, beside)
            other: tuple[int, ...] = tuple(beside.tolist())
            if max(map(abs, other)) > side:
                return None
            if other not in seen:
                seen.add(other)
                queue.append((other, peak + 1))
        if len(queue) > _MOST_ROWS:
            raise Unsolved("too-many-modes", f"a Fourier series has over {_MOST_ROWS} rows")
    return np.concatenate(orders), np.concatenate(values)
