"""Fourier series on the torus of functions of period 2 in the phases, in balls: the determinants of
``torus_series`` to any number of digits, and what is made of them along an orbit.

Modes are kept doubled, M = 2m, with one entry more before them: they belong to the phases (turn,
z/2), of which the first is constant. What is left out is estimated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.numerics.fourier_sums import SumsOverPoints, sums_over_modes
from veselova.analytic.time_map.analyticity_strip import Orbit
from veselova.analytic.time_map.fourier import ColumnsForModes
from veselova.analytic.time_map.fourier_balls import MOST_MODES, FourierTimeMapInBalls
from veselova.analytic.time_map.fourier_modes import Integers, find_significant_modes
from veselova.analytic.time_map.torus_series import SeriesComponent

__all__ = ["GeneralFourierTimeMapInBalls", "SeriesInBalls"]

#: Calibrated: what the modes left out add up to, in units of the smallest kept for 1/(m·f), as in
#: ``fourier_balls``.
_TAIL = 4


@dataclass(frozen=True)
class SeriesInBalls:
    """Σ 2c cos 2π(M·z/2 + turn).

    - orders: (K, g+1) 1 or 0, for the turn of a quarter, and M
    - coefficients: (K,) c, balls
    - edge: (L, g+1) the orders next to those kept
    - smallest: the least |c| kept
    """

    orders: Integers
    coefficients: Values
    edge: Integers
    smallest: Any

    @classmethod
    def of(cls, component: SeriesComponent, scale: Any, smallest: Any) -> SeriesInBalls:
        """Return the series of ``scale`` times the determinants of a component, of all modes with
        |c| above ``smallest``. Raises Unsolved where these are too many.
        """
        xp: Any = component.inversion.arithmetic
        genus = component.inversion.periods.genus

        def made(weights: Values, G: Values, largest: int) -> SumsOverPoints:
            return SumsOverPoints(xp.turns(_with_turn(G / 2, xp)), weights, 2 * largest, xp)

        columns = ColumnsForModes(component, made)

        def determinants(orders: Integers) -> tuple[Values, NDArray[np.bool_]]:
            stacks = []
            for s, column in enumerate(columns(orders)):
                odd = component.odd[:, s]
                by_parity = [column.cosines(_flagged(orders, flag)) for flag in (False, True)]
                stacks.append(np.where(odd[None, :], by_parity[1], by_parity[0]))
            matrices = zip(*stacks, strict=True)
            values = [scale * xp.determinant(np.stack(row, axis=1)) for row in matrices]
            kept = np.array([bool(abs(value.mid()) > smallest) for value in values])
            return np.array(values, dtype=object), kept

        origin = np.zeros(genus, dtype=np.int64)
        origin[component.cut] = 1
        orders, values, edge = find_significant_modes(
            genus, determinants, 2 * MOST_MODES, origin=origin, stride=2
        )
        shifted = component.turn != 0
        return cls(_flagged(orders, shifted), values, _flagged(edge, shifted), smallest)

    def scaled(self, factor: Any) -> SeriesInBalls:
        """Return the series times a number, kept as far."""
        return SeriesInBalls(
            self.orders, factor * self.coefficients, self.edge, abs(factor) * self.smallest
        )

    def at(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the function at phases (N, g) in double precision."""
        phases = np.concatenate([np.full((len(z), 1), -0.25), z / 2], axis=1)
        cosines = np.cos(2 * np.pi * (phases @ self.orders.T))
        return np.asarray(2 * cosines @ self.coefficients.astype(float))

    def integral(self, orbit: Orbit, tau1: Values) -> Values:
        """Return the integral over τ₁ from zero to Neumann times (N,)."""
        xp: Any = orbit.rate.inversion.arithmetic
        doubled = DoubledOrbit(orbit)
        pace = self.orders @ doubled.frequencies
        amplitudes = self.coefficients / (xp.pi * pace)
        ends = np.concatenate([doubled.start[None, :], doubled.phases(tau1)])
        sums = sums_over_modes("sines", self.orders, amplitudes, xp.turns(ends), xp)
        elapsed = float(np.max(np.abs(tau1.astype(float)), initial=0.0))
        return np.asarray(xp.add_error(sums[1:] - sums[0], self.tail(orbit, elapsed)))

    def tail(self, orbit: Orbit, elapsed: float) -> Any:
        """Return about what the modes left out add to the integral until then."""
        every = np.concatenate([self.orders, self.edge]) @ DoubledOrbit(orbit).frequencies
        slowness = 1 / np.abs(every.astype(float))
        return _TAIL * self.smallest * float(np.linalg.norm(np.minimum(slowness, np.pi * elapsed)))


class DoubledOrbit:
    """An orbit in the phases (−¼, z/2)."""

    def __init__(self, orbit: Orbit) -> None:
        xp: Any = orbit.rate.inversion.arithmetic
        self._xp = xp
        self._orbit = orbit
        self.rate = orbit.rate
        self.start = _with_turn(orbit.start[None, :] / 2, xp)[0]
        self.frequencies = np.concatenate([xp.array([0]), orbit.frequencies / 2])

    def phases(self, tau1: Values) -> Values:
        """Return the phases at Neumann times (N,), (N, g+1)."""
        return _with_turn(self._orbit.phases(tau1) / 2, self._xp)


class GeneralFourierTimeMapInBalls(FourierTimeMapInBalls):
    """The Fourier time map of an orbit whose dt/dτ₁ has a part of period 2 in one phase.

    ``odd``: makes the series of that part, of modes above a number.
    """

    def __init__(
        self, orbit: Orbit, odd: Callable[[Any], SeriesInBalls], *, expected: float = 0.0
    ) -> None:
        self._odd = odd
        super().__init__(DoubledOrbit(orbit), expected=expected)  # type: ignore[arg-type]

    def _select_modes(self) -> tuple[Integers, Values, Integers]:
        modes, coefficients, edge = super()._select_modes()
        odd = self._odd(self._smallest)
        return (
            np.concatenate([_flagged(2 * modes, False), odd.orders]),
            np.concatenate([coefficients, odd.coefficients]),
            np.concatenate([_flagged(2 * edge, False), odd.edge]),
        )


def _flagged(orders: Integers, shifted: bool) -> Integers:
    """Return orders with the entry of the constant phase before them."""
    flags = np.full((len(orders), 1), int(shifted), dtype=np.int64)
    return np.concatenate([flags, orders], axis=1)


def _with_turn(halved: Values, xp: Any) -> Values:
    """Return phases (N, g) with −¼ before them."""
    turns = np.full((len(halved), 1), xp.number(-1) / 4, dtype=object)
    return np.asarray(np.concatenate([turns, halved], axis=1))
