"""The time map in balls: Chebyshev series of dt/dτ₁ on panels along the orbit, to any number of
digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebval
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, LAST_COEFFICIENTS, Values
from veselova.analytic.numerics.chebyshev_balls import ChebyshevSeriesInBalls
from veselova.analytic.numerics.chebyshev_decay import MORE, SAMPLE, are_resolved, estimate_terms
from veselova.analytic.numerics.monotone_root import (
    Rows,
    doublings,
    increasing_root,
    interval_step,
    is_shown,
)
from veselova.analytic.time_map.analyticity_strip import Orbit
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.errors import Unsolved

__all__ = ["ChebyshevTimeMapInBalls", "estimate_nodes"]

#: Method: half length of a panel in half widths of the strip: longer ones take hardly fewer nodes
#: for a length.
_PANEL_IN_STRIPS = 3.0

#: Method: half length of a panel in cycles of the fastest phase, where truncation is judged by the
#: coefficients themselves; at most so many half widths of the strip.
_PANEL_IN_CYCLES = 1.0
_LONGEST_IN_STRIPS = 8.0

#: Method: nodes per cycle and digit.
_NODES_PER_DIGIT = 2.6

#: Budget: nodes that are kept: a gigabyte; and those that are evaluated at once, which bounds the
#: rest.
_MOST_NODES = 1_000_000
_BLOCK = 5000

#: Budget: panels looked at to see how fast series fall.
_SAMPLED_PANELS = 200

#: Derived: terms beyond those that the digits of a step ask for.
_EXTRA_TERMS = 6

#: Derived: panels end a little beyond the last time, by a part of it and by cycles of the fastest
#: phase: the end comes from a time map in doubles, which has a relative and an absolute error.
_BEYOND = 1 + 1e-9
_CYCLES_BEYOND = 1e-12

#: Method: by how much panels are made longer where they end before the last time, at the least.
_LONGER = 1.25

#: Derived: a root in double precision is taken where its residual is below this, in half lengths of
#: the panel.
_NEAR = 1e-6


class ChebyshevTimeMapInBalls:
    """τ₁ at given times on one orbit, in balls.

    ``certified``: what series leave out follows from the strip of analyticity; otherwise from their
    last coefficients, which takes a third of the nodes. Raises Unsolved where the times are too far
    for panels.
    """

    name = "panels"

    def __init__(
        self,
        orbit: Orbit,
        approximate: NDArray[np.float64],
        certified: bool,
    ) -> None:
        self._orbit = orbit
        self._certified = certified
        self._xp: Any = orbit.rate.inversion.arithmetic
        self._forward = self._panels(max(0.0, float(np.max(approximate))), 1)
        self._backward = self._panels(max(0.0, -float(np.min(approximate))), -1)

    @property
    def size(self) -> int:
        """Return the number of nodes."""
        return sum(side.rates.size for side in (self._forward, self._backward) if side is not None)

    def tau1(self, times: Values, approximate: NDArray[np.float64]) -> Values:
        """Return τ₁ at times (N,), given exactly, from approximate values."""
        result = self._xp.array(np.zeros(times.shape))
        for side, sign in ((self._forward, 1), (self._backward, -1)):
            chosen = np.flatnonzero(sign * approximate > 0)
            if side is not None and chosen.size:
                farthest = np.max(sign * times[chosen])
                # on a separatrix doubles lose the motion, and with it how far panels have to go
                while not side.end >= farthest:
                    ratio = float(farthest / side.end) if side.end > 0 else 0.0
                    side = self._panels(float(side.reach) * max(_LONGER, ratio), sign)
                    assert side is not None
                result[chosen] = sign * side.roots(sign * times[chosen], sign * approximate[chosen])
        return np.asarray(result)

    def integral(self, tau1: Values) -> Values:
        """Return the integral of the rate from zero to Neumann times (N,) within the panels."""
        approximate = tau1.astype(float)
        result = self._xp.array(np.zeros(tau1.shape))
        for side, sign in ((self._forward, 1), (self._backward, -1)):
            chosen = np.flatnonzero(sign * approximate > 0)
            if side is not None and chosen.size:
                result[chosen] = sign * side.values(sign * tau1[chosen])
        return np.asarray(result)

    def _panels(self, reach: float, direction: int) -> _Panels | None:
        if reach == 0:
            return None
        fastest = max(abs(float(f)) for f in self._orbit.frequencies)
        reach = reach * _BEYOND + _CYCLES_BEYOND / fastest
        if self._certified:
            width, largest = self._orbit.strip
            count = math.ceil(reach / (2 * _PANEL_IN_STRIPS * width))
            # The strip, as wide as so many half panels, holds an ellipse of half axes with sum
            # 1/decay: a strip in the angle.
            ratio = 2 * count * width / reach
            decay = self._xp.number(1 / (ratio + math.sqrt(1 + ratio * ratio))) * (1 + 1e-12)
            nodes = math.ceil(self._xp.nats / -math.log(float(decay)))
            truncation = self._xp.bound_tail(largest, decay, nodes)
            panels = self._evaluate(reach, direction, count, nodes)
            return replace(
                panels, truncation=self._xp.array([truncation] * count), steepest=largest / width
            )
        # Near a separatrix dt/dτ₁ varies much faster than any phase.
        count = math.ceil(
            reach / (2 * min(_PANEL_IN_CYCLES / fastest, _LONGEST_IN_STRIPS * self._orbit.strip[0]))
        )
        self._require_few(count)
        nodes = self._estimate_nodes(reach, direction, count)
        while True:
            panels = self._evaluate(reach, direction, count, nodes)
            last = panels.rates[:, -LAST_COEFFICIENTS:]
            middle = self._xp.midpoints(last)
            noise = np.sum(self._xp.upper_bound(last - middle), axis=1)
            if are_resolved(middle, noise, panels.rates[:, 0], self._xp):
                return replace(panels, truncation=self._xp.estimate_tail(panels.rates))
            nodes = math.ceil(MORE * nodes)

    def _estimate_nodes(self, reach: float, direction: int, count: int) -> int:
        """Return the nodes per panel that the decay of the series in double precision asks for."""
        if self._orbit.coarse_rates is None:
            return math.ceil(_NODES_PER_DIGIT * float(self._xp.digits))
        half = reach / (2 * count)
        theta = DOUBLE.nodes(SAMPLE)
        panels = np.unique(np.linspace(0, count - 1, _SAMPLED_PANELS).astype(np.int64))
        tau1 = direction * ((2 * panels[:, None] + 1) * half - half * np.cos(theta)).ravel()
        start, frequencies = (
            np.array([float(x) for x in v]) for v in (self._orbit.start, self._orbit.frequencies)
        )
        values = self._orbit.coarse_rates(start + tau1[:, None] * frequencies).reshape(
            len(panels), SAMPLE
        )
        return estimate_terms(values / values[:, :1], self._xp.digits)

    def _require_few(self, nodes: int) -> None:
        if nodes > _MOST_NODES:
            wanted = (
                f"a time map of {self._xp.digits} digits would take {nodes:.3g} evaluations or "
                f"more at that time, and {_MOST_NODES} at most are kept"
            )
            raise Unsolved("too-far", f"{wanted}; ask for fewer digits or nearer times")

    def _evaluate(self, reach: float, direction: int, count: int, nodes: int) -> _Panels:
        self._require_few(count * nodes)
        xp = self._xp
        half = xp.number(reach) / (2 * count)
        centres = xp.array([half * (2 * p + 1) for p in range(count)])
        exponentials = xp.cos(xp.nodes(nodes))
        tau1 = direction * (centres[:, None] - half * exponentials).ravel()
        blocks = iterate(range(0, len(tau1), _BLOCK), "time map")
        values = np.concatenate([self._orbit.rates(tau1[k : k + _BLOCK]) for k in blocks])
        return _Panels(
            xp,
            half,
            centres,
            xp.cosine_series(values.reshape(count, nodes)),
            xp.array([0] * count),
            None,
        )


def estimate_nodes(orbit: Orbit, approximate: NDArray[np.float64]) -> float:
    """Return about how many nodes panels to the farthest times take."""
    xp: Any = orbit.rate.inversion.arithmetic
    reach = max(0.0, float(np.max(approximate))) - min(0.0, float(np.min(approximate)))
    if xp.certified:
        # As many as a panel has, which is so many half widths of the strip long.
        decay = _PANEL_IN_STRIPS * 2 + math.hypot(1, _PANEL_IN_STRIPS * 2)
        panels = reach / (2 * _PANEL_IN_STRIPS * orbit.strip[0])
        return math.ceil(panels) * float(xp.nats) / math.log(decay)
    cycles = reach * max(abs(float(f)) for f in orbit.frequencies)
    return cycles * float(xp.digits) * _NODES_PER_DIGIT


@dataclass(frozen=True)
class _Panels:
    """Series in cos mθ of dt/dx on panels x = centre − half·cos θ from 0 on, x = |τ₁|.

    - rates: (P, N)
    - truncation: (P,) what they leave out
    - steepest: a bound of |d²t/dx²|, None where there is none but that of the series, |dT_m/dx|
      ≤ m²/half
    """

    arithmetic: Any
    half: Any
    centres: Values
    rates: Values
    truncation: Values
    steepest: Any

    @property
    def _certified(self) -> bool:
        return self.steepest is not None

    @property
    def reach(self) -> Any:
        """Return |τ₁| at the end of the last panel."""
        return self.centres[-1] + self.half

    @property
    def end(self) -> Any:
        """Return t there, a ball."""
        return self._ends[-1]

    @cached_property
    def _sensitivity(self) -> Values:
        if self._certified:
            return np.full(len(self.rates), self.steepest)
        return np.asarray(
            self.arithmetic.upper_bound(self.rates)
            @ np.arange(self.rates.shape[1]) ** 2
            / self.half
        )

    @cached_property
    def _exponentials(self) -> Values:
        """Return the d_k, k = 1…N, of t = Σ_{k≥0} d_k cos kθ: d_k = −half (c_{k−1} − c_{k+1})/2k
        with c_0 counted twice.
        """
        count, nodes = self.rates.shape
        padded = np.concatenate([self.rates, self.arithmetic.array(np.zeros((count, 2)))], axis=1)
        padded[:, 0] = 2 * padded[:, 0]
        return np.asarray(
            -self.half * (padded[:, :nodes] - padded[:, 2:]) / (2 * np.arange(1, nodes + 1))
        )

    @cached_property
    def _ends(self) -> Values:
        """Return t at the ends of the panels, (P+1,)."""
        spans = self.arithmetic.add_error(
            -2 * np.sum(self._exponentials[:, ::2], axis=1), 2 * self.half * self.truncation
        )
        return np.concatenate([self.arithmetic.array([0]), np.cumsum(spans)])

    def roots(self, times: Values, approximate: NDArray[np.float64]) -> Values:
        """Return x with t(x) = times, from approximate values."""
        places = np.searchsorted(self._ends[1:].astype(float), times.astype(float))
        panels, places = np.unique(np.minimum(places, len(self.centres) - 1), return_inverse=True)
        steps = {
            digits: self._series(panels, digits)
            for digits in [*doublings(self.arithmetic.digits), self.arithmetic.digits]
        }
        result = np.empty(times.shape, dtype=object)
        for place, panel in enumerate(iterate(panels.tolist(), "inverse time map")):
            rows = np.flatnonzero(places == place)
            time_maps = {digits: partial(series, place) for digits, series in steps.items()}
            result[rows] = self._roots_on(panel, time_maps, times[rows], approximate[rows])
        return result

    def values(self, x: Values) -> Values:
        """Return t(x), (N,)."""
        xp = self.arithmetic
        middle = xp.midpoints(x)
        spread = xp.upper_bound(x - middle)
        last = len(self.centres) - 1
        places = np.minimum((middle.astype(float) / (2 * float(self.half))).astype(int), last)
        panels, places = np.unique(places, return_inverse=True)
        series = self._series(panels, xp.digits)
        result = np.empty(x.shape, dtype=object)
        for place, p in enumerate(panels.tolist()):
            rows = np.flatnonzero(places == place)
            constant = self._ends[p] - np.sum(self._exponentials[p])
            value = constant + series(place, (self.centres[p] - middle[rows]) / self.half)[:, 0]
            steepest = np.sum(xp.upper_bound(self.rates[p])) + self.truncation[p]
            lost = 2 * self.half * self.truncation[p] + spread[rows] * steepest
            result[rows] = xp.add_error(value, lost)
        return result

    def _series(self, panels: NDArray[np.intp], digits: int) -> ChebyshevSeriesInBalls:
        """Return the series of t less a constant, and of dt/dx, on some panels, of as many terms as
        so many digits take.
        """
        xp = self.arithmetic
        zero = self.arithmetic.array(np.zeros((len(panels), 1)))
        both = [
            np.hstack([zero, self._exponentials[panels]]),
            np.hstack([self.rates[panels], zero]),
        ]
        terms = math.ceil(both[0].shape[1] * digits / xp.digits) + _EXTRA_TERMS
        with xp.at(digits) as fewer:
            return ChebyshevSeriesInBalls(np.stack(both, axis=1)[:, :, :terms], fewer)

    def _roots_on(
        self,
        p: int,
        time_maps: Mapping[int, Callable[[Values], Values]],
        times: Values,
        approximate: NDArray[np.float64],
    ) -> Values:
        """Newton's method on midpoints, then one step in intervals, with the series of each step by
        its digits.
        """
        xp = self.arithmetic
        centre = self.centres[p]
        constant = self._ends[p] - np.sum(self._exponentials[p])

        def time_map(x: Values, digits: int) -> tuple[Values, Values]:
            """Return t and dt/dx."""
            with xp.at(digits):
                value, rate = time_maps[digits]((centre - x) / self.half).T
                return xp.add_error(
                    constant + value, 2 * self.half * self.truncation[p]
                ), xp.add_error(rate, self.truncation[p])

        lowest, highest = xp.midpoints(xp.array([centre - self.half, centre + self.half]))
        x = self._near(
            p, (times - constant).astype(float), np.clip(approximate, float(lowest), float(highest))
        )
        for digits in doublings(xp.digits):
            value, rate = time_map(x, digits)
            x = xp.midpoints(x - (value - times) / rate)
            x = np.where(x < lowest, lowest, np.where(x > highest, highest, x))
        value, rate = time_map(x, xp.digits)
        step, reach = interval_step(value - times, rate, self._sensitivity[p], xp)
        if self._certified and not is_shown(reach, rate, self.steepest, xp):
            raise Unsolved(
                "not-enclosed", "the inverse time map: no interval could be shown to hold τ₁"
            )
        return np.asarray(x - step)

    def _near(self, p: int, local: NDArray[np.float64], approximate: NDArray[np.float64]) -> Values:
        """Return roots on a panel to double precision, from local times and approximate values,
        which may say nothing.
        """
        xp = self.arithmetic
        half = float(self.half)
        centre = float(self.centres[p])
        exponentials = np.concatenate([[0.0], self._exponentials[p].astype(float)])
        rates = half * self.rates[p].astype(float)

        def excess(
            u: NDArray[np.float64], rows: Rows
        ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            return chebval(-u, exponentials) - local[rows], chebval(-u, rates)

        start = (approximate - centre) / half
        value, slope = excess(start, slice(None))
        if np.all(np.abs(value) <= _NEAR * slope):
            return np.asarray(xp.array(approximate))
        one = np.ones(len(start))
        root = increasing_root(
            excess, np.clip(start, -1, 1), -one, one, np.sqrt(np.finfo(float).eps)
        )
        return np.asarray(xp.midpoints(self.centres[p] + self.half * xp.array(root)))
