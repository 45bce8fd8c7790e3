"""The nodal differentials on the cuts of many curves, curve by curve, compiled: what
analytic.curve.interval does with arrays.

Each function repeats formulas of the one that it names; tests hold both together.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.compiled.attitudes import Torus, cut_roots, new_torus, set_cut
from veselova.analytic.compiled.compiler import compiled

__all__ = ["forms_on_cuts"]

Array = NDArray[np.float64]


@compiled()
def _density(differences: Array, s: int, quarter: float) -> float:
    """FourPoints.density."""
    j = 2 * s + 1
    root = math.sqrt(differences[j, j + 1] + differences[j - 1, j])
    if j + 2 < differences.shape[0]:
        root *= math.sqrt(differences[j, j + 1] + differences[j + 1, j + 2])
    return quarter / math.pi / root


@compiled()
def _set_forms(
    differences: Array, s: int, density: float, below: float, above: float, forms: Array, j: int
) -> None:
    """Interval.forms, and measure and to_midpoints, at one node: forms (g, J)."""
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
def _forms(
    differences: Array, s: int, psi: Array, below: Array, forms: Array, torus: Torus
) -> None:
    row = torus.cuts[0]
    for i in range(differences.shape[0]):
        set_cut(differences[i], s, row)
        density = _density(differences[i], s, row[4])
        for j in range(psi.size):
            lower, upper = cut_roots(psi[j], row)
            below[i, j] = lower * lower
            _set_forms(differences[i], s, density, lower * lower, upper * upper, forms[i], j)


def forms_on_cuts(differences: Array, s: int, psi: Array) -> tuple[Array, Array]:
    """Return λ−b_1, (N, J), and the forms, (N, g, J), on cut s of N curves at angles (J,), as
    Interval.distances and forms do.
    """
    count, genus = len(differences), (differences.shape[1] - 1) // 2
    below, forms = np.empty((count, psi.size)), np.empty((count, genus, psi.size))
    given = np.ascontiguousarray(differences), s, np.ascontiguousarray(psi)
    _forms(*given, below, forms, new_torus(genus))
    return below, forms
