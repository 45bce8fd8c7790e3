"""A motion in closed form as a function of time, of every kind: rest, provenance and pickling; its
attitude on the torus, and how sensitive that is to the phases.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import Values
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.sampled_motion import Provenance
from veselova.mechanics.results.trajectory import Trajectory

__all__ = ["BETWEEN", "MOST_LOCAL", "Attitude", "Motion", "combine_bounds", "sensitivity"]

Array = NDArray[np.float64]

P = TypeVar("P", bound=Problem)

#: Budget: times up to which an error is that by the sensitivities at the times themselves; for more
#: times it is that by the largest sensitivity on the torus. A budget: at so many points they cost
#: less than the periods do.
MOST_LOCAL = 24

#: Calibrated: by how much the steepness between the sampled points may be larger than at them.
BETWEEN = 1.25

#: Derived: the largest second derivative over the square of the largest first one, with some to
#: spare: one for a cosine, 0.8 for a hyperbolic tangent.
_CURVATURE = 4.0


@dataclass(frozen=True)
class Motion(ABC, Generic[P]):
    """The motion of a problem; what was computed for it is kept, and made again where it was left
    behind by pickling.
    """

    problem: P

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def __call__(self, times: Any) -> Trajectory:
        """Return the trajectory at times, in the order in which they are asked for."""
        grid, began = TimeGrid.of(times), time.perf_counter()
        try:
            found = self._evaluate(grid) if self.problem.moves else None
        except Unsolved as refusal:
            if refusal.outcome != "at-rest":
                raise
            found = None  # beside a stable equilibrium nothing moves by a digit
        if found is None:
            provenance = Provenance.since(began, "analytic", "rest", {"regime": "rest"})
            return Trajectory.at_rest(self.problem, grid, provenance, self)
        series, error, method, details = found
        provenance = Provenance.since(began, "analytic", method, details)
        return Trajectory.on_grid(self.problem, grid, error, series, provenance, self)

    @abstractmethod
    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        """Return the series of a problem that moves, their error, the method and its details.
        Raises Unsolved (``at-rest``) where nothing moves by a digit.
        """


@dataclass(frozen=True)
class Attitude:
    """The body at N points of the torus, along sorted principal axes.

    - q: (N, n)
    - normals: (N, n, g) columns n_2 … n_{n−1}, γ
    - components: (N, g) of q' along them
    - spheroconic: (N, g)
    """

    q: Values
    normals: Values
    components: Values
    spheroconic: Values

    @property
    def q_prime(self) -> Values:
        """Return q' = dq/dτ₁ = Σ_k v_k n_k, shape (N, n)."""
        return np.asarray((self.normals * self.components[:, None, :]).sum(axis=2))

    @classmethod
    def concatenate(cls, parts: list[Attitude]) -> Attitude:
        """Return the attitudes one after the other."""
        return cls(
            *(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls))
        )


def sensitivity(slopes: Array, rates: Array, sources: Array) -> Array:
    """Return derivatives of a state, each the largest over K numbers x such as the entries of its
    frame, at N points of the torus, (4, N): |dx/dτ₁| along the flow, √Σ_k (∂x/∂z_k)² of all phases
    together, Σ_k |f_k ∂x/∂z_k| by the frequencies, and √Σ_j (Σ_k ∂x/∂z_k δ_kj)² by the start, where
    source j of rounding moves phase k by δ_kj.

    slopes: (N, K, g) in every phase; rates: (g,) f; sources: (g, S) δ
    """
    with np.errstate(over="ignore"):  # of slopes beyond 1e154 the norm is infinite
        found = (
            np.abs(slopes @ rates),
            np.linalg.norm(slopes, axis=2),
            np.abs(slopes) @ np.abs(rates),
            np.linalg.norm(slopes @ sources, axis=2),
        )
    return np.asarray(np.max(found, axis=2))


def combine_bounds(largest: Array, local: Array) -> Array:
    """Return the error from two bounds: by the largest sensitivities, and by those at the state.

    The state moves by the error meanwhile, and a sensitivity changes by at most _CURVATURE times
    the square of the largest one: what the second bound leaves out is of second order.
    """
    left_out = _CURVATURE * largest * np.minimum(largest, 1.0)  # squares may leave the floats
    return np.asarray(np.minimum(largest, local + left_out))
