"""The answers to the problems of a sweep: a row of numbers by the names of their columns, and the
motion itself where it is kept.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import orjson

from veselova.engines import torus
from veselova.mechanics.core.arguments import Path
from veselova.mechanics.core.budget import limits
from veselova.mechanics.core.errors import OverBudget, Unsolved, VeselovaError
from veselova.service.api.problem_details import problem_code
from veselova.service.api.request_models import TorusRequest, TrajectoryRequest, read_request
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.sweeps.columns import (
    Answer,
    columns_at_once,
    columns_of_motion,
    columns_of_torus,
    series_to_keep,
)
from veselova.service.workers.tasks import solve_request, warm_up
from veselova.version import __version__

_LOG = logging.getLogger("veselova.sweeps")

#: What the column ``outcome`` says of a problem that was solved; else it names the reason, and
#: ``detail`` explains it.
SOLVED = "solved"

#: How the columns of a chunk begin that are series which are kept, each a tensor for each problem.
KEPT = "trajectory."

Row = dict[str, Any]


class OtherVersion(Exception):
    """A worker whose engines could give other numbers than those of the process that asks."""


def compute_chunk(request: str | bytes, start: int, stop: int, version: str) -> bytes:
    """Return the table of the problems start … stop−1 of a sweep, as Parquet; ``request`` is its
    JSON.

    A problem that cannot be solved is a row with the reason. Raises OtherVersion where this process
    has another version of the engines than the one that asks.
    """
    if version != __version__:
        raise OtherVersion(
            f"a worker of the cluster runs veselova {__version__}, and this is {version}"
        )
    with limits(None, False):  # progress is that of the problems
        warm_up()  # so that the budget of its first problem is spent on the problem
    sweep = _sweep(request)
    values = {row: sweep.values(row) for row in range(start, stop)}
    together = _together(sweep, values)
    answers = [_answer(sweep, row, values[row], together.get(row)) for row in range(start, stop)]
    return _parquet([row for row, _ in answers], [kept for _, kept in answers])


@lru_cache(maxsize=4)
def _sweep(request: str | bytes) -> SweepRequest:
    """Return the sweep of a JSON text; all chunks of a job bring the same, which may be long."""
    return read_request(SweepRequest, orjson.loads(request))


def lost_chunk(sweep: SweepRequest, row: int) -> bytes:
    """Return the table of one problem whose worker died over it."""
    detail = "the worker process ended over this problem, as it does when memory runs out"
    return _parquet([_row(sweep, row, sweep.values(row), "worker-lost", detail)])


def _together(sweep: SweepRequest, values: Mapping[int, Mapping[Path, Any]]) -> dict[int, Answer]:
    """Return the answers of the problems that can be computed in a batch, within the budgets of
    all; the others are answered one by one.
    """
    try:
        with limits(sweep.budget_s * len(values), False):
            return columns_at_once(sweep, values)
    except OverBudget:
        return {}
    except Exception:
        _LOG.exception("problems of sweep %s are computed one by one", sweep.id)
        return {}


def _answer(
    sweep: SweepRequest, row: int, values: Mapping[Path, Any], together: Answer | None
) -> tuple[Row, Mapping[str, Any]]:
    """Return the row of one problem, computed alone unless it was ``together`` with others, and the
    series that are kept of it.
    """
    if together is not None:
        columns, series = together
        return {**_row(sweep, row, values, SOLVED, ""), **columns}, series
    found: Row = {}
    kept: dict[str, Any] = {}
    try:
        with limits(sweep.budget_s, False):
            for column, value in _findings(sweep.request_of(values), kept, sweep.trajectories):
                found[column] = value
        outcome = SOLVED
        detail = ""
    except MemoryError:
        outcome = "worker-memory"
        detail = "the problem needs more memory than a worker has"
    except VeselovaError as error:
        outcome = problem_code(error)
        detail = error.reason if isinstance(error, Unsolved) else str(error)
    except Exception as error:
        _LOG.exception("problem %d of sweep %s failed", row, sweep.id)
        outcome = problem_code(error)
        detail = "an unexpected error; it has been logged"
    return {**_row(sweep, row, values, outcome, detail), **found}, kept


def _row(
    sweep: SweepRequest, row: int, values: Mapping[Path, Any], outcome: str, detail: str
) -> Row:
    return {"row": row, **dict(sweep.columns(values)), "outcome": outcome, "detail": detail}


def _findings(request: TorusRequest, kept: dict[str, Any], keep: bool) -> Iterator[tuple[str, Any]]:
    """Yield the columns of one problem; what was found before a failure stays."""
    problem = request.problem.problem
    if problem.has_torus and problem.moves:
        yield from columns_of_torus(torus(problem))
    elif problem.has_torus:
        yield "regime", "rest"
    elif not isinstance(request, TrajectoryRequest):
        torus(problem)  # raises the reason
    if isinstance(request, TrajectoryRequest):
        trajectory = solve_request(request)
        names = request.outputs or list(problem.outputs)
        if keep:
            kept.update(series_to_keep(trajectory, names))
        yield from columns_of_motion(trajectory, names)


def _parquet(rows: list[Row], kept: Sequence[Mapping[str, Any]] = ()) -> bytes:
    """Return the table of the rows, columns in the order in which they first appear, and of the
    series that are kept of each, NaN for problems that have none.
    """
    import pyarrow as pa
    from pyarrow import parquet

    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {name: _column([row.get(name) for row in rows]) for name in names}
    for name, pattern in next(filter(None, kept), {}).items():
        values = np.stack([series.get(name, np.full_like(pattern, np.nan)) for series in kept])
        # another order in memory would be one of the table's type, which Arrow reads wrongly
        ordered = np.ascontiguousarray(values)
        columns[KEPT + name] = pa.FixedShapeTensorArray.from_numpy_ndarray(ordered)
    buffer = io.BytesIO()
    parquet.write_table(pa.table(columns), buffer)
    return buffer.getvalue()


def _column(values: list[Any]) -> Any:
    """Return an Arrow array of numbers or of texts; what is missing is null."""
    import pyarrow as pa

    unknown = all(value is None for value in values)
    return pa.array(values, pa.float64() if unknown else None)
