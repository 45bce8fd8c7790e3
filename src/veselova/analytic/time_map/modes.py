"""The linear flow on the torus, and the time map t = F_0τ₁ + S(z) − S(z⁰) of a rate by known modes,
which may come from its values on a grid; Newton's method is the kernel's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.kernel import modes as kernel_modes
from veselova.analytic.kernel.arithmetic import turns
from veselova.analytic.kernel.coefficients import PLACE
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["LinearFlow", "SampledTimeMap", "SumsOverModes"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_EPSILON = float(np.finfo(float).eps)

#: The kernel's text, for arrays.
_turns: Callable[..., Array] = getattr(turns, "py_func", turns)


@dataclass(frozen=True)
class LinearFlow:
    """z(x) = start + x·rates, x a time, (g,) each.

    Phases are taken modulo 2: the attitude has period 2 in z, everything else period 1.
    """

    start: Array
    rates: Array

    def phases(self, x: Array) -> Array:
        """Return z(x), (N, g), to one rounding of the reduced value."""
        return np.asarray(self.start + _turns(self.rates, 0.0, x[:, None]))


#: Budget: times between two checkpoints.
_TIMES_AT_ONCE = 1000


class SumsOverModes:
    """S(z) = Σ F_m/(π m·f) sin 2πm·z in doubles, from modes (M, g), one of each m and −m, and F_m
    (M,).

    - reach: the most that δ = τ₁ − t/F_0 may be
    """

    def __init__(
        self, modes: Integers, coefficients: Array, mean: float, in_tau1: LinearFlow
    ) -> None:
        rows, which = np.unique(modes[:, :-1], axis=0, return_inverse=True)
        which, last, none = which.ravel(), modes[:, -1], np.zeros(len(rows), np.int64)
        first, highest = none.copy(), none.copy()
        np.minimum.at(first, which, last)
        np.maximum.at(highest, which, last)
        counts = highest + 1 - first
        spans = np.stack([np.cumsum(counts) - counts, counts, first], axis=1)
        slopes, g = np.zeros(int(np.sum(counts))), in_tau1.rates.size
        slopes[spans[which][:, PLACE] + last - first[which]] = 2 * coefficients
        zeros = np.zeros(g, np.int64), np.zeros(1), np.zeros(g), np.zeros(g)
        given = np.ascontiguousarray(rows), spans, slopes, *zeros
        self._mean, self._rates = mean, np.array(in_tau1.rates)
        start = np.array(in_tau1.start)
        self._modes = kernel_modes.modes_of(given, self._rates, start, mean, mean)
        self.reach = 2 * float(np.sum(np.abs(self._modes.amplitudes))) / mean
        self._modes.reach[0] = self.reach / 2  # near a resonance too

    def offsets(self, uniform: Array) -> Array:
        """Return δ (N,) at the phases z⁰ + Ωt (N, g): F_0 δ + S(z⁰ + Ωt + fδ) = S(z⁰). Raises
        Unsolved (``too-far``).
        """
        odd, z = kernel_modes.no_modes(self._rates.size), np.empty(self._rates.size)
        known, found = (self._rates, self._mean, self._modes, odd), np.empty(len(uniform))
        for i, at in enumerate(np.ascontiguousarray(uniform)):
            if i % _TIMES_AT_ONCE == 0:
                checkpoint()
            guess = 0.0, 0.0, 1.0
            for which in (kernel_modes.LARGE, kernel_modes.ALL):
                delta, bend, last = kernel_modes.refine(*known, which, at, guess, z)
                guess = delta, bend, min(last, 1.0)
            if not last < math.inf:
                raise Unsolved("too-far", "a mode of the time map is nearly resonant")
            found[i] = delta
        return found


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
    - in_time: z⁰ and f/F_0
    """

    mean: float
    modes: NDArray[np.int64]
    coefficients: Array
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
        sums = SumsOverModes(modes, coefficients, mean, in_tau1)
        if not 0 <= sums.reach / 2 * float(np.max(np.abs(in_tau1.rates))) <= _FARTHEST:
            raise Unsolved("too-far", "a mode of the time map is nearly resonant")
        return cls(mean, modes, coefficients, LinearFlow(in_tau1.start, in_tau1.rates / mean), sums)

    def tau1(self, times: Array) -> Array:
        """Return τ₁ at times, (N,)."""
        return np.asarray(times / self.mean + self._sums.offsets(self.in_time.phases(times)))

    def off(self, tau1: Array) -> Array:
        """Return the error of δ = τ₁ − t/F_0 at τ₁ (N,) by the rounding of modes: one of F_m makes
        min(1/|πm·f|, 2|τ₁|) of it.
        """
        lengths, squares = self._lengths
        moved = np.minimum(2 * np.abs(tau1), np.max(lengths, initial=0.0))
        whole = np.searchsorted(lengths, moved, side="right")
        square = squares[whole] + moved**2 * (lengths.size - whole)
        return np.asarray(_SMALLEST * np.sqrt(square) + _EPSILON * self._sums.reach / 2)

    @cached_property
    def _lengths(self) -> tuple[Array, Array]:
        """Return 1/|πm·f| of all modes, increasing, and the sums of the squares before each."""
        lengths = np.sort(1 / np.abs(np.pi * self.mean * (self.modes @ self.in_time.rates)))
        return lengths, np.append(0.0, np.cumsum(lengths**2))


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
