"""The motion of a body with an area constant in balls, on the torus of its rank-one problem:
direction of the flow and time as ``AreaVeselova`` has them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.curve.periods import Periods
from veselova.analytic.motion.in_doubles import InDoubles
from veselova.analytic.motion.path_balls import Along, integrals
from veselova.analytic.motion.torus_solution_balls import SolutionInBalls
from veselova.analytic.time_map.analyticity_strip import GeneralOrbit, Orbit
from veselova.analytic.time_map.cross_component import CrossComponent
from veselova.analytic.time_map.fourier_balls import FourierTimeMapInBalls
from veselova.analytic.time_map.rate import time_rate
from veselova.analytic.time_map.torus_series_balls import (
    GeneralFourierTimeMapInBalls,
    SeriesInBalls,
)
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.systems.area_veselova import AreaVeselova

__all__ = ["AreaSolutionInBalls", "solution_in_balls"]


class AreaSolutionInBalls(SolutionInBalls):
    """The solution of an ``AreaVeselova`` problem in balls; raises Unsolved (``too-far``) on a
    separatrix.
    """

    problem: AreaVeselova

    def __init__(
        self, coarse: InDoubles, digits: int, certified: bool, method: str, reach: float = 0.0
    ) -> None:
        if coarse.kernel.on_separatrix:
            reason = "on a separatrix motions with an area constant have 15 digits"
            raise Unsolved("too-far", reason)
        self._known_series: SeriesInBalls | None = None
        super().__init__(coarse, digits, certified, method, reach)
        self._odd_peak = coarse.odd_peak

    def _frequencies(self, periods: Periods) -> Values:
        """Return f = a⁻¹du, du = (−μ2, ς) for the forms dλ/2w, λdλ/2w; for the nodal ones the node
        of the gap enters, and where one direction is frozen λ_2 stays at its I.
        """
        xp: Any = self.arithmetic
        problem = self._coarse.problem
        assert isinstance(problem, AreaVeselova)
        sign = xp.number(problem.sign)
        mu2 = xp.number(problem.mu2 / self.moving.unit)
        if periods.genus == 1:
            frozen = xp.number(self.moving.unit) / xp.number(self.moving.frozen[0])
            return np.asarray(periods.inverse_cycles @ np.array([sign + mu2 * frozen]))
        points = periods.curve.branch_points
        node = (points[2] + points[3]) / 2
        return np.asarray(periods.inverse_cycles @ np.array([-mu2, sign + node * mu2]))

    def _adapt(self, orbit: Orbit) -> Orbit:
        """Return the orbit whose rates are those of attitudes."""
        of_neumann = orbit.rate.inversion.periods.frequencies
        paces = [max(abs(float(f)) for f in rates) for rates in (of_neumann, orbit.frequencies)]
        return GeneralOrbit(
            orbit.spectrum,
            orbit.rate,
            orbit.start,
            orbit.frequencies,
            orbit.time_rate,
            orbit.coarse_rates,
            self._rates,
            paces[0] / paces[1],
            self._fourier_map if self._has_even_torus else None,
        )

    @property
    def _has_even_torus(self) -> bool:
        """Return whether neither a cut nor a gap is narrow: elsewhere the series are long."""
        coarse = self._coarse
        genus = self.frame.periods.genus
        return genus == 2 and coarse.is_even and not coarse.near_separatrix

    def _fourier_map(self, orbit: Orbit, expected: float) -> FourierTimeMapInBalls:
        return GeneralFourierTimeMapInBalls(orbit, self.odd_series, expected=expected)

    def odd_series(self, smallest: Any) -> SeriesInBalls:
        """Return the series of the odd part of dt/dτ₁, modes above a number."""
        if self._known_series is not None and self._known_series.smallest <= smallest:
            return self._known_series
        xp: Any = self.arithmetic
        inversion = self.orbit.rate.inversion
        component = CrossComponent.of(self.frame, inversion)
        periods = inversion.periods
        psi = xp.array([[1, 1]]) * xp.pi / 2
        lower = np.array([periods.curve.point(1), periods.curve.point(3)])
        coordinates = lower + periods.roots_on_cuts(psi)[0][:, 0] ** 2
        c_2 = periods.curve.point(component.place)
        scale = xp.number(self.problem.tilt) * self.orbit.rate.at(psi)[0]
        scale = scale / xp.sqrt(c_2 * np.prod(coordinates)) / xp.determinant(periods.cycles)
        for size in component.row_sizes.tolist():
            scale = scale * xp.number(size)
        found = SeriesInBalls.of(component, scale, smallest)
        points = xp.pi * np.asarray(self.frame.half_periods)
        values = self._odd_rate(self.frame.at(points)).astype(float)
        best = int(np.argmax(np.abs(values)))
        z = np.asarray(self.frame.half_periods).astype(float)[best : best + 1] / 2
        self._known_series = found.scaled(-1) if found.at(z)[0] * values[best] < 0 else found
        return self._known_series

    def _rates(self, z: Values) -> Values:
        """Return dt/dτ₁ at phases z (N, g)."""
        return np.asarray(1 / self._time_rate(self.attitude(z)))

    def _time_rate(self, attitude: Attitude) -> Values:
        """Return dτ₁/dt = dτ₁/dt'/(1 − tilt (u,A'v)/(v,A'v))."""
        own = time_rate(self.spectrum, self.problem.time, self.arithmetic)(attitude.q)
        if attitude.q.shape[1] < 3:
            return own
        return np.asarray(own / (1 - self._ratio(attitude)))

    def _odd_rate(self, attitude: Attitude) -> Values:
        """Return the part of dt/dτ₁ that changes sign with u."""
        own = time_rate(self.spectrum, self.problem.time, self.arithmetic)(attitude.q)
        return np.asarray(-self._ratio(attitude) / own)

    def _ratio(self, attitude: Attitude) -> Values:
        """Return tilt (u,A'v)/(v,A'v)."""
        xp: Any = self.arithmetic
        A = xp.array(self.moving.A)
        across = (attitude.normals[:, :, 0] * attitude.q) @ (A - 1)
        along = (attitude.q * attitude.q) @ A
        tilt = self._side * xp.number(self.problem.tilt)
        return np.asarray(tilt * across / along)

    def _displacement(self, times: Values, tau1: Values, by_series: bool) -> Values:
        """Return the coefficients of n and e_⊥ in the path of a ball, (N, 2)."""
        xp: Any = self.arithmetic
        problem = self.problem
        result = xp.array(np.zeros((len(times), 2)))
        result[:, 0] = xp.number(problem.uniform) * times
        if self.frame.periods.genus < 2:
            return np.asarray(result)
        side = self.body.rotation[:, 0]
        across = xp.number(problem.across)
        if by_series:
            result[:, 1] = problem.sign * side[0] * self.normal_series(0).integral(self.orbit, tau1)
            if self._odd_peak:
                odd = self.odd_series(self.orbit.rate.mean * xp.epsilon)
                result[:, 0] = result[:, 0] - across * odd.integral(self.orbit, tau1)
            return np.asarray(result)
        # (q',n_2) to the sign of u, and the odd part of the time over what it may be
        largest = xp.number(2 * (self._odd_peak or 1.0))
        functions: list[Along] = [
            lambda attitude: attitude.components @ side,
            lambda attitude: self._odd_rate(attitude) / largest,
        ]
        if not self._odd_peak:
            functions = functions[:1]
        found = integrals(self.orbit, self.attitude, functions, tau1)
        result[:, 1] = problem.sign * found[:, 0]
        if self._odd_peak:
            result[:, 0] = result[:, 0] - across * largest * found[:, 1]
        return np.asarray(result)

    @property
    def _side(self) -> int:
        """Return the sign of u against n_2."""
        n_2 = self.moving.directions @ self.body.normals[:, 0].astype(float)
        return 1 if n_2 @ to_float(self.problem.columns[1]) > 0 else -1


def solution_in_balls(
    coarse: InDoubles, digits: int, certified: bool, method: str, reach: float
) -> SolutionInBalls:
    """Return the solution of a problem on a torus in balls."""
    if isinstance(coarse.problem, AreaVeselova):
        return AreaSolutionInBalls(coarse, digits, certified, method, reach)
    return SolutionInBalls(coarse, digits, certified, method, reach)
