"""The numerical engine's answer: integrate the motion and its neighbours, project every ten
radians, report the largest difference.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import require_name
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.sampled_motion import Provenance
from veselova.mechanics.results.trajectory import Trajectory
from veselova.numeric.integrator import Integrator

__all__ = ["METHODS", "solve"]

Array = NDArray[np.float64]

#: Method → where its Integrator lives; a back end is imported when it is asked for.
METHODS: Mapping[str, tuple[str, str]] = {
    "dop853": ("veselova.numeric.dop853", "Dop853"),
    "taylor": ("veselova.numeric.taylor", "Taylor"),
}

#: Calibrated: scaled time (about radians of turning) between projections: at n = 3, t = 1e5 they
#: cut the error from 1e-5 to 3.5e-10.
_SEGMENT = 10.0

#: Budget: scaled time that an integration is begun for: hours at n = 3, and by then one rounding of
#: the data has grown to 1e-7.
_FARTHEST = 1e9

#: Calibrated: how far from the data, in ε, the check run starts: rounding of the start and of each
#: projection is common to equal starts.
_DATA_ROUNDING = 32.0

#: Calibrated: what the difference of runs may hide: rounding that happens to agree, in ε·(1 +
#: turning).
_SHARED_ROUNDING = 16.0

#: Method: scaled times at which runs are compared besides those asked for: half a radian apart up
#: to 64, then each farther by 4 %; and before a quarter of a radian, since a stiff body has turned
#: many times by then.
_INSTANTS = np.concatenate(
    [2.0 ** np.arange(-14, -1), np.arange(0, 64.5, 0.5), 64 * 1.02 ** np.arange(2, 840, 2)]
)

#: Why an error leaves no digit.
_PARTED = "two integrations whose starts differ by a few roundings part by as much"

#: Calibrated: what the estimate may still miss: with it the true error is at most the reported one.
#: Largest true error over an estimate without it, in all draws of ``benchmarks/honesty.py``: 0.66.
_SAFETY = 2.0


def solve(
    problem: Problem, times: Any, *, method: str = "dop853", formulation: str | None = None
) -> Trajectory:
    """Return the motion at the given times by integrating the problem's flow; the start is at time
    zero.

    ``method``: ``dop853`` (SciPy, relative tolerance 2e-14) or ``taylor`` (heyoka, to rounding).
    ``formulation``: one of the problem's ``formulations``, equations of motion that differ and
    agree; None takes the first.
    ``error`` estimates the largest true error of a component of the bounded series at each time,
    by a second integration from a start a few roundings away; that of DOP853 has a looser
    tolerance. It is twice the sum of eight times (``taylor``: four) the running maximum of the
    difference in these series, the rounding that both may share, and the error of a step.
    true ≤ error is tested for n = 2…8, |ω t| ≤ 10⁴.

    Raises InvalidInput for bad times or names, BackendMissing without the library, Unsolved when
    the integrator gives up.
    """
    grid = TimeGrid.of(times)
    require_name(method, ("method",), list(METHODS))
    if formulation is not None:
        require_name(formulation, ("formulation",), problem.formulations)
    module, name = METHODS[method]
    backend: type[Integrator] = getattr(import_module(module), name)
    chosen = formulation or problem.formulations[0]
    began = time.perf_counter()
    again = partial(solve, problem, method=method, formulation=formulation)
    details = {
        "formulation": chosen,
        "tolerance": backend.tolerance,
        "steps": 0,
        "projection_every": _SEGMENT,
    }
    if problem.without_closed_form:
        details["without_closed_form"] = problem.without_closed_form
    if not problem.moves:
        provenance = Provenance.since(began, "numeric", method, details)
        return Trajectory.at_rest(problem, grid, provenance, again)
    flow = problem.flow(chosen)
    farthest = float(np.max(np.abs(grid.doubles / flow.time_unit)))
    if not farthest <= _FARTHEST:
        further = ", the closed form farther" if "analytic" in problem.engines else ""
        raise Unsolved(
            "too-far",
            f"{farthest:.3g} radians of turning; integration goes to {_FARTHEST:.0e}{further}",
        )
    series, error, steps = _integrate_with_neighbours(flow, problem.bounded, grid, backend)
    series = problem.complete(series)
    details = {**details, "steps": steps}
    provenance = Provenance.since(began, "numeric", method, details)
    error = problem.bound(series, error)
    problem.require_digit(grid.doubles, error, _PARTED)
    return Trajectory.on_grid(problem, grid, error, series, provenance, again)


def _integrate_with_neighbours(
    flow: Flow, bounded: tuple[str, ...], grid: TimeGrid, backend: type[Integrator]
) -> tuple[Series, Array, int]:
    asked = grid.doubles / flow.time_unit
    # Two runs may agree by chance at the few times asked for, and where both dwell at the same
    # equilibrium; not at all of these too, which no time that is asked for changes.
    fixed = np.union1d(-_instants_until(-asked[0]), _instants_until(asked[-1]))
    scaled = np.union1d(asked, fixed)
    moved = _DATA_ROUNDING * np.finfo(float).eps
    neighbours = [flow.neighbour(part * moved) for part in backend.neighbours]
    flows = (flow, *neighbours)
    integrator = backend(flows)
    states, *others = _integrate(flows, scaled, integrator)
    series = flow.unpack(states)
    unpacked = [run.unpack(found) for run, found in zip(neighbours, others, strict=True)]
    names = [name for name in bounded if name in series]
    difference = np.max(
        [_largest(series[name] - other[name]) for other in unpacked for name in names], axis=0
    )
    rounding = flow.size * _SHARED_ROUNDING * np.finfo(float).eps * (1 + np.abs(scaled))
    # One step's own error, and that of interpolating inside it, is in both runs where their first
    # steps coincide.
    truncation = flow.size * backend.tolerance
    error = _SAFETY * (
        backend.safety * _largest_until(scaled, difference, fixed) + rounding + truncation
    )
    kept = np.searchsorted(scaled, asked)
    found = {name: values[kept] for name, values in series.items()}
    if not grid.late.any():
        return found, error[kept], integrator.steps
    slopes = np.stack([flow.vector_field(0.0, state) for state in states[kept]])
    later = flow.unpack(states[kept] + (grid.late / flow.time_unit)[:, None] * slopes)
    further = [_largest(later[name] - found[name]) for name in names]
    return found, error[kept] + _SAFETY * np.max(further, axis=0), integrator.steps


def _instants_until(farthest: float) -> Array:
    """Return the fixed instants from zero to at most this scaled time."""
    return _INSTANTS[max(farthest, 0.0) >= _INSTANTS]


def _largest(values: Array) -> Array:
    """Return the largest component at each time, in absolute value."""
    return np.asarray(np.max(np.abs(values.reshape(values.shape[0], -1)), axis=1))


def _integrate(flows: Sequence[Flow], scaled: Array, integrator: Integrator) -> Array:
    """Return the states (B, N, m) of B flows at the scaled times, integrating outwards from t = 0
    in both directions.
    """
    initial = np.stack([flow.initial for flow in flows])
    found = np.empty((len(flows), scaled.size, initial.shape[1]))
    whole = max(float(scaled[-1]), 0.0) - min(float(scaled[0]), 0.0)
    passed = 0.0
    for direction in (1.0, -1.0):
        indices = np.flatnonzero(scaled >= 0) if direction > 0 else np.flatnonzero(scaled < 0)[::-1]
        states = initial
        start = 0.0
        done = 0
        while done < indices.size:
            farthest = direction * scaled[indices[-1]]
            # The last segment is stretched rather than followed by a sliver.
            stop = start + _SEGMENT if farthest - start > 1.5 * _SEGMENT else max(farthest, start)
            reached = done + int(
                np.searchsorted(direction * scaled[indices[done:]], stop, side="right")
            )
            wanted = scaled[indices[done:reached]]
            checkpoint("integration", passed + start, whole)
            if stop > start:
                found[:, indices[done:reached]], states = integrator.advance(
                    states, direction * start, direction * stop, wanted
                )
                states = np.stack(
                    [flow.project(state) for flow, state in zip(flows, states, strict=True)]
                )
            else:
                found[:, indices[done:reached]] = states[:, None]
            start = stop
            done = reached
        passed += start
    return found


def _largest_until(scaled: Array, difference: Array, fixed: Array) -> Array:
    """Return the largest difference at each time and at the fixed instants from t = 0 to it."""
    largest = np.array(difference)
    is_fixed = np.isin(scaled, fixed)
    for side in (1.0, -1.0):
        rows = np.flatnonzero(is_fixed & (side * scaled >= 0))[:: int(side)]
        until = np.maximum.accumulate(difference[rows])
        later = side * scaled > 0
        places = np.searchsorted(side * scaled[rows], side * scaled[later], side="right") - 1
        largest[later] = np.maximum(largest[later], until[places])
    return largest
