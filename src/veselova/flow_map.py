"""The flow of one body as a function of its start: many starts, any times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from veselova.ensemble_starts import Starts
from veselova.ensembles import MOST_BYTES, fill, series_of, side_by_side
from veselova.mechanics.core.budget import Progress, limits
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import exact_vector, positive_number, to_float
from veselova.mechanics.core.number_contexts import in_own_contexts
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.ensemble import Ensemble
from veselova.tunings import FEW_STARTS_OF_ONE_BODY

if TYPE_CHECKING:
    from veselova.analytic.motion.atlas import Atlas

__all__ = ["FlowMap"]

Array = NDArray[np.float64]


@in_own_contexts
class FlowMap:
    """The flow of one Veselova body, n = 3, with all that its tori need interpolated in c_2.

    - A: 3 different positive numbers, rounded to doubles
    - inertia: in place of A, the moments I of a body in space, 3 different doubles; whether a
      body can have them is not asked

    Making it takes as long as 4000 starts of ``solve_many``, and then each start takes a third: it
    pays from some 6000 starts on. For n ≥ 4 tori depend on two constants or more, and
    a table of them does not pay below a million starts: ``solve_many`` serves these. Raises
    InvalidInput for other A's.
    """

    def __init__(self, A: Any = None, *, inertia: Any = None) -> None:
        if (A is None) == (inertia is None):
            raise InvalidInput(("A",), "A or inertia", "neither" if A is None else "both")
        name, given = ("A", A) if inertia is None else ("inertia", inertia)
        numbers = to_float(exact_vector(given, (name,), entry=positive_number))
        if numbers.size != 3:
            required = "3 numbers (solve_many serves other dimensions)"
            raise InvalidInput((name,), required, f"{numbers.size}")
        if np.unique(numbers).size != 3:
            required = "3 different numbers (solve_many serves symmetric bodies)"
            raise InvalidInput((name,), required, show(numbers.tolist()))
        self.inertia = None if inertia is None else numbers
        self.A = numbers if inertia is None else 1 / numbers
        self._known: dict[tuple[float, ...], Atlas] = {}

    def _atlas(self, A: Array) -> Atlas:
        key = tuple(A.tolist())
        if key not in self._known:
            from veselova.analytic.motion.atlas import Atlas

            self._known[key] = Atlas(A)
        return self._known[key]

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

        - q, q_dot: (N, 3), as ``Veselova`` takes them, with ``normalize`` as there; of a body
          given by its ``inertia`` γ and Ω, as ``VeselovaSO3`` takes them
        - times, outputs, most_bytes, budget_s, progress: as ``solve_many`` takes them

        The first call makes the tables, in about half a second, or three where the largest A is
        more than ten times the smallest; beyond 10⁶ times there are none. Starts without a table,
        and those nearer to the separatrix c_2 = I_2 than 1/2000 of the way to the next I, are
        computed side by side, or by ``solve``. ``error`` bounds the true error of every
        component of the bounded series at each time: true ≤ error; it grows like 10ε|ω||t|. Raises
        as ``solve_many`` does.
        """
        faults = Faults()
        grid = faults.attempt(TimeGrid.of, times)
        if self.inertia is None:
            starts = faults.attempt(Starts.of_arrays, self.A, q, q_dot, normalize)
        else:
            body = {"system": "veselova-so3", "inertia": self.inertia, "strict": False}
            state = {"gamma": q, "Omega": q_dot, "normalize": normalize}
            starts = faults.attempt(Starts.of, {**body, **state})
        if starts is not None and starts.n != 3:
            faults.add(("q",), "rows of 3 numbers", f"rows of {starts.n}")
        faults.require_none()
        assert grid is not None
        assert starts is not None
        with limits(budget_s, progress):
            return fill(starts, grid, outputs, most_bytes, self._together, FEW_STARTS_OF_ONE_BODY)

    def _together(
        self, starts: Starts, rows: NDArray[np.intp], grid: TimeGrid, names: tuple[str, ...]
    ) -> Iterator[tuple[NDArray[np.intp], dict[str, Array]]]:
        """Yield the states of starts on the tables, then of those beside them."""
        remaining = np.zeros(starts.count, dtype=bool)
        remaining[rows] = True
        for served, found in self._on_tables(starts, rows, grid, names):
            remaining[served] = False
            yield served, found
        yield from side_by_side(starts, np.flatnonzero(remaining), grid, names)

    def _on_tables(
        self, starts: Starts, rows: NDArray[np.intp], grid: TimeGrid, names: tuple[str, ...]
    ) -> Iterator[tuple[NDArray[np.intp], dict[str, Array]]]:
        masses, q, q_dot = starts.A[rows], starts.q[rows], starts.q_dot[rows]
        if self.inertia is None:
            for states in self._atlas(self.A).states(q, q_dot, grid):
                yield rows[states.rows], series_of(states, masses[states.rows], names)
        elif rows.size:
            from veselova.body_ensembles import bodies_side_by_side

            for places, found in bodies_side_by_side(
                masses, q, q_dot, lambda A, x, v: self._atlas(A[0]).states(x, v, grid), names
            ):
                yield rows[places], found

    def __repr__(self) -> str:
        if self.inertia is None:
            return f"FlowMap(A={self.A.tolist()})"
        return f"FlowMap(inertia={self.inertia.tolist()})"
