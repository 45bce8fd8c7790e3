"""The rate of the time map, d(time)/dτ₁ as a function on the torus.

dt/dτ₁ = √((q,Aq)/W) with (q,Aq) = Π λ_s/Π I_i, W = 2h det A (the quadrature that ends the paper);
for the arc length of a geodesic ds/dτ₁ = 1/(√J (q,Aq)) (knorrer, printed 7.2). Two independent time
maps integrate either along z = z⁰ + fτ₁: by Fourier modes, and on panels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.analytic.curve.branch_points import Spectrum
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.periods import AbelJacobi, Periods

__all__ = ["TIME_RATE_POWERS", "TimeRate"]

#: Derived: d(time)/dτ₁ is a constant times this power of √(q,Aq).
TIME_RATE_POWERS = {"t": 1, "s": -2, "tau1": 0}

#: Calibrated: nodes of a mean beyond half of those of a series.
_EXTRA_NODES = 4


@dataclass(frozen=True)
class TimeRate:
    """d(time)/dτ₁ = scale · Π_s φ_s(λ_s) on the torus of one motion, of t, s or τ₁ itself: its
    Fourier coefficients are determinants of one-variable integrals. φ_s ≤ 1 at any genus.

    time: ``t``, φ = √(λ_s/b_{2s}), ``s``, φ = b_{2s−1}/λ_s, or ``tau1``, φ = 1
    """

    inversion: AbelJacobi[Periods]
    scale: Any
    time: str

    @classmethod
    def of(cls, spectrum: Spectrum, inversion: AbelJacobi[Periods], time: str) -> TimeRate:
        """Return the rate whose scale follows from its value at the start."""
        curve = inversion.periods.curve
        fine = spectrum.arithmetic
        product = fine.number(1)
        with spectrum.arithmetic:
            for s, point in enumerate(spectrum.spheroconic):
                product = product * rate_factor(curve, s, point, time, fine)
            scale = 1 / (spectrum.time_rate * product)
        return cls(inversion, inversion.arithmetic.number(scale), time)

    def at(self, psi: Values) -> Values:
        """Return dt/dτ₁ at angles of shape (N, g)."""
        rate = 0 * psi[:, 0] + self.scale
        for s, root in enumerate(self.inversion.periods.roots_on_cuts(psi)[0]):
            rate = rate * self._factor(s, root * root)
        return np.asarray(rate)

    def _factor(self, s: int, below: Values) -> Values:
        curve = self.inversion.periods.curve
        point = curve.branch_points[2 * s + 1] + below
        return np.asarray(rate_factor(curve, s, point, self.time, curve.arithmetic))

    @property
    def needed_nodes(self) -> tuple[int, ...]:
        """Return those of the forms' own series: the factors are analytic in their strips."""
        return tuple(int(series.shape[-1]) for series in self.inversion.periods.cut_series)

    def _forms(self, s: int, psi: Values) -> tuple[Values, Values]:
        """Return λ−b_{2s+1} (N,) and the forms on cut s, signs included, (g, N)."""
        cut = self.inversion.periods.cuts[s]
        below, above = cut.distances(psi)
        sign = (-1) ** (self.inversion.periods.genus - s - 1)
        return below, np.asarray(sign * cut.forms(below, above))

    def columns(self, count: int) -> list[tuple[Values, Values]]:
        """Return, per cut, (weights w_k at ``count`` nodes, shape (g, N); G_s there, shape (N, g)).

        The torus measure is the determinant of the forms over det a, so the mean of the function
        times e^{−2πi m·z} is F_m = scale · det_{ks}[Σ_j w_kj cos(2π m·G_s(ψ_j))], the
        weights carrying a⁻¹: one-variable integrals only.
        """
        genus = self.inversion.periods.genus
        result = []
        psi = self.inversion.arithmetic.nodes(count)
        for s in range(genus):
            angles = np.zeros((count, genus), dtype=psi.dtype)
            angles[:, s] = psi
            below, forms = self._forms(s, psi)
            weights = self._weights(forms * self._factor(s, below))
            result.append((weights, self.inversion.map(angles)))
        return result

    def _weights(self, forms: Values) -> Values:
        """Return a⁻¹ times the forms at the nodes of a cut, and 2π over their number,
        shape (g, N).
        """
        periods = self.inversion.periods
        return np.asarray(
            periods.inverse_cycles @ forms * (2 * periods.arithmetic.pi / forms.shape[-1])
        )

    def mean_flow(self, direction: Values) -> tuple[Values, Any]:
        """Return f = a⁻¹ du/dτ₁ (g,) and F_0 = scale · det ã/det a, the mean over the torus, ã
        having the factors φ: by means over the cuts alone, for which half the nodes of a series do
        unless errors are to be bounded.
        """
        periods, xp = self.inversion.periods, self.inversion.arithmetic
        rows = []
        for s, cut in enumerate(periods.cuts):
            count = periods.node_count(cut)
            count = count if xp.certified else count // 2 + _EXTRA_NODES
            below, forms = self._forms(s, xp.nodes(count))
            weighted = forms * self._factor(s, below)
            rows.append(np.sum(np.stack([forms, weighted]), axis=-1) * (2 * xp.pi / count))
        a, of_rate = np.stack(rows, axis=-1)
        mean = self.scale * (xp.determinant(of_rate) / xp.determinant(a))
        return np.asarray(xp.inverse(a) @ direction), mean

    @cached_property
    def mean(self) -> Any:
        """Return F_0, in the arithmetic of the periods."""
        return self.mean_flow(np.zeros(self.inversion.periods.genus))[1]


def rate_factor(curve: Curve, s: int, point: Any, time: str, arithmetic: Arithmetic) -> Any:
    """Return φ(λ_s) for the cut s = 0…g−1."""
    below, above = (arithmetic.number(curve.branch_points[2 * s + k]) for k in (1, 2))
    if time == "t":
        return arithmetic.sqrt(point / above)
    return below / point if time == "s" else 1 + 0 * point
