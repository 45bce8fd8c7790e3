"""Fourier sums in balls, as products of matrices: over modes at many points, and over points for
many modes.

Modes m = (m', k) with the same leading entries m' are one row: Σ_k c_k e^{2πi k z_g} of all rows is
one product, and so are the Σ_j w_j e^{2πi m'·z_j} e^{2πi k z_jg} of all k.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.mechanics.core.budget import iterate

__all__ = ["SumsOverPoints", "sums_over_modes"]

Integers = NDArray[np.int64]

#: Budget: exponentials in memory at once.
_EXPONENTIALS = 1_000_000

#: Budget: rows of modes between two checkpoints.
_ROWS = 30


def sums_over_modes(
    kind: Literal["cosines", "sines"],
    modes: Integers,
    coefficients: Values,
    turns: Values,
    arithmetic: Any,
) -> Values:
    """Return Σ c_m cos 2πm·z or Σ c_m sin 2πm·z at turns e^{2πiz} (N, g), shape (N,), for modes (M,
    g) and coefficients (M,).
    """
    xp = arithmetic
    rows, which = np.unique(modes[:, :-1], axis=0, return_inverse=True)
    last = modes[:, -1]
    highest = int(np.max(np.abs(last), initial=0))
    # c_k and c_−k go with the same cosine, and with opposite sines
    even = np.full((len(rows), highest + 1), xp.number(0), dtype=object)
    odd = even.copy()
    np.add.at(even, (which.ravel(), np.abs(last)), coefficients)
    np.add.at(odd, (which.ravel(), np.abs(last)), coefficients * np.sign(last))
    result = np.full(len(turns), xp.number(0), dtype=object)
    step = max(1, _EXPONENTIALS // max(1, len(rows) + highest))
    for first in iterate(range(0, len(turns) if len(modes) else 0, step)):
        points = turns[first : first + step]
        cosines, sines = _exponentials(np.arange(highest + 1)[:, None], points[:, -1:], xp)
        real, imaginary = xp.product(even, cosines), xp.product(odd, sines)
        x, y = _exponentials(rows, points[:, :-1], xp)
        parts = x * real - y * imaginary if kind == "cosines" else y * real + x * imaginary
        result[first : first + step] = np.sum(parts, axis=0)
    return result


class SumsOverPoints:
    """Sums over turns e^{2πiz} (J, g) with weights (K, J), balls, for modes of entries up to
    ``highest``.
    """

    def __init__(self, turns: Values, weights: Values, highest: int, arithmetic: Any) -> None:
        self._xp, self._weights, self._leading = arithmetic, weights, turns[:, :-1]
        last = _exponentials(np.arange(highest + 1)[:, None], turns[:, -1:], arithmetic)
        self._last = tuple(part.T for part in last)
        #: Σ_j w_kj cos(m'·z_j) cos(k z_jg) and the same with sines, (K, highest+1) each, by m'.
        self._rows: dict[tuple[int, ...], tuple[Values, Values]] = {}

    def cosines(self, modes: Integers) -> Values:
        """Return Σ_j w_kj cos 2πm·z_j for modes (M, g), shape (M, K)."""
        leading = list(map(tuple, modes[:, :-1].tolist()))
        missing = [row for row in dict.fromkeys(leading) if row not in self._rows]
        for first in iterate(range(0, len(missing), _ROWS)):
            self._add(missing[first : first + _ROWS])
        result = np.empty((len(modes), len(self._weights)), dtype=object)
        for place, (row, k) in enumerate(zip(leading, modes[:, -1].tolist(), strict=True)):
            even, odd = self._rows[row]
            result[place] = even[:, k] - odd[:, k] if k >= 0 else even[:, -k] + odd[:, -k]
        return result

    def _add(self, rows: list[tuple[int, ...]]) -> None:
        """Form the sums of some rows."""
        modes = np.array(rows, dtype=np.int64).reshape(len(rows), -1)
        shape = (len(rows), *self._weights.shape)
        sums = []
        for part, last in zip(
            _exponentials(modes, self._leading, self._xp), self._last, strict=True
        ):
            weighted = (part[:, None, :] * self._weights).reshape(-1, shape[2])
            sums.append(self._xp.product(weighted, last).reshape(*shape[:2], -1))
        self._rows.update(zip(rows, zip(*sums, strict=True), strict=True))


def _exponentials(modes: Integers, turns: Values, arithmetic: Any) -> tuple[Values, Values]:
    """Return cos 2πm·z and sin 2πm·z, (M, N); of no entries 1 and 0."""
    if modes.shape[1]:
        return tuple(arithmetic.exponentials(modes, turns))
    one = np.full((len(modes), len(turns)), arithmetic.number(1), dtype=object)
    return one, 0 * one
