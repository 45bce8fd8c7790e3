"""The Fourier modes of a time map that count, sets of integer vectors m, one of each m and −m,
grown from zero; the columns of their determinants; and δ = τ₁ − t/F_0 from their sums in doubles.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values, powers
from veselova.analytic.arithmetic.monotone_root import Rows, increasing_root
from veselova.analytic.time_map.rate import TorusRate
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["ColumnsForModes", "Integers", "SumsOverModes", "find_significant_modes"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

T = TypeVar("T")

#: Budget: modes looked at before giving up.
_MOST_MODES = 1_000_000

#: Method: radians by one of ψ beyond those that modes ask for, at least: room for the next layers.
_SPARE_PACE = 16

#: Budget: entries of one block of (times × modes): temporaries that stay in the cache.
_BLOCK = 32_000

#: Derived: a step of Newton's method, in cycles, that leaves an error of its square.
_CONVERGED = 1e-9


def find_significant_modes(
    genus: int,
    coefficients: Callable[[Integers], tuple[Any, NDArray[np.bool_]]],
    most: int = _MOST_MODES,
    expected: float = 0.0,
) -> tuple[Integers, NDArray[Any], Integers]:
    """Return the modes m ≠ 0 (first nonzero entry positive) whose coefficients count, these, and
    the modes next to them.

    ``coefficients`` gives those of modes (M, g), and whether each is large enough. They fall off
    like the support function of a convex body, so the set is convex up to its edge: it is grown
    from zero through neighbours, in whichever directions it reaches far. Where A's nearly coincide
    so do rates of phases, and modes e_s − e_{s+1} are slow. Averages over fast phases are constant
    to first order, so sets Σm = 0 and 2 may be empty where Σm = 1 reaches far: such differences
    lead to neighbours too. ``expected``: about how many there are, to show progress. Raises
    Unsolved where more than ``most`` have been looked at.
    """
    units = np.eye(genus, dtype=np.int64)
    steps = np.concatenate([units, -units, np.diff(units, axis=0), -np.diff(units, axis=0)])
    none = np.empty((0, genus), dtype=np.int64)
    layer = np.zeros((1, genus), dtype=np.int64)
    looked_at = 1
    before = none
    refused = none
    kept_modes = []
    kept_values = []
    while layer.size:
        checkpoint("Fourier modes", looked_at, max(expected, looked_at) if expected else 0.0)
        values, large = coefficients(layer)
        kept_modes.append(layer[large])
        kept_values.append(values[large])
        # Those that count have no neighbours that do but in their own layer, the one before and the
        # next. Others may be met again much later, where rounding may take them for large: none is
        # looked at twice.
        refused = np.concatenate([refused, layer[~large]])
        neighbours = _half_space((layer[large][:, None, :] + steps).reshape(-1, genus))
        before, layer = (
            layer[large],
            _others(neighbours, np.concatenate([before, layer[large], refused])),
        )
        looked_at += len(layer)
        if looked_at > most:
            raise Unsolved(
                "too-far",
                f"there are more than {most} Fourier modes, and the time is too far for panels",
            )
    modes = np.concatenate(kept_modes)
    values = np.concatenate(kept_values)
    moving = np.any(modes != 0, axis=1)
    return modes[moving], values[moving], refused


def _half_space(modes: Integers) -> Integers:
    """Return the modes, each replaced by its negative where its first nonzero entry is negative."""
    first = modes[np.arange(modes.shape[0]), np.argmax(modes != 0, axis=1)]
    return np.asarray(np.where(first[:, None] < 0, -modes, modes))


def _others(modes: Integers, known: Integers) -> Integers:
    """Return the distinct ones among modes (M, g) that are not among the known, in lexicographic
    order.
    """
    rows = np.concatenate([known, modes])
    order = np.lexsort(rows.T[::-1])  # stable: of equal rows known ones come first
    rows = rows[order]
    fresh = np.any(rows != np.roll(rows, 1, axis=0), axis=1) & (order >= len(known))
    return np.asarray(rows[fresh])


class ColumnsForModes(Generic[T]):
    """What is made of ``Rate.columns`` at nodes enough for the e^{−2πi m·G_s} of any modes; kept
    for modes that ask for no more.

    ``made``: what is made of weights, G_s and the most radians that modes, and their entries, may
    turn by one of ψ
    """

    def __init__(self, rate: TorusRate[Any], made: Callable[[Values, Values, int], T]) -> None:
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


class SumsOverModes:
    """Σ 2F_m cos 2πm·z and Σ F_m/(π m·f) sin 2πm·z in doubles, m and −m together: F_m (e^{2πi m·z}
    − …)/(2πi m·f) + c.c. = F_m/(π m·f) (sin 2πm·z − sin 2πm·z⁰).

    - modes: (M, g); coefficients, amplitudes: (M,) F_m and F_m/(π m·f)
    - mean: F_0; start, rates: (g,) z⁰ and f
    """

    def __init__(
        self,
        modes: Integers,
        coefficients: Array,
        amplitudes: Array,
        mean: float,
        start: Array,
        rates: Array,
    ) -> None:
        self._modes, self._mean, self._rates = modes, mean, rates
        self._amplitudes, self._slopes = amplitudes, 2 * coefficients
        self._highest = int(np.max(np.abs(modes), initial=0))
        self._at_start = self._at(start[None])[0]
        #: The most that δ may be.
        self.reach = 2 * float(np.sum(np.abs(amplitudes))) / mean

    def offsets(self, uniform: Array) -> Array:
        """Return δ (N,) at the phases z⁰ + Ωt (N, g): F_0 δ + S(z⁰ + Ωt + fδ) = S(z⁰), by Newton's
        method; dt/dτ₁ > 0.
        """

        def excess(delta: Array, rows: Rows) -> tuple[Array, Array]:
            value, slope = self._at(uniform[rows] + delta[:, None] * self._rates)
            return self._mean * delta + value - self._at_start, self._mean + slope

        reach = np.full(len(uniform), self.reach)
        converged = _CONVERGED / float(np.max(np.abs(self._rates)))
        return increasing_root(excess, np.zeros(len(uniform)), -reach, reach, converged)

    def _at(self, z: Array) -> Array:
        """Return the sums of sines and of cosines at phases (N, g), (2, N)."""
        result = np.empty((2, len(z)))
        block = max(1, _BLOCK // max(1, len(self._modes)))
        for first in range(0, len(z), block):
            checkpoint()
            rows = slice(first, first + block)
            forward = powers(2 * np.pi * z[rows].T, max(self._highest, 1))[: self._highest + 1]
            # k is the index: −1 stands last
            turns = np.concatenate([forward, np.conj(forward[:0:-1])])
            waves = turns[self._modes[:, 0], 0]
            for j in range(1, z.shape[1]):
                waves *= turns[self._modes[:, j], j]
            result[:, rows] = self._amplitudes @ waves.imag, self._slopes @ waves.real
        return result
