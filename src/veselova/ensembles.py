"""Many problems in one call: arrays in, arrays out. What can be is computed side by side, the rest
by ``solve`` and ``torus``, one by one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.engines import solve, torus
from veselova.mechanics.core.budget import Progress, checkpoint, limits
from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    Unsolved,
    missing_fields,
    show,
    unknown_fields,
)
from veselova.mechanics.core.exact_input import double_array, require_truth_value
from veselova.mechanics.core.number_contexts import in_own_contexts
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.geometry.spheroconic import to_spheroconic
from veselova.mechanics.results.ensemble import SOLVED, Ensemble, allocate, chosen_outputs
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.tori import Tori
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.systems.veselova import Veselova
from veselova.tunings import TIMES_SIDE_BY_SIDE

__all__ = [
    "MOST_BYTES",
    "Starts",
    "fill",
    "series_of",
    "side_by_side",
    "solve_many",
    "solve_starts",
    "tori",
]

Array = NDArray[np.float64]

#: Budget: bytes of the arrays of one answer.
MOST_BYTES = 2**31

#: A start this near to the bound of the tolerance is left to the problem itself, which refuses or
#: takes it.
_SURELY = INPUT_TOLERANCE / 2

#: N = n rows that are a symmetric matrix may be meant as one, which Veselova takes as A.
_ONE_MEANING = "n numbers, N rows, or matrices with three axes: (1, n, n) for all, or (N, n, n)"

#: The fields of problems that are given as arrays.
_FIELDS = ("A", "q", "q_dot", "normalize")


@in_own_contexts
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

    - problems: a list of problems of one system and dimension, or the arrays of Veselova
      problems, ``{"A": (N, n) or (n,), "q": (N, n), "q_dot": (N, n)}`` with ``normalize`` as
      there; frames are then the natural ones. Matrices A have three axes: (1, n, n) or (N, n, n)
    - times: as ``solve`` takes them, the same for all problems
    - outputs: the series that are kept, all that do not follow from others where left out
    - most_bytes: of the arrays of the answer
    - budget_s, progress: as ``solve`` takes them, for all problems together

    Veselova problems with n = 2 and 3, up to 200 times and generic starts are computed side by
    side: by the Fourier time map and in angles, at any time. ``solve``
    does the others, one by one. A problem that cannot be solved has NaN and says why in
    ``outcome`` and ``detail``; the others are served. ``error`` bounds the true error of every
    component of the bounded series at each time: true ≤ error. Side by side it grows like
    4ε|ω||t|, without guard digits. Tested for |ω||t| up to 1e6, A's up to 100 apart.

    Raises InvalidInput for arrays of different lengths, no problem at all, problems of different
    systems, and more memory than ``most_bytes``; OverBudget when the budget is used up.
    """
    faults = Faults()
    grid = faults.attempt(TimeGrid.of, times)
    starts = faults.attempt(Starts.of, problems)
    faults.require_none()
    assert grid is not None
    assert starts is not None
    with limits(budget_s, progress):
        return solve_starts(starts, grid, outputs, most_bytes)


def solve_starts(
    starts: Starts, grid: TimeGrid, outputs: Iterable[str] | None, most_bytes: int = MOST_BYTES
) -> Ensemble:
    """Return the motions of validated starts at validated times; raises as ``solve_many`` does."""
    return fill(starts, grid, outputs, most_bytes, side_by_side)


@in_own_contexts
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

    Generic starts, n ≤ 9, are computed side by side, to 1e-14 of every number (of a cycle for
    phases), tested for n = 2…7 (phases to 3e-12 where A's are ten orders of magnitude apart);
    ``torus`` does the others, one by one. A problem without such a
    torus has NaN and says why in ``outcome`` and ``detail``: ``at-rest``, ``fewer-phases`` where
    directions do not move, ``invalid-input``. Raises InvalidInput for arrays of different lengths
    and for none, OverBudget when the budget is used up.
    """
    starts = Starts.of_arrays(A, q, q_dot, normalize)
    from veselova.analytic.motion.invariant_torus_batch import tori as tori_of

    with limits(budget_s, progress):
        rows = np.flatnonzero(starts.surely)
        found = tori_of(starts.A[rows], starts.q[rows], starts.q_dot[rows])
        names = [entry.name for entry in fields(found) if entry.name != "known"]
        arrays: dict[str, Any] = {}
        for name in names:
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
    return Tori(outcomes, tuple(details), **arrays)


def _require_all_phases(found: Torus, n: int) -> None:
    """Raise Unsolved (``fewer-phases``) where a torus has fewer than n−1."""
    if found.phases.size < n - 1:
        reason = f"directions do not move: the torus has {found.phases.size} phases (see torus)"
        raise Unsolved("fewer-phases", reason)


@dataclass(frozen=True)
class Starts:
    """N problems of one system.

    - system, n: their system and dimension
    - count: N
    - A, q, q_dot: (N, n) doubles, exact where ``surely`` (N,)
    - frames: (N, n, n) at the start, NaN for natural ones; None where all are
    - problem: the i-th problem; raises InvalidInput where it is none
    - normalize: whether it scales q and projects q_dot
    """

    system: type[Problem]
    n: int
    count: int
    A: Array
    q: Array
    q_dot: Array
    surely: NDArray[np.bool_]
    frames: Array | None
    problem: Callable[[int], Problem]
    normalize: bool = False

    @property
    def are_natural(self) -> NDArray[np.bool_]:
        """Return which frames are the natural ones, (N,)."""
        if self.frames is None:
            return np.ones(self.count, dtype=bool)
        return np.asarray(np.isnan(self.frames[:, 0, 0]))

    @classmethod
    def of(cls, problems: Any) -> Starts:
        """Return the problems of a list, or of arrays by name. Raises InvalidInput."""
        if isinstance(problems, Mapping):
            return cls.of_arrays(**_fields(problems))
        if isinstance(problems, (str, bytes)) or not isinstance(problems, Sequence):
            required = "a list of problems, or their arrays A, q, q_dot by name"
            raise InvalidInput(("problems",), required, show(problems))
        return _of_list(problems)

    @classmethod
    def of_arrays(cls, A: Any, q: Any, q_dot: Any, normalize: Any = False) -> Starts:
        """Return Veselova problems, arrays as ``solve_many`` has them. Raises InvalidInput."""
        require_truth_value(normalize, "normalize")
        faults = Faults()
        found = [
            faults.attempt(double_array, value, (name,))
            for name, value in (("A", A), ("q", q), ("q_dot", q_dot))
        ]
        faults.require_none()
        masses, position, velocity = (np.asarray(x) for x in found)
        if position.ndim != 2:
            raise InvalidInput(("q",), "an array of N rows of n numbers", _shape(position))
        count, n = position.shape
        if count == 0:
            raise InvalidInput(("q",), "one row at least", "no row")
        if n < 2:
            raise InvalidInput(("q",), "rows of at least 2 numbers", _shape(position))
        if velocity.shape != position.shape:
            required = f"an array of {count} rows of {n} numbers, as q is"
            faults.add(("q_dot",), required, _shape(velocity))
        if masses.shape not in ((n,), position.shape, (1, n, n), (count, n, n)):
            required = f"{n} numbers, or {count} rows of {n}, as q has them"
            faults.add(("A",), required, _shape(masses))
        elif masses.shape == (n, n) and _may_be_inertia(masses):
            faults.add(("A",), _ONE_MEANING, f"a symmetric matrix of shape {masses.shape}")
        faults.require_none()
        given = np.broadcast_to(masses, (count, n) if masses.ndim < 3 else (count, n, n))
        masses = given if masses.ndim < 3 else _diagonals(given)

        def problem(i: int) -> Problem:
            row = masses[i] if np.isfinite(masses[i]).all() else given[i]
            return Veselova(
                row.tolist(),
                position[i].tolist(),
                velocity[i].tolist(),
                normalize=bool(normalize),
            )

        surely = _are_starts(masses, position, velocity, bool(normalize))
        return cls(
            Veselova,
            n,
            count,
            masses,
            position,
            velocity,
            surely,
            None,
            problem,
            bool(normalize),
        )


def _fields(problems: Mapping[str, Any]) -> dict[str, Any]:
    faults = Faults()
    faults.found += unknown_fields(("problems",), problems, _FIELDS)
    faults.found += missing_fields(("problems",), problems, _FIELDS[:3])
    faults.require_none()
    return dict(problems)


def _shape(array: Array) -> str:
    return f"an array of shape {array.shape}"


def _may_be_inertia(A: Array) -> bool:
    """Return whether a matrix is symmetric, and positive definite or no rows of positive numbers:
    rows of it may be meant as those of one matrix.
    """
    symmetric = np.isfinite(A).all() and np.array_equal(A, A.T)
    return bool(symmetric and (np.all(np.linalg.eigvalsh(A) > 0) or not np.all(A > 0)))


def _diagonals(matrices: Array) -> Array:
    """Return the diagonals of matrices (N, n, n), NaN for those that have other entries."""
    found = np.diagonal(matrices, axis1=1, axis2=2)
    others = matrices - found[:, :, None] * np.eye(found.shape[1])
    return np.where(np.any(others != 0, axis=(1, 2))[:, None], np.nan, found)


def _are_starts(A: Array, q: Array, velocity: Array, normalize: bool) -> NDArray[np.bool_]:
    """Return which rows are surely valid starts that move, (N,); no number is not."""
    with np.errstate(all="ignore"):
        length = np.linalg.norm(q, axis=1)
        speed = np.linalg.norm(velocity, axis=1)
        known = np.isfinite(length) & np.isfinite(speed) & (length > 0) & (speed > 0)
        known &= np.all((A > 0) & (np.inf > A), axis=1)
        if not normalize:
            known &= np.abs(length - 1) < _SURELY
            known &= np.abs(np.sum(q * velocity, axis=1)) < _SURELY * speed
    return np.asarray(known)


def _of_list(problems: Sequence[Any]) -> Starts:
    if not problems:
        raise InvalidInput(("problems",), "one problem at least", "none")
    for i, problem in enumerate(problems):
        if not isinstance(problem, Problem):
            required = "a problem, such as veselova.Veselova(A, q, q_dot)"
            raise InvalidInput(("problems", i), required, show(problem))
    first = problems[0]
    system = type(first)
    n = getattr(first, "n", 3)
    for i, problem in enumerate(problems):
        if type(problem) is not system or getattr(problem, "n", 3) != n:
            required = f"a problem of system {system.system} with n = {n}, as the first"
            raise InvalidInput(("problems", i), required, show(problem))
    count = len(problems)
    numbers = np.full((3, count, n), np.nan)
    frames = np.full((count, n, n), np.nan)
    surely = np.zeros(count, dtype=bool)
    for i, problem in enumerate(problems):
        if system is Veselova and problem.axes is None and problem.moves:
            exact = problem.exact
            vectors = (exact.A, exact.q, exact.q_dot)
            numbers[:, i] = [[float(x) for x in vector] for vector in vectors]
            surely[i] = all(
                Fraction(x) == y
                for row, vector in zip(numbers[:, i].tolist(), vectors, strict=True)
                for x, y in zip(row, vector, strict=True)
            )
            if not exact.natural:
                frames[i] = problem.frame
    A, q, q_dot = numbers
    return Starts(system, n, count, A, q, q_dot, surely, frames, problems.__getitem__, True)


#: What computes states side by side: yields (rows, series by name, error).
Together = Callable[[Starts, NDArray[np.intp], TimeGrid, tuple[str, ...]], Iterable[Any]]


def fill(
    starts: Starts,
    grid: TimeGrid,
    outputs: Iterable[str] | None,
    most_bytes: int,
    together: Together,
) -> Ensemble:
    """Return the ensemble of starts at times: what ``together`` gives, and the rest by ``solve``.

    Raises as ``solve_many`` does.
    """
    began = time.perf_counter()
    names = chosen_outputs(starts.system, outputs)
    asked = grid.asked
    arrays = allocate(starts.system, names, starts.count, asked.size, starts.n, most_bytes)
    places = slice(None) if grid.places is None else grid.places
    served = np.zeros(starts.count, dtype=bool)
    details = [""] * starts.count
    outcomes = np.full(starts.count, SOLVED, dtype="U32")
    surely = np.flatnonzero(starts.surely)
    if grid.doubles.size <= TIMES_SIDE_BY_SIDE and surely.size:
        from veselova.analytic.compiled.compiler import serving

        with serving(surely.size):
            for rows, found in together(starts, surely, grid, names):
                for name, values in found.items():
                    arrays[name][rows] = values[:, places]
                served[rows] = True
                checkpoint("problems", float(np.count_nonzero(served)), float(starts.count))
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
    return Ensemble(
        asked, error, outcomes, tuple(details), served, arrays, provenance, starts.system.outputs
    )


def side_by_side(
    starts: Starts, rows: NDArray[np.intp], grid: TimeGrid, names: tuple[str, ...]
) -> Iterable[Any]:
    """Yield (rows, series by name) of starts that can be computed side by side."""
    if starts.system is not Veselova:
        return
    from veselova.analytic.motion.ensemble import states_of_starts

    frames = None if starts.frames is None else starts.frames[rows]
    for states in states_of_starts(
        starts.A[rows], starts.q[rows], starts.q_dot[rows], grid, frames
    ):
        yield rows[states.rows], series_of(states, starts.A[rows[states.rows]], names)


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
