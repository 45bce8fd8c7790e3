"""The hyperelliptic curve w² = R(λ) = −Π(λ−I_i) Π(λ−c_k), equation (Rad, printed 6.12), of genus g
= n−1; c_1 = 0 but for Neumann's system.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.analytic.spectrum.branch_points import Spectrum

__all__ = ["BranchPoint", "Curve"]


@dataclass(frozen=True)
class BranchPoint:
    """Where a branch point comes from: ``I`` with ``index`` the sorted body axis (from 0), or ``c``
    with c_1 at index 0.
    """

    kind: Literal["I", "c"]
    index: int


@dataclass(frozen=True)
class Curve:
    """The branch points b_0 < b_1 < … < b_{2g} and all their differences, each rounded once from
    more digits.

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
        points = np.array([value for value, _, _ in spectrum.branch_points], dtype=object)
        with spectrum.arithmetic:
            differences = arithmetic.array(points - points[:, None])
        origins = tuple(BranchPoint(kind, index) for _, kind, index in spectrum.branch_points)
        return cls(arithmetic, arithmetic.array(points), differences, origins)

    @property
    def genus(self) -> int:
        """Return g = n−1."""
        return (len(self.origins) - 1) // 2

    @cached_property
    def place(self) -> dict[tuple[str, int], int]:
        """Return the index j of each branch point by (kind, index)."""
        return {(origin.kind, origin.index): j for j, origin in enumerate(self.origins)}

    def places(self, kind: Literal["I", "c"]) -> list[int]:
        """Return the indices j of the branch points of one kind."""
        return [self.place[kind, index] for index in range(self.genus + (kind == "I"))]

    def width(self, j: int) -> Any:
        """Return b_{j+1} − b_j."""
        return self.differences[j, j + 1]

    def point(self, j: int) -> Any:
        """Return b_j."""
        return self.branch_points[j]

    @staticmethod
    def cut_of(j: Any) -> Any:
        """Return the cut s = 1…g that ends at b_j, j ≥ 1 (an index, or an array of them); 0 for
        b_0, which ends none.
        """
        return (j + 1) // 2

    @cached_property
    def midpoints(self) -> Values:
        """Return ζ_l − b_j, shape (2g+1, g−1), with ζ_l the midpoint of gap l = 1…g−1: the zeros of
        the nodal differentials.
        """
        even = np.arange(2, 2 * self.genus, 2)
        return (self.differences[:, even] + self.differences[:, even + 1]) / 2

    @cached_property
    def narrowest_gap(self) -> float:
        """Return the least gap that can close against the wider of its two cuts: how near a
        separatrix is; 1 without any.

        The first gap is one between c_1 = 0 and the least I, but for Neumann's system, where it may
        close as the others may.
        """
        widths = [self.differences[j, j + 1] for j in range(2 * self.genus)]
        first = 2 if self.branch_points[0] == 0 else 0
        ratios = [
            float(
                widths[j] / (widths[j] + max(widths[j + 1], widths[j - 1] if j else widths[j + 1]))
            )
            for j in range(first, 2 * self.genus, 2)
        ]
        return min(ratios, default=1.0)
