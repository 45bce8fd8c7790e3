"""The Fourier modes that count: sets of integer vectors m, one of each m and −m,
grown from zero.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["Integers", "find_significant_modes"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Budget: modes looked at before giving up.
_MOST_MODES = 1_000_000


def find_significant_modes(
    genus: int,
    coefficients: Callable[[Integers], tuple[Any, NDArray[np.bool_]]],
    most: int = _MOST_MODES,
    *,
    origin: Integers | None = None,
    stride: int = 1,
    expected: float = 0.0,
) -> tuple[Integers, NDArray[Any], Integers]:
    """Return the modes m ≠ 0 (first nonzero entry positive) whose coefficients count, these, and
    the modes next to them.

    ``coefficients`` gives those of modes (M, g), and whether each is large enough. They fall off
    like the support function of a
    convex body, so the set is convex up to its edge: it is grown from zero through neighbours, in
    whichever directions it reaches far. Where A's nearly coincide so do rates of phases, and modes
    e_s − e_{s+1} are slow. Averages over fast phases are constant to first order, so sets Σm = 0
    and 2 may be empty where Σm = 1 reaches far: such differences lead to neighbours too. Modes are
    ``origin``, zero where none is given, plus multiples of ``stride``: half-integers doubled, say.
    Raises Unsolved where more than ``most`` have been looked at.
    """
    units = np.eye(genus, dtype=np.int64)
    steps = np.concatenate([units, -units, np.diff(units, axis=0), -np.diff(units, axis=0)])
    steps *= stride
    none = np.empty((0, genus), dtype=np.int64)
    layer = np.zeros((1, genus), dtype=np.int64) if origin is None else origin[None, :]
    looked_at = 1
    before = none
    refused = none
    kept_modes = []
    kept_values = []
    while layer.size:
        checkpoint("Fourier modes", looked_at, max(expected, looked_at) if expected else 0.0)
        values, large = coefficients(layer)
        kept_modes.append(layer[large])
        kept_values.append(values[large])
        # Those that count have no neighbours that do but in their own layer, the one before and the
        # next. Others may be met again much later, where rounding may take them for large: none is
        # looked at twice.
        refused = np.concatenate([refused, layer[~large]])
        neighbours = _half_space((layer[large][:, None, :] + steps).reshape(-1, genus))
        before, layer = (
            layer[large],
            _others(neighbours, np.concatenate([before, layer[large], refused])),
        )
        looked_at += len(layer)
        if looked_at > most:
            raise Unsolved(
                "too-far",
                f"there are more than {most} Fourier modes, and the time is too far for panels",
            )
    modes = np.concatenate(kept_modes)
    values = np.concatenate(kept_values)
    moving = np.any(modes != 0, axis=1)
    return modes[moving], values[moving], refused


def _half_space(modes: Integers) -> Integers:
    """Return the modes, each replaced by its negative where its first nonzero entry is negative."""
    first = modes[np.arange(modes.shape[0]), np.argmax(modes != 0, axis=1)]
    return np.asarray(np.where(first[:, None] < 0, -modes, modes))


def _others(modes: Integers, known: Integers) -> Integers:
    """Return the distinct ones among modes (M, g) that are not among the known, in lexicographic
    order.
    """
    rows = np.concatenate([known, modes])
    order = np.lexsort(rows.T[::-1])  # stable: of equal rows known ones come first
    rows = rows[order]
    fresh = np.any(rows != np.roll(rows, 1, axis=0), axis=1) & (order >= len(known))
    return np.asarray(rows[fresh])
