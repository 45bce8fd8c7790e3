"""Theta quotients at many times of an orbit by nonuniform fast Fourier transforms (finufft, extra
``fast``).

Along z = z_c + f(τ₁−τ_c) the theta functions with one ε are sums of the same waves, ε and δ in
halves as in analytic.theta,

    θ[ε;δ](z) = Σ_{x∈Z^g+ε} w_x e^{2πi x·(z_c+δ)} e^{2πi (x·f)(τ₁−τ_c)},   w_x = e^{−π xᵀTx},

which one transform of type 3 takes to any times of a window, at a cost that hardly grows with the
number of waves. The functions are real, so that one complex sum has two of them.

A transform rounds to some ε of Σw_x, whatever the value; and unlike the sums of analytic.theta
these cancel: where T is small θ(z) falls to e^(−π/4T) of Σw_x. The quotients are off by that
rounding over θ(z), which is stated for every time.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.trigonometric_sums import exponentials, turns
from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.theta.characteristic import Characteristic
from veselova.analytic.theta.lattice import RADIUS, lattice_points, points_within, small_norm
from veselova.analytic.theta.theta_quotients import ThetaQuotients
from veselova.mechanics.core.errors import BackendMissing, Unsolved

__all__ = ["Transforms"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: What a transform is asked for, relative to Σw_x; it gives no less in double precision.
_TOLERANCE = 1e-15

#: What it is off by in a window, in ε Σw_x; largest seen over random and adversarial starts: 92,
#: where there is but one wave.
_ROUNDING = 128.0

#: Cycles of the fastest wave in a window: over more of them the rounding of its phases outgrows the
#: transform's.
_CYCLES = 32.0

#: Times from which a window takes a transform, which begins with 1 ms for each ε; fewer take the
#: sums as they are.
_FEWEST = 64

#: Windows from τ₁ = 0 at which times have too few bits left to lie densely in one.
_FARTHEST = 2.0**32

#: Waves of all functions together: 300 MB of weights.
_MOST_WAVES = 2e7

#: i^m.
_QUARTER_TURNS = np.array([1, 1j, -1, -1j])

#: Entries of one block of (waves × times).
_BLOCK = 100_000


@dataclass(frozen=True)
class _Family:
    """The functions with one ε.

    places: theirs among all functions · orders (X, g): 2x of the waves · weights (M, X): w_x e^{2πi
    x·δ}, those of every other function as imaginary parts of the one before · size: Σw_x
    """

    places: list[int]
    orders: NDArray[np.int64]
    weights: Complex
    size: float

    @classmethod
    def of(
        cls, T: Array, epsilon: tuple[int, ...], members: list[tuple[int, Characteristic]]
    ) -> _Family:
        """Return the family of (place, characteristic) with all waves above e^−39 of
        the largest.
        """
        shift = np.array(epsilon) / 2
        x = lattice_points(T, float(np.sqrt(RADIUS**2 + small_norm(T, shift))), shift)
        orders = np.rint(2 * x).astype(np.int64)
        sizes = np.exp(-np.pi * np.sum((x @ T) * x, axis=1))
        weights = sizes * _QUARTER_TURNS[np.array([c.delta for _, c in members]) @ orders.T % 4]
        weights[: len(weights) // 2 * 2 : 2] += 1j * weights[1::2]
        return cls([place for place, _ in members], orders, weights[::2], float(np.sum(sizes)))

    def exponentials(self, z: Array) -> Complex:
        """Return e^{2πi x·z}, shape (X, N), at phases z (N, g)."""
        return exponentials(turns(np.pi * z, int(np.max(np.abs(self.orders)))), self.orders)

    def values(self, sums: Complex) -> Array:
        """Return the functions, shape (N, len(places)), from their sums (M, N)."""
        return (
            np.stack([sums.real, sums.imag], axis=1)
            .reshape(-1, sums.shape[1])[: len(self.places)]
            .T
        )


class Transforms:
    """The attitude along an orbit of one torus, whose phases move with the ``rates`` f, cycles per
    unit of τ₁.

    Raises BackendMissing without finufft, and Unsolved (``too-many-terms``) where sums over Z^g
    would fill the memory.
    """

    def __init__(self, quotients: ThetaQuotients, rates: Array) -> None:
        self._nufft = _load_nufft()
        self._quotients, self._rates, self._fastest = (
            quotients,
            rates,
            int(np.argmax(np.abs(rates))),
        )
        T = np.asarray(quotients.frame.periods.riemann_matrix, dtype=np.float64)
        expected = points_within(T, RADIUS) * len(quotients.functions)
        if not expected <= _MOST_WAVES:
            raise Unsolved(
                "too-many-terms",
                f"{expected:.1e} waves of all theta functions over Z^g; angles serve at any n",
            )
        members = defaultdict(list)
        for place, function in enumerate(quotients.functions):
            members[function.epsilon].append((place, function))
        self._families = [_Family.of(T, epsilon, given) for epsilon, given in members.items()]

    @property
    def size(self) -> int:
        """Return the number of waves of the denominator."""
        return len(self._families[0].orders)

    @cached_property
    def _rounding(self) -> float:
        """Return what a transform makes of the quotients, times θ(z)."""
        sizes = np.empty(len(self._quotients.functions))
        for family in self._families:
            sizes[family.places] = family.size
        of_numerators = np.max(np.abs(self._quotients.constants) * sizes[self._quotients.places])
        return float(_ROUNDING * np.finfo(float).eps * (of_numerators + sizes[0]))

    @cached_property
    def _window(self) -> float:
        return _CYCLES / max(
            float(np.max(np.abs(family.orders @ self._rates))) / 2 for family in self._families
        )

    def at(self, tau1: Array, z: Array) -> tuple[Attitude, Array]:
        """Return the attitude at increasing times τ₁ (N,) with phases z (N, g) modulo 2, and a
        bound on what the transforms add to its error, (N,).

        The phases are taken at their word: τ₁, whose digits far out are fewer, tells the cycles
        between them alone.
        """
        values = np.empty((tau1.size, len(self._quotients.functions)))
        keys = np.floor(tau1 / self._window)
        borders = np.concatenate([[0], np.flatnonzero(np.diff(keys)) + 1, [keys.size]])
        counts = np.diff(borders)
        dense = (counts >= _FEWEST) & (np.abs(keys[borders[:-1]]) < _FARTHEST)
        single = np.repeat(~dense, counts)
        values[single] = self._sum(z[single])
        for rows in (
            slice(first, last)
            for first, last in zip(borders[:-1][dense], borders[1:][dense], strict=True)
        ):
            values[rows] = self._transform(tau1[rows], z[rows])
        return self._quotients.attitude(values), self._rounding / np.abs(values[:, 0])

    def _sum(self, z: Array) -> Array:
        """Return the functions by the sums as they are."""
        values = np.empty((len(z), len(self._quotients.functions)))
        for family in self._families:
            block = max(1, _BLOCK // len(family.orders))
            for first in range(0, len(z), block):
                rows = slice(first, first + block)
                values[rows, family.places] = family.values(
                    family.weights @ family.exponentials(z[rows])
                )
        return values

    def _transform(self, tau1: Array, z: Array) -> Array:
        """Return the functions in one window by transforms around the time in its middle."""
        middle = tau1.size // 2
        rate = self._rates[self._fastest]
        cycles = z[:, self._fastest] - z[middle, self._fastest]
        cycles += 2 * np.rint(((tau1 - tau1[middle]) * rate - cycles) / 2)
        values = np.empty((tau1.size, len(self._quotients.functions)))
        for family in self._families:
            coefficients = family.weights * family.exponentials(z[middle : middle + 1])[:, 0]
            frequencies = np.pi * (family.orders @ self._rates)
            sums = self._nufft(
                frequencies, coefficients, cycles / rate, eps=_TOLERANCE, isign=1, nthreads=1
            )
            values[:, family.places] = family.values(np.atleast_2d(sums))
        return values


def _load_nufft() -> Callable[..., Any]:
    """Return finufft's transform of type 3 in one dimension."""
    try:
        from finufft import nufft1d3
    except ImportError:
        raise BackendMissing("finufft", "method='nufft'", "pip install finufft") from None
    return nufft1d3  # type: ignore[no-any-return]
