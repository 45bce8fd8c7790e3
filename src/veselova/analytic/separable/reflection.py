"""Periods and the Abel–Jacobi map of a motion of which coordinates run into planes where V is −∞.

The quadratures are those of any separable motion. A coordinate that runs into a plane is thought to
turn back there, as a ball at a wall: then z is one-to-one with the angles on a torus, and inverted
on it; the motion ends at the first plane that is reached.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Sums
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.separable.open_interval import OpenInterval
from veselova.analytic.separable.periods import SeparatedPeriods

__all__ = ["ReflectedAbelJacobi", "ReflectedPeriods"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReflectedPeriods(SeparatedPeriods):
    """The period data of cuts some of which are open intervals.

    ``cut_series`` of an open interval are the coefficients of Chebyshev polynomials in 1 − 2θ/π on
    0 ≤ θ ≤ π.
    """

    @cached_property
    def cut_series(self) -> tuple[Array, ...]:
        """Return, per cut, the coefficients of du_k/dθ (signs included), shape (g, N_s)."""
        result = []
        for s, cut in enumerate(self.cuts):
            forms: Callable[[Array], Array] = partial(self.forms, s)
            if isinstance(cut, OpenInterval):
                forms = partial(_at_arcs, forms)
            result.append(self.cosine_coefficients(forms))
        return tuple(result)

    @cached_property
    def half_integrals(self) -> tuple[Array | None, ...]:
        """Return, per open interval, the coefficients (g, N_s+1) of ∫_0^θ du_k, divided by π/2."""
        return tuple(
            np.asarray(-chebyshev.chebint(series, lbnd=1, axis=1))
            if isinstance(cut, OpenInterval)
            else None
            for cut, series in zip(self.cuts, self.cut_series, strict=True)
        )

    @cached_property
    def cycles(self) -> Array:
        """Return a, shape (g, g): twice the integral over an open interval."""
        columns = []
        for series, integral in zip(self.cut_series, self.half_integrals, strict=True):
            if integral is None:
                columns.append(2 * np.pi * series[:, 0])
            else:
                columns.append(np.asarray(np.pi * chebyshev.chebval(-1.0, integral.T)))
        return np.stack(columns, axis=-1)


class ReflectedAbelJacobi(AbelJacobi[ReflectedPeriods]):
    """The map of angles θ of a motion with open intervals to phases z, and back."""

    @cached_property
    def _closed(self) -> tuple[tuple[Sums, Sums] | None, ...]:
        """Return, per cut between turning points, the map beyond θ/2π and its derivative."""
        result: list[tuple[Sums, Sums] | None] = []
        periods = self.periods
        for series, integral in zip(periods.cut_series, periods.half_integrals, strict=True):
            if integral is None:
                by_order = (periods.inverse_cycles @ series).T[None]
                orders = np.arange(1, by_order.shape[1])[:, None]
                sines = DOUBLE.sine_sums(np.ascontiguousarray(by_order[:, 1:] / orders))
                result.append((sines, DOUBLE.cosine_sums(np.ascontiguousarray(by_order))))
            else:
                result.append(None)
        return tuple(result)

    @cached_property
    def _open(self) -> tuple[tuple[Array, Array] | None, ...]:
        """Return, per open interval, the coefficients (N, g) of z and of dz/dθ on 0 ≤ θ ≤ π."""
        periods = self.periods
        inverse = periods.inverse_cycles
        return tuple(
            None
            if integral is None
            else ((inverse @ integral).T * (np.pi / 2), (inverse @ series).T)
            for series, integral in zip(periods.cut_series, periods.half_integrals, strict=True)
        )

    @cached_property
    def rounding(self) -> Array:
        """Return the rounding of each phase over ε, (g,): as many cycles as it may swing by while
        one coordinate turns, or one.
        """
        sizes = sum(np.sum(np.abs(series[:, 1:]), axis=1) for series in self.periods.cut_series)
        return np.asarray(np.maximum(1.0, np.abs(self.periods.inverse_cycles) @ sizes))

    def map(self, psi: Array) -> Array:
        """Return z for angles θ of shape (N, g); θ_s + 2π adds one to z_s."""
        result = np.zeros_like(psi)
        for s, (closed, open_) in enumerate(zip(self._closed, self._open, strict=True)):
            theta = psi[:, s]
            if closed is not None:
                result[:, s] += theta / (2 * np.pi)
                result += closed[0](theta[:, None])
            elif open_ is not None:
                turns = np.rint(theta / (2 * np.pi))
                rest = theta - 2 * np.pi * turns
                result[:, s] += turns
                result += np.sign(rest)[:, None] * _sum(open_[0], np.abs(rest))
        return result

    def jacobian(self, psi: Array) -> Array:
        """Return ∂z_k/∂θ_s for angles of shape (N, g), shape (N, g, g) with k before s."""
        columns = []
        for s, (closed, open_) in enumerate(zip(self._closed, self._open, strict=True)):
            theta = psi[:, s]
            if closed is not None:
                columns.append(closed[1](theta[:, None])[:, :, 0])
            elif open_ is not None:
                rest = theta - 2 * np.pi * np.rint(theta / (2 * np.pi))
                columns.append(_sum(open_[1], np.abs(rest)))
        return np.stack(columns, axis=2)


def _at_arcs(function: Callable[[Array], Array], arc: Array) -> Array:
    """Return a function of θ at θ = π(1 − cos arc)/2."""
    return function(np.pi * np.sin(arc / 2) ** 2)


def _sum(coefficients: Array, theta: Array) -> Array:
    """Return Σ_m c_mk T_m(1 − 2θ/π), shape (N, K), at angles from 0 to π."""
    arc = 2 * np.arcsin(np.sqrt(np.minimum(theta / np.pi, 1.0)))
    return np.asarray(np.cos(np.arange(len(coefficients)) * arc[:, None]) @ coefficients)
