"""The time map of any function on a torus, dt/dτ₁ = F(z), from its values on a grid."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.modes import SumsOverModes
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["SampledTimeMap"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Method: points of the first grid in each phase. Budget: points of the last grid.
_FIRST, _MOST = 16, 1 << 21

#: Derived: modes below this part of F_0 are left out: there the transform is rounding.
_SMALLEST = 4e-16

#: Calibrated: the modes at the border of a grid, over F_0, from which it is refined.
_UNRESOLVED = 4e-15

#: Method: cycles of the fastest phase that modes may move τ₁ by: beyond, a resonance is too near.
_FARTHEST = 1e6


@dataclass(frozen=True)
class SampledTimeMap:
    """t = F_0τ₁ + Σ_{m≠0} F_m (e^{2πi m·z} − e^{2πi m·z⁰})/(2πi m·f) with any positive function F
    of period 1 in each phase, even in z.

    - mean: F_0; modes: (M, g) m, one of each m and −m; coefficients: (M,) F_m
    - off: the error of δ = τ₁ − t/F_0 by the rounding of modes
    - in_time: z⁰ and f/F_0
    """

    mean: float
    modes: NDArray[np.int64]
    coefficients: Array
    off: float
    in_time: LinearFlow
    _sums: SumsOverModes

    @classmethod
    def of(cls, values: Callable[[tuple[int, ...]], Array], in_tau1: LinearFlow) -> SampledTimeMap:
        """Return the map of a function from its values on grids z_k = j/N_k, by their shape.
        Raises Unsolved (``too-far``) where modes are too many, or near a resonance.
        """
        found = _coefficients(values, in_tau1.rates.size)
        mean = float(found.flat[0])
        modes = np.argwhere(np.abs(found) > _SMALLEST * mean)
        coefficients = found[tuple(modes.T)]
        shape = np.array(found.shape)
        modes = np.where(modes > shape // 2, modes - shape, modes)
        # one of each m and −m
        first = modes[np.arange(len(modes)), np.argmax(modes != 0, axis=1)]
        modes, coefficients = modes[first > 0], coefficients[first > 0]
        waves = np.pi * np.abs(modes @ in_tau1.rates)
        lengths = 1 / np.maximum(waves, np.finfo(float).tiny)
        amplitudes = coefficients / (np.pi * (modes @ in_tau1.rates) + (waves == 0))
        moved = float(np.abs(coefficients) @ lengths) / mean
        if not moved * float(np.max(np.abs(in_tau1.rates))) <= _FARTHEST:
            raise Unsolved("too-far", "a mode of the time map is nearly resonant")
        given = mean, in_tau1.start, in_tau1.rates
        off = _SMALLEST * float(np.linalg.norm(lengths)) + _EPSILON * moved
        in_time = LinearFlow(in_tau1.start, in_tau1.rates / mean)
        sums = SumsOverModes(modes, coefficients, amplitudes, *given)
        return cls(mean, modes, coefficients, off, in_time, sums)

    def tau1(self, times: Array) -> Array:
        """Return τ₁ at times, (N,)."""
        return np.asarray(times / self.mean + self._sums.offsets(self.in_time.phases(times)))


def _coefficients(values: Callable[[tuple[int, ...]], Array], genus: int) -> Array:
    """Return F_m on a grid fine enough for all that count."""
    shape = (_FIRST,) * genus
    while math.prod(shape) <= _MOST:
        checkpoint("time map")
        found = np.fft.fftn(values(shape)).real / math.prod(shape)
        borders = [np.abs(np.take(found, n // 2, axis=k)) for k, n in enumerate(shape)]
        open_ = [np.max(size) > _UNRESOLVED * found.flat[0] for size in borders]
        if not any(open_):
            return np.asarray(found)
        shape = tuple(n << grows for n, grows in zip(shape, open_, strict=True))
    raise Unsolved("too-far", f"the time map has more than {_MOST:.0e} Fourier modes")
