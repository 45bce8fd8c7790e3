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

    Making it takes as long as 4000 starts of ``solve_many``, and then each start takes a third: it
    pays from some 6000 starts on. For n ≥ 4 tori depend on two constants or more, and
    a table of them does not pay below a million starts: ``solve_many`` serves these. Raises
    InvalidInput for other A's.
    """

    def __init__(self, A: Any) -> None:
        numbers = to_float(exact_vector(A, ("A",), entry=positive_number))
        if numbers.size != 3:
            required = "3 numbers (solve_many serves other dimensions)"
            raise InvalidInput(("A",), required, f"{numbers.size}")
        if np.unique(numbers).size != 3:
            required = "3 different numbers (solve_many serves symmetric bodies)"
            raise InvalidInput(("A",), required, show(numbers.tolist()))
        self.A = numbers
        self._known: Atlas | None = None

    @property
    def _atlas(self) -> Atlas:
        if self._known is None:
            from veselova.analytic.motion.atlas import Atlas

            self._known = Atlas(self.A)
        return self._known

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

        - q, q_dot: (N, 3), as ``Veselova`` takes them, with ``normalize`` as there
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
        starts = faults.attempt(Starts.of_arrays, self.A, q, q_dot, normalize)
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
        for states in self._atlas.states(starts.q[rows], starts.q_dot[rows], grid):
            served = rows[states.rows]
            remaining[served] = False
            yield served, series_of(states, starts.A[served], names)
        yield from side_by_side(starts, np.flatnonzero(remaining), grid, names)

    def __repr__(self) -> str:
        return f"FlowMap(A={self.A.tolist()})"
