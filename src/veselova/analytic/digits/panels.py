"""The time map in balls: Chebyshev series of dt/dτ₁, and of what a path integrates, on panels along
the orbit, to any number of digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import (
    LAST_COEFFICIENTS,
    Values,
    doublings,
    interval_step,
    is_shown,
)
from veselova.analytic.digits.orbit import Orbit
from veselova.analytic.kernel.panels import place
from veselova.analytic.kernel.series import integrate
from veselova.mechanics.core.budget import checkpoint, iterate
from veselova.mechanics.core.errors import Unsolved

__all__ = ["ChebyshevTimeMapInBalls", "estimate_nodes"]

#: Budget: points at once: their polynomials stay in the cache.
_POINTS = 1000

#: Derived: digits that recurrence loses in T_m: half a bit for every doubling of m, twice.
_RECURRENCE_DIGITS = 6

#: Method: half length of a panel in half widths of the strip: longer ones take hardly fewer nodes
#: for a length.
_PANEL_IN_STRIPS = 3.0

#: Method: half length of a panel in cycles of the fastest phase, where truncation is judged by the
#: coefficients themselves; at most so many half widths of the strip.
_PANEL_IN_CYCLES = 1.0
_LONGEST_IN_STRIPS = 8.0

#: Method: nodes per cycle and digit: of a long panel.
_NODES_PER_DIGIT = 2.6

#: Method: panels that show how many nodes all of them take.
_PROBED = 4

#: Calibrated: how much larger than the precision the last coefficients of a series may be (they are
#: rounding there), and how many times as many nodes are taken where they are larger.
_NEARLY, _MORE = 1e3, 1.25

#: Budget: nodes that are kept: a gigabyte; and those that are evaluated at once, which bounds the
#: rest.
_MOST_NODES = 1_000_000
_BLOCK = 5000

#: Derived: panels end a little beyond the last time, by a part of it and by cycles of the fastest
#: phase: the end comes from a time map in doubles, which has a relative and an absolute error.
_BEYOND = 1 + 1e-9
_CYCLES_BEYOND = 1e-12

#: Method: by how much panels are made longer where they end before the last time, at the least.
_LONGER = 1.25


def _chebyshev_sums(coefficients: Values, x: Values, arithmetic: Any) -> Values:
    """Return Σ_m c_cm T_m(x) at |x| ≤ 1 (N,), shape (N, C), from coefficients (C, M), balls."""
    sums = np.empty((len(x), len(coefficients)), dtype=object)
    for first in range(0, len(x), _POINTS):
        checkpoint()
        at = x[first : first + _POINTS]
        with arithmetic.at(arithmetic.digits + _RECURRENCE_DIGITS):
            table = np.stack(_polynomials(at, coefficients.shape[1]), axis=1)
        sums[first : first + _POINTS] = arithmetic.product(table, coefficients.T)
    return sums


def _polynomials(x: Values, count: int) -> list[Values]:
    """Return T_0(x) … : T_m = 2T_{m/2}T_{m−m/2} − T_{m mod 2}."""
    polynomials = [1 + 0 * x, x]
    for m in range(2, count):
        half = polynomials[m // 2]
        polynomials.append(2 * half * polynomials[m - m // 2] - polynomials[m % 2])
    return polynomials[:count]


Array = NDArray[np.float64]


class ChebyshevTimeMapInBalls:
    """τ₁ at given times on one orbit, in balls, and integrals along it.

    ``certified``: what series leave out follows from the strip of analyticity; otherwise from their
    last coefficients, which takes a third of the nodes. Raises Unsolved where the times are too far
    for panels.
    """

    name = "panels"

    def __init__(self, orbit: Orbit, approximate: Array, certified: bool) -> None:
        self._orbit, self._certified, self._xp = orbit, certified, orbit.arithmetic
        self._sides = {
            sign: self._panels(max(0.0, float(np.max(sign * approximate))), sign)
            for sign in (1, -1)
        }

    @property
    def size(self) -> int:
        """Return the number of nodes."""
        return sum(x.series[0].size for x in self._sides.values() if x is not None)

    def tau1(self, times: Values) -> Values:
        """Return τ₁ at times (N,), given exactly."""
        result = self._xp.array(np.zeros(times.shape))
        for sign, side in self._sides.items():
            chosen = np.flatnonzero([sign * t > 0 for t in times])
            if side is not None and chosen.size:
                farthest = np.max(sign * times[chosen])
                # on a separatrix doubles lose the motion, and with it how far panels have to go
                while not side.end >= farthest:
                    ratio = float(farthest / side.end) if side.end > 0 else 0.0
                    side = self._panels(float(side.reach) * max(_LONGER, ratio), sign)
                    assert side is not None
                self._sides[sign] = side
                result[chosen] = sign * side.roots(sign * times[chosen])
        return np.asarray(result)

    def integrals(self, tau1: Values, count: int) -> Values:
        """Return the integrals over τ₁ from zero of the ``count`` integrands after the rate, (N,
        count), at Neumann times (N,) within the panels.
        """
        result = self._xp.array(np.zeros((len(tau1), count)))
        for sign, side in self._sides.items():
            chosen = np.flatnonzero(sign * tau1.astype(float) > 0)
            if side is not None and chosen.size:
                result[chosen] = sign * side.values(sign * tau1[chosen])
        return np.asarray(result)

    def _panels(self, reach: float, direction: int) -> _Panels | None:
        if reach == 0:
            return None
        fastest = self._orbit.fastest
        reach = reach * _BEYOND + _CYCLES_BEYOND / fastest
        width, largest = self._orbit.strip
        if self._certified:
            count = math.ceil(reach / (2 * _PANEL_IN_STRIPS * width))
            # The strip, as wide as so many half panels, holds an ellipse of half axes with sum
            # 1/decay: a strip in the angle.
            ratio = 2 * count * width / reach
            decay = self._xp.number(1 / (ratio + math.sqrt(1 + ratio * ratio))) * (1 + 1e-12)
            nodes = math.ceil(self._xp.nats / -math.log(float(decay)))
            truncation = self._xp.bound_tail(largest, decay, nodes)
            panels = self._evaluate(reach, direction, count, nodes)
            truncations = self._xp.array([[truncation] * count])
            return replace(panels, truncation=truncations, steepest=largest / width)
        # Near a separatrix dt/dτ₁ varies much faster than any phase.
        longest = min(_PANEL_IN_CYCLES / fastest, _LONGEST_IN_STRIPS * width)
        count = math.ceil(reach / (2 * longest))
        self._require_few(count)
        # as of a function that is analytic in a strip as wide as the longest panel is half long
        decay = math.asinh(2 * longest * count / reach)
        nodes = math.ceil(self._xp.nats / decay) + LAST_COEFFICIENTS
        step = max(1, count // _PROBED)
        while True:
            panels = self._evaluate(reach, direction, count, nodes, step)
            series = panels.series.reshape(-1, nodes)
            last = series[:, -LAST_COEFFICIENTS:]
            middle = self._xp.midpoints(last)
            noise = np.sum(self._xp.upper_bound(last - middle), axis=1)
            # a path integrates functions of order one, of any mean
            sizes = series[:, 0].copy()
            sizes[len(panels.centres) :] = self._xp.number(1)
            rest = np.sum(self._xp.upper_bound(middle[:, -LAST_COEFFICIENTS:]), axis=1)
            if not np.all(rest <= _NEARLY * (noise + self._xp.epsilon * sizes)):
                nodes = math.ceil(_MORE * nodes)
            elif step > 1:
                relative = np.abs(series.astype(float) / sizes.astype(float)[:, None])
                counting = np.max(relative, axis=0) > float(self._xp.epsilon)
                step, nodes = 1, int(np.flatnonzero(counting)[-1]) + 1 + LAST_COEFFICIENTS
            else:
                truncation = self._xp.estimate_tail(series).reshape(-1, count)
                return replace(panels, truncation=truncation)

    def _require_few(self, nodes: int) -> None:
        if nodes > _MOST_NODES:
            wanted = (
                f"a time map of {self._xp.digits} digits would take {nodes:.3g} evaluations or "
                f"more at that time, and {_MOST_NODES} at most are kept"
            )
            raise Unsolved("too-far", f"{wanted}; ask for fewer digits or nearer times")

    def _evaluate(
        self, reach: float, direction: int, count: int, nodes: int, step: int = 1
    ) -> _Panels:
        """Return the series on every ``step``-th of so many panels."""
        self._require_few(count * nodes)
        xp = self._xp
        half = xp.number(reach) / (2 * count)
        centres = xp.array([half * (2 * p + 1) for p in range(0, count, step)])
        tau1 = direction * (centres[:, None] - half * xp.cos(xp.nodes(nodes))).ravel()
        blocks = iterate(range(0, len(tau1), _BLOCK), "time map")
        at = (self._orbit.phases(tau1[k : k + _BLOCK]) for k in blocks)
        values = np.concatenate([self._orbit.integrands(z) for z in at], axis=1)
        series = xp.cosine_series(values.reshape(-1, nodes)).reshape(len(values), -1, nodes)
        return _Panels(xp, half, centres, series, xp.array(np.zeros(series.shape[:2])), None)


def estimate_nodes(orbit: Orbit, approximate: Array) -> float:
    """Return about how many nodes panels to the farthest times take."""
    reach = max(0.0, float(np.max(approximate))) - min(0.0, float(np.min(approximate)))
    return reach * orbit.fastest * float(orbit.arithmetic.digits) * _NODES_PER_DIGIT


@dataclass(frozen=True)
class _Panels:
    """Series in cos mθ of functions of x = |τ₁| on panels x = centre − half·cos θ from 0 on, the
    first of them dt/dx.

    - series: (K, P, N); truncation: (K, P) what they leave out
    - steepest: a bound of |d²t/dx²|, None where there is none but that of the series, |dT_m/dx|
      ≤ m²/half
    """

    arithmetic: Any
    half: Any
    centres: Values
    series: Values
    truncation: Values
    steepest: Any

    @property
    def reach(self) -> Any:
        """Return |τ₁| at the end of the last panel."""
        return self.centres[-1] + self.half

    @property
    def end(self) -> Any:
        """Return t there, a ball."""
        return self._ends[0, -1]

    @cached_property
    def _coefficients(self) -> Values:
        """Return the d_k, k = 1…N, of integrals Σ_{k≥0} d_k cos kθ, (K, P, N): d_k = −half (c_{k−1}
        − c_{k+1})/2k with c_0 counted twice.
        """
        count = self.series.shape[2]
        zeros = self.arithmetic.array(np.zeros((*self.series.shape[:2], 2)))
        padded = np.concatenate([self.series, zeros], axis=2)
        padded[:, :, 0] = 2 * padded[:, :, 0]
        differences = padded[:, :, :count] - padded[:, :, 2:]
        return np.asarray(-self.half * differences / (2 * np.arange(1, count + 1)))

    @cached_property
    def _ends(self) -> Values:
        """Return the integrals at the ends of the panels, (K, P+1)."""
        xp = self.arithmetic
        spans = xp.add_error(
            -2 * np.sum(self._coefficients[:, :, ::2], axis=2), 2 * self.half * self.truncation
        )
        return np.concatenate([xp.array(np.zeros((len(spans), 1))), np.cumsum(spans, axis=1)], 1)

    def _constants(self, p: int) -> Values:
        """Return the d_0 of a panel, (K,)."""
        return np.asarray(self._ends[:, p] - np.sum(self._coefficients[:, p], axis=1))

    def roots(self, times: Values) -> Values:
        """Return x with t(x) = times."""
        last = len(self.centres) - 1
        places = np.searchsorted(self._ends[0, 1:].astype(float), times.astype(float))
        places = np.minimum(places, last)
        result = np.empty(times.shape, dtype=object)
        for p in iterate(np.unique(places).tolist(), "inverse time map"):
            rows = np.flatnonzero(places == p)
            result[rows] = self._roots_on(p, times[rows])
        return result

    def _roots_on(self, p: int, times: Values) -> Values:
        """Newton's method on midpoints from roots in doubles, then one step in intervals."""
        xp, centre, half = self.arithmetic, self.centres[p], self.half
        zero, rates = xp.array([0]), self.series[0, p]
        coefficients = np.concatenate([zero, self._coefficients[0, p]])
        both = np.stack([coefficients, np.concatenate([rates, zero])])
        local, truncation = times - self._constants(p)[0], self.truncation[0, p]

        def excess(x: Values) -> tuple[Values, Values]:
            value, rate = _chebyshev_sums(both, (centre - x) / half, xp).T
            value = xp.add_error(value - local, 2 * half * truncation)
            return value, xp.add_error(rate, truncation)

        lowest, highest = xp.midpoints(xp.array([centre - half, centre + half]))
        x = xp.midpoints(centre + half * xp.array(self._near(p, times)))
        for _ in doublings(xp.digits):
            value, rate = excess(x)
            x = xp.midpoints(x - value / rate)
            x = np.where(x < lowest, lowest, np.where(x > highest, highest, x))
        value, rate = excess(x)
        bend = self.steepest
        if bend is None:
            bend = xp.upper_bound(rates) @ np.arange(len(rates)) ** 2 / half
        step, reach = interval_step(value, rate, bend, xp)
        if self.steepest is not None and not is_shown(reach, rate, bend, xp):
            reason = "the inverse time map: no interval was proven to contain τ₁"
            raise Unsolved("not-enclosed", reason)
        return np.asarray(x - step)

    def _near(self, p: int, times: Values) -> list[float]:
        """Return roots on a panel in double precision, −1 … 1."""
        half, rates = float(self.half), self.series[0, p].astype(float)
        rates[1::2] = -rates[1::2]  # in (x − centre)/half, which is −cos θ
        integral = np.empty(rates.size + 1)
        span = integrate(rates, half, integral)
        elapsed: list[float] = (times - self._ends[0, p]).astype(float).tolist()
        return [place(rates, integral, span, x, half) for x in elapsed]

    def values(self, x: Values) -> Values:
        """Return the integrals of all functions but the first at x, (N, K−1)."""
        xp, half = self.arithmetic, self.half
        middle = xp.midpoints(x)
        spread = xp.upper_bound(x - middle)[:, None]
        places = (middle.astype(float) / (2 * float(half))).astype(int)
        places = np.minimum(places, len(self.centres) - 1)
        result = np.empty((len(x), len(self.series) - 1), dtype=object)
        for p in np.unique(places).tolist():
            rows, coefficients = np.flatnonzero(places == p), self._coefficients[1:, p]
            with_constant = np.concatenate([self._constants(p)[1:, None], coefficients], axis=1)
            steepest = np.sum(xp.upper_bound(self.series[1:, p]), axis=1) + self.truncation[1:, p]
            lost = 2 * half * self.truncation[1:, p] + spread[rows] * steepest
            sums = _chebyshev_sums(with_constant, (self.centres[p] - middle[rows]) / half, xp)
            result[rows] = xp.add_error(sums, lost)
        return result
