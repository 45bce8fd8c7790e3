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
from veselova.mechanics.core.errors import InternalContradiction

__all__ = ["Arrival", "CollisionOrbit"]

Array = NDArray[np.float64]

#: Points among which the first is looked for that is beyond a plane, and how often.
_POINTS = 16
_ROUNDS = 4

#: Newton's steps to the time of a collision, and the last of them, in ε.
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
        found = self._arrive(-1), self._arrive(1)
        before, after = (tau for tau, _, _ in found)
        self._half = (after - before) / 2
        self._phase = float(np.arctan2(-(after + before) / 2, np.sqrt(-after * before)))
        first, last = (
            Arrival(sign * np.pi / 2 - self._phase, *data)
            for sign, data in zip((-1, 1), found, strict=True)
        )
        self.arrivals = first, last

    def _arrive(self, direction: int) -> tuple[float, int, Array]:
        """Return τ, the coordinate and the angles of the first collision forwards (1) or backwards
        (−1) in time.
        """
        angles = self.motion.angles
        planes = {
            s: cut.arrivals(float(angles[s]))[direction > 0]
            for s, cut in enumerate(self.motion.cuts)
            if isinstance(cut, OpenInterval)
        }

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
        reached = np.flatnonzero(beyond(np.array([high]))[0])
        found = [self._refine(list(planes.items())[i], high) for i in reached]
        return min(found, key=lambda arrival: abs(arrival[0]))

    def _refine(self, plane: tuple[int, float], tau: float) -> tuple[float, int, Array]:
        """Return the arrival of a coordinate at a plane near τ: Newton's method for τ and the
        other angles.
        """
        s, angle = plane
        theta = self.inversion.invert((self.origin + tau * self.rates)[None])[0]
        theta[s] = angle
        for _ in range(_MOST_STEPS):
            excess = self.inversion.map(theta[None])[0] - self.origin - tau * self.rates
            slopes = self.inversion.jacobian(theta[None])[0]
            slopes[:, s] = -self.rates
            step = np.linalg.solve(slopes, excess)
            tau -= float(step[s])
            theta = theta - step
            theta[s] = angle
            step[s] *= np.max(np.abs(self.rates))
            if np.max(np.abs(step)) <= _LAST_STEP * DOUBLE.epsilon * max(1, np.max(np.abs(theta))):
                return tau, s, theta
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
        return self.inversion.invert(self.origin + self.tau(u)[:, None] * self.rates)
