"""The clock in closed form: every Fourier coefficient of dt/dτ₁ is a determinant of one-variable integrals.

    t = F_0τ₁ + Σ_{m≠0} F_m (e^{2πi m·z} − e^{2πi m·z⁰})/(2πi m·f)

Any t costs the same; the number of modes grows with the genus (n = 3: hundreds, n = 4: thousands, n = 5: ten thousands).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.clock import Clock, Rate
from veselova.analytic.increasing import increasing_root
from veselova.analytic.orbit import LinearFlow
from veselova.analytic.precision import Values
from veselova.analytic.waves import waves_at
from veselova.mechanics.errors import Unsolved

__all__ = ["ColumnsForModes", "FourierClock", "grown"]

Array = NDArray[np.float64]

#: Modes below this fraction of F_0 are left out: there the determinants are rounding.
_SMALLEST_MODE = 4e-16

#: Modes looked at before giving up.
_MOST_MODES = 1_000_000

#: Nodes beyond those that modes ask for: room for the next layers.
_SPARE_NODES = 32

#: Modes that bring the inverse clock near its answer before all of them are summed.
_FIRST_MODES = 64

#: Smallest dt/dτ₁, as a part of its mean, that a step of the inverse clock divides by.
_LEAST_SLOPE = 0.05

#: Entries of one block of (times × modes): temporaries that stay in the cache.
_BLOCK = 50_000

#: A step of this many cycles leaves an error of its square.
_SETTLED = 1e-9


class FourierClock(Clock):
    """t(τ₁) by the Fourier determinants. The uniform parts z⁰ + Ωt and t/F_0 are exact, δ = τ₁ − t/F_0 stays bounded."""

    name: ClassVar[str] = "fourier"

    def __init__(self, rate: Rate[Any], in_tau1: LinearFlow, in_time: LinearFlow, mean: float) -> None:
        self._in_tau1, self._in_time, self._mean = in_tau1, in_time, mean
        modes, coefficients = _significant_modes(rate)
        order = np.argsort(-np.abs(coefficients))
        self._modes, coefficients = modes[order], coefficients[order]
        # The mode and its negative together: F_m(e^{2πi m·z} − …)/(2πi m·f) + c.c. = F_m/(π m·f) (sin 2πm·z − sin 2πm·z⁰).
        pace = 2 * np.pi * (self._modes @ in_tau1.rates)
        amplitudes = 2 * coefficients / pace
        # With h = πm·(z−z⁰) the sums are 2 cos(2πm·z⁰+h) sin h, cos(2πm·z⁰+2h) and −sin(2πm·z⁰+2h), of sin h cos h and sin²h.
        offset = 2 * np.pi * (self._modes @ in_tau1.start)
        cosine, sine = np.cos(offset), np.sin(offset)
        sizes = 2 * np.stack([amplitudes, 2 * coefficients, -2 * coefficients * pace], axis=1)
        self._weights = sizes * np.stack([cosine, -sine, cosine], axis=1), sizes * np.stack([sine, cosine, sine], axis=1)
        self._at_start = np.cumsum(np.vstack([np.zeros(2), self._weights[1][:, 1:]]), axis=0) / 2
        self._highest = int(np.max(np.abs(self._modes), initial=0))
        self._reach = 2 * float(np.sum(np.abs(amplitudes))) / mean
        self._longest, self._fastest = 2 / np.abs(pace), float(np.max(np.abs(in_tau1.rates)))

    @property
    def size(self) -> int:
        """Return the number of modes kept, m and −m counted once."""
        return int(self._modes.shape[0])

    @property
    def mean(self) -> float:
        """Return F_0."""
        return self._mean

    def ahead(self, means: Array) -> tuple[Array, Array]:
        """Return (t − u, z) at mean times u: the sum over all modes at z = z⁰ + Ωu."""
        advance = self._in_time.advance(means)
        return self._periodic(advance, self.size)[0], self._in_time.start + advance

    def error(self, tau1: Array) -> Array:
        """Return the error of the modes: each is off by about the smallest kept, for 1/(π m·f) or for the time elapsed.

        Modes left out are as small and hardly more numerous; independent errors add in squares.
        """
        farthest = float(max(abs(tau1[0]), abs(tau1[-1])))
        spread = np.sqrt(np.sum(np.minimum(self._longest, farthest) ** 2))
        return np.full(1, 4 * _SMALLEST_MODE * (spread + 1 / self._fastest))

    def time(self, tau1: Array) -> Array:
        """Return t = F_0τ₁ + Σ F_m/(π m·f) (sin 2πm·z − sin 2πm·z⁰)."""
        return self._mean * tau1 + self._periodic(self._in_tau1.advance(tau1), self.size)[0]

    def _periodic(self, advance: Array, size: int) -> tuple[Array, Array, Array]:
        """Return the sum over the first ``size`` modes at z = z⁰ + advance, and its first two derivatives in τ₁.

        The difference of sines is 2 cos(πm·(z+z⁰)) sin(πm·(z−z⁰)), so nothing cancels when m·f or the advance is small.
        """
        result = np.empty((advance.shape[0], 3))
        modes, block = self._modes[:size], max(1, _BLOCK // max(size, 1))
        of_products, of_squares = self._weights[0][:size], self._weights[1][:size]
        for first in range(0, advance.shape[0], block):
            rows = slice(first, first + block)
            half = waves_at(np.pi * advance[rows], modes, self._highest)
            result[rows] = (half.imag * half.real).T @ of_products - np.square(half.imag).T @ of_squares
        result[:, 1:] += self._at_start[size]
        return result[:, 0], result[:, 1], result[:, 2]

    def tau1(self, times: Array) -> tuple[Array, Array]:
        """Return (τ₁, z) by Halley's method for F_0 δ + periodic(z⁰ + Ωt + fδ) = 0; dt/dτ₁ > 0, and large modes come first."""
        uniform, delta = self._in_time.advance(times), np.zeros_like(times)
        reach, least = np.full_like(times, self._reach), _LEAST_SLOPE * self._mean

        def excess(delta: Array, size: int = self.size) -> tuple[Array, Array]:
            periodic, slope, curvature = self._periodic(uniform + delta[:, None] * self._in_tau1.rates, size)
            value, slope = self._mean * delta + periodic, self._mean + slope
            # A step of Halley's is one of Newton's with this in place of the slope.
            return value, slope - value * curvature / (2 * np.maximum(slope, least))

        if self.size > _FIRST_MODES:  # a truncated sum need not increase: one plain step towards it is all it is good for
            value, slope = excess(delta, _FIRST_MODES)
            delta = np.maximum(np.minimum(-value / np.maximum(slope, least), reach), -reach)
        delta = increasing_root(excess, delta, -reach, reach, _SETTLED / self._fastest)
        z = self._in_time.start + uniform + delta[:, None] * self._in_tau1.rates
        return times / self._mean + delta, z


def _significant_modes(rate: Rate[Any]) -> tuple[NDArray[np.int64], Array]:
    """Return the modes m (first nonzero entry positive) with |F_m| above rounding, and F_m."""
    columns, threshold = ColumnsForModes(rate), _SMALLEST_MODE * float(rate.mean)

    def determinants(modes: NDArray[np.int64]) -> tuple[Array, NDArray[np.bool_]]:
        matrices = np.stack([np.cos(2 * np.pi * (modes @ G.T)) @ weights.T for weights, G in columns(modes)], axis=2)
        values = float(rate.scale) * np.linalg.det(matrices)
        return values, np.abs(values) > threshold

    modes, values = grown(rate.inversion.periods.genus, determinants)
    return modes, values.astype(np.float64)


class ColumnsForModes:
    """``Rate.columns`` at nodes enough for the e^{−2πi m·G_s} of any modes; kept for modes that ask for no more."""

    def __init__(self, rate: Rate[Any]) -> None:
        self._rate = rate
        self._count, self._columns = 0, list[tuple[Values, Values]]()

    def __call__(self, modes: NDArray[np.int64]) -> list[tuple[Values, Values]]:
        """Return the columns for modes (M, g)."""
        needed = 2 * (max(self._rate.needed_nodes) + int(np.max(np.abs(modes))))
        if needed > self._count:
            self._count = needed + _SPARE_NODES
            self._columns = self._rate.columns(self._count)
        return self._columns


def grown(
    genus: int, coefficients: Callable[[NDArray[np.int64]], tuple[Any, NDArray[np.bool_]]], most: int = _MOST_MODES
) -> tuple[NDArray[np.int64], NDArray[Any]]:
    """Return the modes m ≠ 0 (first nonzero entry positive) whose coefficients count, and these.

    ``coefficients`` gives those of modes (M, g), and whether each is large enough. They fall off like the support function of a
    convex body, so the set is convex up to its edge: it is grown from zero through neighbours, in whichever directions it
    reaches far. Raises Unsolved where more than ``most`` have been looked at.
    """
    steps = np.concatenate([np.eye(genus, dtype=np.int64), -np.eye(genus, dtype=np.int64)])
    none, layer, looked_at = np.empty((0, genus), dtype=np.int64), np.zeros((1, genus), dtype=np.int64), 1
    before, refused, kept_modes, kept_values = none, none, [], []
    while layer.size:
        values, large = coefficients(layer)
        kept_modes.append(layer[large])
        kept_values.append(values[large])
        # Those that count have no neighbours that do but in their own layer, the one before and the next. Others may be met again
        # much later, where rounding may take them for large: none is looked at twice.
        refused = np.concatenate([refused, layer[~large]])
        neighbours = _half_space((layer[large][:, None, :] + steps).reshape(-1, genus))
        before, layer = layer[large], _others(neighbours, np.concatenate([before, layer[large], refused]))
        looked_at += len(layer)
        if looked_at > most:
            raise Unsolved("too-far", f"the clock has more than {most} Fourier modes, and the time is too far for panels")
    modes, values = np.concatenate(kept_modes), np.concatenate(kept_values)
    moving = np.any(modes != 0, axis=1)
    return modes[moving], values[moving]


def _half_space(modes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the modes, each replaced by its negative where its first nonzero entry is negative."""
    first = modes[np.arange(modes.shape[0]), np.argmax(modes != 0, axis=1)]
    return np.asarray(np.where(first[:, None] < 0, -modes, modes))


def _others(modes: NDArray[np.int64], known: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the distinct ones among modes (M, g) that are not among the known, in lexicographic order."""
    rows = np.concatenate([known, modes])
    order = np.lexsort(rows.T[::-1])  # stable: of equal rows known ones come first
    rows = rows[order]
    fresh = np.any(rows != np.roll(rows, 1, axis=0), axis=1) & (order >= len(known))
    return np.asarray(rows[fresh])
