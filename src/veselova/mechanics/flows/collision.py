"""Flows in potentials that are infinite where a coordinate vanishes: motions run into such planes,
or turn back before them.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.flow import Flow

__all__ = ["SingularFlow", "collision"]

Array = NDArray[np.float64]

#: Units of time left to an attracting plane at which a motion counts as having run into it: steps
#: are still thousands of roundings of the time, and the rest of the way does not show in the seven
#: digits of the time that is named.
_LEFT = 1e-8


class SingularFlow(Flow):
    """A flow that ends where it runs into a plane on which its potential is −∞."""

    @property
    @abstractmethod
    def _singular(self) -> Mapping[Any, Callable[[Array], Any]]:
        """Return, by the indices of the coordinates at whose zeros the potential is infinite, the
        part of it that is.
        """

    @abstractmethod
    def _coordinates(self, state: Array) -> tuple[Array, Array]:
        """Return the coordinates of a state, in any shape, and their derivatives."""

    @abstractmethod
    def _plane(self, index: Any) -> str:
        """Return the name of a plane."""

    @cached_property
    def _sides(self) -> Array:
        return np.sign(self._coordinates(self.initial)[0])

    @property
    def endless(self) -> bool:
        """Return whether the potential is finite everywhere."""
        return not self._singular

    def clearance(self, state: Array) -> float:
        """Return the distance to the nearest singular plane, less what an attracting one makes good
        at once.
        """
        x, speed = self._coordinates(state)
        left = (
            x[i] * self._sides[i] - _LEFT * abs(speed[i]) * (part(x) < 0)
            for i, part in self._singular.items()
        )
        return float(min(left, default=1.0))

    def ending(self, time: float, state: Array) -> Unsolved:
        """Return what happened at the nearest singular plane: a collision, or a barrier that was
        stepped over.
        """
        x, speed = self._coordinates(state)
        nearest = min(self._singular, key=lambda i: x[i] * self._sides[i])
        arrival = (time - x[nearest] / speed[nearest]) * self.time_unit
        plane = self._plane(nearest)
        # beyond a plane odd powers have changed sign: look at it from the side of the start
        for i in self._singular:
            x[i] = abs(x[i]) * self._sides[i]
        if self._singular[nearest](x) < 0:
            return collision(plane, f"about t = {arrival:.7g}")
        return Unsolved(
            "thin-barrier",
            "the motion turns back nearer than the integration resolves to "
            f"{_place(plane, f'about t = {arrival:.7g}')}",
        )


def collision(plane: str, time: str) -> Unsolved:
    """Return the outcome of a motion that is asked for times beyond a collision, at a time in
    words.
    """
    return Unsolved(
        "collision", f"the motion runs into {_place(plane, time)}; ask for earlier times"
    )


def _place(plane: str, time: str) -> str:
    return f"{plane} = 0 at {time}, where the potential is infinite"
