"""The hyperelliptic curve w² = R(λ) = −λ Π(λ−I_i) Π_{k≥2}(λ−c_k), equation (Rad), of genus g = n−1."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from veselova.analytic.precision import Arithmetic, Values
from veselova.analytic.spectrum import Spectrum

__all__ = ["BranchPoint", "Curve"]


@dataclass(frozen=True)
class BranchPoint:
    """Where a branch point comes from: ``I`` with ``index`` the sorted body axis (from 0), or ``c`` with c_1 = 0 at index 0."""

    kind: Literal["I", "c"]
    index: int


@dataclass(frozen=True)
class Curve:
    """The branch points b_0 = 0 < b_1 < … < b_{2g} and all their differences, each rounded once from more digits.

    Cut s = 1…g is [b_{2s−1}, b_{2s}], where λ_s moves; gap s = 0…g−1 is [b_{2s}, b_{2s+1}].
    differences[i, j] = b_j − b_i · origins[j] says whether b_j is an I or a c.
    """

    arithmetic: Arithmetic
    branch_points: Values
    differences: Values
    origins: tuple[BranchPoint, ...]

    @classmethod
    def of(cls, spectrum: Spectrum, arithmetic: Arithmetic) -> Curve:
        """Return the curve of a spectrum, rounded to ``arithmetic``."""
        labelled = [(c, BranchPoint("c", k)) for k, c in enumerate(spectrum.constants)]
        labelled += [(x, BranchPoint("I", i)) for i, x in enumerate(spectrum.inverse)]
        # c_1 = 0 is the smallest; sorting by value alone would let rounding put a c_k that equals an I on either side.
        labelled.sort(key=lambda item: (item[0], item[1].kind))
        points = np.array([value for value, _ in labelled], dtype=object)
        differences = points[None, :] - points[:, None]
        origins = tuple(origin for _, origin in labelled)
        return cls(arithmetic, arithmetic.array(points), arithmetic.array(differences), origins)

    @property
    def genus(self) -> int:
        """Return g = n−1."""
        return (len(self.origins) - 1) // 2

    @cached_property
    def place(self) -> dict[tuple[str, int], int]:
        """Return the index j of each branch point by (kind, index)."""
        return {(origin.kind, origin.index): j for j, origin in enumerate(self.origins)}

    def cut_of(self, j: int) -> int:
        """Return the cut s = 1…g that ends at b_j, j ≥ 1."""
        return (j + 1) // 2

    @cached_property
    def midpoints(self) -> Values:
        """Return ζ_l − b_j, shape (2g+1, g−1), with ζ_l the midpoint of gap l = 1…g−1: the zeros of the nodal differentials."""
        even = np.arange(2, 2 * self.genus, 2)
        return (self.differences[:, even] + self.differences[:, even + 1]) / 2

    def relative_widths(self) -> Values:
        """Return the width of each interval [b_j, b_{j+1}], j = 0…2g−1, divided by b_{2g}."""
        g = self.genus
        widths = self.differences[np.arange(2 * g), np.arange(1, 2 * g + 1)]
        return np.asarray(widths / self.branch_points[-1])
