"""An entry of the cache: a trajectory and the request that it answers, in one file with a checksum, as it is in memory."""

from __future__ import annotations

import json
import math
import os
import struct
import zlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.archive import archived_series, read_archive
from veselova.mechanics.errors import VeselovaError
from veselova.mechanics.table import row_blocks
from veselova.mechanics.trajectory import Provenance, Trajectory
from veselova.service.documents import stored_outputs
from veselova.service.schemas import TrajectoryRequest

__all__ = ["DamagedEntry", "Entry", "read_entry"]

Arrays: TypeAlias = Mapping[str, NDArray[Any]]

#: The checksum at the end of a file.
_CHECKSUM = struct.Struct("<I")


class DamagedEntry(VeselovaError):
    """A file of the cache that does not hold what was put into it."""


@dataclass(frozen=True)
class Entry:
    """Where an entry is kept: its file, the part that is written first, and the bytes that it may have at most."""

    path: str
    part: str
    most: int

    def write(self, request: Mapping[str, Any], trajectory: Trajectory) -> int:
        """Keep a trajectory, whole or not at all, and return its bytes, 0 for one that is too large; raises OSError.

        The file is a line of JSON (request, provenance, names and shapes of the arrays), the arrays, and a checksum of both.
        NumPy's own archive has a header and a checksum for each array, which take four times as long to write for small ones.
        """
        part, arrays = Path(self.part), _arrays(trajectory)
        if sum(array.nbytes for array in arrays.values()) > self.most:
            return 0
        try:
            try:
                stream = part.open("wb")
            except FileNotFoundError:
                part.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
                stream = part.open("wb")
            with stream:
                _write(stream, request, trajectory.provenance, arrays)
                size = stream.tell()
            if size <= self.most:
                part.replace(self.path)
                return size
        except OSError:
            with suppress(OSError):
                part.unlink(missing_ok=True)
            raise
        part.unlink(missing_ok=True)
        return 0


def _arrays(trajectory: Trajectory) -> Arrays:
    problem = trajectory.problem
    outputs = tuple(problem.outputs) if trajectory.decimals is not None else stored_outputs(problem)
    return dict(archived_series(trajectory, outputs))


def _write(stream: BinaryIO, request: Mapping[str, Any], provenance: Provenance, arrays: Arrays) -> None:
    header = {
        "request": {**request, "times": [0.0]},  # the times are among the arrays
        "provenance": provenance.as_dict(),
        "arrays": {name: (array.dtype.str, array.shape) for name, array in arrays.items()},
    }
    line = json.dumps(header).encode() + b"\n"
    stream.write(line)
    checksum = zlib.crc32(line)
    for array in arrays.values():
        for rows in row_blocks(array.shape[0], array[:1].size):
            block = array[rows].tobytes()
            checksum = zlib.crc32(block, checksum)
            stream.write(block)
    stream.write(_CHECKSUM.pack(checksum))


def read_entry(path: str) -> tuple[TrajectoryRequest, Trajectory]:
    """Return what an entry holds, which is now the one used last.

    Raises DamagedEntry where the file is not whole, FileNotFoundError where there is none, OSError where it cannot be read.
    """
    os.utime(path)
    content = memoryview(Path(path).read_bytes())
    try:
        whole = content[: -_CHECKSUM.size]
        if _CHECKSUM.pack(zlib.crc32(whole)) != content[-_CHECKSUM.size :]:
            raise ValueError("another checksum")
        line = bytes(whole[: _end_of_line(whole)])
        header, place, arrays = json.loads(line), len(line), {}
        for name, (kind, shape) in header["arrays"].items():
            size = math.prod(shape) * np.dtype(kind).itemsize
            arrays[name] = np.frombuffer(whole[place : place + size], kind).reshape(shape)
            place += size
        asked = TrajectoryRequest.model_validate(header["request"])
        return asked, read_archive(asked.problem.problem(), {**arrays, "provenance": header["provenance"]})
    except (ValueError, KeyError, TypeError, VeselovaError) as error:
        raise DamagedEntry(f"{path}: {type(error).__name__}") from None


def _end_of_line(content: memoryview) -> int:
    """Return where the line of JSON ends, its break included."""
    step, seen = 1 << 16, b""
    while b"\n" not in seen and len(seen) < len(content):
        seen, step = bytes(content[:step]), 4 * step
    return seen.index(b"\n") + 1
