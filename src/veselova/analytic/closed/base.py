"""A motion in closed form as a function of time: rest, provenance and pickling of every kind."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.trajectory import Trajectory

__all__ = ["Motion"]

Array = NDArray[np.float64]

P = TypeVar("P", bound=Problem)


@dataclass(frozen=True)
class Motion(ABC, Generic[P]):
    """The motion of a problem; what was computed for it is kept, and made again where it was left
    behind by pickling.
    """

    problem: P

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def __call__(self, times: Any) -> Trajectory:
        """Return the trajectory at times."""
        return self.evaluate(TimeGrid.of(times))

    def evaluate(self, grid: TimeGrid) -> Trajectory:
        """Return the trajectory at validated times, in the order in which they were asked for."""
        began = time.perf_counter()
        if self._rests:
            provenance = Provenance.since(began, "analytic", "rest", {"regime": "rest"})
            return Trajectory.at_rest(self.problem, grid, provenance, self)
        series, error, method, details = self._evaluate(grid)
        provenance = Provenance.since(began, "analytic", method, details)
        return Trajectory.on_grid(self.problem, grid, error, series, provenance, self)

    @cached_property
    def _rests(self) -> bool:
        """Return whether nothing moves by as much as the last digit of a double shows."""
        if not self.problem.moves:
            return True
        try:
            self._require_motion()
        except Unsolved as refusal:  # beside a stable equilibrium nothing moves by a digit
            if refusal.outcome == "at-rest":
                return True
            raise
        return False

    @abstractmethod
    def _require_motion(self) -> None:
        """Raise Unsolved where a problem that moves has no motion in closed form, or where nothing
        moves by a digit (``at-rest``).
        """

    @abstractmethod
    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        """Return the series of a problem that moves, their error, the method and its details."""
