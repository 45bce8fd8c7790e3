"""Many problems in one call: arrays in, arrays out. What can be is computed side by side, the rest
by ``solve`` and ``torus``, one by one.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.engines import solve, torus
from veselova.ensemble_starts import Starts
from veselova.mechanics.core.budget import Progress, checkpoint, limits
from veselova.mechanics.core.errors import Faults, InvalidInput, Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.geometry.spheroconic import to_spheroconic
from veselova.mechanics.results.ensemble import SOLVED, Ensemble, allocate, chosen_outputs
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.tori import Tori, TorusNumbers
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.systems.veselova import Veselova
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3
from veselova.tunings import FEW_STARTS, TIMES_SIDE_BY_SIDE

__all__ = [
    "MOST_BYTES",
    "series_of",
    "side_by_side",
    "solve_many",
    "solve_starts",
    "tori",
]

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

    Veselova problems, and arrays of bodies in space with (Ω,γ) = 0, are computed by one compiled
    loop on all processors, up to 200 times of four or more generic starts. ``solve`` does the
    others, one by one. A problem that cannot be solved has NaN and says why in ``outcome`` and
    ``detail``; the others are served. ``error`` bounds the true error of every component of the
    bounded series at each time: true ≤ error. In the loop it grows like 6ε|ω||t|, without guard
    digits. Tested for |ω||t| up to 1e6, A's up to 100 apart.

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
            blank = np.zeros if part.dtype.kind == "U" else np.ones
            values = blank((starts.count, *part.shape[1:]), dtype=part.dtype)
            arrays[name] = values if part.dtype.kind == "U" else values * np.nan
            arrays[name][rows] = part
        known = np.zeros(starts.count, dtype=bool)
        known[rows] = found.known
        outcomes = np.full(starts.count, SOLVED, dtype="U32")
        details = [""] * starts.count
        alone = np.flatnonzero(~known).tolist()
        for done, i in enumerate(alone):
            checkpoint("problems", float(done), float(len(alone)))
            try:
                single = torus(starts.problem(i), progress=False)
                _require_all_phases(single, starts.n)
            except Unsolved as refusal:
                outcomes[i], details[i] = refusal.outcome, refusal.reason
            except InvalidInput as fault:
                outcomes[i], details[i] = "invalid-input", str(fault)
            else:
                for name, values in arrays.items():
                    values[i] = getattr(single, name)
    return Tori(outcome=outcomes, detail=tuple(details), **arrays)


def _require_all_phases(found: Torus, n: int) -> None:
    """Raise Unsolved (``fewer-phases``) where a torus has fewer than n−1."""
    if found.phases.size < n - 1:
        reason = f"directions do not move: the torus has {found.phases.size} phases (see torus)"
        raise Unsolved("fewer-phases", reason)


def solve_starts(
    starts: Starts, grid: TimeGrid, outputs: Iterable[str] | None, most_bytes: int = MOST_BYTES
) -> Ensemble:
    """Return the motions of validated starts at validated times: what can be computed side by side,
    and the rest by ``solve``; all by ``solve`` where there are few, whatever the number of times.

    Raises as ``solve_many`` does.
    """
    began = time.perf_counter()
    names = chosen_outputs(starts.system, outputs)
    asked = grid.asked
    arrays = allocate(starts.system, names, starts.count, asked.size, starts.n, most_bytes)
    served = np.zeros(starts.count, dtype=bool)
    details = [""] * starts.count
    outcomes = np.full(starts.count, SOLVED, dtype="U32")
    surely = np.flatnonzero(starts.surely)
    if grid.doubles.size <= TIMES_SIDE_BY_SIDE and surely.size > FEW_STARTS:
        done = 0
        for rows, found in side_by_side(starts, surely, grid, names):
            for name, values in found.items():
                arrays[name][rows] = values if grid.places is None else values[:, grid.places]
            served[rows] = True
            done += rows.size
            checkpoint("problems", float(done), float(starts.count))
    alone = np.flatnonzero(~served)
    done = starts.count - alone.size
    for i in alone.tolist():
        checkpoint("problems", float(done), float(starts.count))
        done += 1
        try:
            trajectory = solve(starts.problem(i), grid, progress=False)
        except Unsolved as refusal:
            outcomes[i], details[i] = refusal.outcome, refusal.reason
        except InvalidInput as fault:
            outcomes[i], details[i] = "invalid-input", str(fault)
        else:
            for name in names:
                arrays[name][i] = trajectory.series(name)
            arrays["error"][i] = trajectory.error
    error = arrays.pop("error")
    counts = {"together": int(np.count_nonzero(served)), "alone": int(alone.size)}
    provenance = Provenance.since(began, "analytic", "angles", counts)
    kind = starts.system
    return Ensemble(
        asked,
        error,
        outcomes,
        tuple(details),
        served,
        arrays,
        provenance,
        kind.outputs,
        kind.time,
    )


def side_by_side(
    starts: Starts, rows: NDArray[np.intp], grid: TimeGrid, names: tuple[str, ...]
) -> Iterable[Any]:
    """Yield (rows, series by name) of starts that can be computed side by side."""
    if not rows.size or starts.system not in (Veselova, VeselovaSO3):
        return
    from veselova.analytic.closed.many import states_of_starts

    given = starts.A[rows], starts.q[rows], starts.q_dot[rows]
    if starts.system is VeselovaSO3:
        from veselova.body_ensembles import bodies_side_by_side

        for places, found in bodies_side_by_side(
            *given, lambda A, q, q_dot: states_of_starts(A, q, q_dot, grid), names
        ):
            yield rows[places], found
        return

    frames = None if starts.frames is None else starts.frames[rows]
    for states in states_of_starts(*given, grid, frames):
        yield rows[states.rows], series_of(states, given[0][states.rows], names)


def series_of(states: Any, A: Array, names: tuple[str, ...]) -> dict[str, Array]:
    """Return the named series, and the error, of states side by side of bodies A (N, n)."""
    found = {"error": states.error}
    q = states.frame[..., 0]
    for name in names:
        if name == "q":
            found[name] = q
        elif name == "omega":
            product = q[..., :, None] * states.q_dot[..., None, :]
            found[name] = product - np.swapaxes(product, -1, -2)
        elif name == "spheroconic":
            found[name] = np.stack([to_spheroconic(a, x) for a, x in zip(A, q, strict=True)])
        else:
            found[name] = getattr(states, name)
    return found
