"""A section of an orbit between two collisions: its time map, states and their errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.separable.collision_orbit import CollisionOrbit
from veselova.analytic.separable.inversion import SeparableMotion
from veselova.analytic.time_map.chebyshev_panels import Panels
from veselova.analytic.time_map.panel_quadrature import integrate_between
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.flows.collision import collision

__all__ = ["OrbitSection", "OrbitSections", "Passage"]

Array = NDArray[np.float64]

#: Budget: cycles of the fastest phase that panels are willing to cover, those up to which they
#: cover the whole orbit, whatever times are asked for, and panels per cycle to begin with.
_MOST_CYCLES = 5e4
_WHOLE = 200.0
_PANELS = 2

#: Calibrated: rounding in ε: of one evaluation; of a phase; of frequencies, τ and t, relative.
_EVALUATION = 16.0
_PHASE = 4.0
_RATE = 4.0

#: Derived: next to a collision the coordinate lines turn like 1/q_i, which is rounded to ε/q_i² of
#: itself: series end at coefficients of this part of their sizes, all of which are rounded, not the
#: last alone.
_NOISE = 1e-5
_ROUNDED = 24.0

#: Budget: points per panel at which effects of errors are summed.
_SUMMED = 8


@dataclass(frozen=True)
class Passage:
    """What N times of the orbit come to: u, τ (N,) and the phases (N, g) there."""

    u: Array
    tau: Array
    z: Array


class OrbitSection:
    """The part of the orbit that holds times from ``earliest`` to ``latest``, or ends before them:
    u from ``low`` to ``high``. Raises Unsolved (``too-far``, ``narrow-gap``).
    """

    def __init__(self, orbit: CollisionOrbit, earliest: float, latest: float) -> None:
        self.orbit = orbit
        self.motion = orbit.motion
        before, after = orbit.arrivals
        self._fastest = float(np.max(np.abs(orbit.rates)))
        self.low, self.high = before.u, after.u
        if self._fastest * (after.tau - before.tau) > _WHOLE:
            # dt/dτ = √(λ_1…λ_g) is at least this
            slowest = float(np.sqrt(np.prod([cut.lower for cut in self.motion.cuts])))
            self.low = orbit.argument(min(earliest, 0.0) / slowest)
            self.high = orbit.argument(max(latest / slowest, 1 / self._fastest))
        ends = orbit.tau(np.array([self.low, self.high]))
        cycles = self._fastest * float(ends[1] - ends[0])
        if not cycles <= _MOST_CYCLES:
            raise Unsolved(
                "too-far",
                f"{cycles:.3g} cycles of the fastest phase; panels along the orbit go to "
                f"{_MOST_CYCLES:.0e}",
            )

    @property
    def whole(self) -> bool:
        """Return whether it is all of the orbit."""
        return (self.low, self.high) == tuple(arrival.u for arrival in self.orbit.arrivals)

    @cached_property
    def _borders(self) -> Array:
        """Return the borders in u of the panels to begin with."""
        sides = []
        for end in (self.low, self.high):
            cycles = self._fastest * abs(float(self.orbit.tau(np.array([end]))[0]))
            sides.append(np.linspace(0.0, end, 2 + int(_PANELS * cycles)))
        # a side without a time has no panels
        before = sides[0][:0:-1] if self.low < 0 else sides[0][:0]
        return np.concatenate([before, sides[1] if self.high > 0 else sides[1][:1]])

    def integrate(
        self, function: Callable[[Array], Array], noise: float = 0.0, scale: float = 0.0
    ) -> Panels:
        """Return u ↦ ∫ f dτ from the start, for a function of the angles that is rounded to
        ``noise``, to the rounding of ``scale``.
        """

        def integrand(u: Array) -> Array:
            return function(self.orbit.angles(u)) * self.orbit.slope(u)

        return integrate_between(integrand, self._borders, noise, scale)

    @cached_property
    def time_panels(self) -> Panels:
        """Return u ↦ t."""
        return self.integrate(self.orbit.rate.at)

    @cached_property
    def turning(self) -> Panels:
        """Return u ↦ the angle by which m_1 has turned towards m_2, n = 3."""
        return self.integrate(self.motion.turning, _NOISE, 1.0)  # of a radian

    @property
    def size(self) -> int:
        """Return the number of nodes of the time map."""
        return self.time_panels.size

    @cached_property
    def collisions(self) -> list[tuple[float, float, int] | None]:
        """Return t, its error and the number of the axis, of the collisions before the start and
        after it; None of one that is not on this section.
        """
        found: list[tuple[float, float, int] | None] = []
        for end, (arrival, place) in enumerate(
            zip(self.orbit.arrivals, (self.low, self.high), strict=True)
        ):
            if place != arrival.u:
                found.append(None)
                continue
            u, tau, theta = np.array([arrival.u]), np.array([arrival.tau]), arrival.angles[None]
            s = arrival.coordinate
            slopes = self.motion.slopes(theta).angles[0, s]
            late = np.abs(slopes) @ self._phase_error(tau)[0] / abs(slopes @ self.orbit.rates)
            rate = self.orbit.rate.at(theta)
            error = rate * (late + self._lag(u, tau, rate))
            at_lower = np.cos(arrival.angles[s]) > 0
            axis = self.motion.axes[s if at_lower else s + 1]
            found.append((float(self.time_panels.values[-end]), float(error[0]), axis))
        return found

    def passage(
        self, times: Array, remainders: Array | None, plane: Callable[[int], str]
    ) -> Passage:
        """Return where times (N,), increasing, are on the orbit; raises Unsolved (``collision``)
        unless all are between the collisions, by more than the error of these.

        ``plane`` names the plane of an axis.
        """
        for sign, found in zip((-1, 1), self.collisions, strict=True):
            if found is None:
                continue
            time, error, axis = found
            farthest = times[-1] if sign > 0 else times[0]
            if sign * (time - farthest) <= error:
                raise collision(plane(axis), f"t = {time:.12g}")
        panels = self.time_panels
        panel, offset = panels.find_arguments(times, remainders)
        u = panels.borders[panel] + offset
        tau = self.orbit.tau(u)
        return Passage(u, tau, self.orbit.origin + tau[:, None] * self.orbit.rates)

    def states(self, passage: Passage) -> tuple[Attitude, Array, Array]:
        """Return positions and coordinate lines, q̇ = q'/(dt/dτ), (N, n), and the angles."""
        phi = self.orbit.angles(passage.u)
        at = self.motion.attitude(phi)
        return at, at.q_prime / self.orbit.rate.at(phi)[:, None], phi

    def details(self) -> dict[str, Any]:
        """Return what a trajectory's provenance says of the orbit."""
        details = {
            "time_map": "panels",
            "time_map_size": self.size,
            "degree": self.motion.start.degree,
        }
        times = [found[0] for found in self.collisions if found is not None]
        return {**details, "collisions": times} if self.whole else details

    @cached_property
    def _start_error(self) -> Array:
        """Return the error of the phases at any time by rounding of the series, (g,)."""
        periods = self.motion.periods
        sizes = np.abs(periods.inverse_cycles) @ sum(
            np.sum(np.abs(series), axis=1) for series in periods.cut_series
        )
        rounding = DOUBLE.epsilon * np.maximum(_PHASE, _RATE * sizes)
        return np.asarray(rounding + periods.series_truncation)

    @cached_property
    def _rate_error(self) -> Array:
        periods = self.motion.periods
        size = np.abs(periods.inverse_cycles) @ (np.abs(periods.cycles) @ np.abs(self.orbit.rates))
        return np.asarray(_RATE * DOUBLE.epsilon * size)

    def _phase_error(self, tau: Array) -> Array:
        """Return the error of the phases at τ, (N, g)."""
        return np.asarray(self._start_error + np.abs(tau)[:, None] * self._rate_error)

    @cached_property
    def _sums(self) -> tuple[Array, Array, Array]:
        """Return, at points u, what errors of the phases do to t, and the area between the orbit
        and the one that they lead to.
        """
        borders = self.time_panels.borders
        inner = np.linspace(0.0, 1.0, _SUMMED, endpoint=False)
        u = np.append((borders[:-1, None] + inner * np.diff(borders)[:, None]).ravel(), borders[-1])
        middle = (u[1:] + u[:-1]) / 2  # the ends are planes, where q' is infinite
        phi = self.orbit.angles(middle)
        slopes = self.motion.slopes(phi)
        error = self._phase_error(self.orbit.tau(middle))
        speed = np.linalg.norm(slopes.along @ self.orbit.rates, axis=1)
        apart = np.sum(np.linalg.norm(slopes.along, axis=1) * error, axis=1)
        late = np.sum(np.abs(slopes.rate) * error, axis=1)
        steps = self.orbit.slope(middle) * np.diff(u)
        zero = int(np.argmin(np.abs(u)))
        sums = []
        for density in (late, speed * self._near_plane(phi, apart)):
            total = np.append(0.0, np.cumsum(density * steps))
            sums.append(np.abs(total - total[zero]))
        return u, sums[0], sums[1]

    def _lag(self, u: Array, tau: Array, rate: Array) -> Array:
        """Return the error of τ at the times of u, (N,)."""
        points, late, _ = self._sums
        of_time = self.time_panels.error(u) + np.interp(u, points, late)
        of_time = of_time + _RATE * DOUBLE.epsilon * np.abs(self.time_panels.at(u))
        return np.asarray(of_time / rate + _RATE * DOUBLE.epsilon * np.abs(tau))

    def error(self, passage: Passage, phi: Array, frame: bool) -> Array:
        """Return a bound on the error of q, or of q and the coordinate lines and what is carried
        along q without turning (n = 3), (N,).
        """
        slopes = self.motion.slopes(phi)
        lag = self._lag(passage.u, passage.tau, self.orbit.rate.at(phi))
        phases = self._phase_error(passage.tau)
        phases = phases + np.abs(self.motion.inversion.map(phi) - passage.z)
        moves = np.abs(slopes.along)
        flow = np.abs(slopes.along @ self.orbit.rates)
        if frame:
            moves = np.concatenate([moves, np.abs(slopes.turning)[:, None]], axis=1)
            flow = np.concatenate(
                [flow, np.abs(slopes.turning @ self.orbit.rates)[:, None]], axis=1
            )
        moved = np.sum(np.linalg.norm(moves, axis=1) * phases, axis=1)
        moved = moved + np.linalg.norm(flow, axis=1) * lag
        if frame:
            points, _, area = self._sums
            moved = moved + np.interp(passage.u, points, area)
            moved = moved + _ROUNDED * self.turning.error(passage.u)
        return np.asarray(_EVALUATION * DOUBLE.epsilon + self._near_plane(phi, moved))

    def _near_plane(self, phi: Array, moved: Array) -> Array:
        """Return how far q moves by what to first order is ``moved``: next to a plane q_i² does so
        evenly, and q_i as a root.
        """
        start = self.motion.start
        axes = [self.motion.axes[i] for i, beta in enumerate(start.centrifugal) if beta < 0]
        distance = np.min(np.abs(self.motion.attitude(phi).q[:, axes]), axis=1)
        return np.asarray(
            np.minimum(moved * (1 + 2 * moved / distance), np.sqrt(2 * distance * moved))
        )


class OrbitSections:
    """The sections of one orbit: a short orbit has one for all times, a long one has one for those
    that are asked for.
    """

    def __init__(self, motion: SeparableMotion) -> None:
        self._orbit = CollisionOrbit(motion)
        self._nearest = OrbitSection(self._orbit, 0.0, 0.0)

    def of_times(self, times: Array) -> OrbitSection:
        """Return the section of times (N,), increasing; raises Unsolved (``too-far``)."""
        if self._nearest.whole:
            return self._nearest
        return OrbitSection(self._orbit, float(times[0]), float(times[-1]))
