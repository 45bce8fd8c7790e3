"""The NumPy archive of a trajectory: everything that it knows, written array by array, and read back."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.decimals import Decimals, decimals_of
from veselova.mechanics.problem import Problem
from veselova.mechanics.table import row_blocks

if TYPE_CHECKING:
    from veselova.mechanics.trajectory import Trajectory

__all__ = ["read_archive", "write_archive"]

#: Suffixes of the decimals of a series, and of their radii.
_DECIMAL, _RADIUS = "decimal", "radius"

#: Level of compression: the mantissas of a motion are noise to it, and more costs seconds and saves nothing.
_LEVEL = 1


def write_archive(
    trajectory: Trajectory, stream: BinaryIO, outputs: Iterable[str], *, compressed: bool = True, notes: Mapping[str, str] = {}
) -> None:
    """Write times, error, provenance, the chosen series (decimals as texts) and the integrals; ``notes`` are further texts."""
    kind = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
    with zipfile.ZipFile(stream, "w", kind, compresslevel=_LEVEL) as archive:
        for name, array in _arrays(trajectory, tuple(outputs), notes):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                _write_array(member, array)


def _arrays(trajectory: Trajectory, outputs: tuple[str, ...], notes: Mapping[str, str]) -> Iterator[tuple[str, NDArray[Any]]]:
    yield "times", trajectory.times
    yield "error", trajectory.error
    for name, text in {"provenance": json.dumps(trajectory.provenance.as_dict()), **notes}.items():
        yield name, np.array(text)
    for name in outputs:
        yield name, trajectory.series(name)
        if trajectory.decimals is not None:
            yield f"{name}_{_DECIMAL}", trajectory.decimals.midpoints[name].astype(str)
            yield f"{name}_{_RADIUS}", trajectory.decimals.radii[name].astype(str)
    for name, values in trajectory.integrals.items():
        yield f"integral_{name}", values


def _write_array(member: Any, array: NDArray[Any]) -> None:
    """Write an array in NumPy's own format, a block at a time: numpy.lib.format would copy what is not contiguous."""
    header = {"descr": np.lib.format.dtype_to_descr(array.dtype), "fortran_order": False, "shape": array.shape}
    np.lib.format.write_array_header_1_0(member, header)
    if array.ndim == 0:
        member.write(array.tobytes())
        return
    for block in row_blocks(array.shape[0], array[:1].size):
        member.write(array[block].tobytes())


def read_archive(problem: Problem, archive: Mapping[str, NDArray[Any]]) -> Trajectory:
    """Return the trajectory of an open archive; raises KeyError unless it has what no other series gives, of decimals all."""
    from veselova.mechanics.trajectory import Provenance, Trajectory

    provenance = Provenance(**json.loads(str(archive["provenance"])))
    if f"{next(iter(problem.outputs))}_{_DECIMAL}" not in archive:
        series = {name: archive[name] for name in problem.outputs if name not in problem.derived}
        return Trajectory(problem, archive["times"], archive["error"], series, provenance)
    midpoints, radii = (
        {name: decimals_of(archive[f"{name}_{kind}"]) for name in problem.outputs} for kind in (_DECIMAL, _RADIUS)
    )
    decimals = Decimals(provenance.digits, bool(provenance.details["certified"]), midpoints, radii)
    return Trajectory.of_decimals(problem, archive["times"], decimals, provenance)
