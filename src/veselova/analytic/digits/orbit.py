"""The motion in doubles beside one in balls, its cycles and its costs; and the orbit in balls on
its torus, where dt/dτ₁ is analytic along it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import Balls, Values
from veselova.analytic.closed.motion import TorusMotion
from veselova.analytic.closed.quotients import riemann_matrix
from veselova.analytic.curve.branch_points import Spectrum
from veselova.analytic.curve.hyperelliptic import narrowest_gap
from veselova.analytic.digits.torus import TorusInBalls
from veselova.analytic.kernel.rate import ARC, PHYSICAL
from veselova.analytic.kernel.torus import MOST_CYCLES
from veselova.mechanics.core.arguments import FEWEST_DIGITS
from veselova.tunings import THETA_GENUS

__all__ = ["InDoubles", "Orbit"]

Array = NDArray[np.float64]

#: Calibrated: relative gaps below which theta quotients serve, up to genus 4 and above it, and the
#: largest genus at which theta sums are taken there.
_NARROW_GAP = 1e-6
_NARROW_GAP_HIGH_GENUS, _HIGH_GENUS, _SEPARATRIX_GENUS = 1e-12, 4, 7

#: Calibrated: entries of T, and cancellation in the Abel map, from which a torus is uneven: a cut
#: of relative width 1e-10 has 8.
_LARGE_PERIOD, _LARGE_CANCELLATION = 8.0, 10.0

#: Derived: coefficients fall below 4e-16 = e^−36 outside a convex body. Its volume is about
#: (2.34·36/π)^g/(g! det T), as counts of modes up to genus 5 show; half of it counts.
_BODY = 2.34 * 36 / math.pi
_COUNTED_GENUS = 5

#: Derived: modes of a time map that nobody takes: e to this, and no more are counted.
_LARGEST_EXPONENT = 70.0

#: Derived: by the time of the problem: the largest ad, √2−1 and √(3/2)−1, each rounded down by what
#: makes up for the rounding of the half width to a double; and by how much d(time)/dτ₁ may be above
#: its real maximum.
_LARGEST_TURN = {PHYSICAL: 0.4142, ARC: 0.2247}
_ABOVE_REAL = {PHYSICAL: math.sqrt(2), ARC: 2.0}


@dataclass(frozen=True)
class InDoubles(TorusMotion):
    """A motion in doubles, of any ratio of A's. Raises Unsolved as ``kernel_motion``."""

    proven: bool = False

    def tau1(self, times: Array) -> Array:
        """Return approximate τ₁ at increasing times; beyond what doubles hold, that of the mean
        rate.
        """
        if self.cycles(times) > MOST_CYCLES and self.problem.time != "tau1":
            return np.asarray(times / self.kernel.torus.mean)
        return self.states(times, np.zeros(times.size))[0].tau1

    def cycles(self, times: Array) -> float:
        """Return the most cycles that any phase makes between t = 0 and the times."""
        return float(self.kernel.fastest) * float(np.max(np.abs(times)))

    @cached_property
    def narrowest_gap(self) -> float:
        """Return the least gap that can close against the wider of its two cuts."""
        return narrowest_gap(self.kernel.torus.d, self.problem.time == "tau1")

    @property
    def near_separatrix(self) -> bool:
        """Return whether a gap is so narrow that theta functions serve where angles say little."""
        genus = self.kernel.genus
        narrow = _NARROW_GAP if genus <= _HIGH_GENUS else _NARROW_GAP_HIGH_GENUS
        near = self.kernel.on_separatrix or self.narrowest_gap < narrow
        return near and genus <= _SEPARATRIX_GENUS

    @property
    def takes_theta(self) -> bool:
        """Return whether theta quotients are the cheaper route: near a separatrix, and where
        neither narrow cuts nor wide A's give phases very different weights.
        """
        even = float(np.max(self.kernel.torus.cancellation)) < _LARGE_CANCELLATION
        even = even and float(np.max(np.abs(self._T))) < _LARGE_PERIOD
        return self.near_separatrix or (self.kernel.genus <= THETA_GENUS and even)

    @cached_property
    def _T(self) -> Array:
        return riemann_matrix(self.kernel.torus)[0]

    def modes(self, digits: float) -> float:
        """Return about how many modes a Fourier time map of so many digits has."""
        genus = self.kernel.genus
        sign, logarithm = np.linalg.slogdet(self._T)
        if not sign > 0:
            return math.inf
        counted = min(genus, _COUNTED_GENUS)
        exponent = genus * math.log(_BODY) - float(logarithm)
        exponent -= (genus - counted) * math.log(_BODY * math.pi / 36)
        known = math.exp(min(exponent, _LARGEST_EXPONENT)) / (2 * math.factorial(counted))
        return float(known * (digits / FEWEST_DIGITS) ** genus)


@dataclass(frozen=True)
class Orbit:
    """The line z = start + τ₁·frequencies on a torus, (g,) balls each.

    - integrands: at phases (N, g), (K, N): d(time)/dτ₁ of the motion, and what its path integrates
    """

    spectrum: Spectrum
    torus: TorusInBalls
    integrands: Callable[[Values], Values]

    @property
    def arithmetic(self) -> Balls:
        """Return the arithmetic of all its numbers."""
        return self.torus.arithmetic

    @property
    def start(self) -> Values:
        """Return z⁰."""
        return np.asarray(self.torus.numbers.z)

    @property
    def frequencies(self) -> Values:
        """Return f."""
        return np.asarray(self.torus.numbers.frequencies)

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

        Along an orbit q'' = −A⁻¹q + βq with β = 2(A⁻¹q,q) − E and E = (q',q') + (A⁻¹q,q) constant
        (Theorem LR→Nn), I_1 ≤ A⁻¹ ≤ 1 in units of the largest I. At complex times a distance y from
        a real one let |q − q(real)| ≤ d. There

            |q''| ≤ (κ + 4d + 2d²)(1 + d),   κ = max |β − I_i| over real times,
            so   d ≤ |q'|y + ½ max|q''| y²,
            |(q,Aq)/(q,Aq)_real − 1| ≤ 2ad + a²d²,   a² = A_1/min (q,Aq),

        which is below one while ad < √2−1. As long as it is, dt/dτ₁ = √((q,Aq)/W) is analytic and
        at most √2 times its real maximum. Along a geodesic ds/dτ₁ = 1/(√J (q,Aq)). While ad ≤
        √(3/2)−1 that ratio is at least 1/2 in absolute value, so ds/dτ₁ is analytic and at most
        twice its real maximum.
        """
        inverse, known = self.spectrum.inverse, self.torus.numbers
        points, time = known.points, known.time[0]
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
        neumann = self.torus.inversion.periods.frequencies
        slower = max(abs(float(f)) for f in neumann) / self.fastest
        return width * slower, _ABOVE_REAL[time] * known.scale[0]
