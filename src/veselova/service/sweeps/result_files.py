"""The results of a job on the disk: a table of all problems as Parquet, and the kept trajectories
as a Zarr store.
"""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from veselova.service.api.private_files import atomic_file
from veselova.service.sweeps.chunk import KEPT
from veselova.service.sweeps.job_store import Job, Jobs

#: Rows of one row group, and numbers in it: about what a reader has in memory at a time.
_GROUP_ROWS = 65_536
_GROUP_NUMBERS = 4_000_000


def finish(jobs: Jobs, job: Job) -> None:
    """Make the table of all problems, and of the trajectories one file, out of the chunks, which
    go. The table comes last and says that all was made.
    """
    if not (result := jobs.result_path(job.id)).exists():
        chunks = jobs.chunks(job.id)
        if job.sweep.trajectories:
            _keep_trajectories(job, chunks, jobs.packed_path(job.id))
        _concatenate(list(chunks.values()), result)
    shutil.rmtree(jobs.chunk_folder(job.id), ignore_errors=True)


def _keep_trajectories(job: Job, chunks: Mapping[tuple[int, int], Path], target: Path) -> None:
    """Write the series of the chunks, where they have some, into a Zarr store in one file."""
    import zarr
    from pyarrow import parquet

    with TemporaryDirectory(dir=target.parent / "chunks") as folder:
        group = zarr.open_group(folder, mode="w")
        arrays: dict[str, Any] = {}
        for (start, stop), path in chunks.items():
            kept = [name for name in parquet.read_schema(path).names if name.startswith(KEPT)]
            table = parquet.read_table(path, columns=kept)
            for column in kept:
                name = column.removeprefix(KEPT)
                values = table[column].combine_chunks().to_numpy_ndarray()
                if name not in arrays:
                    inner = values.shape[1:]
                    arrays[name] = group.create_array(
                        name,
                        shape=(job.total, *inner),
                        dtype=values.dtype,
                        chunks=(min(job.chunk_rows, job.total), *inner),
                        fill_value=float("nan"),
                        dimension_names=(
                            "row",
                            "time",
                            *(f"{name}_{i}" for i in range(1, len(inner))),
                        ),
                    )
                arrays[name][start:stop] = values
        if arrays:
            _pack(Path(folder), target)


def table_stream(path: Path, form: str) -> Iterator[bytes]:
    """Yield the table of a finished job as ``csv`` or as an ``arrow`` stream, a group of rows at a
    time.
    """
    from pyarrow import csv, ipc, parquet

    buffer = io.BytesIO()
    with parquet.ParquetFile(path) as file:
        schema = file.schema_arrow
        with (csv.CSVWriter if form == "csv" else ipc.new_stream)(buffer, schema) as writer:
            for batch in file.iter_batches(_group_rows(schema)):
                writer.write(batch)
                yield buffer.getvalue()
                buffer.seek(0)
                buffer.truncate()
    yield buffer.getvalue()


def _concatenate(paths: list[Path], target: Path) -> None:
    """Write the tables one after the other into one, many to a row group, columns in the order of
    their first appearance.
    """
    import pyarrow as pa
    from pyarrow import parquet

    schemas = [parquet.read_schema(path) for path in paths]
    whole = pa.unify_schemas(schemas, promote_options="permissive")
    schema = pa.schema([field for field in whole if not field.name.startswith(KEPT)])
    most = _group_rows(schema)
    with (
        atomic_file(target) as part,
        parquet.ParquetWriter(part, schema, compression="zstd") as writer,
    ):
        held = list[Any]()
        for path in paths:
            table = parquet.read_table(path)
            own = table.select([name for name in table.column_names if name in schema.names])
            table = pa.concat_tables([schema.empty_table(), own], promote_options="permissive")
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
