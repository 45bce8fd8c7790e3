"""The time map in closed form: every Fourier coefficient of dt/dτ₁ is a determinant of one-variable
integrals.

    t = F_0τ₁ + Σ_{m≠0} F_m (e^{2πi m·z} − e^{2πi m·z⁰})/(2πi m·f)

Any t costs the same; the number of modes grows with the genus (n = 3: hundreds, n = 4: thousands, n
= 5: ten thousands).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.trigonometric_sums import waves_at
from veselova.analytic.numerics.monotone_root import Rows, increasing_root
from veselova.analytic.time_map.fourier_modes import Integers, find_significant_modes
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.rate import TimeMap, TorusFunction, TorusRate
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["ColumnsForModes", "FourierTimeMap", "find_modes"]

Array = NDArray[np.float64]

T = TypeVar("T")

#: Derived: modes below this part of F_0 are left out: there the determinants are rounding.
_SMALLEST_MODE = 4e-16

#: Calibrated: rounding of a column of a determinant, for a unit of its weights and of its angles,
#: that is hardly ever exceeded.
_COLUMN_ROUNDING = 4 * float(np.finfo(float).eps)

#: Method: radians by one of ψ beyond those that modes ask for, at least: room for the next layers.
_SPARE_PACE = 16

#: Budget: entries of one block of (times × modes): temporaries that stay in the cache.
_BLOCK = 32_000

#: Derived: a step of Newton's method, in cycles, that leaves an error of its square.
_CONVERGED = 1e-9

#: Method: cycles of the fastest phase by which a mode of several phases may move τ₁ for one of a
#: phase at the start: beyond, panels serve.
_SLOW = 1e8


class FourierTimeMap(TimeMap):
    """t(τ₁) by the Fourier determinants. The uniform parts z⁰ + Ωt and t/F_0 are exact, δ = τ₁ −
    t/F_0 stays bounded. Raises Unsolved (``too-far``) where a mode nearly stands.
    """

    name: ClassVar[str] = "fourier"

    def __init__(self, rate: TorusRate[Any], in_tau1: LinearFlow, in_time: LinearFlow) -> None:
        self._modes, coefficients, edge, self._off = find_modes(rate)
        self._mean = float(rate.mean)
        self._in_tau1, self._in_time = in_tau1, in_time
        fastest = float(np.max(np.abs(in_tau1.rates)))
        every = np.pi * np.abs(np.concatenate([self._modes, edge]) @ in_tau1.rates)
        #: How far modes move τ₁ with each of these phases at the start, in a unit of time.
        pull = 4 * np.pi / self._mean * np.abs(coefficients[:, None] * self._modes)
        together = np.count_nonzero(self._modes, axis=1) > 1
        slow = pull.max(axis=1, initial=0.0) * fastest > _SLOW * every[: len(pull)]
        if np.any(slow & together):
            raise Unsolved("too-far", "a mode of the time map nearly stands")
        #: For how long a mode acts in one sense, 1/(π m·f), of those kept and those next to them.
        self._longest = 1 / np.maximum(every, np.finfo(float).tiny)
        self._pull, self._cycle = pull, 1 / fastest
        # The mode and its negative together: F_m(e^{2πi m·z} − …)/(2πi m·f) + c.c. = F_m/(π m·f)
        # (sin 2πm·z − sin 2πm·z⁰).
        self._slopes = 2 * coefficients
        self._amplitudes = coefficients / (np.pi * (self._modes @ in_tau1.rates))
        self._highest = int(np.max(np.abs(self._modes), initial=0))
        self._at_start = self._sums(in_tau1.start[None])[0]
        self._reach = 2 * float(np.sum(np.abs(self._amplitudes))) / self._mean

    @property
    def size(self) -> int:
        """Return the number of modes kept, m and −m counted once."""
        return len(self._modes)

    @property
    def mean(self) -> float:
        """Return F_0."""
        return self._mean

    def error(self, tau1: Array, of_start: Array, of_rates: Array) -> tuple[float, float]:
        """Return the error of the modes until the farthest of Neumann times, and what is to be
        multiplied with |τ₁|: each mode is off by about the smallest kept, for 1/(π m·f) or for the
        time elapsed.

        So are those next to them that are left out, and others are smaller. An error of phase k
        moves τ₁ by 2F_m 2πm_k/F_0 of it for as long. Errors of different modes add in squares. To
        these comes one rounding of δ.
        """
        elapsed = float(np.max(np.abs(tau1)))
        lengths = np.minimum(self._longest, elapsed)
        sway = np.sqrt((self._pull**2).T @ lengths[: self.size] ** 2)
        of_modes = self._off * (float(np.linalg.norm(lengths)) + self._cycle)
        rounding = float(np.finfo(float).eps) * min(self._reach, elapsed)
        return of_modes + rounding + float(of_start @ sway), float(of_rates @ sway)

    def time(self, tau1: Array) -> Array:
        """Return t = F_0τ₁ + Σ F_m/(π m·f) (sin 2πm·z − sin 2πm·z⁰)."""
        sums = self._sums(self._in_tau1.phases(tau1))
        return np.asarray(self._mean * tau1 + sums[0] - self._at_start)

    def tau1(self, times: Array) -> tuple[Array, Array]:
        """Return (τ₁, z) by Newton's method for F_0 δ + S(z⁰ + Ωt + fδ) = S(z⁰); dt/dτ₁ > 0."""
        uniform = self._in_time.phases(times)
        rates = self._in_tau1.rates

        def excess(delta: Array, rows: Rows) -> tuple[Array, Array]:
            value, slope = self._sums(uniform[rows] + delta[:, None] * rates)
            return self._mean * delta + value - self._at_start, self._mean + slope

        reach = np.full(times.size, self._reach)
        converged = _CONVERGED * self._cycle
        delta = increasing_root(excess, np.zeros(times.size), -reach, reach, converged)
        return times / self._mean + delta, uniform + delta[:, None] * rates

    def _sums(self, z: Array) -> Array:
        """Return Σ F_m/(π m·f) sin 2πm·z and 2Σ F_m cos 2πm·z at phases (N, g), (2, N)."""
        result = np.empty((2, len(z)))
        block = max(1, _BLOCK // max(1, self.size))
        for first in range(0, len(z), block):
            checkpoint()
            rows = slice(first, first + block)
            cosines, sines = waves_at(2 * np.pi * z[rows], self._modes, self._highest)
            result[:, rows] = self._amplitudes @ sines, self._slopes @ cosines
        return result


def find_modes(rate: TorusRate[Any]) -> tuple[Integers, Array, Integers, float]:
    """Return the modes m (first nonzero entry positive) with |F_m| above a part of F_0 and above
    its rounding, F_m, the modes next to them, and by what part of F_0 each is off.

    Next to a separatrix there are directions in which one column stays, and a determinant is
    rounding without end.
    """

    def made(weights: Array, G: Array, _: int) -> tuple[Array, Array, float, Array]:
        angles = 2 * np.pi * G.T
        return (
            weights.T,
            angles,
            _COLUMN_ROUNDING * float(np.linalg.norm(weights)),
            np.abs(angles).max(axis=1),
        )

    columns = ColumnsForModes(rate, made)
    mean = float(rate.mean)

    def determinants(modes: Integers) -> tuple[Array, NDArray[np.bool_]]:
        sizes = np.abs(modes)
        found = columns(modes)
        matrices = np.stack(
            [np.cos(modes @ angles) @ weights for weights, angles, _, _ in found], axis=2
        )
        lengths = np.linalg.norm(matrices, axis=1)
        others = ~np.eye(len(found), dtype=bool)
        # An angle is off by a rounding for each entry of m, and so is its cosine.
        off = sum(
            one * (1 + sizes @ wide) * lengths[:, others[s]].prod(axis=1)
            for s, (_, _, one, wide) in enumerate(found)
        )
        values = float(rate.scale) / mean * np.stack([np.linalg.det(matrices), off])
        return values.T, np.abs(values[0]) > np.maximum(_SMALLEST_MODE, values[1])

    modes, values, edge = find_significant_modes(rate.inversion.periods.genus, determinants)
    return (
        modes,
        mean * values[:, 0],
        edge,
        max(4 * _SMALLEST_MODE, float(np.max(values[:, 1], initial=0.0)) / 2),
    )


class ColumnsForModes(Generic[T]):
    """What is made of ``Rate.columns`` at nodes enough for the e^{−2πi m·G_s} of any modes; kept
    for modes that ask for no more.

    ``made``: what is made of weights, G_s and the most radians that modes, and their entries, may
    turn by one of ψ
    """

    def __init__(self, rate: TorusFunction[Any], made: Callable[[Values, Values, int], T]) -> None:
        self._rate = rate
        self._made = made
        self._form(0.0)

    def _form(self, pace: float) -> None:
        # A wave of k radians a radian takes k nodes more of half a period than the forms. It is
        # analytic in their strip, where it is e^{πky/2} at most at height y (e^{ky}, but that G
        # bends at the edge), and k nodes leave e^{−2ky} of it.
        self._most = math.ceil(pace + max(_SPARE_PACE, pace / 2))
        count = max(self._rate.needed_nodes) + self._most
        columns = self._rate.columns(count)
        self._columns = [self._made(*column, self._most) for column in columns]
        #: Radians of 2πm·G_s by one of ψ for each entry of m, between nodes; entries count as well.
        self._paces = [
            np.eye(len(columns)),
            *(2 * count * np.diff(G.astype(np.float64), axis=0).T for _, G in columns),
        ]

    def __call__(self, modes: Integers) -> list[T]:
        """Return the columns for modes (M, g)."""
        pace = max(float(np.max(np.abs(modes @ paces))) for paces in self._paces)
        if pace > self._most:
            self._form(pace)
        return self._columns
