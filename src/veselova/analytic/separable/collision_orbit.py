"""The orbit of a separable motion from one collision to the next: where it begins and ends.

A coordinate that runs into a plane where V is −∞ reaches it at a τ_+, and came from one at a τ_−:
both solve the quadratures with that coordinate at the plane. Next to them q_i is like √(τ_+−τ), so
integrals along the orbit are series in u, τ = (τ_+ + τ_−)/2 + (τ_+ − τ_−)/2 · sin(u + u_0).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.separable.inversion import SeparableMotion, SeparatedRate
from veselova.analytic.separable.open_interval import OpenInterval
from veselova.analytic.separable.orbit_stations import OrbitStations
from veselova.mechanics.core.errors import InternalContradiction

__all__ = ["Arrival", "CollisionOrbit"]

Array = NDArray[np.float64]

#: Method: cycles of a swing of the phases from which the angles are led along the orbit.
_WIDE_SWING = 100.0

#: Budget: points among which the first is looked for that is beyond a plane, and how often.
_POINTS = 16
_ROUNDS = 4

#: Budget: Newton's steps to the time of a collision, and the last of them, in ε.
_MOST_STEPS = 30
_LAST_STEP = 64.0


@dataclass(frozen=True)
class Arrival:
    """The first plane that is reached in one direction of time: u and τ, the coordinate, all
    angles.
    """

    u: float
    tau: float
    coordinate: int
    angles: Array


class CollisionOrbit:
    """The orbit of a motion that collides, from ``arrivals[0]`` to ``arrivals[1]``.

    origin, rates (g,): the phases at the start, and per unit of τ
    """

    def __init__(self, motion: SeparableMotion) -> None:
        self.motion = motion
        self.inversion = motion.inversion
        self.rate = SeparatedRate(motion.inversion)
        self.origin = self.inversion.map(motion.angles[None, :])[0]
        self.rates = np.asarray(motion.periods.frequencies)
        self._stations = self._lead() if np.max(self.inversion.rounding) > _WIDE_SWING else None
        found = self._arrive(-1), self._arrive(1)
        before, after = (tau for tau, _, _ in found)
        self._half = (after - before) / 2
        self._phase = float(np.arctan2(-(after + before) / 2, np.sqrt(-after * before)))
        first, last = (
            Arrival(sign * np.pi / 2 - self._phase, *data)
            for sign, data in zip((-1, 1), found, strict=True)
        )
        self.arrivals = first, last

    def _lead(self) -> tuple[OrbitStations, OrbitStations] | None:
        """Return stations to both collisions; None where these are too many."""
        before, after = (OrbitStations(self.motion, self.origin) for _ in range(2))
        reached = before.reach(self._planes(-1), -1) and after.reach(self._planes(1), 1)
        return (before, after) if reached else None

    def _planes(self, direction: int) -> dict[int, float]:
        """Return, per coordinate that runs into a plane, its angle there, in one direction of
        time.
        """
        return {
            s: cut.arrivals(float(self.motion.angles[s]))[direction > 0]
            for s, cut in enumerate(self.motion.cuts)
            if isinstance(cut, OpenInterval)
        }

    def _arrive(self, direction: int) -> tuple[float, int, Array]:
        """Return τ, the coordinate and the angles of the first collision forwards (1) or backwards
        (−1) in time.
        """
        planes = self._planes(direction)
        if self._stations is not None:
            stations = self._stations[direction > 0]
            high, last = float(stations.tau[-1]), stations.angles[-1]
            passed = direction * (last[list(planes)] - np.array(list(planes.values()))) >= 0
            return self._first(list(planes.items()), passed, high, last)

        def beyond(taus: Array) -> NDArray[np.bool_]:
            theta = self.inversion.invert(self.origin + taus[:, None] * self.rates)
            return np.stack([direction * (theta[:, s] - x) >= 0 for s, x in planes.items()], axis=1)

        low = 0.0
        high = direction * 0.5 / float(np.max(np.abs(self.rates[list(planes)])))
        while not beyond(np.array([high])).any():
            low, high = high, 2 * high
        for _ in range(_ROUNDS):
            taus = np.linspace(low, high, _POINTS + 1)[1:]
            first = int(np.argmax(beyond(taus).any(axis=1)))
            low, high = taus[first - 1] if first else low, float(taus[first])
        last = self.inversion.invert((self.origin + high * self.rates)[None])[0]
        return self._first(list(planes.items()), beyond(np.array([high]))[0], high, last)

    def _first(
        self, planes: list[tuple[int, float]], passed: NDArray[np.bool_], tau: float, last: Array
    ) -> tuple[float, int, Array]:
        """Return the first arrival at the planes that are passed at τ, of angles ``last`` there."""
        found = [self._refine(planes[i], tau, last) for i in np.flatnonzero(passed)]
        return min(found, key=lambda arrival: abs(arrival[0]))

    def _refine(
        self, plane: tuple[int, float], tau: float, last: Array
    ) -> tuple[float, int, Array]:
        """Return the arrival of a coordinate at a plane near τ: Newton's method for τ and the
        other angles.
        """
        s, angle = plane
        theta = np.array(last)
        theta[s] = angle
        last_size = np.inf
        rounding = float(np.max(self.inversion.rounding))
        for _ in range(_MOST_STEPS):
            excess = self.inversion.map(theta[None])[0] - self.origin - tau * self.rates
            slopes = self.inversion.jacobian(theta[None])[0]
            slopes[:, s] = -self.rates
            step = np.linalg.solve(slopes, excess)
            tau -= float(step[s])
            theta = theta - step
            theta[s] = angle
            step[s] *= np.max(np.abs(self.rates))
            size = float(np.max(np.abs(step)))
            least = _LAST_STEP * DOUBLE.epsilon * max(1.0, float(np.max(np.abs(theta))))
            # Steps end at the rounding of the phases, which swing by many cycles.
            if size <= least or last_size <= size <= least * rounding:
                return tau, s, theta
            last_size = size
        raise InternalContradiction("the time of a collision did not settle")

    def tau(self, u: Array) -> Array:
        """Return τ at u."""
        return np.asarray(2 * self._half * np.cos(self._phase + u / 2) * np.sin(u / 2))

    def slope(self, u: Array) -> Array:
        """Return dτ/du."""
        return np.asarray(self._half * np.cos(self._phase + u))

    def argument(self, tau: float) -> float:
        """Return u at τ, of an end where τ is beyond it."""
        sine = np.sin(self._phase) + tau / self._half
        u = float(np.arcsin(min(max(sine, -1.0), 1.0))) - self._phase
        return min(max(u, self.arrivals[0].u), self.arrivals[1].u)

    def angles(self, u: Array) -> Array:
        """Return the angles at u, (N, g)."""
        tau = self.tau(u)
        z = self.origin + tau[:, None] * self.rates
        if self._stations is None:
            return self.inversion.invert(z)
        before, after = self._stations
        nearby = np.where((tau < 0)[:, None], before.at(tau), after.at(tau))
        return self.inversion.invert_from(z, nearby)
