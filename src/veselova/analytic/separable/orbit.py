"""One orbit of a separable motion: its time map, phases, and what rounding of them does
to positions.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.closed.base import (
    BETWEEN,
    MOST_LOCAL,
    Attitude,
    combine_bounds,
    sensitivity,
)
from veselova.analytic.separable.inversion import SeparableMotion, SeparatedRate
from veselova.analytic.time_map.fourier import FourierTimeMap
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.panels import ChebyshevTimeMap
from veselova.mechanics.core.errors import Unsolved
from veselova.tunings import SEPARABLE_FOURIER_CYCLES, SEPARABLE_FOURIER_GENUS

__all__ = ["PHASES_LOST", "SAFETY", "SeparableOrbit"]

Array = NDArray[np.float64]

#: Budget: cycles that panels cover.
_MOST_CYCLES = 5e4

#: Calibrated: what bounds made of samples and of typical rounding may miss: with it the true error
#: is at most the reported one. Largest true error over an error without it, in all draws of
#: ``benchmarks/adversarial.py``: 1.05, next to a separatrix.
SAFETY = 2.0

#: Why an error leaves no digit.
PHASES_LOST = "phases in double precision are not known better"

#: Calibrated: rounding in ε: of one evaluation; of a phase; of frequencies and the time map,
#: relative.
_EVALUATION = 16.0
_PHASE = 8.0
_RATE = 4.0

#: Budget: points at which slopes are sampled.
_SAMPLES = 48

#: Derived: step of the difference quotients of attitudes: truncation and rounding both near 1e-8.
_DIFFERENCE = 1e-8


class SeparableOrbit:
    """The orbit of a motion on its torus."""

    def __init__(self, motion: SeparableMotion) -> None:
        self.motion = motion
        self._degree = self.motion.start.degree
        self.rate = SeparatedRate(self.motion.inversion)
        self.inversion = self.motion.inversion
        origin = self.inversion.map(self.motion.angles[None, :])[0]
        self.in_tau = LinearFlow(origin, self.motion.periods.frequencies)

    @cached_property
    def in_time(self) -> LinearFlow:
        """Return the uniform part of the phases in physical time."""
        return LinearFlow(self.in_tau.start, self.motion.periods.frequencies / self.rate.mean)

    def time_map(self, grid: Array) -> FourierTimeMap | ChebyshevTimeMap:
        """Return a time map for the given times, by cost; raises Unsolved (``too-far``) where it
        takes too many panels.
        """
        if (
            self._cycles(grid) > SEPARABLE_FOURIER_CYCLES
            and self.motion.periods.genus <= SEPARABLE_FOURIER_GENUS
        ):
            with suppress(Unsolved):
                return FourierTimeMap(self.rate, self.in_tau, self.in_time)
        self.require_panels(grid)
        return ChebyshevTimeMap(
            lambda z: self.rate.at(self.inversion.invert(z)),
            self.rate.mean,
            self.in_tau,
            grid[0],
            grid[-1],
        )

    def require_panels(self, grid: Array) -> None:
        """Raise Unsolved (``too-far``) where times are farther off than panels along the orbit are
        made.
        """
        cycles = self._cycles(grid)
        if not cycles <= _MOST_CYCLES:
            raise Unsolved(
                "too-far",
                f"{cycles:.3g} cycles of the fastest phase; panels along the orbit go to "
                f"{_MOST_CYCLES:.0e}",
            )

    def _cycles(self, grid: Array) -> float:
        return float(np.max(np.abs(self.in_time.rates)) * np.max(np.abs(grid)))

    def states(self, z: Array) -> tuple[Attitude, Array, Array]:
        """Return positions and coordinate lines at phases (N, g), q̇ = q'/(dt/dτ), (N, n), and
        dt/dτ, (N,).
        """
        phi = self.inversion.invert(z)
        at = self.motion.attitude(phi)
        rate = self.rate.at(phi)
        return at, np.sum(at.normals * at.components[:, None, :], axis=2) / rate[:, None], rate

    def details(self, time_map: FourierTimeMap | ChebyshevTimeMap) -> dict[str, Any]:
        """Return what a trajectory's provenance says of the orbit."""
        return {"time_map": time_map.name, "time_map_size": time_map.size, "degree": self._degree}

    @cached_property
    def sample(self) -> Array:
        """Return the points of the torus at which slopes are sampled, phases modulo 2."""
        genus = self.motion.periods.genus
        return np.random.default_rng(3).uniform(0.0, 2.0, (_SAMPLES, genus))

    def sensitivity(self, values: Callable[[Attitude], Array]) -> Array:
        """Return how fast numbers (N, …) of the attitudes change with the phases, and more between
        the sampled points, (4,) of ``sensitivity``.
        """
        return np.asarray(np.max(self._sensitivity_at(self.sample, values), axis=1))

    def sensitivities(
        self,
        sampled: Array,
        z: Array,
        values: Callable[[Attitude], Array],
        turning: Array | None = None,
    ) -> tuple[Array, Array | None]:
        """Return the largest of the sampled ones and of those at some of the phases z (N, g), half
        of them where ``turning`` (N,) is largest; and those at each, None where they are many.
        """
        if len(z) <= MOST_LOCAL:
            local = self._sensitivity_at(z, values)
            return np.maximum(sampled, np.max(local, axis=1)), local
        rows = np.linspace(0, len(z) - 1, MOST_LOCAL).astype(int)
        if turning is not None:
            steepest = np.argpartition(turning, -MOST_LOCAL // 2)[-MOST_LOCAL // 2 :]
            rows = np.concatenate([rows[::2], steepest])
        return np.maximum(sampled, np.max(self._sensitivity_at(z[rows], values), axis=1)), None

    def _sensitivity_at(self, z: Array, values: Callable[[Attitude], Array]) -> Array:
        steps = _DIFFERENCE * np.eye(z.shape[1])
        ends = np.concatenate([z, *(z + step for step in steps)])
        found = values(self.motion.attitude(self.inversion.invert(ends)))
        found = found.reshape(1 + len(steps), len(z), -1)
        slopes = BETWEEN / _DIFFERENCE * np.moveaxis(found[1:] - found[0], 0, 2)
        return sensitivity(slopes, self.in_tau.rates, np.diag(self.start_rounding))

    @cached_property
    def start_rounding(self) -> Array:
        """Return the rounding of the phases at the start, (g,)."""
        return np.asarray(_PHASE * DOUBLE.epsilon + self.motion.periods.series_truncation)

    @property
    def rate_rounding(self) -> Array:
        """Return the rounding of the frequencies, (g,)."""
        return np.asarray(_RATE * DOUBLE.epsilon * np.abs(self.in_tau.rates))

    def lag(
        self, times: Array, tau: Array, rate: Array, time_map: FourierTimeMap | ChebyshevTimeMap
    ) -> Array:
        """Return the error of τ at each time, (N,), from dt/dτ there: that of t over the rate."""
        of_map, drift = time_map.error(tau, self.start_rounding, self.rate_rounding)
        by_mean = (_RATE * DOUBLE.epsilon + drift) * np.abs(times / self.rate.mean) + of_map
        return np.asarray(by_mean * np.maximum(1.0, self.rate.mean / rate))

    def error(self, tau: Array, lag: Array, largest: Array, local: Array | None) -> Array:
        """Return a bound on the error of numbers of those sensitivities, (N,)."""

        def by(found: Array) -> Array:
            along_flow, _, by_rates, by_start = found
            moved = _RATE * DOUBLE.epsilon * np.abs(tau) * by_rates
            at_once = _EVALUATION * DOUBLE.epsilon + by_start
            return np.asarray(at_once + moved + lag * along_flow)

        return by(largest) if local is None else combine_bounds(by(largest), by(local))
