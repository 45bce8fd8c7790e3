"""The results of a job on the disk: a table of all problems as Parquet, and the kept trajectories
as a Zarr store.
"""

from __future__ import annotations

import io
import os
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from veselova.service.api.atomic_file import atomic_file
from veselova.service.sweeps.chunk import Chunk
from veselova.service.sweeps.job_store import Job, Jobs

__all__ = ["Result", "table_stream"]

#: Rows of one row group, and numbers in it: about what a reader has in memory at a time.
_GROUP_ROWS = 65_536
_GROUP_NUMBERS = 4_000_000


class Result:
    """Where the chunks of one job go, and what is made of them at the end."""

    def __init__(self, jobs: Jobs, job: Job) -> None:
        self._jobs = jobs
        self._job = job

    def store(self, position: int, parts: list[Chunk]) -> None:
        """Keep the answers of one chunk, in one part or more: the arrays first, for the table says
        that they are there.
        """
        row = self._job.rows(position)[0]
        for part in parts:
            if part.arrays:
                self._store_arrays(row, part)
            row += part.rows
        if any(part.arrays for part in parts):
            os.sync()  # Zarr leaves it to the system when its files reach the disk
        self._jobs.store(self._job, position, _join(parts))

    def _store_arrays(self, row: int, part: Chunk) -> None:
        """Write arrays into their rows of the store; chunks of the computation are chunks of the
        store, so no two write one.
        """
        import zarr

        for name, values in part.arrays.items():
            shape = (self._job.total, *values.shape[1:])
            chunks = (min(self._job.chunk_rows, self._job.total), *values.shape[1:])
            names = ("row", "time", *(f"{name}_{i}" for i in range(1, values.ndim - 1)))
            kind = {"shape": shape, "dtype": values.dtype}
            group = zarr.open_group(self._jobs.trajectories_path(self._job.id), mode="a")
            if name not in group:
                group.create_array(
                    name, chunks=chunks, fill_value=float("nan"), dimension_names=names, **kind
                )
            array = group.require_array(name, **kind)
            array[row : row + part.rows] = values

    def finish(self) -> None:
        """Make the table of all problems, and of the trajectories one file; what was made before is
        left as it is.

        At last the chunks go, of which all was made.
        """
        path = self._jobs.result_path(self._job.id)
        chunks = [
            self._jobs.chunk_path(self._job.id, position)
            for position in range(self._job.chunk_count)
        ]
        if not path.exists():
            _concatenate(chunks, path)
        store = self._jobs.trajectories_path(self._job.id)
        packed = self._jobs.packed_path(self._job.id)
        if store.is_dir():
            if not packed.exists():
                _pack(store, packed)
            shutil.rmtree(store)
        shutil.rmtree(chunks[0].parent, ignore_errors=True)


def table_stream(path: Path, form: str) -> Iterator[bytes]:
    """Yield the table of a finished job as ``csv`` or as an ``arrow`` stream, a group of rows at a
    time.
    """
    import pyarrow as pa
    from pyarrow import csv, ipc, parquet

    buffer = io.BytesIO()
    with parquet.ParquetFile(path) as file:
        writer = (csv.CSVWriter if form == "csv" else ipc.new_stream)(buffer, file.schema_arrow)
        with writer:
            for batch in file.iter_batches(_group_rows(file.schema_arrow)):
                writer.write(pa.Table.from_batches([batch]))
                yield _take(buffer)
    yield _take(buffer)


def _take(buffer: io.BytesIO) -> bytes:
    """Return what was written since the last time."""
    content = buffer.getvalue()
    buffer.seek(0)
    buffer.truncate()
    return content


def _join(parts: list[Chunk]) -> bytes:
    from pyarrow import concat_tables, parquet

    if len(parts) == 1:
        return parts[0].table
    buffer = io.BytesIO()
    tables = [parquet.read_table(io.BytesIO(part.table)) for part in parts]
    parquet.write_table(concat_tables(tables, promote_options="permissive"), buffer)
    return buffer.getvalue()


def _concatenate(paths: list[Path], target: Path) -> None:
    """Write the tables one after the other into one, many to a row group, columns in the order of
    their first appearance.
    """
    import pyarrow as pa
    from pyarrow import parquet

    schemas = [parquet.read_schema(path) for path in paths]
    schema = pa.unify_schemas(schemas, promote_options="permissive")
    most = _group_rows(schema)
    with (
        atomic_file(target) as part,
        parquet.ParquetWriter(part, schema, compression="zstd") as writer,
    ):
        held = list[Any]()
        for path in paths:
            table = pa.concat_tables(
                [schema.empty_table(), parquet.read_table(path)], promote_options="permissive"
            )
            held.append(table.select(schema.names).cast(schema))
            rows = sum(part.num_rows for part in held)
            if rows >= most or path == paths[-1]:
                writer.write_table(pa.concat_tables(held), row_group_size=rows)
                held.clear()


def _group_rows(schema: Any) -> int:
    """Return how many rows of a table a reader may have in memory."""
    return max(1, min(_GROUP_ROWS, _GROUP_NUMBERS // len(schema)))


def _pack(store: Path, target: Path) -> None:
    """Put a Zarr store into one file, in an order and with dates that depend on nothing but its
    content.
    """
    with atomic_file(target) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_STORED) as archive:
        for path in sorted(path for path in store.rglob("*") if path.is_file()):
            with (
                path.open("rb") as source,
                archive.open(zipfile.ZipInfo(path.relative_to(store).as_posix()), "w") as entry,
            ):
                shutil.copyfileobj(source, entry)
