"""Principal axes of a symmetric matrix far beyond double precision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.enclosures import enclose, precision, rational
from veselova.mechanics.geometry.symmetric_axes import BITS, eigenvectors

__all__ = ["AXES_KNOWN", "WideAxes", "wide_axes"]

Array = NDArray[np.float64]

#: Parts of the largest number below which what differs along these axes is rounding.
AXES_KNOWN = Fraction(1, 1 << 240)

#: Parts of the largest number that are kept of what is found: two values that are equal, or a
#: component that is zero, then come out so.
_KEPT = Fraction(1, 1 << 256)


@dataclass(frozen=True)
class WideAxes:
    """The principal axes of a symmetric matrix to 2^−256, determinant +1.

    - values: (n,) the eigenvalues, increasing; multiple ones are equal numbers
    - columns: (n, n) the axes as columns of rationals
    - rounded: the same as floats, each correctly rounded
    """

    values: tuple[Fraction, ...]
    columns: Any
    rounded: Array

    def to_axes(self, vector: Sequence[Fraction]) -> tuple[Fraction, ...]:
        """Return the components of a vector along the axes, to 2^−256 of the largest."""
        components = np.array(vector, dtype=object) @ self.columns
        unit = _KEPT * (max(map(abs, components)) or 1)
        return tuple(round(x / unit) * unit for x in components)


def wide_axes(matrix: Sequence[Sequence[Fraction]]) -> WideAxes:
    """Return the principal axes of a symmetric matrix, not zero."""
    largest = max(abs(x) for row in matrix for x in row)
    with precision(BITS):
        found, V = eigenvectors(enclose(np.array(matrix, dtype=object) / largest))
        columns = np.frompyfunc(rational, 1, 1)(V)
    values = [round(x / _KEPT) * _KEPT for x in found]
    for i in range(1, len(values)):
        if values[i] - values[i - 1] <= 2 * _KEPT:
            values[i] = values[i - 1]
    rounded = columns.astype(np.float64)
    if np.linalg.slogdet(rounded)[0] < 0:  # eigenvectors come with any sign
        columns[:, -1], rounded[:, -1] = -columns[:, -1], -rounded[:, -1]
    return WideAxes(tuple(x * largest for x in values), columns, rounded)
