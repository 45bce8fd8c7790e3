"""The Fourier time maps of many tori at once: what analytic.time_map.fourier does for one, with the
modes of each torus in a box.

    t = F_0τ₁ + Σ_{m≠0} F_m/(π m·f) (sin 2πm·z − sin 2πm·z⁰),  one of each m and −m

The determinants F_m are sums of products of matrices, and so are the series at T points of each
torus. No number depends on which other tori are in the arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.double_double import exact_product
from veselova.analytic.time_map.fourier import COLUMN_ROUNDING, LEAST_SLOPE, SMALLEST_MODE
from veselova.analytic.time_map.fourier_modes import SLOW
from veselova.mechanics.core.budget import checkpoint

__all__ = ["ModeTables", "TimeMaps", "form_tables", "fourier_coefficients", "orders_of"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Method: largest |m_k| of the first steps towards τ₁.
COARSE = 3

#: Derived: cycles of the fastest phase of which a last step of Newton's method leaves its square.
CONVERGED = 1e-10

#: Derived: slowest pace of a mode that is divided by.
STANDING = 1e-300

#: Budget: steps before a torus is left to others: four to six are usual.
MOST_STEPS = 30


@dataclass(frozen=True)
class ModeTables:
    """The Fourier coefficients of dt/dτ₁ over its mean on N tori, for modes m of a box: m_1 = 0 …
    M, the others −M … M.

    - values: (N, M+1, 2M+1, …) F_m/F_0, one of each m and −m; the others, m = 0 and what is
      rounding are zero
    - off: (N,) what each of them is off by
    - kept: (K',) the places in the box of modes that may count on any torus; None for all
    """

    values: Array
    off: Array
    kept: NDArray[np.intp] | None = None

    @property
    def highest(self) -> int:
        """Return M."""
        return int(self.values.shape[1]) - 1

    @property
    def genus(self) -> int:
        """Return g."""
        return self.values.ndim - 1

    @cached_property
    def orders(self) -> NDArray[np.int64]:
        """Return the modes that may count, (K, g)."""
        box = orders_of(self.highest, self.genus)
        return box if self.kept is None else box[self.kept]

    @cached_property
    def flat(self) -> Array:
        """Return F_m/F_0 of these, (N, K)."""
        values = self.values.reshape(len(self.values), -1)
        return values if self.kept is None else values[:, self.kept]

    def box_of(self, flat: Array) -> Array:
        """Return numbers of these modes in the box, (N, M+1, 2M+1, …)."""
        if self.kept is None:
            return np.asarray(flat.reshape(self.values.shape))
        result = np.zeros((len(flat), self.values[0].size))
        result[:, self.kept] = flat
        return result.reshape(self.values.shape)

    def part(self, rows: NDArray[np.intp]) -> ModeTables:
        """Return the tables of some of the tori."""
        return ModeTables(self.values[rows], self.off[rows], self.kept)

    @cached_property
    def fits(self) -> NDArray[np.bool_]:
        """Return of which tori no mode on the faces of the box counts, (N,)."""
        at_face = np.max(np.abs(self.orders), axis=1) == self.highest
        return np.asarray(~np.any(self.flat[:, at_face], axis=1))


def orders_of(highest: int, genus: int) -> NDArray[np.int64]:
    """Return the modes of a box, (K, g): m_1 = 0 … M, the others −M … M."""
    axes = [np.arange(highest + 1), *(np.arange(-highest, highest + 1),) * (genus - 1)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, genus)


def _is_counted(orders: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which modes of a box stand for themselves and their negatives: their first nonzero
    entry is positive.
    """
    first = orders[np.arange(len(orders)), np.argmax(orders != 0, axis=1)]
    return np.asarray(first > 0)


def form_tables(weights: Array, G: Array, scale: Array, mean: Array, highest: int) -> ModeTables:
    """Return the tables of N tori; the arguments are those of ``fourier_coefficients``."""
    values, off, counts = fourier_coefficients(weights, G, scale, mean, highest)
    largest = np.max(np.where(counts, off, 0.0), axis=1) / 2
    genus = weights.shape[1]
    shape = (len(values), highest + 1, *(2 * highest + 1,) * (genus - 1))
    return ModeTables(
        np.where(counts, values, 0.0).reshape(shape), np.maximum(4 * SMALLEST_MODE, largest)
    )


def fourier_coefficients(
    weights: Array, G: Array, scale: Array, mean: Array, highest: int
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return F_m/F_0 of the modes of a box, by how much each is off, and which count, (N, K) each.

    - weights, G: (N, s, k, J) those of G_s at J nodes of each cut
    - scale, mean: of dt/dτ₁, (N,)

    F_m = scale det_{ks}[Σ_j w_kj cos(2πm·G_s(ψ_j))], as in analytic.time_map.fourier.
    """
    genus = weights.shape[1]
    orders = orders_of(highest, genus)
    columns = np.stack(
        [_column(weights[:, s], 2 * np.pi * G[:, s], highest) for s in range(genus)], axis=2
    )  # (N, k, s, K)
    values = _determinants(columns) * (scale / mean)[:, None]
    lengths = np.sqrt(np.sum(columns * columns, axis=1))  # (N, s, K)
    wide = np.max(np.abs(2 * np.pi * G), axis=3)  # (N, s, k)
    sizes = np.sqrt(np.sum(weights * weights, axis=(2, 3)))  # (N, s)
    off = np.zeros_like(values)
    for s in range(genus):
        others = np.prod(np.delete(lengths, s, axis=1), axis=1)
        off += sizes[:, s, None] * (1 + _each(wide[:, s], np.abs(orders).T)) * others
    off *= COLUMN_ROUNDING * np.abs(scale / mean)[:, None]
    counts = (np.abs(values) > np.maximum(SMALLEST_MODE, off)) & _is_counted(orders)
    return values, off, counts


def _column(weights: Array, angles: Array, highest: int) -> Array:
    """Return Σ_j w_kj cos(m·angles_j) for the modes of a box, (N, k, K), from w and angles (N, k,
    J): products of the powers for each entry of m.
    """
    count, genus, nodes = angles.shape
    powers = _powers(angles, highest)  # (N, k, m, J)
    first = powers[:, :1] * weights[:, :, None]  # (N, k, M+1, J)
    if genus == 1:
        return np.asarray(np.sum(first.real, axis=-1))
    for i in range(1, genus - 1):
        first = first[:, :, :, None] * _both_signs(powers[:, i])[:, None, None]
        first = first.reshape(count, genus, -1, nodes)
    # cos(a ± b) = cos a cos b ∓ sin a sin b, each a product of matrices
    last = np.swapaxes(powers[:, genus - 1], 1, 2)
    rows = first.reshape(count, -1, nodes)
    cosines = np.ascontiguousarray(rows.real) @ np.ascontiguousarray(last.real)
    sines = np.ascontiguousarray(rows.imag) @ np.ascontiguousarray(last.imag)
    backwards = (cosines + sines)[..., :0:-1]
    found = np.concatenate([backwards, cosines - sines], axis=-1)
    return np.asarray(found.reshape(count, genus, -1))


def _determinants(columns: Array) -> Array:
    """Return det_{ks} of (N, k, s, K), written out up to three columns."""
    genus = columns.shape[1]
    if genus == 1:
        return np.asarray(columns[:, 0, 0])
    if genus == 2:
        return np.asarray(columns[:, 0, 0] * columns[:, 1, 1] - columns[:, 0, 1] * columns[:, 1, 0])
    if genus == 3:
        a, b, c = (columns[:, :, s] for s in range(3))
        crossed = np.cross(b, c, axis=1)
        return np.asarray(np.sum(a * crossed, axis=1))
    return np.asarray(np.linalg.det(np.moveaxis(columns, 3, 1)))


def _powers(angles: Array, highest: int) -> Complex:
    """Return e^{imφ}, m = 0 … highest, along a new axis before the last, by doubling."""
    result = np.empty((*angles.shape[:-1], highest + 1, angles.shape[-1]), dtype=np.complex128)
    result[..., 0, :] = 1
    np.cos(angles, out=result.real[..., 1, :])
    np.sin(angles, out=result.imag[..., 1, :])
    known = 1
    while known < highest:
        more = min(known, highest - known)
        np.multiply(
            result[..., 1 : more + 1, :],
            result[..., known : known + 1, :],
            out=result[..., known + 1 : known + more + 1, :],
        )
        known += more
    return result


def _both_signs(powers: Complex) -> Complex:
    """Return e^{imφ}, m = −M … M, from those of m = 0 … M, second axis from the end."""
    return np.concatenate([np.conj(powers[..., :0:-1, :]), powers], axis=-2)


@dataclass(frozen=True)
class TimeMaps:
    """t ↦ (τ₁, z) on N tori.

    - tables: the modes of dt/dτ₁
    - start: (N, g) z⁰
    - frequencies: (N, g) f, cycles per unit of τ₁
    - mean: (N,) F_0
    """

    tables: ModeTables
    start: Array
    frequencies: Array
    mean: Array

    def part(self, rows: NDArray[np.intp]) -> TimeMaps:
        """Return the maps of some of the tori."""
        return TimeMaps(
            self.tables.part(rows), self.start[rows], self.frequencies[rows], self.mean[rows]
        )

    def error(self, elapsed: Array, of_start: Array, of_rates: Array) -> tuple[Array, Array]:
        """Return the error that the modes add to τ₁ within Neumann times (N,), and what is to be
        multiplied with |τ₁|, (N,) each, from errors of z⁰ and f, (N, g), as FourierTimeMap does.
        """
        if self.tables.kept is None:
            counts = _with_neighbours(self.tables.values != 0).reshape(len(self.mean), -1)
            counts &= np.any(self.tables.orders != 0, axis=1)
        else:
            counts = np.ones(self._flat.shape, dtype=bool)
        lengths = np.minimum(1 / np.maximum(self.paces, STANDING), elapsed[:, None])
        of_all = np.sqrt(np.sum(np.where(counts, lengths * lengths, 0.0), axis=1))
        of_modes = self.tables.off * (of_all + 1 / self.fastest)
        # with the amplitudes F_m/(F_0 π m·f), or what they reach until then
        shifts = (4 * np.pi * np.abs(self._flat) * lengths) ** 2
        sway = np.sqrt(_each(shifts, self.tables.orders**2))
        of_sum = np.finfo(float).eps * np.minimum(self._reach, elapsed)
        return (
            of_modes + of_sum + np.sum(sway * of_start, axis=1),
            np.sum(sway * of_rates, axis=1),
        )

    @cached_property
    def paces(self) -> Array:
        """Return |π m·f| of the modes, (N, K)."""
        return np.asarray(np.pi * np.abs(_each(self.frequencies, self.tables.orders.T)))

    @cached_property
    def fastest(self) -> Array:
        """Return the most cycles of a phase in a unit of τ₁, (N,)."""
        return np.asarray(np.max(np.abs(self.frequencies), axis=1))

    @cached_property
    def _flat(self) -> Array:
        return self.tables.flat

    @cached_property
    def _amplitudes(self) -> Array:
        """Return F_m/(F_0 π m·f), (N, K)."""
        paces = np.pi * _each(self.frequencies, self.tables.orders.T)
        return np.divide(self._flat, paces, out=np.zeros_like(paces), where=self._flat != 0)

    @cached_property
    def has_slow_modes(self) -> NDArray[np.bool_]:
        """Return on which tori a mode of several phases is so slow that its rounding would be
        divided by next to nothing, (N,).
        """
        orders = self.tables.orders
        largest = np.max(np.abs(orders), axis=1) * (np.count_nonzero(orders, axis=1) > 1)
        pull = 4 * np.abs(self._flat) * largest * self.fastest[:, None]
        return np.asarray(np.any(pull > SLOW * self.paces / np.pi, axis=1))

    @cached_property
    def _reach(self) -> Array:
        """Return the most by which τ₁ differs from t/F_0, (N,)."""
        return np.asarray(2 * np.sum(np.abs(self._amplitudes), axis=1))

    @cached_property
    def _stacked(self) -> Array:
        """Return amplitudes and coefficients, doubled, in one table (N, 2, M+1, 2M+1, …)."""
        amplitudes = self.tables.box_of(self._amplitudes)
        return np.stack([amplitudes, 2 * self.tables.values], axis=1)

    @cached_property
    def _at_start(self) -> Array:
        """Return the sum at z⁰, (N,)."""
        return np.asarray(_sums(self._stacked[:, :1], self.start[:, None])[:, 0, 0].imag)

    def tau1(
        self, times: Array, remainders: Array | None = None
    ) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
        """Return τ₁, z but for whole cycles of z⁰ + Ωt, and dt/dτ₁ over its mean, at times (T,) and
        their remainders (T,):
        (N, T), (N, T, g) and (N, T); and which tori converged, (N,).

        Newton's method for δ + periodic(z⁰ + Ωt + fδ)/F_0 = 0, δ = τ₁ − t/F_0 and Ω = f/F_0, as
        in analytic.time_map.fourier. The first step takes the largest modes alone.
        """
        rates = self.frequencies / self.mean[:, None]
        product, error = exact_product(times[:, None], rates[:, None, :])
        if remainders is not None:
            error += remainders[:, None] * rates[:, None]
        uniform = self.start[:, None] + np.fmod(product, 2.0) + error
        reach = self._reach[:, None]
        delta = np.zeros(uniform.shape[:2])
        value, slope = self._excess(self._coarse, delta, uniform, slice(None))
        delta = np.clip(-value / np.maximum(slope, LEAST_SLOPE), -reach, reach)
        low, high = np.broadcast_to(-reach, delta.shape), np.broadcast_to(reach, delta.shape)
        slopes = np.empty_like(delta)
        converged = np.zeros(len(delta), dtype=bool)
        rows = np.arange(len(delta))
        tables = self._stacked
        for _ in range(MOST_STEPS):
            checkpoint()
            value, slope = self._excess(tables, delta[rows], uniform[rows], rows)
            with np.errstate(divide="ignore", invalid="ignore"):
                step = value / slope
            small = np.abs(step) * self.fastest[rows, None] <= CONVERGED
            before, slopes[rows] = delta[rows], slope
            low, high = np.where(value <= 0, before, low), np.where(value >= 0, before, high)
            moved = before - step
            inside = (slope > 0) & (small | ((low <= moved) & (moved <= high)))
            delta[rows] = np.where(inside, moved, (low + high) / 2)
            done = np.all(small & inside, axis=1)
            converged[rows[done]] = True
            rows, low, high = rows[~done], low[~done], high[~done]
            if not rows.size:
                break
            tables = self._stacked[rows]
        z = uniform + delta[..., None] * self.frequencies[:, None]
        return times / self.mean[:, None] + delta, z, slopes, converged

    def _excess(
        self, tables: Array, delta: Array, uniform: Array, rows: NDArray[np.intp] | slice
    ) -> tuple[Array, Array]:
        """Return δ + periodic/F_0 and its slope at δ (R, T) of some rows, with their tables."""
        sums = _sums(tables, uniform + delta[..., None] * self.frequencies[rows, None])
        return delta + sums[:, 0].imag - self._at_start[rows, None], 1 + sums[:, 1].real

    @cached_property
    def _coarse(self) -> Array:
        few = min(COARSE, self.tables.highest)
        middle = slice(self.tables.highest - few, self.tables.highest + few + 1)
        inner = (slice(None), slice(None), slice(0, few + 1), *(middle,) * (self.tables.genus - 1))
        return np.ascontiguousarray(self._stacked[inner])


def _sums(tables: Array, z: Array) -> Complex:
    """Return Σ_m c_m e^{2πi m·z} over the box of tables (N, L, M+1, 2M+1, …) at z (N, T, g), shape
    (N, L, T).
    """
    count, number, *sides = tables.shape
    highest = sides[0] - 1
    times = z.shape[1]
    powers = _powers(2 * np.pi * np.swapaxes(z, 1, 2), highest)  # (N, g, M+1, T)
    genus = z.shape[2]
    last = powers[:, -1] if genus == 1 else _both_signs(powers[:, -1])
    flat = tables.reshape(count, -1, last.shape[1])
    parts = flat @ np.concatenate([last.real, last.imag], axis=2)
    found: Complex = parts[..., :times] + 1j * parts[..., times:]
    for i in range(genus - 2, -1, -1):
        wave = powers[:, i] if i == 0 else _both_signs(powers[:, i])
        found = found.reshape(count, -1, wave.shape[1], times)
        found = np.sum(found * wave[:, None], axis=2)
    return found.reshape(count, number, times)


def _with_neighbours(counts: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which modes count (N, M+1, 2M+1, …), or are next to one that does."""
    result = counts.copy()
    for axis in range(1, counts.ndim):
        lower = (slice(None),) * axis + (slice(None, -1),)
        upper = (slice(None),) * axis + (slice(1, None),)
        result[lower] |= counts[upper]
        result[upper] |= counts[lower]
    return result


def _each(rows: Array, matrix: NDArray[Any]) -> Array:
    """Return rows (N, a) times a matrix (a, b), each by itself: one product of all may round a row
    otherwise where others are in it.
    """
    return np.asarray((rows[:, None] @ matrix.astype(np.float64))[:, 0])
