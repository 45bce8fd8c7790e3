"""``veselova sweep``: a sweep with a progress line, its table written to a file or summed up on the
terminal.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import Any

from rich.table import Table

from veselova.mechanics.core.budget import reporting
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.api.request_models import read_request
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.cli.console import print_json, terminal
from veselova.service.cli.local_sweep import local_settings, run_sweep

__all__ = ["run"]

_WRITERS = (".parquet", ".csv", ".nc", ".zarr")


def run(
    document: Any, json: bool, output: Path | None, folder: Path | None, workers: int | None
) -> None:
    """Run the sweep of a JSON document and write what is asked for; raises as ``veselova.sweep``
    does.
    """
    request = read_request(SweepRequest, document)
    if output is not None and (output.suffix.lower() not in _WRITERS or not output.parent.is_dir()):
        raise InvalidInput(
            ("--output",),
            f"a file in an existing folder, ending in {', '.join(_WRITERS)}",
            str(output),
        )
    with reporting() as report:
        try:
            job, jobs = run_sweep(
                request,
                local_settings(folder, workers),
                lambda done, total: report and report("sweep", done, total),
            )
        except KeyboardInterrupt:
            print("What is done is kept; the same command goes on from there.", file=sys.stderr)
            raise
    table = jobs.result_path(job.id)
    if output is not None:
        _write(request, table, jobs.packed_path(job.id), output)
    _say(request, table, json, output)


def _write(request: SweepRequest, table: Path, packed: Path, output: Path) -> None:
    from pyarrow import csv, parquet

    suffix = output.suffix.lower()
    if suffix == ".parquet":
        output.write_bytes(table.read_bytes())
    elif suffix == ".csv":
        csv.write_csv(parquet.read_table(table), output)
    else:
        from veselova.service.api.sweep_dataset import sweep_dataset

        dataset = sweep_dataset(request, table, packed if packed.exists() else None)
        dataset.to_zarr(
            output, mode="w", consolidated=False
        ) if suffix == ".zarr" else dataset.to_netcdf(output, engine="scipy")


def _say(request: SweepRequest, table: Path, json: bool, output: Path | None) -> None:
    """Print the outcomes and where the table is, as JSON or for a reader."""
    from pyarrow import parquet

    outcomes = Counter(parquet.read_table(table, columns=["outcome"])["outcome"].to_pylist())
    where = str(output or table)
    if json:
        summary = {
            "id": request.id,
            "total": request.total,
            "outcomes": dict(outcomes),
            "table": where,
        }
        print_json(summary)
        return
    rows = Table("outcome", "problems", box=None)
    for outcome, count in outcomes.most_common():
        rows.add_row(outcome, str(count))
    console = terminal()
    console.print(rows)
    console.print(f"Table: {where}", soft_wrap=True)
