"""The closed form of a motion with more digits than a double has: the same document, its numbers
as decimal strings from ball arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from decimal import Decimal
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.motion.area_solution_balls import AreaSolutionInBalls, solution_in_balls
from veselova.analytic.motion.closed_form_area import no_series, places_of
from veselova.analytic.motion.precision_limits import require_digits, require_exact_axes
from veselova.analytic.motion.time_map_balls import estimate_modes, require_few_modes
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.motion.torus_solution_balls import SolutionInBalls
from veselova.analytic.theta.theta_quotients import ThetaQuotients
from veselova.analytic.time_map.fourier_balls import FourierTimeMapInBalls
from veselova.analytic.time_map.fourier_modes import largest_first
from veselova.analytic.time_map.torus_series_balls import SeriesInBalls
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.systems.area_start import AreaStart, exact_start
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rolling_veselova import RollingVeselova
from veselova.mechanics.systems.torus_problem import TorusProblem, on_torus
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["FAR_DIGITS", "decimal_fields", "torus_in_digits"]

#: Derived: digits of every number beyond those of the document: a time of 10^12 takes 12 of them.
FAR_DIGITS = 15

#: Calibrated: working digits beyond those of the numbers, and attempts, each with twice as many of
#: them.
_SPARE = 15
_ATTEMPTS = 4

#: Method: by how much the least coefficient is below the accuracy, at first: slow modes, and many
#: of them, move τ₁ by more than their coefficients.
_FEWER_MODES = 200.0


def torus_in_digits(given: Problem, digits: int) -> TorusProblem:
    """Return the problem on whose torus a motion runs, with data for a document of so many digits.
    Raises InvalidInput and Unsolved as ``on_torus`` does.
    """
    problem = on_torus(given)
    if isinstance(problem, AreaVeselova):
        assert isinstance(given, (VeselovaSO3, ChaplyginBall))
        require_digits(given, digits, False)
        return given.with_digits(digits + FAR_DIGITS + _SPARE)
    if isinstance(given, VeselovaSO3):
        require_exact_axes(given, digits, False)
        return given.rank_one()
    return problem


def decimal_fields(
    coarse: Solution, steepest: float, given: Problem, accuracy: float, digits: int
) -> dict[str, Any]:
    """Return the fields of the document whose numbers are decimals: strings of ``digits`` and
    FAR_DIGITS significant digits.

    ``coarse``: the motion on the torus in double precision; ``steepest``: its
    ``steepness_in_time``. Raises InvalidInput for A as a matrix,
    Unsolved where the digits are not reached.
    """
    if coarse.problem.axes is not None:
        raise InvalidInput(
            ("digits",),
            "A as n numbers (a matrix is diagonalised in double precision)",
            "A as a matrix",
        )
    counted = max(FEWEST_DIGITS, math.ceil(-math.log10(accuracy)))
    wanted = digits + FAR_DIGITS
    require_few_modes(coarse, counted, wanted + _SPARE)
    spare = _SPARE
    for _ in range(_ATTEMPTS):
        try:
            fine = solution_in_balls(coarse, wanted + spare, False, "theta", 0.0)
            with fine.arithmetic:
                fields = _Numbers(coarse, steepest, fine, wanted).fields(given, accuracy)
        except ZeroDivisionError:  # a ball that should be away from zero is not: too few digits
            fields = None
        if fields is not None:
            return fields
        spare = 3 * spare
    raise Unsolved("no-digit-left", f"{digits} digits were not reached with {wanted + spare}")


class _TooFewDigits(Exception):
    """A number is not known to the digits wanted."""


class _Numbers:
    """The numbers of one solution in balls, as texts of so many significant digits."""

    def __init__(
        self, coarse: Solution, steepest: float, fine: SolutionInBalls, wanted: int
    ) -> None:
        self._coarse = coarse
        self._steepest = steepest
        self._fine = fine
        self._xp = fine.arithmetic
        self._wanted = wanted

    @property
    def _quotients(self) -> ThetaQuotients:
        assert self._fine.quotients is not None
        return self._fine.quotients

    def _texts(self, values: Any) -> Any:
        """Return numbers as nested lists of texts; raises _TooFewDigits where the error of one is
        above its last digit but one, and above that of 1.
        """
        middle, radius = self._xp.decimals(np.asarray(values, dtype=object), self._wanted)
        least = Decimal(10) ** (2 - self._wanted)
        for x, r in zip(np.ravel(middle), np.ravel(radius), strict=True):
            if r > least * max(1, abs(x)):
                raise _TooFewDigits
        return np.vectorize(str, otypes=[object])(middle).tolist()

    def fields(self, given: Problem, accuracy: float) -> dict[str, Any] | None:
        """Return the fields; None where the balls are too wide."""
        try:
            found = {**self._attitude(), **self._time_map(accuracy)}
            if isinstance(self._fine, AreaSolutionInBalls):
                assert isinstance(given, (VeselovaSO3, ChaplyginBall))
                start = exact_start(given, self._wanted, _added(given))
                found["area"] = self._area(given, start, accuracy)
                if isinstance(given, RollingBall):
                    found["path"] = self._path(given, accuracy) | self._plane(start)
            elif isinstance(given, RollingBall):
                found["path"] = self._path(given, accuracy) | self._along_momentum()
        except _TooFewDigits:
            return None
        return found

    def _attitude(self) -> Mapping[str, Any]:
        fine = self._fine
        quotients = self._quotients
        if fine.moving.size != self._coarse.moving.size:
            raise Unsolved("no-closed-form", "a direction moves by less than doubles see")
        g = fine.moving.size - 1
        m = g + 1
        unit = self._xp.sqrt(self._xp.number(fine.moving.unit))
        constants = np.array(quotients.constants, dtype=object)
        constants[m : m + g] = constants[m : m + g] / unit
        pairs = [
            [place, text]
            for place, text in zip(quotients.places.tolist(), self._texts(constants), strict=True)
        ]
        columns = [pairs[m + g + k :: g] for k in range(g)]
        body = fine.body
        return {
            "A": self._texts(self._xp.array(self._coarse.problem.exact.A)),
            "riemann_matrix": self._texts(fine.orbit.rate.inversion.periods.riemann_matrix),
            "characteristics": [
                [[e / 2 for e in c.epsilon], [d / 2 for d in c.delta]] for c in quotients.functions
            ],
            "q": pairs[:m],
            "q_prime": pairs[m : m + g],
            "normals": columns[:-1],
            "gamma": columns[-1],
            "rotation": self._texts(body.rotation),
            "directions": self._texts(body.directions),
            "frozen": self._texts(body.frozen_part),
        }

    def _time_map(self, accuracy: float) -> Mapping[str, Any]:
        fine = self._fine
        xp = self._xp
        orbit = fine.orbit
        unit = xp.sqrt(xp.number(fine.moving.unit))
        uniform = self._coarse.problem.time == "tau1"
        place = int(self._quotients.places[2 * (fine.moving.size - 1)])
        mean = xp.number(1) if uniform else orbit.rate.mean / unit
        constant = xp.number(1) if uniform else orbit.rate_constant / unit
        return {
            "phases": self._texts(orbit.start),
            "frequencies": self._texts(orbit.frequencies / unit),
            "mean_rate": self._texts([mean])[0],
            **({"modes": [], "coefficients": []} if uniform else self._modes(accuracy)),
            "rate": {
                "characteristic": place,
                "constant": self._texts([constant])[0],
                "power": orbit.power,
            },
        }

    def _modes(self, accuracy: float) -> dict[str, Any]:
        """Return the fields of the modes that the accuracy asks for, and of their coefficients to
        the places that it asks for.

        The reach of a mode is that of ``analytic.motion.closed_form``.
        """
        coarse = self._coarse
        mean = float(self._fine.orbit.rate.mean)
        fastest = float(np.max(np.abs(coarse.in_tau1.rates)))
        cutoff = accuracy * fastest * mean / (_FEWER_MODES * max(1.0, self._steepest))
        expected = estimate_modes(coarse, -math.log10(accuracy), coarse.curve.genus)
        time_map = FourierTimeMapInBalls(self._fine.orbit, cutoff, expected=expected)
        # what is below the cutoff may move τ₁ by its part of the accuracy
        while (left := float(time_map.tail(np.inf)) * self._steepest / mean) > accuracy / 4:
            cutoff *= accuracy / (8 * left)
            time_map = FourierTimeMapInBalls(
                self._fine.orbit, cutoff, expected=expected, coarser=time_map
            )
        modes = time_map.modes
        pace = np.abs(modes @ self._fine.orbit.frequencies).astype(float)
        reach = 2 / (np.pi * np.maximum(pace, np.finfo(float).tiny) * mean) * self._steepest
        effects = np.abs(time_map.coefficients).astype(float) * reach
        selected = largest_first(effects, accuracy / 2)
        return self._rounded(
            modes[selected], time_map.coefficients[selected], reach[selected], accuracy
        )

    def _area(self, body: VeselovaSO3 | ChaplyginBall, start: AreaStart, accuracy: float) -> Any:
        """Return the field ``area``: ``closed_form_area`` has the same in doubles."""
        fine = self._fine
        assert isinstance(fine, AreaSolutionInBalls)
        torus = fine.problem
        reach = self._steepest / float(fine.orbit.rate.mean)
        if isinstance(body, RollingBall):
            reach = max(reach, abs(torus.across))
        added = _added(body)
        twists = added is not None
        inverse = [1 / Fraction(moment) for moment in body.moments]
        # −BI/D with I = 1/B − D
        form = inverse if added is None else [b - 1 / added for b in inverse]
        columns = np.array(torus.columns, dtype=object)
        return {
            "odd": self._series(fine.odd_series, reach, accuracy)
            if fine.has_odd_part
            else no_series(),
            "attitude": self._exact(columns @ np.array(start.frame, dtype=object)),
            "momentum": self._exact([start.momentum[0] if twists else 0, *start.momentum[1:]]),
            "inverse": self._exact(np.diag(np.array(inverse, dtype=object))),
            "form": self._exact(np.diag(np.array(form, dtype=object))),
            "constant": self._exact([0 if twists else start.momentum[0]])[0],
        }

    def _path(self, ball: RollingBall, accuracy: float) -> dict[str, Any]:
        """Return the radius, the start and the transverse series of a path."""
        fine = self._fine
        return {
            "radius": self._exact([ball.ball.radius])[0],
            "position": self._exact(ball.ball.contact),
            "transverse": [
                self._series(partial(fine.normal_series, k), 1.0, accuracy)
                for k in range(fine.moving.size - 2)
            ],
        }

    def _along_momentum(self) -> dict[str, Any]:
        torus = self._fine.problem
        assert isinstance(torus, RollingVeselova)
        return {
            "speed": self._texts([self._xp.sqrt(self._xp.number(torus.exact_square_of_speed))])[0]
        }

    def _plane(self, start: AreaStart) -> dict[str, Any]:
        """Return the directions of a path with an area constant, and its speed along n."""
        fine = self._fine
        assert isinstance(fine, AreaSolutionInBalls)
        torus = fine.problem
        horizontal = np.array(start.frame, dtype=object)[:, 1:]
        normal, across = -(np.array(torus.exact_plane, dtype=object) @ horizontal)
        rows = [normal]
        if fine.moving.size > 2:
            side = 1 if float(fine.body.rotation[0, 0]) > 0 else -1
            rows.insert(0, torus.sign * side * across)
        return {
            "speed": self._exact([torus.exact_uniform])[0],
            "odd": self._exact([-torus.exact_across])[0],
            "plane": self._exact(rows),
        }

    def _exact(self, values: Any) -> Any:
        """Return exact numbers as nested lists of texts."""
        return self._texts(self._xp.array(np.array(values, dtype=object)))

    def _series(
        self, make: Callable[[Any], SeriesInBalls], factor: float, accuracy: float
    ) -> dict[str, Any]:
        """Return the fields of a series whose integral over τ₁, times a factor, is wanted to an
        accuracy: ``make`` gives it to a least coefficient.
        """
        orbit = self._fine.orbit
        fastest = float(np.max(np.abs(self._coarse.in_tau1.rates)))
        smallest = accuracy * fastest / (_FEWER_MODES * factor)
        series = make(smallest)
        while (left := float(series.tail(orbit, np.inf)) * factor) > accuracy / 4:
            smallest *= accuracy / (8 * left)
            series = make(smallest)
        pace = np.abs((series.orders[:, 1:] @ orbit.frequencies).astype(float)) / 2
        reach = factor * 2 / (np.pi * np.maximum(pace, np.finfo(float).tiny))
        selected = largest_first(np.abs(series.coefficients).astype(float) * reach, accuracy / 4)
        fields = self._rounded(
            series.orders[selected][:, 1:],
            series.coefficients[selected],
            reach[selected],
            accuracy,
        )
        return {**fields, "turn": -0.25 if np.any(series.orders[:, 0]) else 0.0}

    def _rounded(
        self, modes: Any, coefficients: Values, reach: Any, accuracy: float
    ) -> dict[str, Any]:
        """Return the fields of modes, with coefficients per unit of τ₁ to the places that count."""
        unit = self._xp.sqrt(self._xp.number(self._fine.moving.unit))
        places = places_of(reach, accuracy, self._coarse.tau1_unit)
        values, radii = self._xp.decimals(coefficients / unit, self._wanted)
        if any(radius > Decimal(1).scaleb(-p) for radius, p in zip(radii, places, strict=True)):
            raise _TooFewDigits
        texts = [format(value, f".{p}f") for value, p in zip(values, places, strict=True)]
        return {"modes": modes.tolist(), "coefficients": texts}


def _added(body: Problem) -> Fraction | None:
    """Return ma² of Chaplygin's ball."""
    return body.ball.added if isinstance(body, ChaplyginBall) else None
