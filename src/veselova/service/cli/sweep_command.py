"""``veselova sweep``: a sweep with a progress line, its table written to a file or summed up on the
terminal.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import Any

from veselova.mechanics.core.budget import reporting
from veselova.service.api.request_models import read_request
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.cli.console import print_counts, print_json
from veselova.service.cli.files import check_file
from veselova.service.cli.local_sweep import local_settings, run_sweep

__all__ = ["run"]


def run(
    document: Any, json: bool, output: Path | None, folder: Path | None, workers: int | None
) -> None:
    """Run the sweep of a JSON document and write what is asked for; raises as ``veselova.sweep``
    does.
    """
    from pyarrow import parquet

    request = read_request(SweepRequest, document)
    check_file("--output", output, (".parquet", ".csv", ".nc", ".zarr"))
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
    outcomes = parquet.read_table(table, columns=["outcome"])["outcome"].to_pylist()
    where = str(output or table)
    if json:
        counts = dict(Counter(outcomes).most_common())
        print_json({"id": request.id, "total": request.total, "outcomes": counts, "table": where})
    else:
        print_counts(outcomes)
        print(f"table: {where}")


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
        if suffix == ".zarr":
            dataset.to_zarr(output, mode="w", consolidated=False)
        else:
            dataset.to_netcdf(output, engine="scipy")
