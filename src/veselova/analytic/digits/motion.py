"""Motions to more digits than a double has, or with certified errors: digits are added until the
answer has those asked for.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.closed.area_veselova import AreaVeselova
from veselova.analytic.closed.bodies import AreaBody
from veselova.analytic.curve.moving_part import moving_part
from veselova.analytic.digits.body import series_of_body
from veselova.analytic.digits.frame import resting_series
from veselova.analytic.digits.orbit import InDoubles
from veselova.analytic.digits.solution import AreaSolutionInBalls, SolutionInBalls
from veselova.mechanics.core.budget import has_budget, limits
from veselova.mechanics.core.decimals import (
    FEWEST_DIGITS,
    SHOWN_DIGITS,
    Decimals,
    Later,
    Pair,
    decimal_pair,
)
from veselova.mechanics.core.errors import InvalidInput, OverBudget, Unsolved
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.version import __version__

__all__ = ["MotionInBalls"]

#: Calibrated: working digits beyond those asked for: what inversion, time map and frame of a
#: generic motion lose.
_SPARE = 8

#: Method: digits added beyond those that were missing, and attempts.
_MORE = 4
_ATTEMPTS = 6

#: Budget: seconds of work without a budget, and times: states of so many take about as long.
_LONGEST_S = 60.0
_MOST_TIMES = 100_000


@dataclass(frozen=True)
class MotionInBalls:
    """A motion as a function of time, with ``digits`` correct digits after the point in q and
    frame; ``body``: that which moves on the torus of the problem, None for the problem itself.
    """

    problem: TorusProblem
    digits: int
    certified: bool
    method: str | None
    body: AreaBody | None = None

    def __post_init__(self) -> None:
        if self.problem.axes is not None:
            field = "digits" if self.digits > FEWEST_DIGITS else "certified"
            raise InvalidInput(
                (field,),
                "A as n numbers or a diagonal matrix (other principal axes are not exact numbers)",
                "A as a matrix",
            )

    def __call__(self, times: Any) -> Trajectory:
        """Return the trajectory at times; raises Unsolved as SolutionInBalls does, and where digits
        cannot be reached.
        """
        began = time.perf_counter()
        asked = TimeGrid.of(times, exact=True)
        problem = self.problem
        if not (any(problem.exact.tangent) or (problem.time == "tau1" and problem.moves)):
            return self._trajectory(asked, began, *self._resting(len(asked.exact)))
        if len(asked.exact) > _MOST_TIMES:
            required = f"{_MOST_TIMES} times at most, where digits > {FEWEST_DIGITS} or certified"
            raise InvalidInput(("times",), required, f"{len(asked.exact)} times")
        if has_budget():
            return self._trajectory(asked, began, *self._moving(asked))
        try:
            with limits(_LONGEST_S, None):
                return self._trajectory(asked, began, *self._moving(asked))
        except OverBudget:
            remedy = "ask for fewer digits, or nearer or fewer times, or allow more by budget_s"
            reason = f"more than {_LONGEST_S:g} s of work; {remedy}"
            raise Unsolved("too-costly", reason) from None

    def _resting(self, count: int) -> tuple[str, Mapping[str, Values], int, Mapping[str, Any]]:
        """Return the method, the series, working digits and details of a problem at rest."""
        working = 2 * self.digits + _SPARE
        with balls(working, self.certified) as xp:
            series = self._given(resting_series(self.problem, count, xp))
            return "rest", series, working, {"regime": "rest"}

    def _given(self, series: Mapping[str, Values]) -> Mapping[str, Values]:
        """Return the series of what was asked for, from those of the problem on the torus."""
        if self.body is None:
            return series
        return series_of_body(self.body, self.problem, series, self.digits)

    def _moving(self, asked: TimeGrid) -> tuple[str, Mapping[str, Values], int, Mapping[str, Any]]:
        """Return the method, the series, working digits and details of a motion."""
        grid, coarse = asked.doubles, InDoubles(self.problem)
        ends = np.unique([grid[0], 0.0, grid[-1]])
        reach = float(np.max(np.abs(coarse.tau1(ends))))
        method = self.method or self._cheaper(coarse)
        working = self.digits + _SPARE + math.ceil(math.log10(1 + coarse.cycles(grid)))
        # phases hardly move with the angles there
        if method == "angles" and coarse.near_separatrix:
            working += math.ceil(-math.log10(coarse.narrowest_gap))
        kind = AreaSolutionInBalls if isinstance(self.problem, AreaVeselova) else SolutionInBalls
        for _ in range(_ATTEMPTS):
            try:
                solution = kind(coarse, working, self.certified, method, reach)
                with solution.arithmetic as xp:
                    series, details = solution.series(xp.array(asked.exact))
                    series = self._given(series)
                    missing = self._missing(series, working, xp)
            except ZeroDivisionError:  # a ball that should be away from zero is not: too few digits
                working *= 2
                continue
            if missing <= 0:
                return method, series, working, {"regime": coarse.kernel.regime, **details}
            working += missing + _MORE
        raise Unsolved(
            "no-digit-left", f"{self.digits} digits were not reached with {working} working digits"
        )

    @property
    def _asked(self) -> TorusProblem | AreaBody:
        """Return the problem of the trajectory."""
        return self.problem if self.body is None else self.body

    def _cheaper(self, coarse: InDoubles) -> str:
        """Return the route that takes less: theta sums are short for n = 3, and near a separatrix
        at any n, but not bounded.
        """
        # beside a direction that doubles do not see sums cancel
        seen = moving_part(self.problem).size == coarse.kernel.moving.size
        short = coarse.near_separatrix or (seen and coarse.takes_theta)
        return "theta" if short and not self.certified else "angles"

    def _missing(self, series: Mapping[str, Values], working: int, xp: Any) -> int:
        """Return how many digits the largest error is above the one asked for; the rounding of
        decimals is part of it.
        """
        bounded = np.concatenate([series[name].ravel() for name in self._asked.bounded])
        if not all(x.is_finite() for x in bounded):
            return working
        rounding = xp.number(10) ** (1 - self.digits - SHOWN_DIGITS)
        largest, _ = decimal_pair(max(x.rad() for x in bounded) + rounding, SHOWN_DIGITS)
        return self.digits + int(largest.item().adjusted()) + 1

    def _trajectory(
        self,
        asked: TimeGrid,
        began: float,
        method: str,
        series: Mapping[str, Values],
        working: int,
        details: Mapping[str, Any],
    ) -> Trajectory:
        if asked.places is not None:
            series = {name: values[asked.places] for name, values in series.items()}
        problem, shown = self._asked, self.digits + SHOWN_DIGITS
        pairs: dict[str, Pair | Callable[[], Pair]] = {
            name: partial(decimal_pair, values, shown) for name, values in series.items()
        }
        decimals = Decimals(
            self.digits, self.certified, Later(pairs, 0), Later(pairs, 1), problem.bounded
        )
        arrays = {name: series[name].astype(np.float64) for name in problem.stored}
        radii = [series[name].reshape(len(asked.asked), -1) for name in problem.bounded]
        spread = [max(float(x.rad()) for x in row) for row in np.concatenate(radii, axis=1)]
        error = np.nextafter(spread, np.inf) + problem.rounding(arrays)
        details = {"working_digits": working, "certified": self.certified, **details}
        provenance = Provenance(
            "analytic", method, self.digits, __version__, time.perf_counter() - began, details
        )
        return Trajectory(problem, asked.asked, error, arrays, provenance, self, decimals)
