"""Integrals along an orbit, as Chebyshev series on adjoining panels of Neumann time, and the time
map by them: quadrature of dt/dτ₁. Cost grows with t, hardly with the genus.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.chebyshev import chebint
from numpy.typing import NDArray

from veselova.analytic.kernel.panels import place
from veselova.analytic.kernel.series import set_transform
from veselova.analytic.time_map.modes import LinearFlow
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.errors import Unsolved

__all__ = [
    "ChebyshevTimeMap",
    "Panels",
    "error_of_phases",
    "integrate_displaced",
    "integrate_together",
]

Array = NDArray[np.float64]

#: Method: points per panel.
_NODES = 24

#: Method: panels beyond an end, as ends come from means; none beyond one so near that going on,
#: where it is short, costs little.
_MARGIN = 2
_NEAR = 4

#: Calibrated: a series whose last coefficients fall below this part of its size is resolved; what
#: it leaves out counts as no less.
_TAIL = 4e-15

#: Calibrated: last coefficients that have not fallen to this part of what they were on a longer
#: panel are rounding, if they are below that part of the first.
_STALLED, _NOISE = 0.25, 1e-11

#: Derived: halvings of a panel before giving up: a jump, where a weak wall throws the point back,
#: then counts for less than the rounding of the integral.
_MOST_HALVINGS = 56

#: Budget: panels that may be halved at once, beyond some times those to begin with: a jump halves
#: two each time, and values without a digit halve all.
_MOST_HALVED = 2000
_MOST_HALVED_AGAIN = 8

#: Budget: nodes evaluated at once.
_BLOCK = 4096

#: Rounding of dt/dτ₁ that all panels share, in ε.
_SHARED_ROUNDING = 4 * float(np.finfo(float).eps)

#: Derived: step of a difference quotient in a phase.
_STEP = 1e-7


@dataclass(frozen=True)
class Panels:
    """τ₁ ↦ ∫_0^{τ₁} f(z) along an orbit, on P panels.

    - borders: (P+1,) in τ₁, zero among them
    - lengths: (P,)
    - integrals: (P, 2, N+1) coefficients of the integral from the left border, and of its
      derivative in x, −1 … 1 on a panel
    - values: (P+1,) of the integral at the borders
    - tails: (P+1,) what series and rounding leave out of them
    - mean_size: of f over τ₁
    """

    borders: Array
    lengths: Array
    integrals: Array
    values: Array
    tails: Array
    mean_size: float

    @classmethod
    def of(
        cls, lefts: Array, lengths: Array, coefficients: Array, tails: Array, sizes: Array
    ) -> Panels:
        """Return the integral from the coefficients (P, N) of f on panels in any order; tails (P,)
        are relative to sizes (P,).
        """
        order = np.argsort(lefts)
        left, lengths, sizes = lefts[order], lengths[order], sizes[order]
        borders = np.append(left, left[-1] + lengths[-1])
        slopes = coefficients[order] * (lengths / 2)[:, None]
        integrals = np.zeros((len(slopes), 2, slopes.shape[1] + 1))
        integrals[:, 0], integrals[:, 1, :-1] = chebint(slopes, lbnd=-1, axis=1), slopes
        # Over a panel T_k has an integral below 1/k; to what is left out comes the rounding of the
        # mean.
        relative = np.maximum(tails[order], _TAIL) / slopes.shape[1] + np.finfo(float).eps / 2
        over_panels = np.sum(integrals[:, 0], axis=1)  # at x = 1 every Chebyshev polynomial is one
        zero = int(np.searchsorted(borders, 0.0))
        values, from_zero = (
            _sum_panels(x, zero) for x in (over_panels, relative * sizes * lengths)
        )
        mean_size = float(sizes @ lengths / np.sum(lengths))
        return cls(borders, lengths, integrals, values, from_zero, mean_size)

    @property
    def size(self) -> int:
        """Return the number of nodes."""
        return int(self.integrals.shape[0] * (self.integrals.shape[2] - 1))

    def at(self, tau1: Array) -> Array:
        """Return the integrals from zero to Neumann times within the panels."""
        panel, x = self._places(tau1)
        return np.asarray(self.values[panel] + self.within(panel, x)[0])

    def integrand(self, tau1: Array) -> Array:
        """Return f at Neumann times within the panels."""
        panel, x = self._places(tau1)
        return np.asarray(2 / self.lengths[panel] * self.within(panel, x)[1])

    def _places(self, tau1: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the panels of Neumann times and where these lie in them, −1 … 1."""
        panel = self.panel_of(self.borders, tau1)
        return panel, 2 * (tau1 - self.borders[panel]) / self.lengths[panel] - 1

    def error(self, tau1: Array) -> Array:
        """Return the tails of the panels between zero and increasing Neumann times, twice."""
        return 2 * np.abs(np.interp(tau1, self.borders, self.tails))

    def panel_of(self, borders: Array, values: Array) -> NDArray[np.intp]:
        """Return the panels in which values lie, borders being those of τ₁ or of the integral."""
        return np.clip(
            np.searchsorted(borders, values, side="right") - 1, 0, self.integrals.shape[0] - 1
        )

    def find_arguments(self, values: Array) -> tuple[NDArray[np.intp], Array]:
        """Return where an increasing integral has values (N,): the panels, and the distances from
        their left borders. By Newton's method on the polynomials.
        """
        panel, x = self.panel_of(self.values, values), np.empty(len(values))
        for i, p in enumerate(panel.tolist()):
            integral, slopes = self.integrals[p]
            span, elapsed = self.values[p + 1] - self.values[p], values[i] - self.values[p]
            x[i] = place(slopes, integral, span, elapsed, 1.0)
        return panel, (x + 1) * (self.lengths[panel] / 2)

    def within(self, panel: NDArray[np.intp], x: Array) -> tuple[Array, Array]:
        """Return the integral from the panel's left border to x, and its derivative in x."""
        angle = np.arccos(np.minimum(np.maximum(x, -1.0), 1.0))
        exponentials = np.cos(np.arange(self.integrals.shape[2]) * angle[:, None])
        value, slope = (self.integrals[panel] @ exponentials[:, :, None])[:, :, 0].T
        return value, slope


def _sum_panels(over_panels: Array, zero: int) -> Array:
    """Return the sums at the borders, 0 at number ``zero``: outwards from it, so that far ones do
    not round near ones.
    """
    return np.concatenate(
        [-np.cumsum(over_panels[:zero][::-1])[::-1], [0.0], np.cumsum(over_panels[zero:])]
    )


def integrate_together(
    integrands: Callable[[Array], Array],
    in_tau1: LinearFlow,
    low: float,
    high: float,
    floor: float = 0.0,
    noise: float = 0.0,
) -> list[Panels]:
    """Return τ₁ ↦ ∫_0^{τ₁} f(z) of K functions along z = z⁰ + fτ₁ over a stretch of the orbit with
    low ≤ 0 ≤ high, and a margin, on the same panels.

    ``integrands`` gives them at phases z (N, g), shape (N, K). A panel is resolved to rounding of
    all means, or of ``floor`` where that is larger: an integrand that changes sign has means near
    zero. ``noise`` is what part of them the rounding of the values may be. Panels that are not
    resolved are halved, each for itself. An end at zero, where the integral is known, has no
    margin. Raises Unsolved (``narrow-gap``) where a spike is too short for that.
    """
    # of few bits: borders are exact multiples of it
    length = 2.0 ** math.floor(math.log2(0.5 / np.max(np.abs(in_tau1.rates))))
    before, after = math.ceil(-low / length), math.ceil(high / length)
    first = before + _MARGIN * (before > _NEAR)
    last = max(after + _MARGIN * (after > _NEAR), first == 0)
    lefts = np.arange(-first, last, dtype=float) * length
    lengths = np.full(lefts.size, length)
    most = _MOST_HALVED + _MOST_HALVED_AGAIN * lefts.size
    noise, negligible = max(_NOISE, noise), _TAIL * floor * length
    tails_before: Array = np.full((1, lefts.size), np.inf)
    done: list[tuple[Array, ...]] = []
    for _ in range(_MOST_HALVINGS):
        coefficients, sizes, tails = _series(integrands, in_tau1, lefts, lengths, floor)
        # A spike may be shorter than its phases are exact, and its series never end; a short one
        # needs no more than a long panel.
        resolved = (tails <= _TAIL) | ((tails <= noise) & (tails > _STALLED * tails_before))
        converged = np.all(resolved | (tails * sizes * lengths <= negligible), axis=0)
        found = coefficients, tails, sizes
        done.append((lefts[converged], lengths[converged], *(x[:, converged] for x in found)))
        if np.all(converged):
            lefts, lengths = (np.concatenate([part[k] for part in done]) for k in (0, 1))
            parts = (np.concatenate([part[k] for part in done], axis=1) for k in (2, 3, 4))
            return [Panels.of(lefts, lengths, *values) for values in zip(*parts, strict=True)]
        if np.count_nonzero(~converged) > most:
            break
        halves = lengths[~converged] / 2
        lefts = (lefts[~converged][:, None] + halves[:, None] * np.array([0.0, 1.0])).ravel()
        lengths = np.repeat(halves, 2)
        tails_before = np.repeat(tails[:, ~converged], 2, axis=1)
    raise Unsolved(
        "narrow-gap",
        "a spike along the orbit is narrower than the rounding of phases in doubles; integrate "
        "numerically",
    )


def integrate_displaced(
    integrand: Callable[[Array], Array],
    in_tau1: LinearFlow,
    low: float,
    high: float,
    floor: float = 0.0,
    noise: float = 0.0,
) -> list[Panels]:
    """Return the integrals of one function along an orbit, and along those whose phases are
    displaced by _STEP, one after the other; ``integrand`` gives it at phases z (N, g). Otherwise as
    ``integrate_together``.
    """
    steps = _STEP * np.eye(in_tau1.rates.size)

    def together(z: Array) -> Array:
        values = integrand(np.concatenate([z, *(z + step for step in steps)]))
        return np.asarray(values.reshape(1 + len(steps), -1).T)

    return integrate_together(together, in_tau1, low, high, floor, noise)


def error_of_phases(
    displaced: list[Panels], tau1: Array, of_start: Array, of_rates: Array
) -> Array:
    """Return how far errors of phases at the start and of frequencies, (g,) each, move an integral
    from zero to Neumann times, (N,).

    A constant error δ_k moves it by δ_k ∫∂f/∂z_k dτ, one of a frequency by as much of
    ∫τ ∂f/∂z_k dτ, τ that of the middle of each panel.
    """
    orbit, *others = displaced
    zero = int(np.searchsorted(orbit.borders, 0.0))
    middles = (orbit.borders[1:] + orbit.borders[:-1]) / 2
    left = orbit.panel_of(orbit.borders, tau1)
    error = np.zeros(tau1.size)
    for other, start, rate in zip(others, of_start, of_rates, strict=True):
        moved, at_borders = other.at(tau1) - orbit.at(tau1), other.values - orbit.values
        growing = _sum_panels(np.diff(at_borders) * middles, zero)[left]
        growing = growing + middles[left] * (moved - at_borders[left])
        error += (start * np.abs(moved) + rate * np.abs(growing)) / _STEP
    return error


def _series(
    integrands: Callable[[Array], Array],
    in_tau1: LinearFlow,
    lefts: Array,
    lengths: Array,
    floor: float,
) -> tuple[Array, Array, Array]:
    """Return the Chebyshev coefficients (K, P, nodes) on panels, their sizes and relative tails,
    (K, P). Phases of nodes are those of the border plus a short way.
    """
    points, to_coefficients = _chebyshev()
    offsets = (points * lengths[:, None])[:, :, None]
    z = in_tau1.phases(lefts)[:, None, :] + offsets * in_tau1.rates
    z = z.reshape(-1, z.shape[2])
    values = [
        integrands(z[first : first + _BLOCK])
        for first in iterate(range(0, z.shape[0], _BLOCK), "time map")
    ]
    together = np.ascontiguousarray(np.concatenate(values).T)
    coefficients = together.reshape(len(together), lefts.size, -1) @ to_coefficients
    # zero is resolved
    sizes = np.maximum(np.abs(coefficients[:, :, 0]), max(floor, np.finfo(float).tiny))
    return coefficients, sizes, np.max(np.abs(coefficients[:, :, -3:]), axis=2) / sizes


@lru_cache
def _chebyshev() -> tuple[Array, Array]:
    """Return the Chebyshev points of [0, 1], from 1 downwards, and what takes values there to
    coefficients.
    """
    to_coefficients = np.empty((_NODES, _NODES))
    set_transform(to_coefficients)
    psi = np.pi * (2 * np.arange(_NODES) + 1) / (2 * _NODES)
    return (np.cos(psi) + 1) / 2, to_coefficients.T


class ChebyshevTimeMap:
    """t(τ₁) by Chebyshev panels over a stretch of the orbit that holds the wanted times.

    ``rate`` gives dt/dτ₁ at phases z of shape (N, g); ``mean`` is F_0.
    """

    name = "panels"

    def __init__(
        self,
        rate: Callable[[Array], Array],
        mean: float,
        in_tau1: LinearFlow,
        earliest: float,
        latest: float,
    ) -> None:
        self._mean, self._in_tau1 = mean, in_tau1
        earliest, latest = min(earliest, 0.0), max(latest, 0.0)
        displaced = integrate_displaced(rate, in_tau1, earliest / mean, latest / mean)
        # The mean time map's estimate; extended where that was short.
        while displaced[0].values[0] > earliest or displaced[0].values[-1] < latest:
            ends = (border and 1.5 * border for border in displaced[0].borders[[0, -1]].tolist())
            displaced = integrate_displaced(rate, in_tau1, *ends)
        self._displaced, self.panels = displaced, displaced[0]

    @property
    def size(self) -> int:
        """Return the number of nodes."""
        return self.panels.size

    def error(self, tau1: Array, of_start: Array, of_rates: Array) -> tuple[Array, float]:
        """Return the panels' own error with that of phases, and the rounding of dt/dτ₁ that all
        panels share.

        The first is that of t divided by F_0, whatever dt/dτ₁ is along these panels: whoever takes
        it multiplies by F_0 over the rate at each time.
        """
        error = self.panels.error(tau1)
        error = error + error_of_phases(self._displaced, tau1, of_start, of_rates)
        return error / self._mean, _SHARED_ROUNDING

    def tau1(self, times: Array) -> tuple[Array, Array]:
        """Return (τ₁, z) at physical times within the panels, by Newton's method on the panel's
        polynomial.
        """
        panels = self.panels
        panel, offset = panels.find_arguments(times)
        z = self._in_tau1.phases(panels.borders[panel]) + offset[:, None] * self._in_tau1.rates
        return panels.borders[panel] + offset, z
