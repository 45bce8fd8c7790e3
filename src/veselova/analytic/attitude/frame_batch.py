"""The closed formula of the frame on many tori at once: what analytic.attitude.frame does for one,
for T points on each of N tori whose branch points come in one order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.attitude.frame import Attitude, orthogonal
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.interval import Interval

__all__ = ["attitudes"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Points:
    """The distances and signed roots at angles on N curves, side by side: P = N·T points.

    psi: (N, T, g)
    """

    curve: Curve
    cuts: Sequence[Interval]
    psi: Array

    @cached_property
    def own_roots(self) -> Array:
        """Return the signed root of |λ_s−b_i| at each end b_i of its cut s, one for b_0, (2g+1,
        P).
        """
        count, times, genus = self.psi.shape
        result = np.ones((2 * genus + 1, count * times))
        for s, cut in enumerate(self.cuts):
            below, above = cut.roots(self.psi[:, :, s])
            result[2 * s + 1], result[2 * s + 2] = below.ravel(), above.ravel()
        return result

    @cached_property
    def on_cuts(self) -> tuple[Array, Array]:
        """Return λ_s−b_{2s−1} and b_{2s}−λ_s, each (g, P)."""
        squares = self.own_roots * self.own_roots
        return squares[1::2], squares[2::2]

    def spread(self, values: Array) -> Array:
        """Return numbers of the N curves, last axis, at the P points."""
        return np.repeat(values, self.psi.shape[1], axis=-1)

    @cached_property
    def _differences(self) -> Array:
        return self.spread(np.moveaxis(self.curve.differences, 0, -1))

    @cached_property
    def roots(self) -> Array:
        """Return √|λ_s−b_i|, (g, 2g+1, P), one where b_i ends cut s."""
        below, above = self.on_cuts
        genus = self.curve.genus
        result = np.empty((genus, 2 * genus + 1, below.shape[1]))
        for s in range(genus):
            j = 2 * s + 1
            result[s, :j] = self._differences[:j, j] + below[s]
            result[s, j : j + 2] = 1.0
            result[s, j + 2 :] = self._differences[j + 1, j + 2 :] + above[s]
        return np.sqrt(result, out=result)

    @cached_property
    def roots_between(self) -> Array:
        """Return √|λ_s−λ_j|, (g, g, P), one for s = j."""
        below, above = self.on_cuts
        genus = self.curve.genus
        result = np.ones((genus, genus, below.shape[1]))
        for s in range(genus):
            for j in range(s + 1, genus):
                between = self._differences[2 * s + 2, 2 * j + 1]
                result[s, j] = np.sqrt(above[s] + between + below[j])
                result[j, s] = result[s, j]
        return result

    def stretches(self, kind: Literal["I", "c"]) -> Array:
        """Return √|b − b'| from the branch points b of one kind to those beyond each cut, (g, m,
        P).
        """
        layout = self.curve.layout(kind)
        inside = layout.beyond < layout.places.size
        others = layout.places[np.where(inside, layout.beyond, 0)]
        distances = np.abs(self._differences[layout.places, others])
        return np.asarray(np.sqrt(np.where(inside[..., None], distances, 1.0)))


def attitudes(curve: Curve, cuts: Sequence[Interval], signs: Array, psi: Array) -> Attitude:
    """Return the attitudes at angles (N, T, g), those of all N·T points one after the other.

    ``signs`` (N, n) are the ς_i of each motion along sorted axes.
    """
    points = _Points(curve, cuts, psi)
    genus = curve.genus
    q, position = orthogonal(points, "I", points.spread(signs.T))
    v, velocity = orthogonal(points, "c", None)
    order = [*range(1, genus), 0]  # n_2 … n_{n−1}, then γ, which belongs to c_1 = 0
    normals = np.einsum("sip,skp->pik", position, velocity[:, order], optimize=False)
    lower_ends = points.spread(curve.branch_points[:, 1 : 2 * genus : 2].T)
    return Attitude(q.T, normals, v[order].T, (lower_ends + points.on_cuts[0]).T)
