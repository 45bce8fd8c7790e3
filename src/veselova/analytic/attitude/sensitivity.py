"""The sensitivity of the frame to the phases, which bounds the effect of their errors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["BETWEEN", "MOST_LOCAL", "Sensitivity", "combine_bounds"]

Array = NDArray[np.float64]

#: Budget: times up to which an error is that by the sensitivities at the times themselves; for more
#: times it is that by the largest sensitivity on the torus. A budget: at so many points they cost
#: less than the periods do.
MOST_LOCAL = 24

#: Calibrated: by how much the steepness between the sampled points may be larger than at them.
BETWEEN = 1.25

#: Derived: the largest second derivative over the square of the largest first one, with some to
#: spare: one for a cosine, 0.8 for a hyperbolic tangent.
_CURVATURE = 4.0


class Sensitivity(NamedTuple):
    """Derivatives of numbers x of a state, such as the entries of its frame, at N points of the
    torus, or their maxima over points. Each is the largest over the numbers, (N,) or one number.

    - along_flow: |dx/dτ₁|
    - together: √Σ_k (∂x/∂z_k)²
    - by_rates: Σ_k |f_k ∂x/∂z_k|
    - by_start: √Σ_j (Σ_k ∂x/∂z_k δ_kj)², where source j of rounding at the start moves phase k
      by δ_kj
    """

    along_flow: Array
    together: Array
    by_rates: Array
    by_start: Array

    @classmethod
    def at_points(cls, slopes: Array, rates: Array, sources: Array) -> Sensitivity:
        """Return those at each point, from derivatives of K numbers in every phase, (N, K, g), the
        frequencies (g,) and δ (g, S).
        """
        with np.errstate(over="ignore"):  # of slopes beyond 1e154 the norm is infinite
            return cls(
                np.max(np.abs(slopes @ rates), axis=1),
                np.max(np.linalg.norm(slopes, axis=2), axis=1),
                np.max(np.abs(slopes) @ np.abs(rates), axis=1),
                np.max(np.linalg.norm(slopes @ sources, axis=2), axis=1),
            )

    def largest(self) -> Sensitivity:
        """Return the maxima over the points."""
        return Sensitivity(*(np.asarray(np.max(part, axis=0)) for part in self))

    def maximum(self, other: Sensitivity) -> Sensitivity:
        """Return the larger of both, number by number."""
        pairs = zip(self, other, strict=True)
        return Sensitivity(*(np.maximum(mine, theirs) for mine, theirs in pairs))


def combine_bounds(largest: Array, local: Array) -> Array:
    """Return the error from two bounds: by the largest sensitivities, and by those at the state.

    The state moves by the error meanwhile, and a sensitivity changes by at most _CURVATURE times
    the square of the largest one: what the second bound leaves out is of second order.
    """
    left_out = _CURVATURE * largest * np.minimum(largest, 1.0)  # squares may leave the floats
    return np.asarray(np.minimum(largest, local + left_out))
