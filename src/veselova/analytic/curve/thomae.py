"""Thomae's formula in doubles: |θ(0)|⁴ of half-integer characteristics from differences of branch
points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from veselova.analytic.curve.abel_images import Halves
from veselova.analytic.curve.nodal_forms import pairs_on_one_side
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.results.curve import ThomaeConstant

__all__ = ["thomae_constants"]


def thomae_constants(
    curve: RealCurve, halves: Sequence[Halves], subsets: Sequence[tuple[int, ...]]
) -> tuple[ThomaeConstant, ...]:
    """Return |θ[η_S](0)|⁴ = (det a/(2π)^g)² Π_{i<j∈S}|β_i−β_j| Π_{i<j∉S}|β_i−β_j| for sets S of g+1
    numbers of β's, a the periods of μ^{k−1}dμ/v.

    det a is that of the nodal differentials over Π_{k<l}(ζ_l−ζ_k): it does not cancel. Mantissas
    and exponents of products are kept apart, since products leave the range of a double.
    """
    genus = curve.genus
    differences = np.abs(curve.periods.curve.differences)
    even = np.arange(2, 2 * genus, 2)
    zetas = (differences[np.ix_(even, even)] + differences[np.ix_(even + 1, even + 1)]) / 2
    fractions, powers = np.frexp(zetas[np.triu_indices(genus - 1, 1)])
    determinant = float(np.linalg.det(curve.periods.cycles)) / (math.pi**genus * np.prod(fractions))
    mantissas, exponents = (part.tolist() for part in np.frexp(differences))
    eta = np.array(halves)
    shift = np.sum(eta[1::2], axis=0)
    found = []
    for subset in iterate(subsets):
        epsilon, delta = (np.sum(eta[list(subset)], axis=0) + shift) % 1
        pairs = pairs_on_one_side(2 * genus + 1, subset)
        product = math.prod(mantissas[i][j] for i, j in pairs)
        exponent = sum(exponents[i][j] for i, j in pairs) - 2 * int(np.sum(powers))
        found.append(
            ThomaeConstant(
                tuple(sorted(curve.order[j] for j in subset)),
                (tuple(epsilon.tolist()), tuple(delta.tolist())),
                math.ldexp(determinant**2 * product, exponent),
            )
        )
    return tuple(found)
