"""The motion in doubles beside one in balls: its cycles and its costs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.torus import riemann_matrix
from veselova.analytic.closed.torus_motion import TorusMotion
from veselova.analytic.curve.abel_jacobi import NARROW_GAP
from veselova.analytic.kernel.rule import MOST_CYCLES
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.tunings import THETA_GENUS

__all__ = ["InDoubles"]

Array = NDArray[np.float64]

#: Calibrated: above genus 4 a gap goes to theta quotients below this, up to there below NARROW_GAP;
#: and the largest genus at which theta sums are taken there.
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


@dataclass(frozen=True)
class InDoubles:
    """A motion in doubles, of any ratio of A's. Raises Unsolved as ``kernel_motion``."""

    problem: TorusProblem

    @cached_property
    def _motion(self) -> TorusMotion:
        return TorusMotion(self.problem, proven=False)

    @property
    def kernel(self) -> KernelMotion:
        """Return the motion by the kernel."""
        return self._motion.kernel

    def tau1(self, times: Array) -> Array:
        """Return approximate τ₁ at increasing times; beyond what doubles hold, that of the mean
        rate.
        """
        if self.cycles(times) > MOST_CYCLES and self.problem.time != "tau1":
            return np.asarray(times / self.kernel.torus.mean)
        return self._motion.states(times, np.zeros(times.size))[0].tau1

    def cycles(self, times: Array) -> float:
        """Return the most cycles that any phase makes between t = 0 and the times."""
        return float(self.kernel.fastest) * float(np.max(np.abs(times)))

    @cached_property
    def narrowest_gap(self) -> float:
        """Return the least gap that can close against the wider of its two cuts, 1 without any; the
        first one is that between c_1 = 0 and the least I, but for Neumann's system.
        """
        widths: list[float] = np.diagonal(self.kernel.torus.d, 1).tolist()
        first = 2 if self.problem.time != "tau1" else 0
        sides = [(widths[j - 1] if j else 0.0, widths[j + 1]) for j in range(first, len(widths), 2)]
        gaps = zip(widths[first::2], sides, strict=True)
        ratios: list[float] = [gap / (gap + max(near)) for gap, near in gaps]
        return min(ratios, default=1.0)

    @property
    def near_separatrix(self) -> bool:
        """Return whether a gap is so narrow that theta functions serve where angles say little."""
        genus = self.kernel.genus
        narrow = NARROW_GAP if genus <= _HIGH_GENUS else _NARROW_GAP_HIGH_GENUS
        near = self.kernel.on_separatrix or self.narrowest_gap < narrow
        return near and genus <= _SEPARATRIX_GENUS

    @property
    def takes_theta(self) -> bool:
        """Return whether theta quotients are the cheaper route: near a separatrix, and where
        neither narrow cuts nor wide A's give phases very different weights.
        """
        even = float(self.kernel.torus.cancellation[0]) < _LARGE_CANCELLATION
        even = even and float(np.max(np.abs(self._T))) < _LARGE_PERIOD
        return self.near_separatrix or (self.kernel.genus <= THETA_GENUS and even)

    @cached_property
    def _T(self) -> Array:
        return riemann_matrix(self.kernel)[0]

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
        return float(known * (digits / DOUBLE.digits) ** genus)
