"""The time map in closed form: every Fourier coefficient of dt/dτ₁ is a determinant of one-variable
integrals.

    t = F_0τ₁ + Σ_{m≠0} F_m (e^{2πi m·z} − e^{2πi m·z⁰})/(2πi m·f)

Near a resonance, where m·f is small, m·z is a phase of its own: made of the others, its rounding
would be divided by m·f.

Any t costs the same; the number of modes grows with the genus (n = 3: hundreds, n = 4: thousands, n
= 5: ten thousands).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.trigonometric_sums import waves_at
from veselova.analytic.numerics.monotone_root import Rows, fourth_order_divisor, increasing_root
from veselova.analytic.time_map.fourier_modes import (
    Integers,
    find_significant_modes,
    with_slow_phases,
)
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.rate import TimeMap, TorusFunction, TorusRate
from veselova.mechanics.core.budget import checkpoint

__all__ = [
    "COLUMN_ROUNDING",
    "LEAST_SLOPE",
    "SMALLEST_MODE",
    "ColumnsForModes",
    "FourierTimeMap",
    "find_modes",
]

Array = NDArray[np.float64]

T = TypeVar("T")

#: Derived: modes below this part of F_0 are left out: there the determinants are rounding.
SMALLEST_MODE = 4e-16

#: Rounding of a column of a determinant, for a unit of its weights and of its angles, that is
#: hardly ever exceeded.
COLUMN_ROUNDING = 4 * float(np.finfo(float).eps)

#: Method: radians by one of ψ beyond those that modes ask for, at least: room for the next layers.
_SPARE_PACE = 16

#: Method: modes that bring the inverse time map near its answer before all of them are summed: the
#: fewest, and their part.
_FIRST_MODES = 64
_FIRST_PART = 1 / 16

#: Method: smallest dt/dτ₁, as a part of its mean, that a step of the inverse time map divides by.
LEAST_SLOPE = 0.05

#: Budget: by how much the times elapsed of which errors are told apart may differ.
_MOST_ELAPSED = 1e12

#: Budget: entries of one block of (times × modes): temporaries that stay in the cache.
_BLOCK = 32_000

#: Derived: cycles that the last step of the inverse time map may leave open; and a step that leaves
#: so much where no slope is known to be the least, and the error is of the order of its square.
_OPEN = 1e-17
_CONVERGED = 1e-9


class FourierTimeMap(TimeMap):
    """t(τ₁) by the Fourier determinants. The uniform parts z⁰ + Ωt and t/F_0 are exact, δ = τ₁ −
    t/F_0 stays bounded.
    """

    name: ClassVar[str] = "fourier"

    def __init__(
        self,
        rate: TorusRate[Any],
        in_tau1: LinearFlow,
        in_time: LinearFlow,
        mean: float,
    ) -> None:
        modes, coefficients, edge, self._off = find_modes(rate)
        order = np.argsort(-np.abs(coefficients))
        modes, coefficients = modes[order], coefficients[order]
        self._genus, self._mean = in_tau1.rates.size, mean
        self._fastest = float(np.max(np.abs(in_tau1.rates)))
        #: How far modes move τ₁ with each of these phases at the start, in a unit of time.
        self._pull = 4 * np.pi / mean * np.abs(coefficients[:, None] * modes)
        at_edge = in_tau1.rates_of(edge)
        self._modes, slow = with_slow_phases(
            modes, self._pull.max(axis=1, initial=0.0), in_tau1.rates
        )
        if len(slow):
            in_tau1 = in_tau1.with_combinations(slow)
            # f/F_0 is rounded, and its combinations would not be those of f: f is divided to more
            # digits
            in_time = in_tau1.per(mean)
        self._in_tau1 = in_tau1
        self._in_time = in_time
        # The mode and its negative together: F_m(e^{2πi m·z} − …)/(2πi m·f) + c.c. = F_m/(π m·f)
        # (sin 2πm·z − sin 2πm·z⁰).
        pace = 2 * np.pi * self._in_tau1.rates_of(self._modes)
        amplitudes = 2 * coefficients / pace
        # With h = πm·(z−z⁰) the sums are 2 cos(2πm·z⁰+h) sin h, and cos(2πm·z⁰+2h) and
        # −sin(2πm·z⁰+2h) in turn, divided by k!: of sin h cos h and of sin²h.
        offset = 2 * np.pi * (self._modes @ self._in_tau1.start)
        cosine = np.cos(offset)
        sine = np.sin(offset)
        sizes = 2 * np.stack(
            [amplitudes, 2 * coefficients, -coefficients * pace, -coefficients * pace**2 / 3],
            axis=1,
        )
        of_products = sizes * np.stack([cosine, -sine, cosine, -sine], axis=1)
        of_squares = -sizes * np.stack([sine, cosine, sine, cosine], axis=1)
        self._sum, few = (
            _Sum.of(mean, self._modes, of_products, of_squares),
            max(_FIRST_MODES, int(_FIRST_PART * len(modes))),
        )
        self._first = (
            _Sum.of(mean, self._modes[:few], of_products[:few], of_squares[:few])
            if few < len(modes)
            else None
        )
        self._reach = 2 * float(np.sum(np.abs(amplitudes))) / mean
        #: For how long a mode acts in one sense, 1/(π m·f), of those kept and those next to them.
        self._longest = 1 / np.maximum(
            np.abs(np.concatenate([pace / 2, np.pi * at_edge])), np.finfo(float).tiny
        )
        self._longest_of_all = float(np.max(self._longest, initial=0.0))
        self._converged = self._last_step(coefficients, pace)

    @property
    def size(self) -> int:
        """Return the number of modes kept, m and −m counted once."""
        return int(self._modes.shape[0])

    @property
    def mean(self) -> float:
        """Return F_0."""
        return self._mean

    def error(self, tau1: Array, of_start: Array, of_rates: Array) -> tuple[Array, Array]:
        """Return the error of the modes at increasing Neumann times, and what is to be multiplied
        with |τ₁|, (N,) each: each mode is off by about the smallest kept, for 1/(π m·f) or for the
        time elapsed.

        So are those next to them that are left out, and others are smaller. An error of phase k
        moves τ₁ by 2F_m 2πm_k/F_0 of it for as long. Errors of different modes add in squares. To
        these comes one rounding of δ.
        """
        most = max(abs(tau1.item(0)), abs(tau1.item(-1)))
        if tau1.size == 1 or most == 0:
            of_all, sway = (
                self._swayed if most > self._longest_of_all else self._bound_modes([most])
            )
            return of_all + of_start @ sway, of_rates @ sway
        # the time elapsed of each, up to a factor of two
        halvings = math.ceil(math.log2(max(1.0, min(most * 2 * self._fastest, _MOST_ELAPSED))))
        halves = most * 0.5 ** np.arange(1, halvings + 1)
        ends = np.searchsorted(tau1, np.concatenate([-halves, halves[::-1]]))
        counts = np.diff(ends, prepend=0, append=tau1.size)
        level = halvings - np.abs(np.arange(-halvings, halvings + 1))
        levels, which = np.unique(level[counts > 0], return_inverse=True)
        of_all, sway = self._bound_modes(most * 0.5**levels)
        counts = counts[counts > 0]
        return (
            np.repeat((of_all + of_start @ sway)[which], counts),
            np.repeat((of_rates @ sway)[which], counts),
        )

    @cached_property
    def _swayed(self) -> tuple[Array, Array]:
        return self._bound_modes([np.inf])

    def _bound_modes(self, elapsed: Any) -> tuple[Array, Array]:
        """Return the error of the modes and of δ, (K,), and how far τ₁ moves with each phase, (g,
        K), for K times elapsed.
        """
        lengths = np.minimum(self._longest[:, None], elapsed)
        of_modes = self._off * (np.linalg.norm(lengths, axis=0) + 1 / self._fastest)
        sway = np.sqrt((self._pull**2).T @ lengths[: self.size] ** 2)
        return of_modes + np.finfo(float).eps * np.minimum(self._reach, elapsed), sway

    def time(self, tau1: Array) -> Array:
        """Return t = F_0τ₁ + Σ F_m/(π m·f) (sin 2πm·z − sin 2πm·z⁰)."""
        return np.asarray(self._mean * tau1 + self._sum.at(self._in_tau1.advance(tau1))[0])

    def _last_step(self, coefficients: Array, pace: Array) -> float:
        """Return the step of τ₁ that leaves _OPEN: of s stays |a³ − 2ab + c| s⁴, with t(τ₁+x) −
        t(τ₁) ∝ x + ax² + bx³ + cx⁴ …
        """
        least = self._mean - 2 * float(np.sum(np.abs(coefficients)))
        if least < LEAST_SLOPE * self._mean:
            return _CONVERGED / self._fastest
        a, b, c = (
            float(np.sum(np.abs(coefficients * pace**k))) / (least * d)
            for k, d in ((1, 1), (2, 3), (3, 12))
        )
        return float((_OPEN / (self._fastest * (a**3 + 2 * a * b + c))) ** 0.25) if a else np.inf

    def tau1(self, times: Array) -> tuple[Array, Array]:
        """Return (τ₁, z) by Householder's method for F_0 δ + periodic(z⁰ + Ωt + fδ) = 0; dt/dτ₁ >
        0; large modes come first.
        """
        uniform = self._in_time.advance(times)
        delta = np.zeros(times.size)
        reach = np.full(times.size, self._reach)
        mean = self._mean
        rates = self._in_tau1.rates

        def excess(delta: Array, rows: Rows) -> tuple[Array, Array]:
            value, *rise = self._sum.at(uniform[rows] + delta[:, None] * rates)
            value += mean * delta
            return value, fourth_order_divisor(value, *rise)

        # a truncated sum need not increase: one plain step towards it is all it is good for
        if self._first is not None:
            value, *rise = self._first.at(uniform)
            delta = np.maximum(
                np.minimum(
                    -value / np.maximum(fourth_order_divisor(value, *rise), LEAST_SLOPE * mean),
                    reach,
                ),
                -reach,
            )
        delta = increasing_root(
            excess, delta, -reach, reach, self._converged, _CONVERGED / self._fastest
        )
        z = self._in_time.start + uniform + delta[:, None] * rates
        return times / mean + delta, z[:, : self._genus]


@dataclass(frozen=True)
class _Sum:
    """t − F_0τ₁ summed over M modes, and t's Taylor coefficients in τ₁.

    - orders: (M, g)
    - highest: their largest entry
    - weights: (2M, 4): what cos h sin h and sin² h of each are multiplied with, h = πm·(z−z⁰)
    - at_start: (3,): the coefficients at z⁰
    """

    orders: Integers
    highest: int
    weights: Array
    at_start: Array

    @classmethod
    def of(cls, mean: float, orders: Integers, of_products: Array, of_squares: Array) -> _Sum:
        """Return the sum from the weights (M, 4) of products and of squares."""
        at_start = np.array([mean, 0.0, 0.0]) - of_squares[:, 1:].sum(axis=0) / 2
        return cls(
            orders,
            int(np.max(np.abs(orders), initial=0)),
            np.concatenate([of_products, of_squares]),
            at_start,
        )

    def at(self, advance: Array) -> Array:
        """Return the sum at z = z⁰ + advance (N, g) and the coefficients of the first three powers,
        shape (4, N).

        The difference of sines is 2 cos(πm·(z+z⁰)) sin(πm·(z−z⁰)), so nothing cancels when m·f or
        the advance is small.
        """
        (count, _), (modes, _) = advance.shape, self.orders.shape
        result = np.empty((count, 4))
        block = max(1, min(count, _BLOCK // max(modes, 1)))
        room = np.empty((2, modes, block))
        for first in range(0, count, block):
            checkpoint()
            rows = slice(first, first + block)
            half = waves_at(
                np.pi * advance[rows], self.orders, self.highest, room[:, :, : count - first]
            )
            cosines, sines = half
            cosines *= sines
            sines *= sines
            np.matmul(half.reshape(2 * modes, half.shape[2]).T, self.weights, out=result[rows])
        result[:, 1:] += self.at_start
        return result.T


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
            COLUMN_ROUNDING * float(np.linalg.norm(weights)),
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
        return values.T, np.abs(values[0]) > np.maximum(SMALLEST_MODE, values[1])

    modes, values, edge = find_significant_modes(rate.inversion.periods.genus, determinants)
    return (
        modes,
        mean * values[:, 0],
        edge,
        max(4 * SMALLEST_MODE, float(np.max(values[:, 1], initial=0.0)) / 2),
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
