"""What the commands compute, print and write."""

from __future__ import annotations

import os
import sys
from collections import Counter
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from veselova.mechanics.core.budget import limits
from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import (
    comparison_document,
    encode,
    ensemble_document,
    trajectory_document,
)
from veselova.service.api.request_models import (
    ComparisonRequest,
    EnsembleRequest,
    TrajectoryRequest,
    read_request,
)
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.api.toolkit_requests import ClosedFormRequest
from veselova.service.cli.console import (
    describe,
    print_counts,
    print_document,
    print_json,
    print_trajectory,
)
from veselova.service.cli.local_sweep import local_settings, run_sweep
from veselova.service.workers.tasks import (
    TASKS,
    closed_form_request,
    compare_request,
    ensemble_request,
    solve_request,
)

_WRITERS = (".npz", ".csv", ".parquet", ".arrow", ".json")
_PICTURES = (".png", ".pdf", ".svg")
_FILMS = (".mp4", ".gif", ".html")

#: Fields of a motion's request that say nothing of its torus.
_OF_MOTIONS = ("times", "engine", "method", "formulation", "outputs", "digits", "certified")

#: Columns of a table of geodesics.
_OF_GEODESICS = ("P1", "P2", "s12", "azi1", "azi2", "error")


def without_motion(document: Any, but: str = "") -> Any:
    """Return a request without the fields of a motion, but one: its file serves for its torus
    too.
    """
    if not isinstance(document, dict):
        return document
    return {name: x for name, x in document.items() if name not in _OF_MOTIONS or name == but}


def _budget(request: Any) -> AbstractContextManager[None]:
    """Stop the work after the ``budget_s`` of a file, if it has one, and show progress on a
    terminal.
    """
    return limits(request.budget_s if "budget_s" in request.model_fields_set else None, None)


def answer(kind: str, document: Any, json: bool) -> None:
    """Compute and print the document of a request of one of the ``TASKS``."""
    model, compute = TASKS[kind]
    request = read_request(model, document)
    with _budget(request):
        found = compute(request)
    if not json and isinstance(found.get("s12"), list):  # a row for each geodesic
        rows = zip(*(found[name] for name in _OF_GEODESICS))
        found = {"geodesics": [dict(zip(_OF_GEODESICS, row)) for row in rows]}
    print_json(found) if json else print_document(found)


def solve(
    document: Any, json: bool, output: Path | None, plot: Path | None, animate: Path | None
) -> None:
    """Solve a motion, and write it, its picture and its film."""
    request = read_request(TrajectoryRequest, document)
    _check_file("--output", output, _WRITERS)
    _check_file("--plot", plot, _PICTURES)
    _check_file("--animate", animate, _FILMS)
    with limits(None, None):  # motion and film share one line of progress
        with _budget(request):
            trajectory = solve_request(request)
        _write(trajectory, output, request.outputs)
        if plot:
            trajectory.plot().savefig(plot, dpi=130)
        if animate:
            _film(trajectory, animate)
    if json:
        print_json(trajectory_document(trajectory, request.outputs))
        return
    print_trajectory(trajectory)
    _report_files(output, plot, animate)


def solve_many(document: Any, json: bool, output: Path | None, plot: Path | None) -> None:
    """Solve all starts of a request, and write the arrays; raises InvalidInput for a picture."""
    request = read_request(EnsembleRequest, document)
    _check_file("--output", output, (".npz", ".json"))
    if plot is not None:
        raise InvalidInput(("--plot",), "no picture and no film of many starts", str(plot))
    with _budget(request):
        ensemble = ensemble_request(request)
    if output is not None and output.suffix.lower() == ".json":
        output.write_bytes(encode(ensemble_document(ensemble)))
    elif output is not None:
        ensemble.to_npz(output)
    if json:
        print_json(ensemble_document(ensemble))
        return
    print_counts(ensemble.outcome.tolist())
    for i in np.flatnonzero(~ensemble.solved)[:20].tolist():
        print(f"start {i}: {ensemble.detail[i]}")
    if ensemble.solved.any():
        print(f"largest error: {np.max(ensemble.error[ensemble.solved]):.1e}")
    _report_files(output)


def compare(document: Any, json: bool, output: Path | None, plot: Path | None) -> None:
    """Solve a motion twice, print how both agree, and write the first one and a picture."""
    if isinstance(document, dict):  # one file serves solve and compare
        document = {name: value for name, value in document.items() if name != "engine"}
    request = read_request(ComparisonRequest, document)
    _check_file("--output", output, _WRITERS)
    _check_file("--plot", plot, _PICTURES)
    with _budget(request):
        comparison = compare_request(request)
    _write(comparison.first, output, request.outputs)
    if plot:
        comparison.plot().savefig(plot, dpi=130)
    if json:
        print_json(comparison_document(comparison, request.outputs))
        return
    for trajectory in (comparison.first, comparison.second):
        describe(trajectory)
    summary = comparison.summary()
    names = ("deviation", "error", "drift", "conditioning_floor")
    print_document({name: summary[name] for name in names}, 2)
    verdict = "agree within" if comparison.agrees else "DISAGREE beyond"
    print(f"\n{' and '.join(comparison.names)} {verdict} their error bounds.")
    _report_files(output, plot)


def closed_form(document: Any, json: bool, output: Path | None) -> None:
    """Write or print a motion as data."""
    request = read_request(ClosedFormRequest, without_motion(document, but="digits"))
    _check_file("--output", output, (".json",))
    with _budget(request):
        found = closed_form_request(request)
    if output:
        output.write_text(found.to_json() + "\n", encoding="utf-8")
    if json or not output:
        print_json(found.document)
    else:
        print(f"{found}: {output}")


def sweep(
    document: Any, json: bool, output: Path | None, folder: Path | None, workers: int | None
) -> None:
    """Run the sweep of a JSON document and write what is asked for; raises as ``veselova.sweep``
    does.
    """
    from pyarrow import parquet

    request = read_request(SweepRequest, document)
    _check_file("--output", output, (".parquet", ".csv", ".nc"))
    try:
        job, jobs = run_sweep(request, local_settings(folder, workers))
    except KeyboardInterrupt:
        print("Finished problems are kept; the same command resumes.", file=sys.stderr)
        raise
    table = jobs.result_path(job.id)
    if output is not None:
        _write_table(request, table, jobs.packed_path(job.id), output)
    outcomes = parquet.read_table(table, columns=["outcome"])["outcome"].to_pylist()
    where = str(output or table)
    if json:
        counts = dict(Counter(outcomes).most_common())
        print_json({"id": request.id, "total": request.total, "outcomes": counts, "table": where})
    else:
        print_counts(outcomes)
        print(f"table: {where}")


def _film(trajectory: Trajectory, path: Path) -> None:
    """Write a motion as a film, or as a page that plays it."""
    if path.suffix.lower() == ".html":
        from veselova.motion_page import write_page

        write_page(trajectory, path)
    else:
        trajectory.animate(path)


def _write(trajectory: Trajectory, path: Path | None, outputs: list[str] | None) -> None:
    """Write a motion in the format that the suffix names."""
    if path is not None and path.suffix.lower() == ".json":
        path.write_bytes(encode(trajectory_document(trajectory, outputs)))
    elif path is not None:
        getattr(trajectory, f"to_{path.suffix[1:].lower()}")(path, outputs)


def _report_files(*paths: Path | None) -> None:
    for path in filter(None, paths):
        print(f"written: {path}")


def _write_table(request: SweepRequest, table: Path, packed: Path, output: Path) -> None:
    from pyarrow import csv, parquet

    suffix = output.suffix.lower()
    if suffix == ".parquet":
        output.write_bytes(table.read_bytes())
    elif suffix == ".csv":
        csv.write_csv(parquet.read_table(table), output)
    else:
        from veselova.service.api.sweep_request import sweep_dataset

        dataset = sweep_dataset(request, table, packed if packed.exists() else None)
        dataset.to_netcdf(output, engine="scipy")


def _check_file(option: str, path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Raise InvalidInput unless an option names no file, or one that can be written."""
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        raise InvalidInput((option,), f"a file name ending in {', '.join(suffixes)}", str(path))
    if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        required = "a file that can be written, in an existing folder"
        raise InvalidInput((option,), required, str(path))
