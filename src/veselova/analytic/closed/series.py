"""Fourier series on a torus as arrays: of (q',n_k), of d(time)/dτ₁ and of its odd part."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.kernel import modes
from veselova.analytic.kernel.coefficients import COUNT, FIRST
from veselova.analytic.kernel.weights import ODD, RATE
from veselova.mechanics.core.errors import Unsolved

__all__ = ["ODD", "RATE", "Series", "series_of"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Budget: the largest |m_k| by genus, eight beyond, and the most modes.
_SIDES, _MOST_MODES = (0, 640, 640, 80, 40, 20), 400_000


class Series(NamedTuple):
    """2 Σ c cos 2π(M·z/2 + turn), one of each M and −M.

    - orders: (K, g) M, doubled modes; coefficients: (K,) c
    - turn: cycles
    """

    orders: Integers
    coefficients: Array
    turn: float


def series_of(torus: Any, which: int) -> Series:
    """Return the series of a function of ``kernel.weights`` but for its mean, over 1e-16 of its
    largest value. Raises Unsolved (``too-many-modes``).
    """
    g = torus.z.size
    side = _SIDES[g] if g < len(_SIDES) else 8
    flow = torus.frequencies / torus.mean, np.zeros(g)
    found = modes.make_modes(torus, which, *flow, side, _MOST_MODES)
    if found.reach[0] == modes.INSUFFICIENT:
        raise Unsolved("too-many-modes", f"a series has modes beyond {side}")
    spans = found.spans[modes.ALL]
    ends = [np.arange(first, first + count) for first, count in spans[:, [FIRST, COUNT]]]
    last = np.concatenate([*ends, np.empty(0, np.int64)])
    rows = np.repeat(found.rows, spans[:, COUNT], axis=0)
    orders = 2 * np.column_stack([rows, last]) + found.halves
    kept = found.slopes != 0
    return Series(orders[kept], found.slopes[kept] / 2, float(found.turn[0]))
