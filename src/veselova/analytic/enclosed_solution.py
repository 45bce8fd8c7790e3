"""The closed-form motion of one problem in balls: every number of the chain with its error, to any number of digits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.abel_jacobi import AbelJacobi
from veselova.analytic.balls import balls
from veselova.analytic.clock import Clock, ClockRate, clock_rate
from veselova.analytic.curve import Curve
from veselova.analytic.drift import Drift, expected_growth
from veselova.analytic.enclosed_clock import EnclosedClock, expected_nodes
from veselova.analytic.enclosed_fourier import MOST_MODES, EnclosedFourier
from veselova.analytic.enclosed_frame import across, along_axes, directions, frame_around
from veselova.analytic.enclosed_theta import EnclosedTheta
from veselova.analytic.enclosed_windows import EnclosedWindows
from veselova.analytic.enclosure import enclosed, spheroconic
from veselova.analytic.frame import Attitude, Frame
from veselova.analytic.periods import Periods
from veselova.analytic.precision import DOUBLE, Values
from veselova.analytic.quotients import ThetaQuotients
from veselova.analytic.reduction import Moving, moving_part
from veselova.analytic.solution import WIDEST_RATE, Solution
from veselova.analytic.spectrum import Spectrum, resolved
from veselova.analytic.start import start
from veselova.analytic.strip import Orbit
from veselova.mechanics.errors import Unsolved

__all__ = ["EnclosedSolution", "series_of"]

#: A rotation this near to a matrix of signs is one: beyond, constants of motion are so close together that the natural frame of
#: the problem, in double precision, is taken for a given one.
_NEARLY_NATURAL = 1e-9

#: Relative gap below which no inversion in doubles begins one in balls.
_NARROWEST = 1e-20

#: Digits of a share in |q|² and |q̇|² that doubles see.
_SMALL_SHARE = 200

#: The smallest movement along a direction that is followed, beside those along others.
_LEAST_DIGITS = 500

#: Least distance of two branch points in doubles, whose squares of roots are to be doubles too.
_LEAST_WIDTH = 1e-290

#: Digits by which motions may part before a start that was moved is given up.
_MOST_GROWTH = 1000

#: Milliseconds with some _DIGITS (fewer and more change all of them alike, about), by genus, the last for all above: a node of
#: panels; a mode of the Fourier clock at once, where no cut takes more than _NODES in doubles, and with every time, which costs
#: more as the genus grows; and a time of that clock.
_NODE, _MODE = {1: 0.05, 2: 0.1, 3: 0.35, 4: 0.8}, {1: 1.0, 2: 0.22, 3: 0.22, 4: 0.6}
_MODE_AT_TIME, _TIME, _NODES = {1: 1.5e-4, 2: 1.5e-4, 3: 2e-4, 4: 6e-4}, 0.1, 36

#: The digits of those, by what power of them modes grow, whose sums are in balls for genus 1, and milliseconds beyond which modes
#: are not begun: minutes.
_DIGITS, _GROWTH, _LONGEST = 60, {1: 2.5, 2: 1.5, 3: 1.5, 4: 1.5}, 120_000


class EnclosedSolution:
    """The motion of a moving body in balls of so many working digits; use it ``with solution.arithmetic:``.

    ``coarse``: the same in double precision. ``certified``: all truncations are bounded (only angles can be); else estimated.
    ``method``: ``theta`` or ``angles``. ``reach``: the farthest Neumann time, in units where the largest I is 1. ``distance``: as
    in Solution. Raises Unsolved (``not-enclosed``) where a bound cannot be closed.
    """

    def __init__(
        self, coarse: Solution, digits: int, certified: bool, method: str, reach: float = 0.0, distance: Fraction | None = None
    ) -> None:
        problem, self._coarse = coarse.problem, coarse
        given = self._given = moving_part(problem)
        if certified and (coarse.separatrices or coarse.curve.narrowest_gap < _NARROWEST):
            reason = "on and near a separatrix phases say little of the body, and theta functions are not bounded"
            raise Unsolved("not-enclosed", reason)
        #: How far a start on a separatrix is moved.
        self.distance = Fraction(1, 10 ** (2 * digits + 10)) if distance is None else distance
        beyond = _digits_of_least(given, digits)
        found = resolved(given, digits, self.distance, beyond)
        if certified and (found.separatrices or found.moving.size < given.size):
            raise Unsolved("not-enclosed", f"a direction moves by less than 1e-{_LEAST_DIGITS} of the others")
        if certified and found.moving != given:
            growth = expected_growth(found.spectrum, reach)
            if growth > _MOST_GROWTH:
                raise Unsolved("not-enclosed", "the start had to be moved, and no bound of its drift holds for as long as that")
            found = resolved(given, digits, beyond=max(growth, beyond))
        self.problem, self.moving, self.separatrices = problem, found.moving, found.separatrices
        self.arithmetic: Any = balls(digits, certified)
        self.spectrum = enclosed(found)
        fine: Any = self.spectrum.arithmetic
        with fine:
            curve = Curve.of(self.spectrum, self.arithmetic)
        with self.arithmetic:
            inversion = AbelJacobi(Periods(curve), AbelJacobi(Periods(_in_doubles(found.spectrum))))
            begin = start(found.spectrum, curve, self.spectrum)
            self.frame, self._angles = Frame(inversion.periods, begin.signs), begin.angles[None, :]
            rate = ClockRate.of(self.spectrum, inversion, "t")
            origin, frequencies = inversion.map(self._angles)[0], inversion.periods.frequencies
            self._quotients: ThetaQuotients | None = None
            if method == "theta":
                theta = EnclosedTheta(inversion.periods.riemann_matrix, self.arithmetic)
                self._quotients = ThetaQuotients(theta, self.frame)
            stretch = None if self._quotients is None else self._quotients.stretch
            # Doubles do not see every direction that moves.
            in_angles = coarse.takes_rate_from_angles(coarse.default_method())
            coarse_rate = partial(coarse.rate_at, in_angles=in_angles) if coarse.moving.size == self.moving.size else None
            self.orbit = Orbit(self.spectrum, rate, origin, frequencies, stretch, coarse_rate)

    def series(self, times: Values, coarse: Clock) -> tuple[Mapping[str, Values], Mapping[str, Any]]:
        """Return the series of a trajectory along the principal axes, by name, and what they took.

        times (N,) exact, increasing · coarse: the clock in double precision, in units where the largest I is 1.
        """
        xp, moving, n = self.arithmetic, self.moving, self.problem.n
        tau1, attitude, details = self._motion(times, coarse)
        q_dot = self._along_axes(attitude.q_prime * clock_rate(self.spectrum, "t", xp)(attitude.q)[:, None])
        frame = np.empty((len(times), n, n), dtype=object)
        frame[:, :, 0] = self._along_axes(attitude.q)
        frame[:, :, 1:] = self._along_axes(attitude.normals @ self._rotation) + self._frozen_part
        points = attitude.spheroconic
        if not points.size:
            points = spheroconic(attitude.q, self.spectrum.inverse, xp)
        series = series_of(moving, q_dot, frame, points, tau1, xp)
        return (series if self._drift is None else self._drifted(series, self._drift, tau1)), details

    def _drifted(self, series: Mapping[str, Values], drift: Drift, tau1: Values) -> Mapping[str, Values]:
        """Return the series of the moved start, widened to hold those of the given one."""
        xp, unit = self.arithmetic, self.arithmetic.number(self.moving.unit)
        late, velocity, turned, points = drift.bounds(tau1, xp)
        q_dot = xp.widened(series["q_dot"], velocity[:, None])
        frame = xp.widened(series["frame"], turned[:, None, None])
        spheroconic = xp.widened(series["spheroconic"], points[:, None] / unit)
        return _with_derived(q_dot, frame, spheroconic, xp.widened(series["tau1"], late * xp.sqrt(unit)))

    def _motion(self, times: Values, coarse: Clock) -> tuple[Values, Attitude, Mapping[str, Any]]:
        """Return τ₁ and the attitude at the times, time by time or from windows, whichever costs less."""

        def sampled(t: NDArray[np.float64]) -> NDArray[np.float64]:
            attitude = self._coarse.attitude(coarse.tau1(t)[1], "angles")
            return np.concatenate([attitude.q, attitude.normals.reshape(len(t), -1)], axis=1)

        windows, size = None, self.moving.size
        if not (self.arithmetic.certified or self._coarse.near_separatrix):
            cycles = self._coarse.fastest * abs(float(times[-1] - times[0]))
            windows = EnclosedWindows.worth_while(times, cycles, sampled, self.arithmetic)
        while windows is not None:
            tau1, attitude, details = self._evaluated(windows.times, coarse)
            normals = attitude.normals if size != 3 else attitude.normals[:, :, :1]  # γ = ±q×n_2
            table = [tau1, attitude.q, attitude.components, normals.reshape(len(tau1), -1)]
            found = windows.at(times, np.column_stack(table))
            if found is not None:
                q, components, rest = found[:, 1 : 1 + size], found[:, 1 + size : 2 * size], found[:, 2 * size :]
                if size == 3:
                    handed = (across(attitude.q[:1], normals[:1, :, 0]) @ attitude.normals[0, :, 1])[0]
                    side = 1 if handed > 0 else -1 if handed < 0 else 1 / handed  # of a ball that holds zero, nothing known
                    rest = np.stack([rest, across(q, rest) * side], axis=2)
                return found[:, 0], Attitude(q, rest.reshape(len(times), size, -1), components, found[:, :0]), details
            windows = windows.finer()
        return self._evaluated(times, coarse)

    def _evaluated(self, times: Values, coarse: Clock) -> tuple[Values, Attitude, Mapping[str, Any]]:
        approximate = coarse.tau1(times.astype(float))[0] * math.sqrt(self._coarse.moving.unit / self.moving.unit)
        # Zero is exactly that, and a time below the range of doubles, or below the rounding of a clock in doubles, is not.
        signs = np.array([0 if t == 0 else 1 if t > 0 else -1 for t in times])
        approximate = np.where(signs * approximate > 0, approximate, signs * np.finfo(float).tiny)
        clock = self._clock(approximate)
        tau1 = clock.tau1(times, approximate)
        z = self.orbit.phases(tau1)
        attitude = self._quotients.at(z) if self._quotients is not None else self.frame.at(self.orbit.rate.inversion.invert(z))
        return tau1, attitude, {"clock": clock.name, "clock_size": clock.size, "evaluations": len(times)}

    def _clock(self, approximate: NDArray[np.float64]) -> EnclosedClock | EnclosedFourier:
        """Return the cheaper clock, or the other one where that has too many nodes or modes; only that of panels is bounded."""
        xp, genus, times = self.arithmetic, self.moving.size - 1, approximate.size
        kind = min(genus, max(_NODE))
        modes = self._coarse.modes * (xp.digits / DOUBLE.digits) ** genus
        # Next to a separatrix cuts take many nodes, and modes turn so much faster on them.
        forming = modes * _MODE[kind] * max(1.0, max(self._coarse.rate.needed_nodes) / _NODES) ** 2
        by_modes = forming + times * (modes * _MODE_AT_TIME[kind] + _TIME)
        by_panels = expected_nodes(self.orbit, approximate) * _NODE[kind]
        clocks: list[Callable[[], EnclosedClock | EnclosedFourier]]
        clocks = [partial(EnclosedClock, self.orbit, approximate, xp.certified)]
        # Of a direction that doubles do not see they say nothing.
        known = self._coarse.moving.size == self.moving.size and self.moving.rate_variation < WIDEST_RATE
        growth = (xp.digits / _DIGITS) ** _GROWTH[kind]
        if known and modes <= MOST_MODES and forming * growth <= _LONGEST and not xp.certified:
            clocks.insert(int(by_panels < by_modes), partial(EnclosedFourier, self.orbit))
        for clock in clocks[:-1]:
            with suppress(Unsolved):
                return clock()
        return clocks[-1]()

    @cached_property
    def _directions(self) -> Values:
        return directions(self.moving, self.arithmetic)

    def _along_axes(self, vectors: Values) -> Values:
        """Return vectors (N, m, …) along the directions that move by their components along the principal axes, (N, n, …)."""
        return along_axes(self.moving, self._directions, vectors)

    @cached_property
    def _start_frame(self) -> Values:
        """Return e_2 … e_n at t = 0: the given ones, made exactly orthonormal."""
        return frame_around(self._directions @ self.spectrum.q, self._rows, self.arithmetic)[:, 1:]

    @property
    def _rows(self) -> Any:
        return self.problem.exact.frame if self.problem.exact.frame is not None else self.problem.frame

    @cached_property
    def _natural_signs(self) -> NDArray[np.float64] | None:
        """Return ℜ where e_2 … e_n are the normals but for signs: in the natural frame, where nothing rests."""
        if not self.problem.exact.natural or self.moving.frozen:
            return None
        raw = self._start_normals.astype(float).T @ self.moving.directions.T @ self.problem.frame[:, 1:]
        signs = np.rint(raw)
        return signs if np.max(np.abs(raw - signs)) < _NEARLY_NATURAL else None

    @cached_property
    def _start_normals(self) -> Values:
        return np.asarray(self.frame.at(self._angles).normals[0])

    @cached_property
    def _rotation(self) -> Values:
        """Return the constant ℜ of (orth)."""
        if self._natural_signs is not None:
            return np.asarray(self.arithmetic.array(self._natural_signs))
        return np.asarray(self._start_normals.T @ self._directions.T @ self._start_frame)

    @cached_property
    def _drift(self) -> Drift | None:
        """Return how far the start that was moved may get from the given one, where that has to be bounded."""
        xp, given = self.arithmetic, self._given
        if not xp.certified or self.moving == given:
            return None
        drift = Drift.of(given, self.moving, xp)
        if self._natural_signs is None:
            q = xp.array(self.problem.exact.q)
            frames = [frame_around(x, self._rows, xp) for x in (q / xp.sqrt(np.sum(q * q)), self._directions @ self.spectrum.q)]
            return replace(drift, frames=np.sum(xp.at_most(frames[0] - frames[1])))
        # An eigenvector turns by at most 2√2 δT over the distance of its eigenvalue (Davis, Kahan; Yu, Wang, Samworth).
        constants = self.spectrum.constants
        gaps = [abs(x - y) for x, y in itertools.combinations(constants, 2)] + [xp.number(1)]
        inverse = sum((1 / gap for gap in gaps), xp.number(0))
        return replace(drift, frames=drift.matrix * (1 + 3 * len(constants) * inverse))

    @cached_property
    def _frozen_part(self) -> Any:
        """Return what stays of e_2 … e_n: their components along the directions that do not move."""
        if not self.moving.frozen:
            return 0
        return self._start_frame - self._directions @ (self._directions.T @ self._start_frame)


def _digits_of_least(given: Moving, digits: int) -> int:
    """Return the digits beyond which branch points are to coincide, so that the direction that moves least is kept."""
    share = given.least_share
    wanted = (share.denominator.bit_length() - share.numerator.bit_length()) * 3 // 10
    return max(0, min(wanted, 2 * _LEAST_DIGITS) // 2 + 20 - 2 * digits) if wanted > _SMALL_SHARE else 0


def _in_doubles(spectrum: Spectrum) -> Curve:
    """Return the curve from which inversions in balls start: widths that doubles cannot hold are taken for wider ones."""
    curve = Curve.of(spectrum, DOUBLE)
    places = np.arange(len(curve.branch_points))
    widths = np.maximum(np.abs(curve.differences), _LEAST_WIDTH)
    return replace(curve, differences=np.sign(places - places[:, None]) * widths)


def series_of(
    moving: Moving, q_dot: Values, frame: Values, spheroconic: Values, tau1: Values, arithmetic: Any
) -> Mapping[str, Values]:
    """Return the series of a trajectory by name, from q̇ and frame along the principal axes, λ and τ₁ of the moving part."""
    xp, unit = arithmetic, arithmetic.number(moving.unit)
    frozen = np.tile(xp.array([1 / a for a in moving.frozen]), (len(tau1), 1))
    coordinates = np.concatenate([spheroconic / unit, frozen], axis=1)
    order = np.argsort(coordinates.astype(float), axis=1, kind="stable")
    return _with_derived(q_dot, frame, np.take_along_axis(coordinates, order, axis=1), tau1 * xp.sqrt(unit))


def _with_derived(q_dot: Values, frame: Values, spheroconic: Values, tau1: Values) -> Mapping[str, Values]:
    product = frame[:, :, :1] * q_dot[:, None, :]
    omega = product - np.swapaxes(product, 1, 2)
    return {"q": frame[:, :, 0], "q_dot": q_dot, "frame": frame, "omega": omega, "spheroconic": spheroconic, "tau1": tau1}
