"""Where dt/dτ₁ is analytic along an orbit, and how large it is there: a bound that no gap or cut
enters.

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
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.spectrum.branch_points import Spectrum
from veselova.analytic.time_map.rate import TIME_RATE_POWERS, TimeRate

__all__ = ["GeneralOrbit", "Orbit"]

#: Derived: by the time of the problem: the largest ad, √2−1 and √(3/2)−1, each rounded down by what
#: makes up for the rounding of the half width to a double; and by how much d(time)/dτ₁ may be above
#: its real maximum.
_LARGEST_TURN = {"t": 0.4142, "s": 0.2247}
_ABOVE_REAL = {"t": math.sqrt(2), "s": 2.0}


@dataclass(frozen=True)
class Orbit:
    """The line z = start + τ₁·frequencies on the torus with the rate of the time map there; start,
    frequencies (g,) are balls.

    stretch: √(q,Aq) at phases but for a constant, by theta functions, where angles are not to be
    asked · coarse_rates: the rate at phases in doubles, where these can give it
    """

    spectrum: Spectrum
    rate: TimeRate
    start: Values
    frequencies: Values
    time_rate: Callable[[Values], Values] | None
    coarse_rates: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None

    @property
    def has_fourier_map(self) -> bool:
        """Return whether the Fourier series of the rate is known: it is that of ``rate``."""
        return True

    def phases(self, tau1: Values) -> Values:
        """Return z modulo 2 at Neumann times (N,), shape (N, g): however far they are, doubles tell
        its cells apart.
        """
        z = self.start + tau1[:, None] * self.frequencies
        return np.asarray(z - 2 * self.rate.inversion.arithmetic.floor(z / 2))

    def rates(self, tau1: Values) -> Values:
        """Return d(time)/dτ₁ at Neumann times (N,)."""
        z = self.phases(tau1)
        if self.time_rate is None:
            return self.rate.at(self.rate.inversion.invert(z))
        return np.asarray(self.rate_constant * self.time_rate(z) ** self.power)

    @property
    def power(self) -> int:
        """Return the power of √(q,Aq) that d(time)/dτ₁ is."""
        return TIME_RATE_POWERS[self.rate.time]

    @cached_property
    def rate_constant(self) -> Any:
        """Return d(time)/dτ₁ over its power of the stretch, from the start."""
        assert self.time_rate is not None
        at_start = self.time_rate(self.start[None, :])[0] ** self.power
        return 1 / (self.rate.inversion.arithmetic.number(self.spectrum.time_rate) * at_start)

    @cached_property
    def strip(self) -> tuple[float, Any]:
        """Return (y, M) with |d(time)/dτ₁| ≤ M for |Im τ₁| ≤ y along this orbit, and every other on
        its torus.
        """
        inverse = self.spectrum.inverse
        points = self.rate.inversion.periods.curve.branch_points
        q = self.spectrum.q
        q_prime = self.spectrum.q_prime
        lowest = float(inverse[0].lower())
        level = float((np.sum(q_prime * q_prime) + np.sum(inverse * q * q)).upper())
        # (q,Aq) = Π λ_s/Π I_i, and I_1 = 1/A_1: the least of a⁻².
        share = float((inverse[0] * math.prod(points[1::2]) / math.prod(inverse)).lower())
        d = _LARGEST_TURN[self.rate.time] * math.sqrt(share)
        kappa = max(abs(2 - level - lowest), abs(2 * lowest - level - 1))
        bend = (kappa + 4 * d + 2 * d * d) * (1 + d)
        speed = math.sqrt(level - lowest)
        return 2 * d / (speed + math.sqrt(speed * speed + 2 * bend * d)), _ABOVE_REAL[
            self.rate.time
        ] * self.rate.scale


@dataclass(frozen=True)
class GeneralOrbit(Orbit):
    """An orbit with another direction, or along which another function is integrated.

    - rates_at: dt/dτ₁, or the function, at phases (N, g)
    - fourier_map: makes its Fourier time map from the expected number of modes; None for none
    - slower: by how much its τ₁ is longer than that of Neumann's flow on this torus, about
    """

    rates_at: Callable[[Values], Values]
    slower: float
    fourier_map: Callable[[Orbit, float], Any] | None = None

    @property
    def has_fourier_map(self) -> bool:
        """Return whether there is one."""
        return self.fourier_map is not None

    def rates(self, tau1: Values) -> Values:
        """Return dt/dτ₁ at Neumann times (N,)."""
        return self.rates_at(self.phases(tau1))

    @property
    def strip(self) -> tuple[float, Any]:
        """Return about how wide the strip is where dt/dτ₁ is analytic, not a bound, and its scale:
        that of Neumann's flow.
        """
        width, largest = super().strip
        return width * self.slower, largest
