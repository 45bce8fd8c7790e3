"""The time map in closed form: every Fourier coefficient of dt/dτ₁ is a determinant of one-variable
integrals.

    t = F_0τ₁ + Σ_{m≠0} F_m (e^{2πi m·z} − e^{2πi m·z⁰})/(2πi m·f)

Any t costs the same; the number of modes grows with the genus (n = 3: hundreds, n = 4: thousands, n
= 5: ten thousands).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.modes import (
    ColumnsForModes,
    Integers,
    SumsOverModes,
    find_significant_modes,
)
from veselova.analytic.time_map.rate import TorusRate
from veselova.mechanics.core.errors import Unsolved

__all__ = ["FourierTimeMap", "find_modes"]

Array = NDArray[np.float64]

#: Derived: modes below this part of F_0 are left out: there the determinants are rounding.
_SMALLEST_MODE = 4e-16

#: Calibrated: rounding of a column of a determinant, for a unit of its weights and of its angles,
#: that is hardly ever exceeded.
_COLUMN_ROUNDING = 4 * float(np.finfo(float).eps)

#: Method: cycles of the fastest phase by which a mode of several phases may move τ₁ for one of a
#: phase at the start: beyond, panels serve.
_SLOW = 1e8


class FourierTimeMap:
    """t(τ₁) by the Fourier determinants. The uniform parts z⁰ + Ωt and t/F_0 are exact, δ = τ₁ −
    t/F_0 stays bounded. Raises Unsolved (``too-far``) where a mode nearly stands.
    """

    name = "fourier"

    def __init__(self, rate: TorusRate[Any], in_tau1: LinearFlow, in_time: LinearFlow) -> None:
        modes, coefficients, edge, self._off = find_modes(rate)
        self._mean = float(rate.mean)
        self._rates, self._in_time = in_tau1.rates, in_time
        self.size = len(modes)
        fastest = float(np.max(np.abs(in_tau1.rates)))
        every = np.pi * np.abs(np.concatenate([modes, edge]) @ in_tau1.rates)
        #: How far modes move τ₁ with each of these phases at the start, in a unit of time.
        pull = 4 * np.pi / self._mean * np.abs(coefficients[:, None] * modes)
        together = np.count_nonzero(modes, axis=1) > 1
        slow = pull.max(axis=1, initial=0.0) * fastest > _SLOW * every[: len(pull)]
        if np.any(slow & together):
            raise Unsolved("too-far", "a mode of the time map is nearly resonant")
        #: For how long a mode acts in one sense, 1/(π m·f), of those kept and those next to them.
        self._longest = 1 / np.maximum(every, np.finfo(float).tiny)
        self._pull, self._cycle = pull, 1 / fastest
        amplitudes = coefficients / (np.pi * (modes @ in_tau1.rates))
        given = self._mean, in_tau1.start, in_tau1.rates
        self._sums = SumsOverModes(modes, coefficients, amplitudes, *given)

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
        rounding = float(np.finfo(float).eps) * min(self._sums.reach, elapsed)
        return of_modes + rounding + float(of_start @ sway), float(of_rates @ sway)

    def tau1(self, times: Array) -> tuple[Array, Array]:
        """Return (τ₁, z modulo 2) at physical times (N,)."""
        uniform = self._in_time.phases(times)
        delta = self._sums.offsets(uniform)
        return times / self._mean + delta, uniform + delta[:, None] * self._rates


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
