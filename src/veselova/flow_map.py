"""The flow of one body as a function of its start: many starts, any times."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.ensemble_starts import Starts
from veselova.ensembles import MOST_BYTES, solve_starts
from veselova.mechanics.core.budget import Progress, limits
from veselova.mechanics.core.errors import Faults, InvalidInput
from veselova.mechanics.core.exact_input import exact_vector, scale_number, to_float
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.ensemble import Ensemble

__all__ = ["FlowMap"]

Array = NDArray[np.float64]


class FlowMap:
    """The flow of one Veselova body: ``solve_many`` for starts of one body.

    - A: n positive numbers, rounded to doubles
    - inertia: in place of A, the 3 moments I of a body in space; whether a body can have them is
      not asked

    Raises InvalidInput for other A's.
    """

    def __init__(self, A: Any = None, *, inertia: Any = None) -> None:
        if (A is None) == (inertia is None):
            raise InvalidInput(("A",), "A or inertia", "neither" if A is None else "both")
        name, given = ("A", A) if inertia is None else ("inertia", inertia)
        count = None if inertia is None else 3
        numbers = to_float(exact_vector(given, (name,), count, scale_number))
        self.inertia = None if inertia is None else numbers
        self.A = numbers if inertia is None else 1 / numbers

    def solve(
        self,
        q: Any,
        q_dot: Any,
        times: Any,
        outputs: Iterable[str] | None = None,
        *,
        normalize: bool = False,
        most_bytes: int = MOST_BYTES,
        budget_s: float | None = None,
        progress: Progress = None,
    ) -> Ensemble:
        """Return the motions of many starts at the same times, as arrays with the axes problem,
        time.

        - q, q_dot: (N, n), as ``Veselova`` takes them, with ``normalize`` as there; of a body
          given by its ``inertia`` γ and Ω, as ``VeselovaSO3`` takes them
        - times, outputs, most_bytes, budget_s, progress: as ``solve_many`` takes them

        ``error`` bounds the true error of every component of the bounded series at each time:
        true ≤ error. ``solve_many`` does the work; raises as it does.
        """
        faults = Faults()
        grid = faults.attempt(TimeGrid.of, times)
        if self.inertia is None:
            starts = faults.attempt(Starts.of_arrays, self.A, q, q_dot, normalize)
        else:
            body = {"system": "veselova-so3", "inertia": self.inertia, "strict": False}
            state = {"gamma": q, "Omega": q_dot, "normalize": normalize}
            starts = faults.attempt(Starts.of, {**body, **state})
        faults.require_none()
        with limits(budget_s, progress):
            return solve_starts(starts, grid, outputs, most_bytes)

    def __repr__(self) -> str:
        if self.inertia is None:
            return f"FlowMap(A={self.A.tolist()})"
        return f"FlowMap(inertia={self.inertia.tolist()})"
