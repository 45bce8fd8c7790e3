"""Resonances of a torus: integer combinations of its frequencies that vanish."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import whole_number
from veselova.mechanics.core.errors import InvalidInput, show

__all__ = ["NearReturn", "Resonance", "find_near_returns", "find_resonance", "find_windings"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Combinations that are looked at, about a second of work.
_MOST_COMBINATIONS = 4_000_000

#: The largest order of a resonance, and of the windings of a periodic orbit.
_HIGHEST_ORDER = 1_000_000


@dataclass(frozen=True, eq=False)
class Resonance:
    """The integer relations between the frequencies f of a torus, to a tolerance.

    - relations: (r, g) independent integer vectors k with k·f = 0, the lowest orders first
    - detuning: (r,) |k·f| over the largest |f_s|
    - windings: (g,) integers to which f is parallel where r = g−1: how often each phase goes round
      in one period of a periodic orbit; None elsewhere
    """

    relations: Integers
    detuning: Array
    windings: Integers | None


class NearReturn(NamedTuple):
    """A time at which all phases are nearly back; see ``Torus.nearly_periodic``."""

    time: float
    windings: tuple[int, ...]
    misfit: float


def find_near_returns(frequencies: Array, max_order: Any) -> tuple[NearReturn, ...]:
    """Return the returns of phases with these frequencies, each nearer than all before; raises
    InvalidInput.
    """
    order = whole_number(max_order, ("max_order",), 1, _HIGHEST_ORDER)
    times = np.arange(1, order + 1) / np.max(np.abs(frequencies))
    advances = times[:, None] * frequencies
    misfits = np.max(np.abs(advances - np.rint(advances)), axis=1)
    before = np.minimum.accumulate(np.concatenate([[1.0], misfits[:-1]]))
    return tuple(
        NearReturn(float(times[k]), tuple(map(int, np.rint(advances[k]))), float(misfits[k]))
        for k in np.flatnonzero(misfits < before)
    )


def find_resonance(frequencies: Array, max_order: Any = 12, tolerance: Any = 1e-9) -> Resonance:
    """Return the independent relations k·f = 0 with |k_s| ≤ max_order, to the tolerance.

    Raises InvalidInput for a bad order or tolerance, and for more than 4·10⁶ combinations.
    """
    order = whole_number(max_order, ("max_order",), 1, _HIGHEST_ORDER)
    small = _tolerance(tolerance)
    g = frequencies.size
    if (2 * order + 1) ** g > _MOST_COMBINATIONS:
        largest = int((_MOST_COMBINATIONS ** (1 / g) - 1) / 2)
        raise InvalidInput(("max_order",), f"at most {largest} for {g} frequencies", show(order))
    scaled = frequencies / np.max(np.abs(frequencies))
    axis = np.arange(-order, order + 1)
    sums = np.zeros((1,) * g)
    for s in range(g):
        sums = sums + (scaled[s] * axis).reshape([-1 if i == s else 1 for i in range(g)])
    found = np.argwhere(np.abs(sums) <= small) - order
    found = found[np.lexsort((np.abs(found).max(axis=1), np.abs(found).sum(axis=1)))]
    relations = np.zeros((0, g), dtype=np.int64)
    for k in found:
        longer = np.vstack([relations, k])
        if len(relations) < g - 1 and np.linalg.matrix_rank(longer) == len(longer):
            relations = longer
    leading = relations[np.arange(len(relations)), np.argmax(relations != 0, axis=1)]
    relations = relations * np.where(leading < 0, -1, 1)[:, None]
    # by Cramer's rule windings are minors of the relations
    most = min(_HIGHEST_ORDER, max(1, order ** (g - 1)))
    periodic = len(relations) == g - 1
    windings = find_windings(frequencies, most, small) if periodic else None
    return Resonance(relations, np.abs(relations @ scaled), windings)


def find_windings(frequencies: Array, max_order: Any, tolerance: Any) -> Integers | None:
    """Return the least integers p, |p_s| ≤ max_order, to which f is parallel: |f_s/f_j − p_s/p_j|
    ≤ tolerance for the largest f_j; None where there are none. Raises InvalidInput as
    ``find_resonance``.
    """
    order = whole_number(max_order, ("max_order",), 1, _HIGHEST_ORDER)
    small = _tolerance(tolerance)
    largest = int(np.argmax(np.abs(frequencies)))
    ratios = frequencies / frequencies[largest]
    turns = np.arange(1, order + 1)[:, None]
    misfits = np.max(np.abs(np.rint(turns * ratios) / turns - ratios), axis=1)
    close = np.flatnonzero(misfits <= small)
    if not close.size:
        return None
    sign = 1 if frequencies[largest] > 0 else -1
    return np.asarray(sign * np.rint(turns[close[0]] * ratios), dtype=np.int64)


def _tolerance(given: Any) -> float:
    valid = isinstance(given, (int, float)) and not isinstance(given, bool) and 0 < given < 0.1
    if not valid:
        raise InvalidInput(("tolerance",), "a number between 0 and 0.1", show(given))
    return float(given)
