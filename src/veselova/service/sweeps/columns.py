"""The columns of a sweep's table from tori and motions, one by one or in a batch."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from veselova.mechanics.core.arguments import Path
from veselova.mechanics.core.exact_input import is_double
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.sampled_motion import Provenance
from veselova.mechanics.results.torus import Torus, TorusNumbers
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.veselova import Veselova
from veselova.service.api.request_models import TrajectoryRequest
from veselova.service.api.sweep_parameters import components, replace_values
from veselova.service.api.sweep_request import SweepRequest
from veselova.tunings import TIMES_SIDE_BY_SIDE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from veselova.analytic.closed.many import KnownTori
    from veselova.ensemble_starts import Starts


Columns = dict[str, Any]

#: The columns of a problem, and the series that are kept of its motion.
Answer = tuple[Columns, Mapping[str, Any]]

#: What a torus has to say in numbers, and how each is called in the table.
_NUMBERS = (
    "energy",
    "jacobi_integral",
    "constants",
    "branch_points",
    "frequencies_tau1",
    "frequencies_t",
    "rotation_numbers",
    "actions",
    "phases",
)


def columns_of_torus(found: Torus | SimpleNamespace) -> Iterator[tuple[str, Any]]:
    """Yield the columns of one torus."""
    for name in _NUMBERS:
        if (value := getattr(found, name)) is not None:
            yield from components(name, np.asarray(value).tolist())
    if found.drift is not None:
        yield from components("mean_velocity", found.drift.velocity.tolist())
    yield "mean_rate", float(found.mean_rate)
    yield "regime", found.regime
    yield "origins", " ".join(found.origins)


def columns_of_motion(trajectory: Trajectory, names: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Yield the columns of one motion: its error, drifts, and extremes of the named series."""
    yield "error.max", float(np.max(trajectory.error))
    for name, drift in trajectory.drift.items():
        yield f"drift.{name}", drift
    for name in names:
        series = trajectory.series(name)
        for kind, extremes in (("min", series.min(axis=0)), ("max", series.max(axis=0))):
            yield from components(f"{name}.{kind}", extremes.tolist())


def series_to_keep(trajectory: Trajectory, names: Sequence[str]) -> dict[str, Any]:
    """Return the named series and the error."""
    return {**{name: trajectory.series(name) for name in names}, "error": trajectory.error}


def columns_at_once(
    sweep: SweepRequest, values: Mapping[int, Mapping[Path, Any]]
) -> dict[int, Answer]:
    """Return the columns of those problems that can be computed together, by their rows, and the
    series that are kept of their motions.

    ``values``: what the parameters of the sweep are in each row. A row that is missing in the
    answer is computed alone, or is no valid problem.
    """
    if not sweep.asked_at_once:
        return {}
    from veselova.analytic.closed.many import tori
    from veselova.ensemble_starts import Starts

    stated = sweep.problem.model_dump(exclude_none=True)
    doubles = {
        row: start
        for row, places in values.items()
        if (start := _start(replace_values(stated, places), stated["normalize"])) is not None
    }
    if not doubles:
        return {}
    A, q, q_dot = np.moveaxis(np.array(list(doubles.values()), dtype=np.float64), 1, 0)
    starts = Starts.of_arrays(A, q, q_dot, stated["normalize"])
    valid = np.flatnonzero(starts.surely)
    found = _columns(list(doubles), valid, tori(starts.A[valid], starts.q[valid], q_dot[valid]))
    if sweep.times is None:
        return {row: (columns, {}) for row, columns in found.items()}
    rows = list(doubles)
    known = np.array([i for i in valid.tolist() if rows[i] in found], dtype=np.intp)
    if not known.size:
        return {}
    request = sweep.request_of(values[rows[known[0]]])
    assert isinstance(request, TrajectoryRequest)
    motions = _motions(rows, known, starts, request.time_grid, sweep)
    return {row: ({**found[row], **columns}, kept) for row, (columns, kept) in motions.items()}


def _motions(
    rows: list[int], known: NDArray[np.intp], starts: Starts, grid: TimeGrid, sweep: SweepRequest
) -> dict[int, Answer]:
    """Return the columns of those motions that can be computed side by side, and what is kept.

    ``known`` are places of the ``starts``, whose problems are those of the ``rows``.
    """
    from veselova.ensembles import side_by_side

    if grid.doubles.size > TIMES_SIDE_BY_SIDE:
        return {}
    places = slice(None) if grid.places is None else grid.places
    names = sweep.outputs or list(Veselova.outputs)
    stored = starts.problem(int(known[0])).stored
    answers: dict[int, Answer] = {}
    began = time.perf_counter()
    for block, series in side_by_side(starts, known, grid, stored):
        shown = {name: array[:, places] for name, array in series.items()}
        error = shown.pop("error")
        for k, i in enumerate(block.tolist()):
            problem = starts.problem(i)
            arrays = {name: array[k] for name, array in shown.items()}
            provenance = Provenance.since(began, "analytic", "angles", {})
            trajectory = Trajectory(problem, grid.asked, error[k], arrays, provenance)
            columns = dict(columns_of_motion(trajectory, names))
            kept = series_to_keep(trajectory, names) if sweep.trajectories else {}
            answers[rows[i]] = columns, kept
    return answers


def _start(problem: Mapping[str, Any], normalize: Any) -> Sequence[Sequence[float]] | None:
    """Return A, q and q_dot where all are lists of doubles of one length, and neither a frame nor
    another ``normalize`` is given.
    """
    start = [problem["A"], problem["q"], problem["q_dot"]]
    sizes = {
        len(vector) if isinstance(vector, list) and all(map(is_double, vector)) else 0
        for vector in start
    }
    plain = "frame" not in problem and problem["normalize"] is normalize
    return start if plain and len(sizes) == 1 and min(sizes) > 1 else None


def _columns(rows: list[int], places: NDArray[np.intp], found: KnownTori) -> dict[int, Columns]:
    """Return the columns of the tori that are known, by their rows; the k-th torus is that of
    ``rows[places[k]]``.
    """
    names = [entry.name for entry in fields(TorusNumbers)]
    # a geodesic's energy is conserved, and no other integral takes its place
    others = {"jacobi_integral": None, "drift": None, "regime": "generic"}
    return {
        rows[places[i]]: dict(
            columns_of_torus(
                SimpleNamespace(**{name: getattr(found, name)[i] for name in names}, **others)
            )
        )
        for i in np.flatnonzero(found.known).tolist()
    }
