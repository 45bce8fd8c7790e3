"""The closed-form motion of one problem in balls: every number of the chain with its error, to any
number of digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Values
from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.attitude.body_frame_balls import BodyFrame
from veselova.analytic.attitude.frame import Attitude, Frame
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.periods import Periods
from veselova.analytic.motion.drift_bound import PerturbationBound, estimate_growth
from veselova.analytic.motion.in_doubles import InDoubles
from veselova.analytic.motion.path_balls import Along, integrals
from veselova.analytic.motion.series_balls import States, series_of, to_all_directions
from veselova.analytic.motion.theta_quotients import ThetaQuotients
from veselova.analytic.motion.time_map_balls import choose_time_map, cost_of_modes
from veselova.analytic.spectrum.branch_points import Resolved, Spectrum, resolve_spectrum
from veselova.analytic.spectrum.moving_part import Moving, moving_part
from veselova.analytic.spectrum.polynomials import spheroconic
from veselova.analytic.theta.many_digits import ThetaInBalls
from veselova.analytic.time_map.analyticity_strip import Orbit
from veselova.analytic.time_map.fourier_balls import FourierTimeMapInBalls
from veselova.analytic.time_map.panels_balls import estimate_nodes
from veselova.analytic.time_map.rate import TimeRate, time_rate
from veselova.analytic.time_map.torus_series import NormalComponent
from veselova.analytic.time_map.torus_series_balls import SeriesInBalls
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.systems.rolling_veselova import RollingVeselova
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.tunings import BALL_PATH

__all__ = ["SolutionInBalls"]

#: Calibrated: relative gap below which no inversion in doubles begins one in balls.
_NARROWEST = 1e-20

#: Derived: digits of a share in |q|² and |q̇|² that doubles see.
_SMALL_SHARE = 200

#: Budget: the smallest movement along a direction that is followed, beside those along others.
_LEAST_DIGITS = 500

#: Derived: least distance of two branch points in doubles, whose squares of roots are to be doubles
#: too.
_LEAST_WIDTH = 1e-290

#: Budget: states between two checkpoints.
_BLOCK = 500

#: Budget: digits by which motions may part before a start that was moved is given up.
_MOST_GROWTH = 1000
_MOVED = (
    f"the start had to be moved, and the bound of its drift grows beyond 1e{_MOST_GROWTH} "
    "times the distance until then"
)


class SolutionInBalls:
    """The motion of a moving body in balls of so many working digits; use it ``with
    solution.arithmetic:``.

    ``coarse``: the same in double precision. ``certified``: all truncations are bounded (only
    angles can be); else estimated.
    ``method``: ``theta`` or ``angles``. ``reach``: the farthest Neumann time, in units where the
    largest I is 1. Where branch points coincide the start is moved. On a separatrix, and where
    errors are certified, it is moved by so little that a bound of Gronwall's kind keeps its motion
    as near to the given one as the digits ask for until then. Raises Unsolved (``not-enclosed``,
    ``too-far``) where a bound cannot be closed.
    """

    def __init__(
        self, coarse: InDoubles, digits: int, certified: bool, method: str, reach: float = 0.0
    ) -> None:
        problem = coarse.problem
        self._coarse = coarse
        given = self._given = moving_part(problem)
        if certified and (coarse.kernel.on_separatrix or coarse.narrowest_gap < _NARROWEST):
            reason = (
                "on and near a separatrix phases say little of the body, and theta functions "
                "are not bounded"
            )
            raise Unsolved("not-enclosed", reason)
        beyond = _digits_of_least(given, digits)
        found = resolve_spectrum(given, digits, Fraction(1, 10 ** (2 * digits + 10)), beyond)
        if certified and (found.separatrices or found.moving.size < given.size):
            raise Unsolved(
                "not-enclosed", f"a direction moves by less than 1e-{_LEAST_DIGITS} of the others"
            )
        self._is_bounded = found.moving != given and (certified or bool(found.separatrices))
        if self._is_bounded:
            growth = estimate_growth(found.spectrum, reach)
            if growth > _MOST_GROWTH:
                raise Unsolved("not-enclosed" if certified else "too-far", _MOVED)
            beyond = max(growth, beyond)
            found = resolve_spectrum(
                given, digits, Fraction(1, 10 ** (2 * digits + 10 + beyond)), beyond
            )
        self.problem = problem
        self.moving = found.moving
        self.separatrices = found.separatrices
        self.arithmetic: Any = balls(digits, certified)
        self.spectrum = found.spectrum
        fine: Any = self.spectrum.arithmetic
        with fine:
            curve = Curve.of(self.spectrum, self.arithmetic)
        with self.arithmetic:
            inversion = AbelJacobi(Periods(curve), AbelJacobi(Periods(_in_doubles(found.spectrum))))
            self.frame = Frame(inversion.periods, self.arithmetic.array(self.spectrum.signs))
            self._angles = inversion.periods.start_angles(self.spectrum)[None, :]
            rate = TimeRate.of(self.spectrum, inversion, problem.time)
            origin = inversion.map(self._angles)[0]
            frequencies = self._frequencies(inversion.periods)
            self.quotients: ThetaQuotients | None = None
            if method == "theta":
                theta = ThetaInBalls(inversion.periods.riemann_matrix, self.arithmetic)
                self.quotients = ThetaQuotients(theta, self.frame)
            time_rate = None if self.quotients is None else self.quotients.time_rate
            # beside a separatrix angles in doubles say little
            coarse_rates = None if coarse.near_separatrix else _rates_in_doubles(found, problem)
            orbit = Orbit(self.spectrum, rate, origin, frequencies, time_rate, coarse_rates)
            self.orbit = self._adapt(orbit)

    def _frequencies(self, periods: Periods) -> Values:
        """Return f."""
        return periods.frequencies

    def _adapt(self, orbit: Orbit) -> Orbit:
        """Return the orbit with the rates of this motion: those of the rank-one problem."""
        return orbit

    def _time_rate(self, attitude: Attitude) -> Values:
        """Return dτ₁/d(time) at attitudes, (N,)."""
        return time_rate(self.spectrum, self.problem.time, self.arithmetic)(attitude.q)

    def attitude(self, z: Values) -> Attitude:
        """Return the attitude at phases z (N, g), by theta functions or by inversion."""
        if self.quotients is not None:
            return self.quotients.at(z)
        return self.frame.at(self.orbit.rate.inversion.invert(z))

    def series(self, times: Values) -> tuple[Mapping[str, Values], Mapping[str, Any]]:
        """Return the series of a trajectory along the principal axes, by name, and what they took,
        at times (N,), exact and increasing.
        """
        xp = self.arithmetic
        problem = self.problem
        tau1, attitude, details = self._motion(times)
        velocity = attitude.q_prime * self._time_rate(attitude)[:, None]
        points = attitude.spheroconic
        if not points.size:
            points = spheroconic(attitude.q, self.spectrum.inverse, xp)
        unit = xp.number(self.moving.unit)
        points = to_all_directions(points / unit, self.moving.frozen, xp)
        states = States(
            tau1 * xp.sqrt(unit),
            self.body.to_axes(velocity),
            self.body.frames(attitude),
            points,
            self._displacement(times, tau1, self._takes_series(tau1, details["time_map"]))
            if "displacement" in problem.outputs
            else None,
        )
        return series_of(
            problem,
            states if self._drift is None else self._add_perturbation(states, self._drift, tau1),
            xp,
        ), details

    def _displacement(self, times: Values, tau1: Values, by_series: bool) -> Values:
        """Return the displacement of a ball that neither slips nor twists, (N, n−1): uniform along
        the momentum, and the integrals of (q',n_k) across it.
        """
        xp = self.arithmetic
        problem = self.problem
        assert isinstance(problem, RollingVeselova)
        if self._drift is not None:
            raise Unsolved("too-far", "on a separatrix the path of a ball has 15 digits")
        count = self.frame.periods.genus - 1
        if by_series:
            across = xp.array(np.zeros((len(tau1), count)))
            for k in range(count):
                across[:, k] = self.normal_series(k).integral(self.orbit, tau1)
        else:
            functions: list[Along] = [
                lambda attitude, k=k: attitude.components[:, k]  # type: ignore[misc]
                for k in range(count)
            ]
            across = integrals(self.orbit, self.attitude, functions, tau1)
        along = xp.sqrt(xp.number(problem.exact_square_of_speed)) * times
        return np.asarray(np.concatenate([across, along[:, None]], axis=1) @ self.body.rotation)

    def _takes_series(self, tau1: Values, time_map: str) -> bool:
        """Return whether Fourier series of a path take less than panels."""
        if "displacement" not in self.problem.outputs or time_map != FourierTimeMapInBalls.name:
            return False
        coarse = self._coarse
        if coarse.near_separatrix or not coarse.is_even:
            return False
        by_series = BALL_PATH * cost_of_modes(coarse, self.arithmetic.digits, len(tau1))
        return by_series < estimate_nodes(self.orbit, tau1.astype(float))

    def normal_series(self, k: int) -> SeriesInBalls:
        """Return the series of (q',n_{k+2}), of modes above the precision."""
        xp = self.arithmetic
        inversion = self.orbit.rate.inversion
        place = self.frame.periods.curve.place["c", k + 1]
        component = NormalComponent(inversion, 1.0, self.frame, place)
        points = xp.pi * np.asarray(self.frame.half_periods)
        products = np.prod(component.factors_at(points), axis=0)
        best = int(np.argmax(np.abs(products.astype(float))))
        scale = self.frame.at(points[best : best + 1]).components[0, k] / products[best]
        return SeriesInBalls.of(component, scale, xp.epsilon)

    def _add_perturbation(self, states: States, drift: PerturbationBound, tau1: Values) -> States:
        """Return the states of the moved start, widened to hold those of the given one."""
        xp = self.arithmetic
        unit = self.arithmetic.number(self.moving.unit)
        late, velocity, rotated, points = drift.bounds(tau1, xp)
        return States(
            xp.add_error(states.tau1, late * xp.sqrt(unit)),
            xp.add_error(states.velocity, velocity[:, None]),
            xp.add_error(states.frame, rotated[:, None, None]),
            xp.add_error(states.spheroconic, points[:, None] / unit),
        )

    def _motion(self, times: Values) -> tuple[Values, Attitude, Mapping[str, Any]]:
        """Return τ₁ and the attitude at the times, and what they took."""
        approximate = self._coarse.tau1(times.astype(float)) * math.sqrt(
            self._coarse.kernel.moving.unit / self.moving.unit
        )
        # Zero is exactly that, and a time below the range of doubles, or below the rounding of a
        # time map in doubles, is not.
        signs = np.array([0 if t == 0 else 1 if t > 0 else -1 for t in times])
        approximate = np.where(signs * approximate > 0, approximate, signs * np.finfo(float).tiny)
        time_map = choose_time_map(self.orbit, approximate, self._coarse, self.moving)
        tau1 = time_map.tau1(times, approximate)
        blocks = iterate(range(0, len(tau1), _BLOCK), "motion")
        parts = [self.attitude(self.orbit.phases(tau1[k : k + _BLOCK])) for k in blocks]
        details = {"time_map": time_map.name, "time_map_size": time_map.size}
        return tau1, Attitude.concatenate(parts), details

    @cached_property
    def body(self) -> BodyFrame:
        normals = np.asarray(self.frame.at(self._angles).normals[0])
        return BodyFrame(self.problem, self.moving, self.spectrum.q, normals, self.arithmetic)

    @cached_property
    def _drift(self) -> PerturbationBound | None:
        """Return how far the start that was moved may get from the given one, where that has to be
        bounded.
        """
        xp = self.arithmetic
        given = self._given
        if not self._is_bounded:
            return None
        drift = PerturbationBound.of(given, self.moving, xp)
        q = xp.array(self.problem.exact.q)
        turn = self.body.turn(drift.matrix, self.spectrum.constants, q / xp.sqrt(np.sum(q * q)))
        return replace(drift, frames=xp.upper_bound(turn).item())


def _rates_in_doubles(
    found: Resolved, problem: TorusProblem
) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Return d(time)/dτ₁ at phases (N, g), even in them, by angles in doubles."""
    inversion = AbelJacobi(Periods(_in_doubles(found.spectrum)))
    rate = TimeRate.of(found.spectrum.in_arithmetic(DOUBLE), inversion, problem.time)
    return lambda z: np.asarray(rate.at(inversion.invert(z)))


def _digits_of_least(given: Moving, digits: int) -> int:
    """Return the digits beyond which branch points are to coincide, so that the direction that
    moves least is kept.
    """
    share = given.least_share
    wanted = (share.denominator.bit_length() - share.numerator.bit_length()) * 3 // 10
    return (
        max(0, min(wanted, 2 * _LEAST_DIGITS) // 2 + 20 - 2 * digits)
        if wanted > _SMALL_SHARE
        else 0
    )


def _in_doubles(spectrum: Spectrum) -> Curve:
    """Return the curve from which inversions in balls start: widths that doubles cannot hold are
    taken for wider ones.
    """
    curve = Curve.of(spectrum, DOUBLE)
    places = np.arange(len(curve.branch_points))
    widths = np.maximum(np.abs(curve.differences), _LEAST_WIDTH)
    return replace(curve, differences=np.sign(places - places[:, None]) * widths)
