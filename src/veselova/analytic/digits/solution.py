"""The closed-form motion of one problem in balls: every number of the chain with its error, to any
number of digits. With an area constant the flow has the direction, and the time the rate, that
``AreaVeselova`` gives.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property, partial
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import Values, balls
from veselova.analytic.closed.area_veselova import AreaVeselova
from veselova.analytic.closed.base import Attitude
from veselova.analytic.closed.motion import TIMES
from veselova.analytic.closed.quotients import POWERS
from veselova.analytic.closed.start import flow_of, log_drift
from veselova.analytic.curve.branch_points import COINCIDE, resolve_spectrum, spheroconic
from veselova.analytic.curve.kernel_text import text_over
from veselova.analytic.curve.moving_part import moving_part
from veselova.analytic.digits.fourier import MOST_MODES, FourierTimeMapInBalls
from veselova.analytic.digits.frame import BodyFrame, ThetaQuotients, series_of, to_all_directions
from veselova.analytic.digits.orbit import InDoubles, Orbit
from veselova.analytic.digits.panels import ChebyshevTimeMapInBalls, estimate_nodes
from veselova.analytic.digits.torus import TorusInBalls
from veselova.analytic.theta.siegel_terms import ThetaInBalls
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.systems.rolling_veselova import RollingVeselova
from veselova.tunings import BALL_MODE, BALL_MODE_TERMS

__all__ = ["AreaSolutionInBalls", "SolutionInBalls"]

#: Calibrated: relative gap below which no inversion in doubles begins one in balls.
_NARROWEST = 1e-20

#: Calibrated: by how much dt/dτ₁ may vary for a Fourier time map.
_WIDEST_RATE = 1e10

#: Budget: states between two checkpoints.
_BLOCK = 500

#: Budget: digits by which motions may part before a start that was moved is given up.
_MOST_GROWTH = 1000
_MOVED = (
    f"the start had to be moved, and the bound of its drift grows beyond 1e{_MOST_GROWTH} "
    "times the distance until then"
)

TimeMap: TypeAlias = ChebyshevTimeMapInBalls | FourierTimeMapInBalls


class SolutionInBalls:
    """The motion of a moving body in balls of so many working digits; use it ``with
    solution.arithmetic:``.

    ``coarse``: the same in double precision. ``certified``: all truncations are bounded (only
    angles can be); else estimated.
    ``has_fourier_map``: whether the rate of the orbit is a product over its angles.
    ``method``: ``theta`` or ``angles``. ``reach``: the farthest Neumann time, in units where the
    largest I is 1. Where branch points coincide the start is moved. On a separatrix, and where
    errors are certified, it is moved by so little that a bound of Gronwall's kind keeps its motion
    as near to the given one as the digits ask for until then. Raises Unsolved (``not-enclosed``,
    ``too-far``) where a bound cannot be closed.
    """

    has_fourier_map: ClassVar[bool] = True

    def __init__(
        self, coarse: InDoubles, digits: int, certified: bool, method: str, reach: float = 0.0
    ) -> None:
        self.coarse, self.problem = coarse, coarse.problem
        given = moving_part(self.problem)
        if certified and (coarse.kernel.on_separatrix or coarse.narrowest_gap < _NARROWEST):
            reason = (
                "on and near a separatrix phases say little of the body, and theta functions "
                "are not bounded"
            )
            raise Unsolved("not-enclosed", reason)
        distance = Fraction(1, 10 ** (2 * digits + 10))
        found = resolve_spectrum(given, digits, distance)
        if certified and (found.separatrices or found.moving.size < given.size):
            raise Unsolved(
                "not-enclosed", f"a direction moves by less than 1e-{COINCIDE // 2} of the others"
            )
        #: By how much the start was moved, where what that makes of the motion has to be bounded.
        self._moved = Fraction(0)
        if found.moving != given and (certified or bool(found.separatrices)):
            growth = math.ceil(log_drift(found.spectrum, np.array([reach]))[0] / math.log(10))
            if growth > _MOST_GROWTH:
                raise Unsolved("not-enclosed" if certified else "too-far", _MOVED)
            self._moved = distance / 10**growth
            found = resolve_spectrum(given, digits, self._moved, growth)
        self.moving = found.moving
        self.arithmetic = balls(digits, certified)
        self.spectrum = found.spectrum
        time = TIMES[self.problem.time]
        with self.arithmetic as xp:
            part, points = self.moving, [xp.number(b) for b in self.spectrum.points]
            flow = flow_of(self.problem, points, part.unit, part.frozen)
            self.torus = TorusInBalls.of(self.spectrum, xp, time, np.array(flow))
            self.quotients: ThetaQuotients | None = None
            if method == "theta":
                theta = ThetaInBalls(self.torus.inversion.periods.riemann_matrix, xp)
                self.quotients = ThetaQuotients(theta, self.torus)
            self.orbit = Orbit(self.spectrum, self.torus, self._integrands)

    @property
    def integrals(self) -> int:
        """Return how many integrals make the path."""
        return self.torus.genus - 1 if isinstance(self.problem, RollingVeselova) else 0

    def _integrands(self, z: Values) -> Values:
        """Return d(time)/dτ₁, and what the path integrates, at phases z (N, g), (1+K, N)."""
        if not self.integrals:
            return self._rates(z)[None]
        at = self._attitude(z)
        return np.concatenate([1 / self._time_rate(at)[None], self._path_rates(at).T])

    def _rates(self, z: Values) -> Values:
        """Return d(time)/dτ₁ at phases."""
        if self.quotients is None:
            return self.torus.rate(self.torus.inversion.invert(z))
        return np.asarray(self._rate_constant * self.quotients.root_of_qAq(z) ** self._power)

    @property
    def _power(self) -> int:
        return POWERS[self.torus.numbers.time[0]]

    @cached_property
    def _rate_constant(self) -> Any:
        """Return d(time)/dτ₁ over its power of √(q,Aq), from the start."""
        assert self.quotients is not None
        at_start = self.quotients.root_of_qAq(self.orbit.start[None, :])[0] ** self._power
        return 1 / (self.arithmetic.number(self.spectrum.time_rate) * at_start)

    def _time_rate(self, attitude: Attitude) -> Values:
        """Return dτ₁/d(time) at attitudes, (N,): a power of (q,Aq), from its value at the start."""
        xp, spectrum = self.arithmetic, self.spectrum
        relative, first = xp.array(1 / spectrum.inverse), xp.array(spectrum.q)
        root = xp.sqrt((attitude.q**2 @ relative) / (first**2 @ relative))
        return np.asarray(xp.number(spectrum.time_rate) * root**-self._power)

    def _path_rates(self, attitude: Attitude) -> Values:
        """Return what a path integrates over τ₁ at attitudes, (N, K): (q',n_k)."""
        return attitude.components[:, : self.integrals]

    def _displacement(self, times: Values, integrals: Values) -> Values:
        """Return the displacement of a ball that neither slips nor twists, (N, n−1): uniform along
        the momentum, and the integrals of (q',n_k) across it.
        """
        assert isinstance(self.problem, RollingVeselova)
        along = self.arithmetic.sqrt(self.arithmetic.number(self.problem.exact_square_of_speed))
        across = np.concatenate([integrals, (along * times)[:, None]], axis=1)
        return np.asarray(across @ self.body.rotation)

    def _attitude(self, z: Values) -> Attitude:
        """Return the attitude at phases z (N, g), by theta functions or by inversion."""
        if self.quotients is not None:
            return self.quotients.at(z)
        return self.torus.attitude(self.torus.inversion.invert(z))

    def series(self, times: Values) -> tuple[Mapping[str, Values], Mapping[str, Any]]:
        """Return the series of a trajectory along the principal axes, by name, and what they took,
        at times (N,), exact and increasing.
        """
        xp, problem = self.arithmetic, self.problem
        tau1, integrals, details = self._follow(times)
        blocks = iterate(range(0, len(tau1), _BLOCK), "motion")
        parts = [self._attitude(self.orbit.phases(tau1[k : k + _BLOCK])) for k in blocks]
        attitude = Attitude.concatenate(parts)
        velocity = attitude.q_prime * self._time_rate(attitude)[:, None]
        points = attitude.spheroconic
        if not points.size:
            points = spheroconic(attitude.q, self.spectrum.inverse, xp)
        unit = xp.number(self.moving.unit)
        states: dict[str, Values] = {
            "tau1": tau1 * xp.sqrt(unit),
            "q_dot": self.body.to_axes(velocity),
            "frame": self.body.frames(attitude),
            "spheroconic": to_all_directions(points / unit, self.moving.frozen, xp),
        }
        if "displacement" in problem.outputs:
            states["displacement"] = self._displacement(times, integrals)
        if self._moved:
            self._add_drift(states, tau1)
        return series_of(problem, states), details

    def _add_drift(self, states: dict[str, Values], tau1: Values) -> None:
        """Widen the states of the moved start to hold those of the given one."""
        if "displacement" in states:
            raise Unsolved("too-far", "on a separatrix the path of a ball has 15 digits")
        xp, unit = self.arithmetic, self.arithmetic.number(self.moving.unit)
        of_frame = self.body.sensitivity(self.spectrum.constants)
        logs = log_drift(self.spectrum, np.abs(tau1.astype(float)), of_frame)
        off = xp.exp(xp.array(logs)) * xp.number(self._moved)
        slowest = xp.number(self.spectrum.time_rate) / self.spectrum.inverse[0]
        units = xp.sqrt(unit), slowest, 1, 1 / unit
        for name, size in zip(("tau1", "q_dot", "frame", "spheroconic"), units, strict=True):
            axes = (slice(None), *[None] * (states[name].ndim - 1))
            states[name] = xp.add_error(states[name], (off * size)[axes])

    def _follow(self, times: Values) -> tuple[Values, Values, Mapping[str, Any]]:
        """Return τ₁ at the times, what the path integrates until then, and what they took."""
        xp, orbit = self.arithmetic, self.orbit
        if self.moving.time == "tau1":
            details = {"time_map": "uniform", "time_map_size": 0}
            return np.asarray(times * xp.number(self.spectrum.time_rate)), np.empty((0, 0)), details
        approximate = self.coarse.tau1(times.astype(float)) * math.sqrt(
            self.coarse.kernel.moving.unit / self.moving.unit
        )
        # Zero is exactly that, and a time below the range of doubles, or below the rounding of a
        # time map in doubles, is not.
        signs = np.array([0 if t == 0 else 1 if t > 0 else -1 for t in times])
        approximate = np.where(signs * approximate > 0, approximate, signs * np.finfo(float).tiny)
        time_map = self._time_map(approximate)
        tau1, integrals = time_map.tau1(times), xp.array(np.zeros((len(times), 0)))
        if self.integrals:
            panels = time_map
            if not isinstance(panels, ChebyshevTimeMapInBalls):
                panels = ChebyshevTimeMapInBalls(orbit, tau1.astype(float), False)
            integrals = panels.integrals(tau1, self.integrals)
        return tau1, integrals, {"time_map": time_map.name, "time_map_size": time_map.size}

    def _time_map(self, approximate: NDArray[np.float64]) -> TimeMap:
        """Return the cheaper time map for approximate Neumann times (N,), or the other where it has
        too many terms. Only the truncation of panels is bounded. Raises Unsolved (``too-far``)
        where neither reaches as far.
        """
        xp, orbit, kernel = self.arithmetic, self.orbit, self.coarse.kernel
        panels = partial(ChebyshevTimeMapInBalls, orbit, approximate, xp.certified)
        # of a direction that doubles do not see they say nothing
        known = kernel.moving.size == self.moving.size and self.moving.rate_variation < _WIDEST_RATE
        if xp.certified or not (known and self.has_fourier_map):
            return panels()
        expected = self.coarse.modes(xp.digits)
        if expected > MOST_MODES:
            return panels()
        modes = partial(FourierTimeMapInBalls, orbit, expected)
        terms = BALL_MODE_TERMS * xp.digits * float(np.max(kernel.torus.angles.counts))
        cost = BALL_MODE * (1 + terms**2) * expected
        cheaper = cost < estimate_nodes(orbit, approximate)
        try:
            return modes() if cheaper else panels()
        except Unsolved:
            return panels() if cheaper else modes()

    @cached_property
    def body(self) -> BodyFrame:
        """Return what makes frames of attitudes."""
        normals = self.torus.attitude(self.torus.numbers.psi[None]).normals[0]
        return BodyFrame(self.problem, self.moving, self.spectrum.q, normals, self.arithmetic)


class AreaSolutionInBalls(SolutionInBalls):
    """The solution of an ``AreaVeselova`` problem in balls; raises Unsolved (``too-far``) on a
    separatrix.
    """

    problem: AreaVeselova
    has_fourier_map = False  # dt/dτ₁ has an odd part too

    def __init__(self, coarse: InDoubles, *rest: Any) -> None:
        if coarse.kernel.on_separatrix:
            reason = "on a separatrix motions with an area constant have 15 digits"
            raise Unsolved("too-far", reason)
        super().__init__(coarse, *rest)

    @property
    def integrals(self) -> int:
        """Return how many integrals make the path, the last one that of the odd part."""
        rolls = "displacement" in self.problem.outputs and self.torus.genus > 1
        return 2 if rolls else 0

    def _rates(self, z: Values) -> Values:
        """Return dt/dτ₁ at phases z (N, g)."""
        return np.asarray(1 / self._time_rate(self._attitude(z)))

    def _time_rate(self, attitude: Attitude) -> Values:
        """Return dτ₁/dt = dτ₁/dt'/(1 − tilt (u,A'v)/(v,A'v))."""
        own = super()._time_rate(attitude)
        return own if attitude.q.shape[1] < 3 else np.asarray(own / (1 - self._ratio(attitude)))

    def _ratio(self, attitude: Attitude) -> Values:
        """Return tilt (u,A'v)/(v,A'v)."""
        xp, n_2 = self.arithmetic, self.moving.directions @ self.body.normals[:, 0].astype(float)
        tilt = self.problem.side_of(n_2) * xp.number(self.problem.tilt)
        frame = np.stack([attitude.q.T, attitude.normals[:, :, 0].T], axis=1)
        return np.asarray(text_over(xp).tilted(self.torus.numbers._replace(tilt=[tilt]), frame))

    def _path_rates(self, attitude: Attitude) -> Values:
        """Return (q',n_2) to the sign of u, and the odd part of dt/dτ₁, (N, 2)."""
        across = attitude.components @ self.body.rotation[:, 0]
        odd = -self._ratio(attitude) / super()._time_rate(attitude)
        return np.stack([across, odd], axis=1)

    def _displacement(self, times: Values, integrals: Values) -> Values:
        """Return the coefficients of n and e_⊥ in the path of a ball, (N, 2)."""
        xp, problem = self.arithmetic, self.problem
        result = xp.array(np.zeros((len(times), 2)))
        result[:, 0] = xp.number(problem.uniform) * times
        if self.integrals:
            result[:, 0] = result[:, 0] - xp.number(problem.across) * integrals[:, 1]
            result[:, 1] = problem.sign * integrals[:, 0]
        return np.asarray(result)
