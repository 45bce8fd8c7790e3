"""An orbit on its torus, where dt/dτ₁ is analytic along it, and how large it is there: a bound that
no gap or cut enters.

Along an orbit q'' = −A⁻¹q + βq with β = 2(A⁻¹q,q) − E and E = (q',q') + (A⁻¹q,q) constant (Theorem
LR→Nn), I_1 ≤ A⁻¹ ≤ 1 in units of the largest I. At complex times a distance y from a real one let
|q − q(real)| ≤ d. There

    |q''| ≤ (κ + 4d + 2d²)(1 + d),   κ = max |β − I_i| over real times,   so   d ≤ |q'|y + ½
        max|q''| y²,
    |(q,Aq)/(q,Aq)_real − 1| ≤ 2ad + a²d²,   a² = A_1/min (q,Aq),

which is below one while ad < √2−1. As long as it is, dt/dτ₁ = √((q,Aq)/W) is analytic and at most
√2 times its real maximum. Along a geodesic ds/dτ₁ = 1/(√J (q,Aq)). While ad ≤ √(3/2)−1 that ratio
is at least 1/2 in absolute value, so ds/dτ₁ is analytic and at most twice its real maximum.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.spectrum.branch_points import Spectrum
from veselova.analytic.time_map.rate import TimeRate

__all__ = ["Orbit"]

#: Derived: by the time of the problem: the largest ad, √2−1 and √(3/2)−1, each rounded down by what
#: makes up for the rounding of the half width to a double; and by how much d(time)/dτ₁ may be above
#: its real maximum.
_LARGEST_TURN = {"t": 0.4142, "s": 0.2247}
_ABOVE_REAL = {"t": math.sqrt(2), "s": 2.0}


@dataclass(frozen=True)
class Orbit:
    """The line z = start + τ₁·frequencies on a torus, (g,) balls each.

    - rate: d(time)/dτ₁ of the rank-one problem there
    - integrands: at phases (N, g), (K, N): d(time)/dτ₁ of the motion, and what its path integrates
    - slower: by how much τ₁ is longer than that of Neumann's flow on this torus, about
    """

    spectrum: Spectrum
    rate: TimeRate
    start: Values
    frequencies: Values
    integrands: Callable[[Values], Values]
    slower: float = 1.0

    @property
    def arithmetic(self) -> Any:
        """Return the arithmetic of all its numbers."""
        return self.rate.inversion.arithmetic

    @property
    def fastest(self) -> float:
        """Return the most cycles that a phase makes in a unit of τ₁."""
        return max(abs(float(f)) for f in self.frequencies)

    def phases(self, tau1: Values) -> Values:
        """Return z modulo 2 at Neumann times (N,), shape (N, g): however far they are, doubles tell
        its cells apart.
        """
        z = self.start + tau1[:, None] * self.frequencies
        return np.asarray(z - 2 * self.arithmetic.floor(z / 2))

    @cached_property
    def strip(self) -> tuple[float, Any]:
        """Return (y, M) with |d(time)/dτ₁| ≤ M for |Im τ₁| ≤ y along this orbit, and every other on
        its torus; of another direction than Neumann's flow has about these, and no bound.
        """
        inverse, time = self.spectrum.inverse, self.rate.time
        points = self.rate.inversion.periods.curve.branch_points
        q, q_prime = self.spectrum.q, self.spectrum.q_prime
        lowest = float(inverse[0].lower())
        level = float((np.sum(q_prime * q_prime) + np.sum(inverse * q * q)).upper())
        # (q,Aq) = Π λ_s/Π I_i, and I_1 = 1/A_1: the least of a⁻².
        share = float((inverse[0] * math.prod(points[1::2]) / math.prod(inverse)).lower())
        d = _LARGEST_TURN[time] * math.sqrt(share)
        kappa = max(abs(2 - level - lowest), abs(2 * lowest - level - 1))
        bend = (kappa + 4 * d + 2 * d * d) * (1 + d)
        speed = math.sqrt(level - lowest)
        width = 2 * d / (speed + math.sqrt(speed * speed + 2 * bend * d))
        return width * self.slower, _ABOVE_REAL[time] * self.rate.scale
