"""Motions to more digits than a double has, or with certified errors, of problems on a torus and of
the bodies and balls in space that move with them: digits are added until the answer has those asked
for.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.balls import Values, balls
from veselova.analytic.closed.area_veselova import AreaVeselova, unit_of, vector_of
from veselova.analytic.closed.bodies import AreaBody
from veselova.analytic.curve.moving_part import moving_part
from veselova.analytic.digits.frame import frame_around, resting_series
from veselova.analytic.digits.orbit import InDoubles
from veselova.analytic.digits.solution import AreaSolutionInBalls, SolutionInBalls
from veselova.analytic.kernel.compiler import prepare
from veselova.mechanics.core.arguments import FEWEST_DIGITS
from veselova.mechanics.core.budget import has_budget, limits
from veselova.mechanics.core.decimals import (
    SHOWN_DIGITS,
    Decimals,
    Later,
    Objects,
    Pair,
    decimal_pair,
    exact_as,
    rational,
)
from veselova.mechanics.core.errors import InvalidInput, OverBudget, Unsolved
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.geometry.symmetric_axes import midpoints
from veselova.mechanics.results.sampled_motion import Provenance
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.rigid_body import RigidBody
from veselova.mechanics.systems.rolling_ball import RollingBall
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

#: Derived: digits beyond those asked for.
_SPARE_OF_START = 30

#: Derived: a column of the natural frame in double precision this near to one of many digits is
#: that one.
_NEARLY_NATURAL = 1e-9


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
        prepare()  # what compiles once is no work of this call
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
        return _series_of_body(self.body, self.problem, series, self.digits)

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


def _series_of_body(
    body: AreaBody, torus: TorusProblem, series: Mapping[str, Values], digits: int
) -> Mapping[str, Values]:
    """Return the series of a body by name, in the order of its outputs, from those of the problem
    on its torus; ``digits``: those of its start.

    Both frames are the same where (Ω,γ) = 0. Else E(t) = [v u −n](t) [v u −n](0)ᵀ E(0), and Ω =
    B(K + σγ) with K fixed in space. A ball is at x(0) − a·displacement.
    """
    frame, plane = series["frame"], None
    if isinstance(torus, AreaVeselova):
        at_start, momentum = _exact_start(body, digits)
        frame = frame @ exact_as(frame, np.array(torus.columns, dtype=object) @ at_start)
        plane = -(np.array(torus.plane, dtype=object) @ at_start[:, 1:])
        Omega = _angular_velocity(body, momentum, frame)
    else:
        Omega = np.cross(series["q_dot"], frame[:, :, 0])
    found: dict[str, Values] = {"Omega": Omega, "frame": frame}
    if isinstance(body, RollingBall):
        moved = series["displacement"]
        if plane is not None:
            moved = moved @ exact_as(moved, plane)
        start_point, radius = (exact_as(moved, x) for x in (body.ball.contact, body.ball.radius))
        found["position"] = start_point - radius * moved
    for name in body.derived:
        found[name] = body.derive(name, found)
    return {name: found[name] for name in body.outputs}


def _angular_velocity(body: AreaBody, momentum: tuple[Fraction, ...], frame: Values) -> Any:
    """Return Ω = B(K + σγ), σ = (c − (BK,γ))/(Bγ,γ), or D(BK,γ)/(1 − D(Bγ,γ))."""
    along, *across_gamma = momentum
    added, gamma = body.added, frame[:, :, 0]
    # (Ω,γ), which exceeds the others in small bodies, has no part in BK
    momentum = (Fraction(0) if added is None else along, *across_gamma)
    free = body.velocity_of(frame @ exact_as(frame, momentum))
    across = body.velocity_of(gamma)
    if added is None:
        share = exact_as(frame, along) - np.sum(free * gamma, axis=1)
        share = share / np.sum(across * gamma, axis=1)
    else:
        # 1 − D(Bγ,γ) = (Bγ,Iγ), without cancellation
        inertia = [moment - added for moment in body.moments]
        share = exact_as(frame, added) * np.sum(free * gamma, axis=1)
        share = share / np.sum(across * (exact_as(gamma, inertia) * gamma), axis=1)
    return free + share[:, None] * across


def _exact_start(body: RigidBody, digits: int) -> tuple[Objects, tuple[Fraction, ...]]:
    """Return the frame at t = 0, (3, 3), orthonormal, and the components of K along e_1, e_2, e_3,
    the first the area constant: rationals along the principal axes, which are exact, whose error is
    below 10^−digits.

    K = 𝓘Ω − (𝓘Ω,γ)γ + (Ω,γ)γ, or that of Chaplygin's ball, K = JΩ − D(Ω,γ)γ.

    The frame is the natural one of γ and γ̇ = γ×Ω where none was given and double precision knows
    it: γ, p/|p| and their vector product. Otherwise it is that in double precision, made
    orthonormal.
    """
    with balls(digits + _SPARE_OF_START) as xp:
        gamma = unit_of(vector_of(body.exact_gamma))
        Omega, moments = vector_of(body.exact_Omega), vector_of(body.moments)
        frame = _natural(gamma, Omega, moments, body) if body.exact_frame is None else None
        if frame is None:
            given = body.frame if body.exact_frame is None else body.exact_frame
            frame = frame_around(gamma, given, xp)
        M = Omega * moments
        shift = Omega @ gamma
        D = body.added
        shift = shift - M @ gamma if D is None else -vector_of([D])[0] * shift
        momentum = tuple(map(rational, (M + shift * gamma) @ frame))
        return np.frompyfunc(rational, 1, 1)(frame), momentum


def _natural(gamma: Objects, Omega: Objects, moments: Objects, body: RigidBody) -> Objects | None:
    """Return the columns γ, ±p×γ/|p|, ±p/|p| in the order and with the signs of the frame in
    double precision; None where it is another.
    """
    rate = np.cross(gamma, Omega)
    Aq, Av = gamma / moments, rate / moments
    p = midpoints((gamma @ Aq) * Av - (rate @ Aq) * Aq)
    if all(x == 0 for x in p):
        return None
    p = unit_of(p)
    found = [gamma]
    for near in body.frame.T[1:]:
        for vector in (p, np.cross(p, gamma)):
            cosine = float(np.dot(near, vector.astype(np.float64)))
            if abs(cosine) > 1 - _NEARLY_NATURAL:
                found.append(vector if cosine > 0 else -vector)
    return np.stack(found, axis=1) if len(found) == 3 else None
