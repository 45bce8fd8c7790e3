"""The flat table of a trajectory, one row per time, and the files that hold it: CSV, Parquet,
Arrow.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InternalContradiction, InvalidInput, needs, show

__all__ = [
    "Source",
    "Table",
    "Target",
    "flat_columns",
    "located",
    "open_target",
    "reading",
    "row_blocks",
]

Columns: TypeAlias = Mapping[str, NDArray[Any]]

#: Where a file is written to: its path, or a binary stream that is open.
Target: TypeAlias = "str | Path | BinaryIO"

#: Where a file is read from, in the same ways.
Source: TypeAlias = Target

#: Numbers that are turned into text, and into rows of a binary table, at a time.
_TEXT_BLOCK = 1 << 19
_BINARY_BLOCK = 1 << 22


def row_blocks(rows: int, width: int, numbers: int = _TEXT_BLOCK) -> Iterator[slice]:
    """Return slices that cut a table of so many rows and columns into blocks of about so many
    numbers.
    """
    step = max(1, numbers // max(width, 1))
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


@contextmanager
def reading(source: Any, required: str, *failures: type[Exception]) -> Iterator[Any]:
    """Give a source to read from: its path, or the stream. Raises InvalidInput, located at
    ``source``, where it is neither, and where reading it fails: it is not what is required.
    """
    path = isinstance(source, (str, os.PathLike))
    stream = callable(getattr(source, "read", None)) and not isinstance(source, io.TextIOBase)
    if not path and not stream:
        raise InvalidInput(("source",), f"a path, or a binary stream, of {required}", show(source))
    named = (OSError, ValueError, EOFError, TypeError, RecursionError)
    expected: tuple[type[Exception], ...] = (*named, *failures)
    try:
        yield located(source) if path else source
    except InvalidInput:
        raise
    except expected as error:
        name = show(str(source)) if path else show(source)
        given = f"{name} ({type(error).__name__})"
        raise InvalidInput(("source",), required, given) from None


@dataclass(frozen=True)
class Table:
    """Columns of one length, doubles or decimals, and facts that go with them by name, JSON-ready.
    Written block by block.
    """

    columns: Columns
    facts: Mapping[str, Any]

    def _blocks(self, numbers: int) -> Iterator[dict[str, NDArray[Any]]]:
        rows = len(next(iter(self.columns.values())))
        for block in row_blocks(rows, len(self.columns), numbers):
            yield {
                name: np.ascontiguousarray(values[block]) for name, values in self.columns.items()
            }

    def to_csv(self, target: Target) -> None:
        """Write comma-separated values under one line of names: the shortest text of every double,
        all digits of decimals.
        """
        with open_target(target) as stream:
            stream.write((",".join(self.columns) + "\n").encode())
            for block in self._blocks(_TEXT_BLOCK):
                stream.write(_lines(np.column_stack(list(block.values()))))

    def to_parquet(self, target: Target) -> None:
        """Write Parquet, the facts as JSON in the schema's metadata; raises BackendMissing
        without pyarrow.
        """
        with needs("pyarrow", "Parquet output"):
            from pyarrow import parquet
        # Without dictionaries, which no two numbers of a motion share; a table is a row group,
        # written at once.
        with (
            open_target(target) as stream,
            parquet.ParquetWriter(stream, self._schema(), use_dictionary=False) as writer,
        ):
            for table in self._tables():
                writer.write_table(table)

    def to_arrow(self, target: Target) -> None:
        """Write an Arrow IPC stream, the facts as JSON in the schema's metadata; raises
        BackendMissing without pyarrow.
        """
        with needs("pyarrow", "Arrow output"):
            from pyarrow import ipc
        with open_target(target) as stream, ipc.new_stream(stream, self._schema()) as writer:
            for table in self._tables():
                writer.write_table(table)

    def _schema(self) -> Any:
        import pyarrow

        fields = [pyarrow.field(name, pyarrow.float64()) for name in self.columns]
        metadata = {name: json.dumps(fact) for name, fact in self.facts.items()}
        return pyarrow.schema(fields, metadata)

    def _tables(self) -> Iterator[Any]:
        import pyarrow

        schema = self._schema()
        for block in self._blocks(_BINARY_BLOCK):
            yield pyarrow.table(list(block.values()), schema=schema)


def _lines(rows: NDArray[Any]) -> bytes:
    """Return rows of doubles or of texts as lines of comma-separated values."""
    if rows.dtype == object:
        return "".join(",".join(str(value) for value in row) + "\n" for row in rows).encode()
    import orjson  # three times as fast as %.17g, and as exact

    if not np.all(np.isfinite(rows)):
        raise InternalContradiction("a table holds a number that is not finite")
    text = orjson.dumps(np.ascontiguousarray(rows), option=orjson.OPT_SERIALIZE_NUMPY)
    return text[2:-2].replace(b"],[", b"\n") + b"\n"
