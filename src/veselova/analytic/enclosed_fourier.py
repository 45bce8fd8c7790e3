"""The Fourier clock in balls, for any time at all: the determinants of analytic.fourier_clock to any number of digits."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.fourier_clock import ColumnsForModes, grown
from veselova.analytic.increasing import Rows, increasing_root
from veselova.analytic.precision import Values
from veselova.analytic.strip import Orbit

__all__ = ["MOST_MODES", "EnclosedFourier", "expected_modes"]

#: Modes that a clock of 15 digits has, by genus; they grow with the genus-th power of the digits.
_MODES = {1: 12, 2: 200, 3: 1500, 4: 10_000}
_OF_DIGITS = 15

#: Modes looked at before giving up: minutes.
MOST_MODES = 200_000

#: Modes that bring the inverse clock near its answer in double precision, where Newton's method settles at this step (in cycles).
_FIRST_MODES = 4000
_SETTLED = 1e-7

#: Digits that Newton's method in balls starts from.
_FIRST_DIGITS = 10

#: What the modes left out add up to, in units of the smallest kept, each over 1/(π m·f), and what those next to them do: others
#: fall off as fast as they came.
_TAIL = 4


def expected_modes(genus: int, digits: int) -> float:
    """Return about how many modes a clock has; infinite where there would be too many."""
    return _MODES[genus] * (digits / _OF_DIGITS) ** genus if genus in _MODES else math.inf


class EnclosedFourier:
    """τ₁ at given times on one orbit, in balls, at a cost that does not grow with time. What is left out is estimated."""

    name = "fourier"

    def __init__(self, orbit: Orbit) -> None:
        self._orbit = orbit
        self._xp: Any = orbit.rate.inversion.arithmetic
        self._mean = orbit.rate.mean
        self._modes, coefficients, edge = self._significant()
        rates = self._modes @ orbit.frequencies
        self._amplitudes = coefficients / (self._xp.pi * rates)
        self._slopes = 2 * coefficients
        slowness = np.array(1 / (np.concatenate([self._modes, edge]) @ orbit.frequencies), dtype=float)
        self._tail = _TAIL * self._smallest * float(np.linalg.norm(slowness))

    @property
    def size(self) -> int:
        """Return the number of modes kept, m and −m counted once."""
        return len(self._modes)

    @cached_property
    def _smallest(self) -> Any:
        return self._mean * self._xp.epsilon

    def _significant(self) -> tuple[NDArray[np.int64], Values, NDArray[np.int64]]:
        """Return the modes m with |F_m| above the precision and F_m, the largest first, and the modes next to them."""
        rate, xp = self._orbit.rate, self._xp
        columns = ColumnsForModes(rate)

        def determinants(modes: NDArray[np.int64]) -> tuple[Values, NDArray[np.bool_]]:
            stacks = [xp.product(xp.cosines(modes, xp.turns(G)), weights.T) for weights, G in columns(modes)]
            values = np.array([xp.determinant(np.stack(rows, axis=1)) for rows in zip(*stacks, strict=True)], dtype=object)
            values = rate.scale * values
            return values, np.array([bool(abs(value.mid()) > self._smallest) for value in values])

        modes, values, edge = grown(rate.inversion.periods.genus, determinants, MOST_MODES)
        order = np.argsort([-abs(float(value)) for value in values], kind="stable")
        return modes[order], values[order], edge

    def _periodic(self, z: Values) -> tuple[Values, Values]:
        """Return Σ F_m/(π m·f) (sin 2πm·z − sin 2πm·z⁰) and its derivative in τ₁ at z (N, g)."""
        if not self.size:  # a circle: the rate is constant
            zero = self._xp.array(np.zeros(len(z)))
            return zero, zero
        cosines, sines = self._xp.waves(self._modes, self._xp.turns(np.concatenate([z, self._orbit.start[None, :]])))
        columns = np.stack([self._amplitudes, self._slopes], axis=1)
        values, slopes = self._xp.product(sines.T, columns), self._xp.product(cosines.T, columns)
        return values[:-1, 0] - values[-1, 0], slopes[:-1, 1]

    def tau1(self, times: Values, _approximate: NDArray[np.float64]) -> Values:
        """Return τ₁ = t/F_0 + δ at times (N,) given exactly."""
        xp: Any = self._xp
        uniform = times / self._mean
        z = self._orbit.phases(uniform)

        def excess(delta: Values) -> tuple[Values, Values]:
            value, slope = self._periodic(z + delta[:, None] * self._orbit.frequencies)
            return self._mean * delta + value, self._mean + slope

        delta = xp.array(self._near(z.astype(float)))
        for _ in range(math.ceil(math.log2(xp.digits / _FIRST_DIGITS))):
            value, slope = excess(delta)
            delta = xp.midpoints(delta - value / slope)
        value, slope = excess(delta)
        return np.asarray(uniform + delta + xp.around_zero((abs(value) + self._tail) / slope))

    def _near(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return δ in double precision, from the uniform phases."""
        modes = self._modes[:_FIRST_MODES].astype(float)
        amplitudes, slopes = self._amplitudes[:_FIRST_MODES].astype(float), self._slopes[:_FIRST_MODES].astype(float)
        frequencies, mean = self._orbit.frequencies.astype(float), float(self._mean)
        begin = np.sum(amplitudes * np.sin(2 * np.pi * (modes @ self._orbit.start.astype(float))))
        reach = np.full(len(z), 2 * float(np.sum(np.abs(amplitudes))) / mean)

        def excess(delta: NDArray[np.float64], rows: Rows) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            angles = 2 * np.pi * ((z[rows] + delta[:, None] * frequencies) @ modes.T)
            return mean * delta + np.sin(angles) @ amplitudes - begin, mean + np.cos(angles) @ slopes

        return increasing_root(excess, np.zeros(len(z)), -reach, reach, _SETTLED / float(np.max(np.abs(frequencies))))
