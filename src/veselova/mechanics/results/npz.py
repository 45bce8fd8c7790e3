"""The NumPy archive of a trajectory: everything that it knows, written array by array, and read back."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import Decimals, decimals_of
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.table import row_blocks

if TYPE_CHECKING:
    from veselova.mechanics.results.trajectory import Trajectory

__all__ = ["archived_series", "read_archive", "write_archive"]

#: Suffixes of the decimals of a series, and of their radii.
_DECIMAL, _RADIUS = "decimal", "radius"

#: Level of compression: the mantissas of a motion are noise to it, and more costs seconds and saves nothing.
_LEVEL = 1


def write_archive(trajectory: Trajectory, stream: BinaryIO, outputs: Iterable[str]) -> None:
    """Write times, error, provenance, the chosen series (decimals as texts) and the integrals."""
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL) as archive:
        for name, array in _arrays(trajectory, tuple(outputs)):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                _write_array(member, array)


def _arrays(trajectory: Trajectory, outputs: tuple[str, ...]) -> Iterator[tuple[str, NDArray[Any]]]:
    yield "provenance", np.array(json.dumps(trajectory.provenance.as_dict()))
    yield from archived_series(trajectory, outputs)
    for name, values in trajectory.integrals.items():
        yield f"integral_{name}", values


def archived_series(trajectory: Trajectory, outputs: Iterable[str]) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield times, error and the chosen series by the names of their arrays, decimals and their radii as texts as well."""
    yield "times", trajectory.times
    if trajectory.remainders is not None:
        yield "remainders", trajectory.remainders
    yield "error", trajectory.error
    for name in outputs:
        yield name, trajectory.series(name)
        if trajectory.decimals is not None:
            yield f"{name}_{_DECIMAL}", trajectory.decimals.midpoints[name].astype(str)
            yield f"{name}_{_RADIUS}", trajectory.decimals.radii[name].astype(str)


def _write_array(member: Any, array: NDArray[Any]) -> None:
    """Write an array in NumPy's own format, a block at a time: numpy.lib.format would copy what is not contiguous."""
    header = {"descr": np.lib.format.dtype_to_descr(array.dtype), "fortran_order": False, "shape": array.shape}
    np.lib.format.write_array_header_1_0(member, header)
    if array.ndim == 0:
        member.write(array.tobytes())
        return
    for block in row_blocks(array.shape[0], array[:1].size):
        member.write(array[block].tobytes())


def read_archive(problem: Problem, archive: Mapping[str, Any]) -> Trajectory:
    """Return the trajectory of an open archive, or of such arrays by name with the dictionary of their ``provenance``.

    Raises KeyError unless it has what no other series gives, of decimals all.
    """
    from veselova.mechanics.results.trajectory import Provenance, Trajectory

    found = archive["provenance"]
    provenance = Provenance(**(found if isinstance(found, dict) else json.loads(str(found))))
    series = {name: archive[name] for name in problem.stored}
    decimals = None
    if f"{next(iter(problem.outputs))}_{_DECIMAL}" in archive:
        midpoints, radii = (
            {name: decimals_of(archive[f"{name}_{kind}"]) for name in problem.outputs} for kind in (_DECIMAL, _RADIUS)
        )
        decimals = Decimals(provenance.digits, bool(provenance.details["certified"]), midpoints, radii, problem.bounded)
    remainders = archive["remainders"] if "remainders" in archive else None  # noqa: SIM401  an open archive has no get
    times, error = archive["times"], archive["error"]
    return Trajectory(problem, times, error, series, provenance, decimals=decimals, remainders=remainders)
