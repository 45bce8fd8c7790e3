"""The nodal differentials on the cuts of one curve, compiled: what analytic.curve.interval does
with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.compiled.attitudes import DENSITY, cut_roots
from veselova.analytic.compiled.compiler import compiled

__all__ = ["set_forms"]

Array = NDArray[np.float64]


@compiled()
def _set_node(
    differences: Array, s: int, density: float, below: float, above: float, forms: Array, j: int
) -> None:
    """Interval.forms, and density and to_midpoints, at one node: forms (g, J)."""
    genus = forms.shape[0]
    left = 2 * s + 1
    outer, product = 1.0, 1.0
    for i in range(2 * genus + 1):
        if i < left - 1 or i > left + 2:
            distance = (
                differences[i, left] + below if i < left else differences[left + 1, i] + above
            )
            if i < 2 or i == 2 * genus:
                outer *= distance
    common = density / math.sqrt(outer)
    for l in range(genus - 1):
        gap = 1.0
        for i in range(2 * l + 2, 2 * l + 4):
            if i < left - 1 or i > left + 2:
                gap *= (
                    differences[i, left] + below if i < left else differences[left + 1, i] + above
                )
        gap = math.sqrt(gap)
        end = left if l < s else left + 1
        middle = (differences[end, 2 * l + 2] + differences[end, 2 * l + 3]) / 2
        factor = ((below if l < s else -above) - middle) / gap
        # the factors of earlier gaps for this form, and this factor for the forms of earlier gaps
        for k in range(l):
            forms[k, j] *= factor
        forms[l, j] = common * product / gap
        product *= factor
    forms[genus - 1, j] = common * product


@compiled()
def set_forms(
    differences: Array, s: int, row: Array, psi: Array, below: Array, forms: Array
) -> None:
    """Fill λ−b_1, (J,), and the forms, (g, J), on cut s of a curve at angles (J,), from the
    constants of the cut: Interval.distances and forms.
    """
    for j in range(psi.size):
        lower, upper = cut_roots(psi[j], row)
        below[j] = lower * lower
        _set_node(differences, s, row[DENSITY], lower * lower, upper * upper, forms, j)
