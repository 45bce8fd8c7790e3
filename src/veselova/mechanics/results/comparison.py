"""Two trajectories of one problem, quantity by quantity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Comparison"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Both engines' answers to one problem at the same times, and how they agree."""

    analytic: Trajectory
    numeric: Trajectory

    def __repr__(self) -> str:
        agreement = "agree" if self.agrees else "disagree"
        gaps = ", ".join(
            f"{name} by {self.deviation[name]:.2g}" for name in self.analytic.problem.bounded
        )
        return (
            f"<Comparison: {self.analytic!r} and {self.numeric!r} {agreement}, they differ in "
            f"{gaps}>"
        )

    def difference(self, name: str) -> Array:
        """Return the largest difference of one output over its components, at each time, shape
        (N,).
        """
        gap = np.abs(self.analytic.series(name) - self.numeric.series(name))
        return np.asarray(np.max(gap.reshape(gap.shape[0], -1), axis=1, initial=0.0))

    @cached_property
    def deviation(self) -> dict[str, float]:
        """Return the largest difference of each output over all times and components."""
        return {
            name: float(np.max(self.difference(name))) for name in self.analytic.problem.outputs
        }

    @cached_property
    def conditioning_floor(self) -> Array:
        """Return how far one rounding of the data moves the state at each time: agreement below it
        is luck.
        """
        return self.analytic.problem.conditioning_floor(self.analytic.times)

    @cached_property
    def agrees(self) -> bool:
        """Return whether the bounded outputs differ, at every time, by no more than the sum of both
        errors.
        """
        allowed = self.analytic.error + self.numeric.error
        return bool(
            all(np.all(self.difference(name) <= allowed) for name in self.analytic.problem.bounded)
        )

    @property
    def drift(self) -> dict[str, dict[str, float]]:
        """Return the largest change of each integral of motion, by engine and name."""
        return {"analytic": self.analytic.drift, "numeric": self.numeric.drift}

    @property
    def seconds(self) -> dict[str, float]:
        """Return the time that each engine took."""
        return {
            "analytic": self.analytic.provenance.seconds,
            "numeric": self.numeric.provenance.seconds,
        }

    def summary(self) -> dict[str, Any]:
        """Return the comparison as a JSON-ready dictionary."""
        engines = {"analytic": self.analytic, "numeric": self.numeric}
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

    def plot(self) -> Figure:
        """Return a figure of the motion with the difference of the engines; raises BackendMissing
        without matplotlib.
        """
        from veselova.mechanics.results.plot import picture

        ordered = Comparison(self.analytic.in_order_of_time(), self.numeric.in_order_of_time())
        differences = {name: ordered.difference(name) for name in self.analytic.problem.outputs}
        errors = {"analytic": ordered.analytic.error, "numeric": ordered.numeric.error}
        return picture(ordered.analytic, differences, errors, ordered.conditioning_floor)

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{name}</th><td>{value:.2e}</td></tr>"
            for name, value in self.deviation.items()
        )
        return f"<table><tr><th>output</th><th>largest difference</th></tr>{rows}</table>"
