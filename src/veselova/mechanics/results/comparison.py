"""Two trajectories of one problem, quantity by quantity."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.problem import html_table
from veselova.mechanics.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Comparison"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Two answers to one problem at the same times, and how they agree: those of both engines, or
    of two formulations where the system has one engine.

    - first, second: the trajectories. Those of the engines are ``analytic`` and ``numeric`` too
    - names: what the two are called, the engines or the formulations
    """

    first: Trajectory
    second: Trajectory
    names: tuple[str, str] = ("analytic", "numeric")

    @property
    def trajectories(self) -> dict[str, Trajectory]:
        """Return both trajectories by their names."""
        return {self.names[0]: self.first, self.names[1]: self.second}

    @property
    def analytic(self) -> Trajectory:
        """Return the motion in closed form; raises AttributeError for two formulations."""
        return self._of_engine("analytic")

    @property
    def numeric(self) -> Trajectory:
        """Return the integrated motion; raises AttributeError for two formulations."""
        return self._of_engine("numeric")

    def _of_engine(self, name: str) -> Trajectory:
        if name not in self.names:
            both = " and ".join(self.names)
            raise AttributeError(f"a comparison of the formulations {both} has .first and .second")
        return self.trajectories[name]

    def __repr__(self) -> str:
        agreement = "agree" if self.agrees else "disagree"
        gaps = ", ".join(
            f"{name} by {self.deviation[name]:.2g}" for name in self.first.problem.bounded
        )
        return (
            f"<Comparison: {self.first!r} and {self.second!r} {agreement}, they differ in {gaps}>"
        )

    def difference(self, name: str) -> Array:
        """Return the largest difference of one output over its components, at each time, shape
        (N,).
        """
        gap = np.abs(self.first.series(name) - self.second.series(name))
        return np.asarray(np.max(gap.reshape(gap.shape[0], -1), axis=1, initial=0.0))

    @cached_property
    def deviation(self) -> dict[str, float]:
        """Return the largest difference of each output over all times and components."""
        return {name: float(np.max(self.difference(name))) for name in self.first.problem.outputs}

    @cached_property
    def conditioning_floor(self) -> Array:
        """Return how far one rounding of the data moves the state at each time: agreement below it
        is luck.
        """
        return self.first.problem.conditioning_floor(self.first.times)

    @cached_property
    def agrees(self) -> bool:
        """Return whether the bounded outputs differ, at every time, by no more than the sum of both
        errors.
        """
        allowed = self.first.error + self.second.error
        return bool(
            all(np.all(self.difference(name) <= allowed) for name in self.first.problem.bounded)
        )

    @property
    def drift(self) -> dict[str, dict[str, float]]:
        """Return the largest change of each integral of motion, by the two ``names``."""
        return {name: found.drift for name, found in self.trajectories.items()}

    @property
    def seconds(self) -> dict[str, float]:
        """Return the time that each of the two took."""
        return {name: found.provenance.seconds for name, found in self.trajectories.items()}

    def summary(self) -> dict[str, Any]:
        """Return the comparison as a JSON-ready dictionary."""
        engines = self.trajectories
        return {
            "deviation": self.deviation,
            "agrees": self.agrees,
            "conditioning_floor": float(np.max(self.conditioning_floor)),
            "error": {
                name: float(np.max(trajectory.error)) for name, trajectory in engines.items()
            },
            "drift": self.drift,
            "seconds": self.seconds,
            "provenance": {
                name: trajectory.provenance.as_dict() for name, trajectory in engines.items()
            },
        }

    def plot(
        self,
        ax: Axes | None = None,
        *,
        outputs: Iterable[str] | None = None,
        style: Any = "screen",
    ) -> Figure:
        """Return a figure of the motion with the difference of the two; raises BackendMissing
        without matplotlib.
        """
        from veselova.mechanics.results.plot import picture

        ordered = Comparison(
            self.first.in_order_of_time(), self.second.in_order_of_time(), self.names
        )
        return picture(ordered.first, ax, outputs, style, ordered)

    def _repr_html_(self) -> str:
        return html_table({f"largest difference of {k}": x for k, x in self.deviation.items()})
