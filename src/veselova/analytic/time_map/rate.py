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

    def _weight_forms(self, s: int, psi: Values) -> Values:
        cut = self.inversion.periods.cuts[s]
        below, above = cut.distances(psi)
        sign = (-1) ** (self.inversion.periods.genus - s - 1)
        return np.asarray(sign * cut.forms(below, above) * self._factor(s, below))

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
            weights = self._weights(self._weight_forms(s, psi))
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

    @cached_property
    def mean(self) -> Any:
        """Return F_0, the mean over the torus, in the arithmetic of the periods."""
        xp = self.inversion.arithmetic
        forms = (self._weight_forms(s, xp.nodes(n)) for s, n in enumerate(self.needed_nodes))
        means = [np.sum(self._weights(x), axis=-1) for x in forms]
        return self.scale * xp.determinant(np.stack(means, axis=-1))


def rate_factor(curve: Curve, s: int, point: Any, time: str, arithmetic: Arithmetic) -> Any:
    """Return φ(λ_s) for the cut s = 0…g−1."""
    below, above = (arithmetic.number(curve.branch_points[2 * s + k]) for k in (1, 2))
    if time == "t":
        return arithmetic.sqrt(point / above)
    return below / point if time == "s" else 1 + 0 * point
