"""The Fourier modes of d(time)/dτ₁ that count, for any genus, with checkpoints between rows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.kernel.coefficients import make_box, set_neighbour, set_row
from veselova.analytic.kernel.weights import RATE
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["find_coefficients"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_EPSILON = float(np.finfo(float).eps)

#: Method: the box of modes that is tried first; it is doubled until the modes fit.
_FIRST_SIDE = 10

#: Budget: the largest |m_k|, and the most rows that are looked at: a minute at n = 6.
_LARGEST_SIDE, _MOST_ROWS = 640, 1_000_000

#: Calibrated: coefficients count from so many roundings on, ε F_0 or what a corner of the box has;
#: and the most of that, in ε F_0, which is no mode.
_ABOVE_ROUNDING, _ROUNDING = 4.0, 64.0


def find_coefficients(torus: Any) -> tuple[Integers, Array, float]:
    """Return the modes (M, g) with |F_m| above rounding, one of each m and −m without zero, the F_m
    (M,), in units where the largest I is one, and what each is off by.

    Raises Unsolved (``too-many-modes``).
    """
    scale, axes = float(torus.scale[0]), torus.z.size - 1
    least = _EPSILON * abs(float(torus.mean[0]) / scale)
    side = _FIRST_SIDE
    while side <= _LARGEST_SIDE:
        box = make_box(torus, RATE, side)
        corner = _corner(box, axes, side)
        # a larger corner has a mode, unless no box is large enough
        if corner < _ROUNDING * least or 4 * side > _LARGEST_SIDE:
            rounding = max(least, corner)
            found = _in_box(box, axes, side, _ABOVE_ROUNDING * rounding)
            if found is not None:
                modes, values = found
                return modes, scale * values, abs(scale) * rounding
        side *= 2
    raise Unsolved("too-many-modes", f"the time map has modes beyond {_LARGEST_SIDE}")


def _corner(box: Any, axes: int, side: int) -> float:
    """Return the largest determinant of a corner of the box, over the rate's scale: of two, since
    modes e_k − e_{k+1} may reach far.
    """
    line = np.empty(2 * side + 1)
    set_row(box, np.full(axes, side), side, 0.0, line)
    sizes = np.abs(line)
    return float(min(np.max(sizes[:3]), np.max(sizes[-3:])))


def _in_box(box: Any, axes: int, side: int, least: float) -> tuple[Integers, Array] | None:
    """Return the modes above ``least``, over the rate's scale, None where they leave the box.

    A row has one m_1 … m_{g−1} and all m_g. Rows are looked at from zero on through neighbours of
    those that count.
    """
    line, zero = np.empty(2 * side + 1), (0,) * axes
    queue, seen = [(zero, 0)], {zero}
    modes, values = [np.empty((0, axes + 1), np.int64)], [np.empty(0)]
    for row, near in queue:  # it grows
        checkpoint("Fourier modes", len(modes))
        set_row(box, np.array(row, dtype=np.int64), near, least, line)
        if row == zero:
            line[: side + 1] = 0.0
        last = np.flatnonzero(line)
        if last.size:
            if last[0] == 0 or last[-1] == 2 * side:
                return None
            ends = np.full((last.size, axes + 1), [*row, 0])
            ends[:, axes] = last - side
            modes.append(ends)
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
            raise Unsolved("too-many-modes", f"the time map has over {_MOST_ROWS} rows of them")
    return np.concatenate(modes), np.concatenate(values)
