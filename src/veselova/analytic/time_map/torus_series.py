"""Fourier series on the torus of functions of period 2 in the phases, and their integrals along an
orbit.

The measure of the torus is a determinant of one-variable forms. So every coefficient of a product
Π_s φ_s(λ_s) is a determinant of one-variable integrals, as in ``fourier``. A factor that is the
signed root of λ_s minus an end of its own cut changes sign with ψ_s → ψ_s + 2π: the modes m are
then half-integers in z_s, and no mode is zero. Modes are kept doubled, M = 2m, and belong to the
halved phases z/2.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.trigonometric_sums import powers, turns, waves_at
from veselova.analytic.attitude.frame import Frame
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.periods import Periods
from veselova.analytic.time_map.fourier import COLUMN_ROUNDING, ColumnsForModes
from veselova.analytic.time_map.fourier_modes import (
    Integers,
    TorusSeries,
    find_significant_modes,
    with_slow_phases,
)
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.rate import TorusFunction

__all__ = ["NormalComponent", "SeriesComponent", "SeriesIntegral", "find_series"]

Array = NDArray[np.float64]

#: Derived: coefficients below this are left out; those functions are at most one.
_SMALLEST = 1e-17

#: Calibrated: roundings of a sum over modes, for a unit of their amplitudes.
_SUM_ROUNDING = 4.0

#: Budget: entries of one block of (times × modes).
_BLOCK = 400_000


@dataclass(frozen=True)
class SeriesComponent(TorusFunction[Periods]):
    """A function on the torus whose Fourier coefficients are determinants, of period 2 in the phase
    of one cut and without mean.

    place  the number of the branch point, at least 1, that ends this cut
    """

    frame: Frame
    place: int

    @property
    def cut(self) -> int:
        """Return the cut s = 0 … g−1 that the branch point ends."""
        return int(self.frame.periods.curve.cut_of(self.place)) - 1

    @property
    def is_lower(self) -> bool:
        """Return whether it is the lower end, where the signed root is odd in ψ_s."""
        return self.place % 2 == 1

    @property
    @abstractmethod
    def odd(self) -> NDArray[np.bool_]:
        """Return which rows of which columns of the determinants are odd in ψ, (g, g)."""

    @property
    @abstractmethod
    def turn(self) -> float:
        """Return the phase of the series, in cycles."""

    def _roots_of_all_cuts(self, psi: Values) -> tuple[Values, Values]:
        """Return ``Frame.roots`` where every cut has the angles (N,): the same for all columns."""
        known = self._known_roots.get(psi.size)
        if known is None or not np.array_equal(known[0], psi):
            angles = np.repeat(psi[:, None], self.inversion.periods.genus, axis=1)
            known = (psi, *self.frame.roots(angles))
            self._known_roots[psi.size] = known
        return known[1:]

    @cached_property
    def _known_roots(self) -> dict[int, tuple[Values, Values, Values]]:
        return {}

    @property
    def needed_nodes(self) -> tuple[int, ...]:
        """Return those of the forms' own series: the factors are analytic in their strips."""
        return tuple(int(series.shape[-1]) for series in self.inversion.periods.cut_series)


@dataclass(frozen=True)
class NormalComponent(SeriesComponent):
    """(q',n_k) = scale · Π_s φ_s(λ_s), φ_s = √|c_k−λ_s|, signed on the cut that c_k ends.

    place  the number of the branch point c_k
    """

    @classmethod
    def of(cls, frame: Frame, inversion: AbelJacobi[Periods], k: int) -> NormalComponent:
        """Return the component along n_k for k = 1 … g−1, n_2 the first of them; its scale follows
        from the frame where the product is largest.
        """
        found = cls(inversion, 1.0, frame, frame.periods.curve.place["c", k])
        psi = np.pi * np.asarray(frame.half_periods, dtype=np.float64)
        products = found.at(psi)
        best = int(np.argmax(np.abs(products)))
        scale = float(frame.at(psi[best : best + 1]).components[0, k - 1]) / float(products[best])
        return cls(inversion, scale, frame, found.place)

    @property
    def odd(self) -> NDArray[np.bool_]:
        """Return all rows of the cut that c_k ends, where that is its lower end."""
        genus = self.inversion.periods.genus
        return np.tile(self.is_lower & (np.arange(genus) == self.cut), (genus, 1))

    @property
    def turn(self) -> float:
        """Return −¼ for an odd column, of −i sin: −i e^{ix} + c.c. is 2 cos(x − π/2)."""
        return -0.25 if self.is_lower else 0.0

    def at(self, psi: Values) -> Values:
        """Return (q',n_k) at angles of shape (N, g)."""
        return np.asarray(self.scale * np.prod(self.factors_at(psi), axis=0))

    def factors_at(self, psi: Values) -> Values:
        """Return φ_s at angles (N, g), shape (g, N)."""
        return self._factors(*self.frame.roots(psi))

    def _factors(self, roots: Values, own: Values) -> Values:
        """Return φ_s from the roots at angles (N, g), shape (g, N)."""
        factors = roots[:, self.place].copy()
        factors[self.cut] = own[self.place]
        return np.asarray(factors)

    def _weight_forms(self, s: int, psi: Values) -> Values:
        cut = self.inversion.periods.cuts[s]
        below, above = cut.distances(psi)
        sign = (-1) ** (self.inversion.periods.genus - s - 1)
        factors = self._factors(*self._roots_of_all_cuts(psi))
        return np.asarray(sign * cut.forms(below, above) * factors[s])


def find_series(component: SeriesComponent) -> TorusSeries:
    """Return the Fourier series of a component. Raises Unsolved where it has too many modes."""
    genus = component.inversion.periods.genus

    def made(weights: Array, G: Array, _: int) -> tuple[Array, Array, float, Array]:
        angles = np.pi * G.T  # of doubled modes
        rounding = COLUMN_ROUNDING * float(np.linalg.norm(weights))
        return weights.T, angles, rounding, np.abs(angles).max(axis=1)

    columns = ColumnsForModes(component, made)

    def determinants(orders: Integers) -> tuple[Array, NDArray[np.bool_]]:
        found = columns(orders)
        stacks = []
        for s, (weights, angles, _, _) in enumerate(found):
            phases = orders @ angles
            odd = component.odd[:, s]
            sums = np.empty((len(orders), genus))
            for rows, function in ((odd, np.sin), (~odd, np.cos)):
                if rows.any():
                    sums[:, rows] = function(phases) @ weights[:, rows]
            stacks.append(sums)
        matrices = np.stack(stacks, axis=2)
        lengths = np.linalg.norm(matrices, axis=1)
        others = ~np.eye(len(found), dtype=bool)
        sizes = np.abs(orders)
        off = sum(
            one * (1 + sizes @ wide) * lengths[:, others[s]].prod(axis=1)
            for s, (_, _, one, wide) in enumerate(found)
        )
        values = float(component.scale) * np.stack([np.linalg.det(matrices), off])
        return values.T, np.abs(values[0]) > np.maximum(_SMALLEST, np.abs(values[1]))

    origin = np.zeros(genus, dtype=np.int64)
    origin[component.cut] = 1
    orders, values, edge = find_significant_modes(genus, determinants, origin=origin, stride=2)
    off = max(4 * _SMALLEST, float(np.max(np.abs(values[:, 1]), initial=0.0)) / 2)
    return TorusSeries(orders, values[:, 0], np.full(len(orders), component.turn), edge, off)


class SeriesIntegral:
    """τ₁ ↦ ∫_0^{τ₁} of a series along the orbit z = z⁰ + fτ₁.

    Each mode gives c/(π m·f) (sin 2π(m·z + turn) − sin 2π(m·z⁰ + turn)). Near a resonance, where
    m·f is small, m·z is a phase of its own, as in ``fourier``. An exact resonance grows like τ₁.
    """

    def __init__(self, series: TorusSeries, in_tau1: LinearFlow) -> None:
        halved = in_tau1.halved()
        genus = halved.rates.size
        self._start = halved.start
        self._fastest = float(np.max(np.abs(halved.rates)))
        self._off = series.off
        self._pull = 4 * np.pi * np.abs(series.coefficients[:, None] * series.orders)
        at_edge = halved.rates_of(series.edge)
        orders, slow = with_slow_phases(
            series.orders, self._pull.max(axis=1, initial=0.0), halved.rates
        )
        flow = halved.with_combinations(slow) if len(slow) else halved
        pace = 2 * np.pi * flow.rates_of(orders)
        amplitudes = 2 * series.coefficients / pace
        self._amplitudes = np.abs(amplitudes)
        self._longest = 1 / np.maximum(
            np.abs(np.concatenate([pace / 2, np.pi * at_edge])), np.finfo(float).tiny
        )
        self._is_slow = np.any(orders[:, genus:], axis=1)
        fast = ~self._is_slow
        weights = -1j * amplitudes * np.exp(2j * np.pi * series.turns)
        self._fast = _ModeTable.of(series.orders[fast], weights[fast])
        self._slow = _SlowModes(
            flow,
            orders[self._is_slow, genus:],
            amplitudes[self._is_slow],
            series.turns[self._is_slow],
        )
        self._at_start = float(self._fast.at(self._start[None, :])[0])

    @property
    def size(self) -> int:
        """Return the number of modes."""
        return int(self._amplitudes.size)

    def at(self, tau1: Array, z: Array) -> Array:
        """Return the integral at Neumann times (N,) with their phases (N, g), z modulo 2."""
        result = self._fast.at(z / 2) - self._at_start
        return result + self._slow.at(tau1) if self._is_slow.any() else result

    def error(self, tau1: Array, of_start: Array, of_rates: Array) -> Array:
        """Return a bound on the error at Neumann times (N,), but for that of the times themselves:
        modes off and left out, errors of z⁰ (g,) and of f (g,) per unit of time.
        """
        elapsed = float(np.max(np.abs(tau1), initial=0.0))
        lengths = np.minimum(self._longest, elapsed)
        of_modes = self._off * (float(np.linalg.norm(lengths)) + 1 / self._fastest)
        shifts = self._pull * lengths[: self.size, None]
        sway = np.sqrt((shifts * shifts).sum(axis=0)) / 2
        reach = self._amplitudes.copy()
        reach[self._is_slow] *= np.minimum(1.0, elapsed / self._longest[: self.size][self._is_slow])
        of_sum = _SUM_ROUNDING * np.finfo(float).eps * float(np.sum(reach))
        return np.asarray(
            of_modes + of_sum + float(of_start @ sway) + np.abs(tau1) * float(of_rates @ sway)
        )


@dataclass(frozen=True)
class _SlowModes:
    """Modes that hardly move, Σ amplitude (sin 2π(k·x + turn) − sin 2π(k·x⁰ + turn)), in the phases
    x of slow combinations, the last of the flow.
    """

    flow: LinearFlow
    orders: Integers
    amplitudes: Array
    turns: Array

    def at(self, tau1: Array) -> Array:
        """Return the sum at Neumann times: 2 cos(offset + h) sin h, so that nothing cancels."""
        count = self.orders.shape[1]
        offset = 2 * np.pi * (self.orders @ self.flow.start[-count:] + self.turns)
        h = np.pi * (self.flow.advance(tau1)[:, -count:] @ self.orders.T)
        return np.asarray((np.cos(offset + h) * np.sin(h)) @ (2 * self.amplitudes))


@dataclass(frozen=True)
class _ModeTable:
    """Re Σ w e^{2πi M·ζ} for doubled modes M of one parity; those of genus 2 as a product of
    matrices.

    - orders: (K, g)
    - weights: (K,)
    - parity: (g,) of the orders
    - table: the w by (M−parity)/2, None for another genus
    """

    orders: Integers
    weights: NDArray[np.complex128]
    parity: Integers
    table: NDArray[np.complex128] | None

    @classmethod
    def of(cls, orders: Integers, weights: NDArray[np.complex128]) -> _ModeTable:
        """Return the table of modes whose first nonzero entries are positive."""
        parity = orders[0] % 2 if len(orders) else np.zeros(orders.shape[1], dtype=np.int64)
        if orders.shape[1] != 2 or not len(orders):
            return cls(orders, weights, parity, None)
        steps = (orders - parity) // 2
        highest = np.max(np.abs(steps), axis=0)
        table = np.zeros((highest[0] + 1, 2 * highest[1] + 1), dtype=np.complex128)
        table[steps[:, 0], steps[:, 1]] = weights  # negative places from the end, as ``turns`` has
        return cls(orders, weights, parity, table)

    def at(self, halved: Array) -> Array:
        """Return the sum at halved phases (N, g)."""
        result = np.zeros(len(halved))
        step = max(1, _BLOCK // max(len(self.orders), 1))
        for first in range(0, len(halved), step):
            rows = slice(first, first + step)
            angles = 2 * np.pi * halved[rows]
            if self.table is None:
                cosines, sines = waves_at(
                    angles, self.orders, int(np.max(np.abs(self.orders), initial=0))
                )
                result[rows] = self.weights.real @ cosines - self.weights.imag @ sines
                continue
            lower = powers(2 * angles[:, 0], max(1, len(self.table) - 1))[: len(self.table)]
            upper = turns(2 * angles[:, 1:], self.table.shape[1] // 2)[:, 0]
            both = np.sum(lower * (self.table @ upper[: self.table.shape[1]]), axis=0)
            result[rows] = (np.exp(1j * (angles @ self.parity)) * both).real
        return result
