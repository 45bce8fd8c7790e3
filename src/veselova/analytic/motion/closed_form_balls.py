"""The closed form of a motion with more digits than a double has: the same document, its numbers
as decimal strings from ball arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Decimal
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.motion.time_map_balls import estimate_modes, require_few_modes
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.motion.torus_solution_balls import SolutionInBalls
from veselova.analytic.theta.theta_quotients import ThetaQuotients
from veselova.analytic.time_map.fourier_balls import FourierTimeMapInBalls
from veselova.analytic.time_map.fourier_modes import largest_first
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, Unsolved

__all__ = ["FAR_DIGITS", "decimal_fields"]

#: Derived: digits of every number beyond those of the document: a time of 10^12 takes 12 of them.
FAR_DIGITS = 15

#: Calibrated: working digits beyond those of the numbers, and attempts, each with twice as many of
#: them.
_SPARE = 15
_ATTEMPTS = 4

#: Method: by how much the least coefficient is below the accuracy, at first: slow modes, and many
#: of them, move τ₁ by more than their coefficients.
_FEWER_MODES = 200.0


def decimal_fields(coarse: Solution, accuracy: float, digits: int) -> dict[str, Any]:
    """Return the fields of the document whose numbers are decimals: strings of ``digits`` and
    FAR_DIGITS significant digits.

    ``coarse``: the motion in double precision. Raises InvalidInput for A as a matrix, Unsolved
    where the digits are not reached.
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
            fine = SolutionInBalls(coarse, wanted + spare, False, "theta")
            with fine.arithmetic:
                fields = _Numbers(coarse, fine, wanted).fields(accuracy)
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

    def __init__(self, coarse: Solution, fine: SolutionInBalls, wanted: int) -> None:
        self._coarse = coarse
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

    def fields(self, accuracy: float) -> dict[str, Any] | None:
        """Return the fields; None where the balls are too wide."""
        try:
            return {**self._attitude(), **self._time_map(accuracy)}
        except _TooFewDigits:
            return None

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
        modes: Values = np.empty((0, fine.moving.size - 1), dtype=np.int64)
        coefficients: list[str] = []
        if not uniform:
            modes, coefficients = self._modes(accuracy, unit)
        return {
            "phases": self._texts(orbit.start),
            "frequencies": self._texts(orbit.frequencies / unit),
            "mean_rate": self._texts([mean])[0],
            "modes": modes.tolist(),
            "coefficients": coefficients,
            "rate": {
                "characteristic": place,
                "constant": self._texts([constant])[0],
                "power": orbit.power,
            },
        }

    def _modes(self, accuracy: float, unit: Any) -> tuple[Any, list[str]]:
        """Return the modes that the accuracy asks for, largest first, and their coefficients to the
        places that it asks for.

        The reach of a mode is that of ``analytic.motion.closed_form``.
        """
        coarse = self._coarse
        mean = float(self._fine.orbit.rate.mean)
        sensitivity = float(coarse.sensitivity.along_flow)
        fastest = float(np.max(np.abs(coarse.in_tau1.rates)))
        cutoff = accuracy * fastest * mean / (_FEWER_MODES * max(1.0, sensitivity))
        expected = estimate_modes(coarse, -math.log10(accuracy), coarse.curve.genus)
        time_map = FourierTimeMapInBalls(self._fine.orbit, cutoff, expected=expected)
        # what is below the cutoff may move τ₁ by its part of the accuracy
        while (left := float(time_map.tail(np.inf)) * sensitivity / mean) > accuracy / 4:
            cutoff *= accuracy / (8 * left)
            time_map = FourierTimeMapInBalls(
                self._fine.orbit, cutoff, expected=expected, coarser=time_map
            )
        modes = time_map.modes
        pace = np.abs(modes @ self._fine.orbit.frequencies).astype(float)
        reach = 2 / (np.pi * np.maximum(pace, np.finfo(float).tiny) * mean) * sensitivity
        effects = np.abs(time_map.coefficients).astype(float) * reach
        selected = largest_first(effects, accuracy / 2)
        step = accuracy / (4 * max(1, len(selected)) * reach[selected]) / coarse.tau1_unit
        values, radii = self._xp.decimals(time_map.coefficients[selected] / unit, self._wanted)
        texts = []
        for value, radius, finest in zip(values, radii, step.tolist(), strict=True):
            if radius > Decimal(finest):
                raise _TooFewDigits
            places = max(0, -math.floor(math.log10(finest)))
            texts.append(format(value, f".{places}f"))
        return modes[selected], texts
