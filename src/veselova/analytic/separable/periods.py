"""Periods and angle series of the differentials p_k dλ/(2√R) on the cuts of a separable motion.

The sum over k points on a curve whose genus may be larger: no Jacobian, but the map ψ ↦ z is all
the same a diffeomorphism of the torus (Liouville), and is inverted as in
analytic.curve.abel_jacobi.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.periods import AngleSeries
from veselova.analytic.separable.curve import SeparatedCut
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["SeparatedPeriods"]

Array = NDArray[np.float64]

#: Budget: nodes to begin with, and where a cut is too near another root.
_FEWEST_NODES = 16
_MOST_NODES = 8192

#: Derived: a series is complete when its last two coefficients are below this part of the largest.
_RESOLVED = 1e-15


class SeparatedPeriods(AngleSeries):
    """The period data of the cuts of a separable motion, in double precision."""

    arithmetic = DOUBLE
    without_angles: ClassVar[str] = "integrate numerically"

    def __init__(self, cuts: Sequence[SeparatedCut]) -> None:
        self.cuts, self.genus = cuts, len(cuts)

    @property
    def narrowest_gap(self) -> float:
        """Return the least gap between neighbouring cuts against the wider of both."""
        pairs = ((a, b, float(b.ends[0] - a.ends[1])) for a, b in itertools.pairwise(self.cuts))
        ratios = (gap / (gap + max(a.width, b.width)) for a, b, gap in pairs)
        return min(ratios, default=1.0)

    def points(self, phi: Array) -> Array:
        """Return λ_s at angles (N, g)."""
        return np.stack(
            [cut.lower + cut.distances(phi[:, s])[0] for s, cut in enumerate(self.cuts)], axis=1
        )

    def forms(self, s: int, phi: Array) -> Array:
        """Return du_k/dψ = ±p_k dλ/(2√R dψ) on cut s, shape (g, N): p_g = Π(λ−ζ_l) with ζ_l
        mid-gap, p_k = p_g/(λ−ζ_k).
        """
        g = self.genus
        cut = self.cuts[s]
        below, above = cut.distances(phi)
        factors = []
        for l in range(g - 1):
            middle = (self.cuts[l].ends[1] + self.cuts[l + 1].ends[0]) / 2
            # λ−ζ_l from the end of the cut that faces the gap.
            factors.append(
                below + float(cut.ends[0] - middle)
                if s > l
                else -(above + float(middle - cut.ends[1]))
            )
        one = np.ones_like(phi)
        products = [np.prod([one, *factors[:k], *factors[k + 1 :]], axis=0) for k in range(g - 1)]
        products.append(np.prod([one, *factors], axis=0))
        return np.asarray((-1) ** (g - s - 1) * np.array(products) / (2 * cut.speed(phi)))

    @cached_property
    def cut_series(self) -> tuple[Array, ...]:
        """Return, per cut, the cosine coefficients of du_k/dφ (signs included), shape (g, N_s)."""
        return tuple(self.cosine_coefficients(partial(self.forms, s)) for s in range(self.genus))

    def cosine_coefficients(self, function: Callable[[Array], Array]) -> Array:
        """Return the cosine coefficients of even functions of an angle, (K, M), from their values
        (K, N) at angles (N,).

        Raises Unsolved where they do not fall to rounding.
        """
        count = _FEWEST_NODES
        while count <= _MOST_NODES:
            checkpoint()
            coefficients = self.arithmetic.cosine_series(function(self.arithmetic.nodes(count)))
            size = np.max(np.abs(coefficients), axis=1, keepdims=True)
            if np.all(np.abs(coefficients[:, -2:]) <= _RESOLVED * size):
                significant = np.flatnonzero(
                    np.any(np.abs(coefficients) > _RESOLVED / 4 * size, axis=0)
                )
                return np.asarray(coefficients[:, : max(2, int(significant[-1]) + 2)])
            count *= 2
        raise Unsolved(
            "separatrix",
            "a turning point is nearly a double root: the series of its angle does not end",
        )

    @cached_property
    def series_truncation(self) -> Array:
        """Return what the angle series leave out of z_k, about, shape (g,)."""
        left_out = sum(_RESOLVED * np.max(np.abs(series), axis=1) for series in self.cut_series)
        return np.asarray(np.abs(self.inverse_cycles) @ left_out)
