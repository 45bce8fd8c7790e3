"""The Fourier time map in balls, for any time at all: the determinants of analytic.time_map.fourier
to any number of digits.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.balls import SumsOverPoints, sums_over_modes
from veselova.analytic.arithmetic.monotone_root import doublings, interval_step
from veselova.analytic.digits.orbit import Orbit
from veselova.analytic.time_map.modes import (
    ColumnsForModes,
    Integers,
    SumsOverModes,
    find_significant_modes,
)

__all__ = ["MOST_MODES", "FourierTimeMapInBalls"]

#: Budget: modes looked at before giving up: minutes.
MOST_MODES = 200_000

#: Calibrated: what the modes left out add up to, in units of the smallest kept for 1/(m·f) or for
#: the time elapsed, those kept and those next to them: others fall off as fast as they came.
_TAIL = 4


class FourierTimeMapInBalls:
    """τ₁ at given times on one orbit, in balls, at a cost that does not grow with time. What is
    left out is estimated.

    Modes (M, g) with |F_m| above the precision are kept. ``expected``: about how many there are.
    """

    name = "fourier"

    def __init__(self, orbit: Orbit, expected: float = 0.0) -> None:
        self._orbit, self._xp = orbit, orbit.arithmetic
        self._mean = orbit.rate.mean
        self._smallest = self._mean * self._xp.epsilon
        self._modes, coefficients, edge = self._select_modes(expected)
        rates = self._modes @ orbit.frequencies
        self._amplitudes = coefficients / (self._xp.pi * rates)
        self._slopes = 2 * coefficients
        self._bend = np.sum(self._xp.upper_bound(2 * self._xp.pi * rates * self._slopes))
        #: 1/|m·f| of those kept and of those next to them.
        every = np.concatenate([self._modes, edge]) @ orbit.frequencies
        self._slowness = np.abs(1 / every).astype(float)
        self._in_doubles = SumsOverModes(
            self._modes,
            coefficients.astype(float),
            self._amplitudes.astype(float),
            float(self._mean),
            orbit.start.astype(float),
            orbit.frequencies.astype(float),
        )

    @property
    def size(self) -> int:
        """Return the number of modes kept, m and −m counted once."""
        return len(self._modes)

    def _select_modes(self, expected: float) -> tuple[Integers, Values, Integers]:
        """Return the modes m with |F_m| above the precision, F_m, and the modes next to them."""
        xp, rate = self._xp, self._orbit.rate

        def made(weights: Values, G: Values, largest: int) -> SumsOverPoints:
            return SumsOverPoints(xp.turns(G), weights, largest, xp)

        columns = ColumnsForModes(rate, made)

        def determinants(modes: Integers) -> tuple[Values, NDArray[np.bool_]]:
            stacks = [column.cosines(modes) for column in columns(modes)]
            rows = zip(*stacks, strict=True)
            found = [rate.scale * xp.determinant(np.stack(row, axis=1)) for row in rows]
            large = np.array([bool(abs(value.mid()) > self._smallest) for value in found])
            return np.array(found, dtype=object), large

        # those at the edge are looked at too
        genus = rate.inversion.periods.genus
        return find_significant_modes(genus, determinants, 2 * MOST_MODES, expected)

    def tau1(self, times: Values, _approximate: NDArray[np.float64]) -> Values:
        """Return τ₁ = t/F_0 + δ at times (N,) given exactly: Newton's method for F_0 δ + P(z⁰ +
        (t/F_0 + δ)f) − P(z⁰) = 0.
        """
        xp = self._xp
        uniform = times / self._mean
        z = self._orbit.phases(uniform)
        delta = xp.array(self._in_doubles.offsets(z.astype(float)))
        for _ in doublings(xp.digits):
            value, slope = self._excess(z, delta)
            delta = xp.midpoints(delta - value / slope)
        value, slope = self._excess(z, delta)
        tau1 = uniform + delta
        tail = self._tail(float(np.max(np.abs(tau1.astype(float)))))
        return np.asarray(tau1 - interval_step(xp.add_error(value, tail), slope, self._bend, xp)[0])

    def _tail(self, elapsed: float) -> Any:
        """Return what the modes left out add up to in t after so much Neumann time: what a mode
        does to t grows until a half of its period, 1/(2 m·f).
        """
        lengths = np.minimum(self._slowness, math.pi * elapsed)
        return _TAIL * self._smallest * float(np.linalg.norm(lengths))

    def _excess(self, z: Values, delta: Values) -> tuple[Values, Values]:
        """Return F_0 δ + P(z + δf) − P(z⁰) and its slope."""
        orbit, xp = self._orbit, self._xp
        ends = np.concatenate([orbit.start[None, :], z + delta[:, None] * orbit.frequencies])
        turns = xp.turns(ends)
        first, *sines = sums_over_modes("sines", self._modes, self._amplitudes, turns, xp)
        cosines = sums_over_modes("cosines", self._modes, self._slopes, turns[1:], xp)
        return self._mean * delta + np.array(sines) - first, self._mean + cosines
