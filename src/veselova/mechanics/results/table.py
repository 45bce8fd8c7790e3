"""The flat table of a trajectory, one row per time, and the files that hold it: CSV, Parquet,
Arrow; and its NumPy archive, read back.
"""

from __future__ import annotations

import io
import json
import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import Decimals, decimals_of
from veselova.mechanics.core.errors import InternalContradiction, InvalidInput, needs, show
from veselova.mechanics.core.problem import Problem

__all__ = [
    "Target",
    "flat_columns",
    "located",
    "open_target",
    "read_decimals",
    "reading",
    "require_arrays",
    "row_blocks",
    "write_arrow",
    "write_csv",
    "write_parquet",
]

Columns: TypeAlias = Mapping[str, NDArray[Any]]

#: A file to write or to read: its path, or a binary stream that is open.
Target: TypeAlias = "str | Path | BinaryIO"

#: Numbers that are turned into text at a time.
_BLOCK = 1 << 19


def row_blocks(rows: int, width: int) -> Iterator[slice]:
    """Return slices that cut a table of so many rows and columns into blocks."""
    step = max(1, _BLOCK // max(width, 1))
    return (slice(first, min(first + step, rows)) for first in range(0, rows, step))


def flat_columns(name: str, values: NDArray[Any]) -> Columns:
    """Return the components of a series (first axis the times) as columns named like ``frame_1_2``,
    from 1.
    """
    return {
        "_".join([name, *(str(i + 1) for i in index)]): values[(slice(None), *index)]
        for index in np.ndindex(values.shape[1:])
    }


def located(path: str | os.PathLike[str]) -> Path:
    """Return a path whose ``~`` is the home folder."""
    return Path(os.path.expanduser(path))


@contextmanager
def open_target(target: Target) -> Iterator[BinaryIO]:
    """Open a path for writing, or pass on a stream and leave it open; raises InvalidInput for what
    is neither.
    """
    if isinstance(target, (str, os.PathLike)):
        with located(target).open("wb") as stream:
            yield stream
    elif isinstance(target, io.TextIOBase) or not callable(getattr(target, "write", None)):
        required = "a path, or a binary stream open for writing"
        raise InvalidInput(("target",), required, show(target))
    else:
        yield target


def write_csv(columns: Columns, target: Target) -> None:
    """Write comma-separated values under one line of names: the shortest text of every double, all
    digits of decimals.
    """
    rows = len(next(iter(columns.values())))
    with open_target(target) as stream:
        stream.write((",".join(columns) + "\n").encode())
        for block in row_blocks(rows, len(columns)):
            stream.write(_lines(np.column_stack([values[block] for values in columns.values()])))


def write_parquet(columns: Columns, facts: Mapping[str, Any], target: Target) -> None:
    """Write Parquet, the facts as JSON in the schema's metadata; raises BackendMissing without
    pyarrow.
    """
    with needs("pyarrow", "Parquet output"):
        from pyarrow import parquet
    # without dictionaries, which no two numbers of a motion share
    with open_target(target) as stream:
        parquet.write_table(_arrow_table(columns, facts), stream, use_dictionary=False)


def write_arrow(columns: Columns, facts: Mapping[str, Any], target: Target) -> None:
    """Write an Arrow IPC stream, the facts as JSON in the schema's metadata; raises BackendMissing
    without pyarrow.
    """
    with needs("pyarrow", "Arrow output"):
        from pyarrow import ipc
    table = _arrow_table(columns, facts)
    with open_target(target) as stream, ipc.new_stream(stream, table.schema) as writer:
        writer.write_table(table)


def _arrow_table(columns: Columns, facts: Mapping[str, Any]) -> Any:
    import pyarrow

    metadata = {name: json.dumps(fact) for name, fact in facts.items()}
    return pyarrow.table(dict(columns)).replace_schema_metadata(metadata)


def _lines(rows: NDArray[Any]) -> bytes:
    """Return rows of doubles or of texts as lines of comma-separated values."""
    if rows.dtype == object:
        return "".join(",".join(str(value) for value in row) + "\n" for row in rows).encode()
    import orjson  # three times as fast as %.17g, and as exact

    if not np.all(np.isfinite(rows)):
        raise InternalContradiction("a table holds a number that is not finite")
    text = orjson.dumps(np.ascontiguousarray(rows), option=orjson.OPT_SERIALIZE_NUMPY)
    return text[2:-2].replace(b"],[", b"\n") + b"\n"


#: What files of motions are, and how reading others fails.
_ARCHIVE = "a file of a motion that to_npz wrote"
_DAMAGE = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RuntimeError)
_FAILURES = (*_DAMAGE, OSError, EOFError, BadZipFile, zlib.error, struct.error)


@contextmanager
def reading(source: Any) -> Iterator[Mapping[str, Any]]:
    """Give the arrays of an archive, by its path or from a stream. Raises InvalidInput, located at
    ``source``, for what is neither, and where reading it fails.
    """
    path = isinstance(source, (str, os.PathLike))
    stream = callable(getattr(source, "read", None)) and not isinstance(source, io.TextIOBase)
    if not path and not stream:
        raise InvalidInput(("source",), f"a path, or a binary stream, of {_ARCHIVE}", show(source))
    try:
        with np.load(located(source) if path else source, allow_pickle=False) as archive:
            yield dict(archive.items())
    except InvalidInput:
        raise
    except _FAILURES as error:
        given = f"{show(str(source) if path else source)} ({type(error).__name__})"
        raise InvalidInput(("source",), _ARCHIVE, given) from None


def read_decimals(
    problem: Problem, archive: Mapping[str, Any], digits: int, certified: bool
) -> Decimals | None:
    """Return the decimals of an open archive, None where it has doubles alone. Raises KeyError
    where some are missing.
    """
    if f"{next(iter(problem.outputs))}_decimal" not in archive:
        return None
    midpoints, radii = (
        {name: decimals_of(archive[f"{name}_{kind}"]) for name in problem.outputs}
        for kind in ("decimal", "radius")
    )
    return Decimals(digits, certified, midpoints, radii, problem.bounded)


def require_arrays(arrays: Mapping[str, Any], problem: Problem) -> None:
    """Raise InvalidInput unless a file has all arrays of a motion: doubles of one number of times,
    in the shapes of the problem's series.
    """
    shapes = {
        "times": (),
        "error": (),
        **{name: problem.start[name].shape[1:] for name in problem.stored},
    }
    if missing := [name for name in ("provenance", *shapes) if name not in arrays]:
        required = f"a file with provenance, {', '.join(shapes)}"
        raise InvalidInput(("source",), required, f"one without {', '.join(missing)}")
    count = np.size(arrays["times"])
    for name, rest in shapes.items():
        found, shape = arrays[name], (count, *rest)
        whole = found.dtype == np.float64 and found.shape == shape and count
        if not whole or not np.isfinite(found).all():
            given = f"{found.dtype} of shape {found.shape}"
            raise InvalidInput(("source", name), f"finite doubles of shape {shape}", given)
