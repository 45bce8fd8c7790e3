"""Angles along an orbit, led from station to station from those at the start.

Next to a corner of the torus, where two coordinates are in one plane, the map of angles to phases
folds. Where intervals have very different widths its phases swing by many cycles while one
coordinate turns, and Newton's method from afar loses its way. From a point of the orbit nearby it
converges.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.separable.inversion import SeparableMotion
from veselova.mechanics.core.budget import checkpoint

__all__ = ["OrbitStations"]

Array = NDArray[np.float64]

#: Method: radians that the angles turn by between two stations, at first and at most, and the
#: shortest step, in parts of the first.
_FIRST_TURN = 0.02
_MOST_TURN = 0.5
_LEAST_TURN = 1e-9

#: Method: how far from its extrapolation a station may be, in radians.
_NEAR = 0.05

#: Budget: stations before giving up: where intervals are as different as that, the narrowest is
#: left in less than a turn.
_MOST_STATIONS = 400


class OrbitStations:
    """Points of one orbit from the start to the first plane that is reached in one direction.

    tau (M,) from zero on, angles and slopes (M, g): θ and dθ/dτ there.
    """

    def __init__(self, motion: SeparableMotion, origin: Array) -> None:
        self._motion = motion
        self._origin = origin
        self._rates = np.asarray(motion.periods.frequencies)
        theta = np.array(motion.angles)
        self.tau = np.zeros(1)
        self.angles, self.slopes = theta[None], self._slope(theta)[None]

    def reach(self, planes: Mapping[int, float], direction: int) -> bool:
        """Return whether the last station is beyond one of the planes, angles by coordinate,
        forwards (1) or backwards (−1) in time.
        """
        turn = _FIRST_TURN
        while not any(direction * (self.angles[-1, s] - x) >= 0 for s, x in planes.items()):
            checkpoint()
            if self.tau.size > _MOST_STATIONS or turn < _LEAST_TURN * _FIRST_TURN:
                return False
            step = direction * turn / float(np.max(np.abs(self.slopes[-1])))
            expected = self.angles[-1] + step * self.slopes[-1]
            tau = self.tau[-1] + step
            found = self._motion.inversion.settle(expected, self._origin + tau * self._rates)
            if found is None or np.max(np.abs(found - expected)) > _NEAR:
                turn /= 4
                continue
            self.tau = np.append(self.tau, tau)
            self.angles = np.vstack([self.angles, found])
            self.slopes = np.vstack([self.slopes, self._slope(found)])
            turn = min(2 * turn, _MOST_TURN)
        return True

    def _slope(self, theta: Array) -> Array:
        return np.asarray(self._motion.speeds(theta[None])[0])

    def at(self, tau: Array) -> Array:
        """Return angles at τ (N,), (N, g), by the cubic between two stations."""
        order = np.sign(self.tau[-1])
        index = np.clip(np.searchsorted(order * self.tau, order * tau), 1, self.tau.size - 1)
        first = self.tau[index - 1]
        length = (self.tau[index] - first)[:, None]
        x = (tau - first)[:, None] / length
        early, late = self.angles[index - 1], self.angles[index]
        rise, climb = length * self.slopes[index - 1], length * self.slopes[index]
        chord = late - early
        bend = (1 - x) * (rise - chord) + x * (chord - climb)
        return np.asarray(early + x * chord + x * (1 - x) * bend)
