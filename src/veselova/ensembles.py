"""Many problems in one call: arrays in, arrays out. Problems are computed in batches where
possible, the rest by ``solve`` and ``torus``, one by one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.engines import solve, torus
from veselova.ensemble_starts import Starts
from veselova.mechanics.core.budget import Progress, checkpoint, limits
from veselova.mechanics.core.errors import Faults, InvalidInput, Unsolved
from veselova.mechanics.core.exact_input import exact_vector, scale_number, to_float
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.geometry.integrals_of_motion import to_spheroconic
from veselova.mechanics.geometry.so_n import wedge
from veselova.mechanics.results.ensemble import SOLVED, Ensemble, allocate, chosen_outputs
from veselova.mechanics.results.sampled_motion import Provenance
from veselova.mechanics.results.torus import Tori, TorusNumbers
from veselova.tunings import FEW_STARTS, TIMES_SIDE_BY_SIDE

__all__ = ["FlowMap", "side_by_side", "solve_many", "solve_starts", "tori"]

Array = NDArray[np.float64]

#: Budget: bytes of the arrays of one answer.
MOST_BYTES = 2**31


def solve_many(
    problems: Sequence[Problem] | Mapping[str, Any],
    times: Any,
    outputs: Iterable[str] | None = None,
    *,
    most_bytes: int = MOST_BYTES,
    budget_s: float | None = None,
    progress: Progress = None,
) -> Ensemble:
    """Return the motions of many problems at the same times, as arrays with the axes problem, time.

    - problems: a list of problems of one system and dimension, or arrays of the fields of a
      system with tori by name, such as ``{"A": (N, n) or (n,), "q": (N, n), "q_dot": (N, n)}``.
      A field is one for all problems, or has a row for each. Matrices A and ``inertia`` have
      three axes: (1, n, n) or (N, n, n). ``normalize``, ``strict`` and ``potential`` are for all.
      ``"system"`` names the system; balls need it, the others are known by their fields
    - times: as ``solve`` takes them, the same for all problems
    - outputs: the series that are kept; where left out q_dot, frame and tau1 of Veselova
      problems, whose others would double the arrays, and all of other systems
    - most_bytes: of the arrays of the answer
    - budget_s, progress: as ``solve`` takes them, for all problems together

    Veselova problems are computed by one compiled loop on all processors, up to 200 times of four
    or more generic starts. ``solve`` does the others, one by one. A problem that cannot be solved
    has NaN and says why in ``outcome`` and ``detail``; the others are served. ``error`` bounds the
    true error of every component of the bounded series at each time: true ≤ error. In the loop it
    grows like 6ε|ω||t|, without guard digits. Tested for |ω||t| up to 1e6, A's up to 100 apart.

    Raises InvalidInput for arrays of different lengths, no problem at all, problems of different
    systems, and more memory than ``most_bytes``; OverBudget when the budget is used up.
    """
    faults = Faults()
    grid = faults.attempt(TimeGrid.of, times)
    starts = faults.attempt(Starts.of, problems)
    faults.require_none()
    with limits(budget_s, progress):
        return solve_starts(starts, grid, outputs, most_bytes)


def tori(
    A: Any,
    q: Any,
    q_dot: Any,
    *,
    normalize: bool = False,
    budget_s: float | None = None,
    progress: Progress = None,
) -> Tori:
    """Return the invariant tori of many Veselova problems as arrays, first axis the problems.

    - A: (N, n), or (n,) for one body; matrices have three axes, (1, n, n) or (N, n, n)
    - q, q_dot: (N, n), as ``Veselova`` takes them, with ``normalize`` as there
    - budget_s, progress: as ``solve`` takes them, for all problems together

    Generic starts are computed by one compiled loop, to 1e-14 of every number (of a cycle for
    phases), tested for n = 2…7 (phases to 3e-12 where A's are ten orders of magnitude apart);
    ``torus`` does the others, one by one. A problem without such a torus has NaN and says why in
    ``outcome`` and ``detail``: ``at-rest``, ``fewer-phases`` where directions do not move,
    ``invalid-input``. Raises InvalidInput for arrays of different lengths and for none, OverBudget
    when the budget is used up.
    """
    starts = Starts.of_arrays(A, q, q_dot, normalize)
    from veselova.analytic.closed.many import tori as tori_of

    with limits(budget_s, progress):
        rows = np.flatnonzero(starts.surely)
        found = tori_of(starts.A[rows], starts.q[rows], starts.q_dot[rows])
        arrays: dict[str, Any] = {}
        for name in (entry.name for entry in fields(TorusNumbers)):
            part = getattr(found, name)
            blank = "" if part.dtype.kind == "U" else np.nan
            arrays[name] = np.full((starts.count, *part.shape[1:]), blank, dtype=part.dtype)
            arrays[name][rows] = part
        known = np.zeros(starts.count, dtype=bool)
        known[rows] = found.known

        def set_torus(i: int) -> None:
            single = torus(starts.problem(i), progress=False)
            if (phases := single.phases.size) < starts.n - 1:
                reason = f"directions do not move: the torus has {phases} phases (see torus)"
                raise Unsolved("fewer-phases", reason)
            for name, values in arrays.items():
                values[i] = getattr(single, name)

        outcomes, details = _one_by_one(known, set_torus)
    return Tori(outcome=outcomes, detail=details, **arrays)


def _one_by_one(
    served: NDArray[np.bool_], work: Callable[[int], None]
) -> tuple[NDArray[np.str_], tuple[str, ...]]:
    """Do the work for each row that is not served yet. Return the outcome of every row, and the
    reason where it is none.
    """
    outcomes = np.full(served.size, SOLVED, dtype="U32")
    details = [""] * served.size
    alone = np.flatnonzero(~served).tolist()
    for done, i in enumerate(alone, start=served.size - len(alone)):
        checkpoint("problems", float(done), float(served.size))
        try:
            work(i)
        except Unsolved as refusal:
            outcomes[i], details[i] = refusal.outcome, refusal.reason
        except InvalidInput as fault:
            outcomes[i], details[i] = "invalid-input", str(fault)
    return outcomes, tuple(details)


def solve_starts(
    starts: Starts, grid: TimeGrid, outputs: Iterable[str] | None, most_bytes: int = MOST_BYTES
) -> Ensemble:
    """Return the motions of validated starts at validated times: what can be computed side by side,
    and the rest by ``solve``; all by ``solve`` where there are few, whatever the number of times.

    Raises as ``solve_many`` does.
    """
    began = time.perf_counter()
    kind = starts.system
    names = chosen_outputs(kind, outputs)
    asked = grid.asked
    arrays = allocate(kind, names, starts.count, asked.size, starts.n, most_bytes)
    served = np.zeros(starts.count, dtype=bool)
    surely = np.flatnonzero(starts.surely)
    if grid.doubles.size <= TIMES_SIDE_BY_SIDE and surely.size > FEW_STARTS:
        for rows, found in side_by_side(starts, surely, grid, names):
            for name, values in found.items():
                arrays[name][rows] = values if grid.places is None else values[:, grid.places]
            served[rows] = True
            checkpoint("problems", float(np.count_nonzero(served)), float(starts.count))

    def set_series(i: int) -> None:
        trajectory = solve(starts.problem(i), grid, progress=False)
        for name in names:
            arrays[name][i] = trajectory.series(name)
        arrays["error"][i] = trajectory.error

    outcomes, details = _one_by_one(served, set_series)
    error = arrays.pop("error")
    together = int(np.count_nonzero(served))
    counts = {"together": together, "alone": starts.count - together}
    provenance = Provenance.since(began, "analytic", "angles", counts)
    axes = kind.outputs, kind.time
    return Ensemble(asked, error, outcomes, details, served, arrays, provenance, *axes)


def side_by_side(
    starts: Starts, rows: NDArray[np.intp], grid: TimeGrid, names: tuple[str, ...]
) -> Iterator[tuple[NDArray[np.intp], dict[str, Array]]]:
    """Yield (rows, series and error by name) of starts that can be computed side by side."""
    from veselova.analytic.closed.many import states_of_starts

    given = starts.A[rows], starts.q[rows], starts.q_dot[rows]
    frames = None if starts.frames is None else starts.frames[rows]
    for states in states_of_starts(*given, grid, frames):
        found = {"error": states.error}
        q = states.frame[..., 0]
        for name in names:
            if name == "q":
                found[name] = q
            elif name == "omega":
                found[name] = wedge(q, states.q_dot)
            elif name == "spheroconic":
                bodies = given[0][states.rows]
                found[name] = np.stack(
                    [to_spheroconic(a, x) for a, x in zip(bodies, q, strict=True)]
                )
            else:
                found[name] = getattr(states, name)
        yield rows[states.rows], found


class FlowMap:
    """The flow of one body: ``solve_many`` for starts of one body.

    - A: n positive numbers, rounded to doubles
    - inertia: in place of A, the 3 moments I of a body in space; whether a body can have them is
      not asked

    Raises InvalidInput for other A's.
    """

    def __init__(self, A: Any = None, *, inertia: Any = None) -> None:
        if (A is None) == (inertia is None):
            raise InvalidInput(("A",), "A or inertia", "neither" if A is None else "both")
        name, given, count = ("A", A, None) if inertia is None else ("inertia", inertia, 3)
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
        time: what ``solve_many`` returns, which has the same arguments, for this body.

        - q, q_dot: (N, n), as ``Veselova`` takes them, with ``normalize`` as there; of a body
          given by its ``inertia`` γ and Ω, as ``VeselovaSO3`` takes them
        """
        given: dict[str, Any] = {"A": self.A, "q": q, "q_dot": q_dot, "normalize": normalize}
        if self.inertia is not None:
            state = {"gamma": q, "Omega": q_dot, "normalize": normalize, "strict": False}
            given = {"inertia": self.inertia, **state}
        return solve_many(
            given, times, outputs, most_bytes=most_bytes, budget_s=budget_s, progress=progress
        )

    def __repr__(self) -> str:
        if self.inertia is None:
            return f"FlowMap(A={self.A.tolist()})"
        return f"FlowMap(inertia={self.inertia.tolist()})"
