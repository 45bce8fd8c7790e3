"""An entry of the cache: a trajectory and the request that it answers, in one file with a checksum,
as it is in memory.
"""

from __future__ import annotations

import json
import math
import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

import numpy as np
import orjson
from numpy.typing import NDArray

from veselova.mechanics.core.errors import VeselovaError
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.table import row_blocks
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.request_models import TrajectoryRequest

__all__ = ["DamagedEntry", "Entry", "read_entry"]

Arrays: TypeAlias = Mapping[str, NDArray[Any]]

#: Bytes of an array that is written at once.
_SMALL = 100_000

#: The checksum at the end of a file.
_CHECKSUM = struct.Struct("<I")


class DamagedEntry(VeselovaError):
    """A file of the cache that does not hold what was put into it."""


@dataclass(frozen=True)
class Entry:
    """Where an entry is kept: its file, the part that is written first, and the bytes that it may
    have at most.
    """

    path: str
    part: str
    most: int

    def write(self, request: Mapping[str, Any], trajectory: Trajectory) -> int:
        """Keep a trajectory, whole or not at all, and return its bytes, 0 for one that is too
        large; raises OSError.
        """
        arrays = _arrays(trajectory)
        if sum(array.nbytes for array in arrays.values()) > self.most:
            return 0
        part = Path(self.part)
        try:
            try:
                stream = part.open("wb")
            except FileNotFoundError:
                part.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
                stream = part.open("wb")
            with stream:
                _write(stream, request, trajectory, arrays)
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
    """Return what a trajectory is made of: what follows from it is computed again where it is asked
    for.
    """
    problem = trajectory.problem
    if trajectory.decimals is not None:
        return dict(trajectory.named_arrays(problem.outputs))
    series = {
        name: values for name, values in trajectory.arrays.items() if name not in problem.derived
    }
    remainders = {} if trajectory.remainders is None else {"remainders": trajectory.remainders}
    return {"times": trajectory.times, **remainders, "error": trajectory.error, **series}


def _write(
    stream: BinaryIO, request: Mapping[str, Any], trajectory: Trajectory, arrays: Arrays
) -> None:
    """Write the parts of an entry, and a checksum of all."""
    checksum = 0
    for part in _parts(request, trajectory, arrays):
        checksum = zlib.crc32(part, checksum)
        stream.write(part)
    stream.write(_CHECKSUM.pack(checksum))


def _parts(request: Mapping[str, Any], trajectory: Trajectory, arrays: Arrays) -> Iterator[bytes]:
    """Yield a line of JSON (request, provenance, names and shapes of the arrays), then the arrays,
    large ones block by block.

    NumPy's own archive has a header and a checksum for each array, which take four times as long to
    write for small ones.
    """
    header = {
        "request": {**request, "times": [0.0]},  # the times are among the arrays
        "provenance": trajectory.provenance.as_dict(),
        "decimals": trajectory.decimals is not None,
        "arrays": {name: (array.dtype.str, array.shape) for name, array in arrays.items()},
    }
    try:
        yield orjson.dumps(header, option=orjson.OPT_APPEND_NEWLINE)
    except TypeError:  # an integer of more than 64 bits
        yield json.dumps(header).encode() + b"\n"
    for array in arrays.values():
        if array.nbytes <= _SMALL:
            yield array.tobytes()
        else:
            yield from (
                array[rows].tobytes() for rows in row_blocks(array.shape[0], array[:1].size)
            )


def read_entry(path: str) -> tuple[TrajectoryRequest, Trajectory]:
    """Return what an entry holds, which is now the one used last.

    Raises DamagedEntry where the file is not whole, FileNotFoundError where there is none, OSError
    where it cannot be read.
    """
    os.utime(path)
    try:
        return _unpack(Path(path).read_bytes())
    except (ValueError, KeyError, TypeError, VeselovaError) as error:
        raise DamagedEntry(f"{path}: {type(error).__name__}") from None


def _unpack(content: bytes) -> tuple[TrajectoryRequest, Trajectory]:
    """Return what the content of an entry holds; raises ValueError, KeyError, TypeError or
    VeselovaError where it is damaged.
    """
    whole = memoryview(content)[: -_CHECKSUM.size]
    checksum = content[-_CHECKSUM.size :]
    if _CHECKSUM.pack(zlib.crc32(whole)) != checksum:
        raise ValueError("another checksum")
    line = content[: content.index(b"\n") + 1]
    header = json.loads(line)
    place = len(line)
    arrays = {}
    for name, (kind, shape) in header["arrays"].items():
        size = math.prod(shape) * np.dtype(kind).itemsize
        arrays[name] = np.frombuffer(whole[place : place + size], kind).reshape(shape)
        place += size
    asked = TrajectoryRequest.model_validate(header["request"])
    problem = asked.problem.problem()
    provenance = header["provenance"]
    if header["decimals"]:
        return asked, Trajectory.from_arrays(problem, {**arrays, "provenance": provenance})
    times = arrays.pop("times")
    error = arrays.pop("error")
    remainders = arrays.pop("remainders", None)
    trajectory = Trajectory(
        problem, times, error, arrays, Provenance(**provenance), remainders=remainders
    )
    return asked, trajectory
