"""The function (n_2,Aq)/√((q,Aq) det A/c_2) on a torus of genus 2, and its Fourier series.

It is ± ρ = ± y_2 y_γ c_2 Σ_s Ξ_s/(λ_s(λ_s−c_2)) with y_k = (q',n_k) and 2Ξ_s = λ_s' for the flow of
Neumann's system. The sum over s has λ_1−λ_2 as its denominator, as the measure of the torus has it
as a factor. So a coefficient is a determinant of one-variable integrals once more. With φ_s =
√λ_s √|λ_s−c_2|, signed on the cut that c_2 ends, its rows are

    φ_s dλ/(2w),    ½ φ_s dλ/(λ(λ−c_2)).

On the cut that c_2 ends the second is smooth as well: dλ is along both signed roots of the cut.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.frame import Frame
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.periods import Periods
from veselova.analytic.time_map.torus_series import SeriesComponent

__all__ = ["CrossComponent"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CrossComponent(SeriesComponent):
    """ρ over its largest value at the half periods; ``scale`` is what determinants of rows that
    are scaled to one are multiplied with.
    """

    @classmethod
    def of(cls, frame: Frame, inversion: AbelJacobi[Periods]) -> CrossComponent:
        """Return the component, but for its sign."""
        return cls(inversion, 1.0, frame, frame.periods.curve.place["c", 1])

    @property
    def odd(self) -> NDArray[np.bool_]:
        """Return the parities: both roots of the other cut make dλ odd, one of them is left on the
        own one.
        """
        first, second = np.zeros(2, dtype=bool), np.ones(2, dtype=bool)
        first[self.cut] = self.is_lower
        second[self.cut] = not self.is_lower
        return np.stack([first, second])

    @property
    def turn(self) -> float:
        """Return 0 where each product of the determinant has two odd factors or none, and −¼ where
        it has one.
        """
        return 0.0 if self.is_lower else -0.25

    @cached_property
    def row_sizes(self) -> Array:
        """Return the largest entry of each row at the nodes of the forms, (2,)."""
        count = max(self.needed_nodes)
        psi = self.inversion.arithmetic.nodes(count)
        rows = [np.max(np.abs(self._rows(s, psi).astype(float)), axis=1) for s in range(2)]
        return np.asarray(np.max(rows, axis=0))

    def _weights(self, forms: Values) -> Values:
        # rows of different parity, which a⁻¹ would mix
        return np.asarray(forms * (2 * self.inversion.arithmetic.pi / forms.shape[-1]))

    def _weight_forms(self, s: int, psi: Values) -> Values:
        return np.asarray(self._rows(s, psi) / self.row_sizes[:, None])

    def _rows(self, s: int, psi: Values) -> Values:
        cut = self.inversion.periods.cuts[s]
        below, above = cut.distances(psi)
        measure, of_gaps = cut.measure(below, above)
        density = measure / np.prod(of_gaps, axis=0)
        roots, own = self._roots_of_all_cuts(psi)
        lower, upper = own[2 * s + 1], own[2 * s + 2]
        others = [i for i in range(1, 5) if i not in (2 * s + 1, 2 * s + 2, self.place)]
        common = density * np.prod(roots[s][others], axis=0)
        to_zero = roots[s, 0]
        if s == self.cut:
            first = to_zero * own[self.place]
            second = -upper * common if self.is_lower else -lower * common
        else:
            first = to_zero * roots[s, self.place]
            side = 1.0 if s > self.cut else -1.0
            second = side * lower * upper * common
        sign = (-1) ** (1 - s)
        return np.stack([sign * first * density, second])
