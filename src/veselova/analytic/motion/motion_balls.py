"""Motions to more digits than a double has, or with certified errors: digits are added until the
answer has those asked for.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.balls import Balls, balls
from veselova.analytic.motion.area_solution_balls import solution_in_balls
from veselova.analytic.motion.in_doubles import InDoubles
from veselova.analytic.motion.rest_balls import resting_series
from veselova.analytic.spectrum.moving_part import moving_part
from veselova.mechanics.core.budget import has_budget, limits
from veselova.mechanics.core.decimals import FEWEST_DIGITS, Decimals, Later
from veselova.mechanics.core.enclosures import Pair
from veselova.mechanics.core.errors import InvalidInput, OverBudget, Unsolved
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.tunings import BALL_THETA_SIZE
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

#: Derived: significant digits of the numbers given out, beyond those asked for: the radius of a
#: component of size one is not rounding.
_SHOWN = 3

#: −x to the last digit, whatever the caller's context of decimals.
_negative = np.frompyfunc(Decimal.copy_negate, 1, 1)


@dataclass(frozen=True)
class MotionInBalls:
    """A motion that can be asked for times, with ``digits`` correct digits after the point in q and
    frame.
    """

    problem: TorusProblem
    digits: int
    certified: bool
    method: str | None

    def __post_init__(self) -> None:
        if self.problem.axes is not None:
            field = "digits" if self.digits > FEWEST_DIGITS else "certified"
            raise InvalidInput(
                (field,),
                "A as n numbers or a diagonal matrix (other principal axes are no exact numbers)",
                "A as a matrix",
            )

    def __call__(self, times: Any) -> Trajectory:
        """Return the trajectory at times; raises Unsolved as EnclosedSolution does, and where
        digits cannot be reached.
        """
        began = time.perf_counter()
        asked = TimeGrid.of(times, exact=True)
        exact = asked.exact
        if not (
            any(self.problem.exact.tangent) or (self.problem.time == "tau1" and self.problem.moves)
        ):
            return self._resting(asked, began)
        if len(exact) > _MOST_TIMES:
            required = f"{_MOST_TIMES} times at most, where digits > {FEWEST_DIGITS} or certified"
            raise InvalidInput(("times",), required, f"{len(exact)} times")
        if has_budget():
            return self._moving(asked, began)
        try:
            with limits(_LONGEST_S, None):
                return self._moving(asked, began)
        except OverBudget:
            remedy = "ask for fewer digits, or nearer or fewer times, or allow more by budget_s"
            reason = f"more than {_LONGEST_S:g} s of work; {remedy}"
            raise Unsolved("too-costly", reason) from None

    def _moving(self, asked: TimeGrid, began: float) -> Trajectory:
        """Return the trajectory of a motion that does not rest."""
        exact, grid = asked.exact, asked.doubles
        coarse = self._in_doubles()
        cycles = coarse.cycles(grid)
        ends = np.unique([grid[0], 0.0, grid[-1]])
        reach = float(np.max(np.abs(coarse.tau1(ends))))
        method = self.method or self._cheaper(coarse)
        working = self.digits + _SPARE + math.ceil(math.log10(1 + cycles))
        # phases hardly move with the angles there
        if method == "angles" and coarse.near_separatrix:
            working += math.ceil(-math.log10(coarse.narrowest_gap))
        for _ in range(_ATTEMPTS):
            try:
                found, details = self._attempt(coarse, method, working, exact, reach)
            except ZeroDivisionError:  # a ball that should be away from zero is not: too few digits
                working *= 2
                continue
            missing = found.missing(self.digits, working)
            if missing <= 0:
                details = {
                    "regime": coarse.kernel.regime,
                    "working_digits": working,
                    "certified": self.certified,
                    **details,
                }
                return self._trajectory(method, asked, found, details, began)
            working += missing + _MORE
        raise Unsolved(
            "no-digit-left", f"{self.digits} digits were not reached with {working} working digits"
        )

    def _in_doubles(self) -> InDoubles:
        """Return the motion in doubles, from which that in balls begins."""
        found = InDoubles(self.problem)
        try:
            _ = found.kernel
        except Unsolved as refusal:
            if refusal.outcome == "at-rest":  # beside a stable equilibrium
                further = f"; {FEWEST_DIGITS} digits, not certified, are those of rest"
                raise Unsolved(refusal.outcome, f"{refusal.reason}{further}") from None
            raise
        return found

    def _cheaper(self, coarse: InDoubles) -> str:
        """Return the route that takes less: theta sums are short for n = 3, and near a separatrix
        at any n, but not bounded.
        """
        # beside a direction that doubles do not see sums cancel
        size = moving_part(self.problem).size
        harmless = size == coarse.kernel.moving.size <= BALL_THETA_SIZE and coarse.takes_theta
        short = coarse.near_separatrix or harmless
        return "theta" if short and not self.certified else "angles"

    def _resting(self, asked: TimeGrid, began: float) -> Trajectory:
        working = 2 * self.digits + _SPARE
        with balls(working, self.certified) as xp:
            found = _Found.of(
                self.problem, resting_series(self.problem, asked.doubles.size, xp), xp
            )
        details = {"regime": "rest", "working_digits": working, "certified": self.certified}
        return self._trajectory("rest", asked, found, details, began)

    def _trajectory(
        self, method: str, asked: TimeGrid, found: _Found, details: Mapping[str, Any], began: float
    ) -> Trajectory:
        if asked.places is not None:
            found = found.at(asked.places)
        decimals = found.decimals(self.digits, self.certified)
        arrays = {name: found.round_to_doubles(name) for name in self.problem.stored}
        error = np.nextafter(found.spread.astype(np.float64), np.inf)
        error = error + self.problem.rounding(arrays)
        provenance = Provenance(
            "analytic", method, self.digits, __version__, time.perf_counter() - began, details
        )
        return Trajectory(
            self.problem,
            asked.asked,
            error,
            arrays,
            provenance,
            self,
            decimals,
        )

    def _attempt(
        self,
        coarse: InDoubles,
        method: str,
        working: int,
        exact: tuple[Fraction | float, ...],
        reach: float,
    ) -> tuple[_Found, Any]:
        solution = solution_in_balls(coarse, working, self.certified, method, reach)
        with solution.arithmetic as xp:
            series, details = solution.series(xp.array(exact))
            return _Found.of(self.problem, series, xp), details


@dataclass(frozen=True)
class _Found:
    """The series of a problem in balls of an arithmetic, and the largest radius of those that are
    bounded at each time, (N,).
    """

    problem: TorusProblem
    arithmetic: Balls
    series: Mapping[str, Values]
    spread: Values

    @classmethod
    def of(cls, problem: TorusProblem, series: Mapping[str, Values], arithmetic: Balls) -> _Found:
        """Return the series with their radii, infinite where nothing is known of a number."""
        unknown = arithmetic.number(math.inf)
        radius = np.frompyfunc(lambda x: x.rad() if x.is_finite() else unknown, 1, 1)
        radii = [radius(series[name]).reshape(len(series[name]), -1) for name in problem.bounded]
        return cls(problem, arithmetic, series, np.max(np.concatenate(radii, axis=1), axis=1))

    def at(self, places: NDArray[np.intp]) -> _Found:
        """Return the series at the times of these places."""
        series = {name: values[places] for name, values in self.series.items()}
        return _Found(self.problem, self.arithmetic, series, self.spread[places])

    def missing(self, digits: int, working: int) -> int:
        """Return how many digits the largest error is above the one asked for; the rounding of
        decimals is part of it.
        """
        if not all(radius.is_finite() for radius in self.spread):
            return working
        with self.arithmetic as xp:
            (largest,), _ = xp.decimals(
                np.array([np.max(self.spread) + xp.number(10) ** (1 - digits - _SHOWN)]), _SHOWN
            )
        return digits + int(largest.adjusted()) + 1

    def round_to_doubles(self, name: str) -> NDArray[np.float64]:
        """Return the doubles nearest to the midpoints of a series."""
        return self.series[name].astype(np.float64)

    def decimals(self, digits: int, certified: bool) -> Decimals:
        """Return the decimals, made when they are asked for."""
        shown = digits + _SHOWN
        pairs: dict[str, Pair | Callable[[], Pair]] = {
            name: partial(self.arithmetic.decimals, values, shown)
            for name, values in self.series.items()
        }
        if "omega" in self.series:
            pairs["omega"] = partial(_skew, self.arithmetic, self.series["omega"], shown)
        return Decimals(digits, certified, Later(pairs, 0), Later(pairs, 1), self.problem.bounded)


def _skew(arithmetic: Balls, omega: Values, digits: int) -> Pair:
    """Return the decimals of skew matrices (N, n, n), of which the upper half is converted."""
    upper = np.triu_indices(omega.shape[1], 1)
    above, slack = arithmetic.decimals(omega[:, *upper], digits)
    return _square(above, np.asarray(_negative(above)), upper), _square(slack, slack, upper)


def _square(above: Values, below: Values, upper: tuple[Values, Values]) -> Values:
    """Return matrices (N, n, n) with zero diagonals from what stands above and below, (N,
    n(n−1)/2).
    """
    size = int(upper[1][-1]) + 1
    result = np.full((len(above), size, size), Decimal(0))
    result[:, upper[0], upper[1]], result[:, upper[1], upper[0]] = above, below
    return result
