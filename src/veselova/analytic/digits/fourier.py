"""The Fourier time map in balls, for any time at all, to any number of digits.

t = F_0τ₁ + Σ_{m≠0} F_m (e^{2πi m·z} − e^{2πi m·z⁰})/(2πi m·f), F_m a determinant of one-variable
integrals
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import (
    SumsOverPoints,
    Values,
    doublings,
    interval_step,
    sums_over_modes,
)
from veselova.analytic.curve.kernel_text import text_over, zeros
from veselova.analytic.digits.orbit import Orbit
from veselova.analytic.digits.torus import TorusInBalls
from veselova.analytic.time_map.modes import LinearFlow, SumsOverModes
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["MOST_MODES", "FourierTimeMapInBalls"]

Integers = NDArray[np.int64]

#: Budget: modes looked at before giving up: minutes.
MOST_MODES = 200_000

#: Method: radians by one of ψ beyond those that modes ask for, at least: room for the next layers.
_SPARE_PACE = 16

#: Calibrated: what the modes left out add up to, in units of the smallest kept for 1/(m·f) or for
#: the time elapsed, those kept and those next to them: others fall off as fast as they came.
_TAIL = 4


class FourierTimeMapInBalls:
    """τ₁ at given times on one orbit, in balls, at a cost that does not grow with time. What is
    left out is estimated.

    Modes (M, g) with |F_m| above the precision are kept. ``expected``: about how many there are.
    """

    name = "fourier"

    def __init__(self, orbit: Orbit, expected: float = 0.0) -> None:
        self._orbit, self._xp = orbit, orbit.arithmetic
        self._mean = orbit.torus.mean
        self._smallest = self._mean * self._xp.epsilon
        self._modes, coefficients, edge = self._select_modes(expected)
        rates = self._modes @ orbit.frequencies
        self._amplitudes = coefficients / (self._xp.pi * rates)
        self._slopes = 2 * coefficients
        self._bend = np.sum(self._xp.upper_bound(2 * self._xp.pi * rates * self._slopes))
        #: 1/|m·f| of those kept and of those next to them.
        every = np.concatenate([self._modes, edge]) @ orbit.frequencies
        self._slowness = np.abs(1 / every).astype(float)
        flow = LinearFlow(orbit.start.astype(float), orbit.frequencies.astype(float))
        known = self._modes, coefficients.astype(float), float(self._mean)
        self._in_doubles = SumsOverModes(*known, flow)

    @property
    def size(self) -> int:
        """Return the number of modes kept, m and −m counted once."""
        return len(self._modes)

    def _select_modes(self, expected: float) -> tuple[Integers, Values, Integers]:
        """Return the modes m with |F_m| above the precision, F_m, and the modes next to them."""
        xp, torus = self._xp, self._orbit.torus
        scale, columns = torus.numbers.scale[0], _Columns(torus)

        def determinants(modes: Integers) -> tuple[Values, NDArray[np.bool_]]:
            stacks = [column.cosines(modes) for column in columns(modes)]
            rows = zip(*stacks, strict=True)
            found = [scale * xp.determinant(np.stack(row, axis=1)) for row in rows]
            large = np.array([bool(abs(value.mid()) > self._smallest) for value in found])
            return np.array(found, dtype=object), large

        return _find_significant_modes(torus.genus, determinants, expected)

    def tau1(self, times: Values) -> Values:
        """Return τ₁ = t/F_0 + δ at times (N,) given exactly: Newton's method for F_0 δ + P(z⁰ +
        (t/F_0 + δ)f) − P(z⁰) = 0.
        """
        xp = self._xp
        uniform = times / self._mean
        z = self._orbit.phases(uniform)
        delta = xp.array(self._in_doubles.offsets(z.astype(float)))
        for _ in doublings(xp.digits):
            value, slope = self._excess(z, delta)
            delta = xp.midpoints(delta - value / slope)
        value, slope = self._excess(z, delta)
        tau1 = uniform + delta
        tail = self._tail(float(np.max(np.abs(tau1.astype(float)))))
        return np.asarray(tau1 - interval_step(xp.add_error(value, tail), slope, self._bend, xp)[0])

    def _tail(self, elapsed: float) -> Any:
        """Return what the modes left out add up to in t after so much Neumann time: what a mode
        does to t grows until a half of its period, 1/(2 m·f).
        """
        lengths = np.minimum(self._slowness, math.pi * elapsed)
        return _TAIL * self._smallest * float(np.linalg.norm(lengths))

    def _excess(self, z: Values, delta: Values) -> tuple[Values, Values]:
        """Return F_0 δ + P(z + δf) − P(z⁰) and its slope."""
        orbit, xp = self._orbit, self._xp
        ends = np.concatenate([orbit.start[None, :], z + delta[:, None] * orbit.frequencies])
        turns = xp.turns(ends)
        first, *sines = sums_over_modes("sines", self._modes, self._amplitudes, turns, xp)
        cosines = sums_over_modes("cosines", self._modes, self._slopes, turns[1:], xp)
        return self._mean * delta + np.array(sines) - first, self._mean + cosines


class _Columns:
    """Sums over the weights of ``_column`` at nodes enough for the e^{−2πi m·G_s} of any modes;
    kept for modes that ask for no more.
    """

    def __init__(self, torus: TorusInBalls) -> None:
        self._torus = torus
        self._form(0.0)

    def _form(self, pace: float) -> None:
        # A wave of k radians a radian takes k nodes more of half a period than the forms. It is
        # analytic in their strip, where it is e^{πky/2} at most at height y (e^{ky}, but that G
        # bends at the edge), and k nodes leave e^{−2ky} of it.
        torus, xp = self._torus, self._torus.arithmetic
        self._most = math.ceil(pace + max(_SPARE_PACE, pace / 2))
        needed = max(x.shape[1] for x in torus.inversion.periods.cut_series)
        count = needed + self._most
        columns = [_column(torus, s, count) for s in range(torus.genus)]
        self._columns = [
            SumsOverPoints(xp.turns(G), weights, self._most, xp) for weights, G in columns
        ]
        #: Radians of 2πm·G_s by one of ψ for each entry of m, between nodes; entries count as well.
        self._paces = [
            np.eye(len(columns)),
            *(2 * count * np.diff(G.astype(np.float64), axis=0).T for _, G in columns),
        ]

    def __call__(self, modes: Integers) -> list[SumsOverPoints]:
        """Return the columns for modes (M, g)."""
        pace = max(float(np.max(np.abs(modes @ paces))) for paces in self._paces)
        if pace > self._most:
            self._form(pace)
        return self._columns


def _column(torus: TorusInBalls, s: int, count: int) -> tuple[Values, Values]:
    """Return the weights w_k at ``count`` nodes of a cut, shape (g, N), and G_s there, (N, g).

    The torus measure is the determinant of the forms over det a, so the mean of d(time)/dτ₁ times
    e^{−2πi m·z} is F_m = scale · det_{ks}[Σ_j w_kj cos(2π m·G_s(ψ_j))], the weights carrying a⁻¹:
    one-variable integrals only.
    """
    xp, known, periods = torus.arithmetic, torus.numbers, torus.inversion.periods
    psi, cut, angles = xp.nodes(count), periods.cuts[s], zeros((count, torus.genus))
    angles[:, s] = psi
    below, forms = cut.forms(psi)
    factor = text_over(xp).rate_factor(known.points, known.time[0], s, below)
    forms = (-1) ** (torus.genus - s - 1) * forms * factor
    weights = periods.inverse_cycles @ forms * (2 * xp.pi / count)
    return np.asarray(weights), torus.inversion.map(angles)


def _find_significant_modes(
    genus: int,
    coefficients: Callable[[Integers], tuple[Any, NDArray[np.bool_]]],
    expected: float,
) -> tuple[Integers, NDArray[Any], Integers]:
    """Return the modes m ≠ 0 (first nonzero entry positive) whose coefficients count, these, and
    the modes next to them.

    ``coefficients`` gives those of modes (M, g), and whether each is large enough. They fall off
    like the support function of a convex body, so the set is convex up to its edge: it is grown
    from zero through neighbours, in whichever directions it reaches far. Where A's nearly coincide
    so do rates of phases, and modes e_s − e_{s+1} are slow. Averages over fast phases are constant
    to first order, so sets Σm = 0 and 2 may be empty where Σm = 1 reaches far: such differences
    lead to neighbours too. ``expected``: about how many there are, to show progress. Raises
    Unsolved where too many have been looked at.
    """
    units = np.eye(genus, dtype=np.int64)
    steps = np.concatenate([units, -units, np.diff(units, axis=0), -np.diff(units, axis=0)])
    layer = np.zeros((1, genus), dtype=np.int64)
    seen = set(map(tuple, layer.tolist()))
    kept, found, edge = [], [], []
    while layer.size:
        checkpoint("Fourier modes", len(seen), max(expected, len(seen)) if expected else 0.0)
        values, large = coefficients(layer)
        kept.append(layer[large])
        found.append(values[large])
        edge.append(layer[~large])
        beside = (layer[large][:, None, :] + steps).reshape(-1, genus)
        first = beside[np.arange(len(beside)), np.argmax(beside != 0, axis=1)]
        beside = np.where(first[:, None] < 0, -beside, beside)
        # some may be met again much later, where rounding may take them for large
        fresh = sorted(set(map(tuple, beside.tolist())) - seen)
        seen.update(fresh)
        layer = np.array(fresh, dtype=np.int64).reshape(-1, genus)
        if len(seen) > 2 * MOST_MODES:  # those at the edge are among them
            reason = f"there are more than {MOST_MODES} Fourier modes"
            raise Unsolved("too-far", f"{reason}, and the time is too far for panels")
    modes, values = np.concatenate(kept), np.concatenate(found)
    moving = np.any(modes != 0, axis=1)
    return modes[moving], values[moving], np.concatenate(edge)
