"""The Fourier time map in balls, for any time at all: the determinants of analytic.time_map.fourier
to any number of digits.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Values
from veselova.analytic.arithmetic.trigonometric_sums import waves_at
from veselova.analytic.numerics.fourier_sums import SumsOverPoints, sums_over_modes
from veselova.analytic.numerics.monotone_root import Rows, doublings, increasing_root, interval_step
from veselova.analytic.time_map.analyticity_strip import Orbit
from veselova.analytic.time_map.fourier import ColumnsForModes
from veselova.analytic.time_map.fourier_modes import find_significant_modes

__all__ = ["MOST_MODES", "FourierTimeMapInBalls"]

#: Budget: modes looked at before giving up: minutes.
MOST_MODES = 200_000

#: Derived: a step of Newton's method in double precision, in cycles, that leaves the rounding of a
#: double; and waves in memory at once.
_CONVERGED = 1e-7
_BLOCK = 2_000_000

#: Derived: digits of modes, and of slopes, beyond those of a step.
_MODE_DIGITS = 2
_SLOPE_DIGITS = 2

#: Calibrated: what the modes left out add up to, in units of the smallest kept for 1/(m·f) or for
#: the time elapsed, those kept and those next to them: others fall off as fast as they came.
_TAIL = 4


class FourierTimeMapInBalls:
    """τ₁ at given times on one orbit, in balls, at a cost that does not grow with time. What is
    left out is estimated.

    Modes (M, g) with |F_m| above the precision are kept, with their ``coefficients`` (M,).
    ``expected``: about how many modes there are.
    """

    name = "fourier"

    def __init__(self, orbit: Orbit, *, expected: float = 0.0) -> None:
        self._orbit = orbit
        self._expected = expected
        xp: Any = orbit.rate.inversion.arithmetic
        self._xp = xp
        self._mean = orbit.rate.mean
        self._smallest = self._mean * xp.epsilon
        self._columns: ColumnsForModes[SumsOverPoints] = self._make_columns()
        self.modes, coefficients, edge = self._select_modes()
        self.coefficients = coefficients
        rates = self.modes @ orbit.frequencies
        self._amplitudes = coefficients / (xp.pi * rates)
        self._slopes = 2 * coefficients
        self._bend = np.sum(xp.upper_bound(2 * xp.pi * rates * self._slopes))
        fastest = 2 * xp.pi * np.max(np.abs(orbit.frequencies.astype(float)))
        #: What modes do to dt/dτ₁, or to t within a turn of the fastest phase, as a part of the
        #: mean.
        self._weights = (
            np.maximum(xp.upper_bound(self._slopes), xp.upper_bound(fastest * self._amplitudes))
            / self._mean
        )
        #: 1/|m·f| of those kept and of those next to them.
        self._slowness = np.abs(
            1 / (np.concatenate([self.modes, edge]) @ orbit.frequencies)
        ).astype(float)

    @property
    def size(self) -> int:
        """Return the number of modes kept, m and −m counted once."""
        return len(self.modes)

    def _select_modes(self) -> tuple[NDArray[np.int64], Values, NDArray[np.int64]]:
        """Return the modes m with |F_m| above the precision, F_m, and the modes next to them."""

        def determinants(modes: NDArray[np.int64]) -> tuple[Values, NDArray[np.bool_]]:
            values = self._find_coefficients(modes)
            return values, np.array([bool(abs(value.mid()) > self._smallest) for value in values])

        # those at the edge are looked at too
        genus = self._orbit.rate.inversion.periods.genus
        return find_significant_modes(genus, determinants, 2 * MOST_MODES, expected=self._expected)

    def _make_columns(self) -> ColumnsForModes[SumsOverPoints]:
        xp = self._xp
        return ColumnsForModes(
            self._orbit.rate,
            lambda weights, G, largest: SumsOverPoints(xp.turns(G), weights, largest, xp),
        )

    def _find_coefficients(self, modes: NDArray[np.int64]) -> Values:
        """Return F_m of modes (M, g)."""
        stacks = [column.cosines(modes) for column in self._columns(modes)]
        rows = zip(*stacks, strict=True)
        values = [self._xp.determinant(np.stack(row, axis=1)) for row in rows]
        return np.asarray(self._orbit.rate.scale * np.array(values, dtype=object))

    def tau1(self, times: Values, _approximate: NDArray[np.float64]) -> Values:
        """Return τ₁ = t/F_0 + δ at times (N,) given exactly: Newton's method for F_0 δ + P(z⁰ +
        (t/F_0 + δ)f) − P(z⁰) = 0.
        """
        xp = self._xp
        uniform = times / self._mean
        z = self._orbit.phases(uniform)
        delta = xp.array(self._near(z.astype(float)))
        for digits in doublings(xp.digits):
            with xp.at(digits):
                value, slope = self._excess(digits, z, delta)
                delta = xp.midpoints(delta - value / slope)
        value, slope = self._excess(xp.digits, z, delta)
        tau1 = uniform + delta
        tail = self.tail(float(np.max(np.abs(tau1.astype(float)))))
        return np.asarray(tau1 - interval_step(xp.add_error(value, tail), slope, self._bend, xp)[0])

    def tail(self, elapsed: float) -> Any:
        """Return what the modes left out add up to in t after so much Neumann time: what a mode
        does to t grows until a half of its period, 1/(2 m·f).
        """
        return (
            _TAIL
            * self._smallest
            * float(np.linalg.norm(np.minimum(self._slowness, math.pi * elapsed)))
        )

    def _excess(self, digits: int, z: Values, delta: Values) -> tuple[Values, Values]:
        """Return F_0 δ + P(z + δf) − P(z⁰) to so many digits, and its slope to half of them: a step
        asks for no more.
        """
        xp = self._xp
        half = math.ceil(digits / 2) + _SLOPE_DIGITS
        start = self._orbit.start[None, :]
        turns = xp.turns(np.concatenate([start, z + delta[:, None] * self._orbit.frequencies]))
        selected = self._select_by_digits(digits)
        exponentials = sums_over_modes(
            "sines", self.modes[selected], self._amplitudes[selected], turns, xp.at(digits)
        )
        value = self._mean * delta + exponentials[1:] - exponentials[0]
        selected = self._select_by_digits(half)
        with xp.at(half) as fewer:
            exponentials = sums_over_modes(
                "cosines", self.modes[selected], self._slopes[selected], turns[1:], fewer
            )
            return value, xp.add_error(
                self._mean + exponentials, np.sum(xp.upper_bound(self._slopes[~selected]))
            )

    def _select_by_digits(self, digits: int) -> NDArray[np.bool_]:
        """Return the modes that matter to so many digits."""
        return np.asarray(
            self._weights > self._xp.number(10) ** -(digits + _MODE_DIGITS), dtype=bool
        )

    def _near(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return δ in double precision, from the uniform phases (N, g)."""
        selected = self._select_by_digits(DOUBLE.digits)
        modes = self.modes[selected]
        amplitudes = self._amplitudes[selected].astype(float)
        slopes = self._slopes[selected].astype(float)
        frequencies = self._orbit.frequencies.astype(float)
        mean = float(self._mean)
        begin = np.sum(amplitudes * np.sin(2 * np.pi * (modes @ self._orbit.start.astype(float))))
        reach = 2 * float(np.sum(np.abs(amplitudes))) / mean
        converged = _CONVERGED / float(np.max(np.abs(frequencies)))
        highest = int(np.max(np.abs(modes), initial=0))
        block = max(1, _BLOCK // max(1, len(modes)))

        def root(z: NDArray[np.float64]) -> NDArray[np.float64]:
            def excess(
                delta: NDArray[np.float64], rows: Rows
            ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
                cosines, sines = waves_at(
                    2 * np.pi * (z[rows] + delta[:, None] * frequencies), modes, highest
                )
                return mean * delta + amplitudes @ sines - begin, mean + slopes @ cosines

            bounds = np.full(len(z), reach)
            return increasing_root(excess, np.zeros(len(z)), -bounds, bounds, converged)

        return np.concatenate([root(z[first : first + block]) for first in range(0, len(z), block)])
