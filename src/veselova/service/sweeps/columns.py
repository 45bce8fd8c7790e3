"""What the table of a sweep says of tori and motions: of one, or of many that are computed at
once.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from veselova.mechanics.core.problem import Problem
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.request_models import TrajectoryRequest
from veselova.service.api.sweep_parameters import Path, components, is_double, replace_values
from veselova.service.api.sweep_request import SweepRequest
from veselova.tunings import TIMES_SIDE_BY_SIDE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from veselova.analytic.closed.many import KnownTori

__all__ = ["Answer", "columns_at_once", "columns_of_motion", "columns_of_torus", "series_to_keep"]

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

#: A start this near to the bound of the tolerance is left to the problem itself, which refuses or
#: takes it.
_SURELY = INPUT_TOLERANCE / 2


def columns_of_torus(found: Torus) -> Iterator[tuple[str, Any]]:
    """Yield the columns of one torus."""
    for name in _NUMBERS:
        if (value := getattr(found, name)) is not None:
            yield from components(name, np.asarray(value).tolist())
    if found.drift is not None:
        yield from components("mean_velocity", found.drift.velocity.tolist())
    yield "mean_rate", found.mean_rate
    yield "regime", found.regime
    yield "origins", " ".join(found.origins)


def columns_of_motion(
    problem: Problem, trajectory: Trajectory, names: Sequence[str]
) -> Iterator[tuple[str, Any]]:
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

    stated = sweep.problem.model_dump(exclude_none=True)
    rows = []
    starts = []
    for row, places in values.items():
        if (start := _start(replace_values(stated, places))) is not None:
            rows.append(row)
            starts.append(start)
    if not rows:
        return {}
    A, q, q_dot = np.moveaxis(np.array(starts, dtype=np.float64), 1, 0)
    found = _columns(rows, tori(A, q, q_dot))
    if sweep.times is None:
        return {row: (columns, {}) for row, columns in found.items()}
    motions = _motions({row: values[row] for row in found}, sweep)
    return {row: ({**found[row], **columns}, kept) for row, (columns, kept) in motions.items()}


def _motions(values: Mapping[int, Mapping[Path, Any]], sweep: SweepRequest) -> dict[int, Answer]:
    """Return the columns of those motions that can be computed side by side, and what is kept."""
    from veselova.ensemble_starts import Starts
    from veselova.ensembles import side_by_side

    requests = {row: sweep.request_of(places) for row, places in values.items()}
    if not requests:
        return {}
    rows = list(requests)
    problems = [request.problem.problem() for request in requests.values()]
    first = requests[rows[0]]
    assert isinstance(first, TrajectoryRequest)
    grid = first.time_grid()
    if grid.doubles.size > TIMES_SIDE_BY_SIDE:
        return {}
    starts = Starts.of(problems)
    places = slice(None) if grid.places is None else grid.places
    names = sweep.outputs or list(problems[0].outputs)
    answers: dict[int, Answer] = {}
    began = time.perf_counter()
    for block, series in side_by_side(
        starts, np.flatnonzero(starts.surely), grid, tuple(problems[0].stored)
    ):
        shown = {name: array[:, places] for name, array in series.items()}
        error = shown.pop("error")
        for k, i in enumerate(block.tolist()):
            arrays = {name: array[k] for name, array in shown.items()}
            provenance = Provenance.since(began, "analytic", "angles", {})
            trajectory = Trajectory(
                problems[i],
                grid.asked,
                error[k],
                arrays,
                provenance,
            )
            columns = dict(columns_of_motion(problems[i], trajectory, names))
            kept = series_to_keep(trajectory, names) if sweep.trajectories else {}
            answers[rows[i]] = columns, kept
    return answers


def _start(problem: Mapping[str, Any]) -> Sequence[Sequence[float]] | None:
    """Return A, q and q_dot where all are lists of doubles of one length and surely a valid start,
    and no frame is given.
    """
    start = [problem["A"], problem["q"], problem["q_dot"]]
    sizes = {
        len(vector) if isinstance(vector, list) and all(map(is_double, vector)) else 0
        for vector in start
    }
    if (
        len(sizes) > 1
        or min(sizes) < 2
        or "frame" in problem
        or not isinstance(problem["normalize"], bool)
    ):
        return None
    return start if problem["normalize"] or _is_on_sphere(start[1], start[2]) else None


def _is_on_sphere(q: list[float], velocity: list[float]) -> bool:
    with np.errstate(over="ignore", invalid="ignore"):
        position = np.array(q, dtype=np.float64)
        speed = np.array(velocity, dtype=np.float64)
        length = abs(float(np.linalg.norm(position)) - 1)
        along = abs(float(position @ speed))
        return length < _SURELY and along < _SURELY * float(np.linalg.norm(speed))


def _columns(rows: list[int], found: KnownTori) -> dict[int, Columns]:
    # a geodesic's energy is conserved, and no other integral takes its place
    given = [name for name in (*_NUMBERS, "mean_rate") if name != "jacobi_integral"]
    numbers: list[NDArray[np.float64]] = [getattr(found, name) for name in given]
    names = [
        column
        for name, values in zip(given, numbers, strict=True)
        for column, _ in components(name, values[0].tolist())
    ]
    table = np.concatenate([values.reshape(len(rows), -1) for values in numbers], axis=1).tolist()
    return {
        rows[i]: {
            **dict(zip(names, table[i], strict=True)),
            "regime": "generic",
            "origins": " ".join(found.origins[i]),
        }
        for i in np.flatnonzero(found.known).tolist()
    }
