"""The NumPy archive of a trajectory, written array by array, and its decimals read back."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import Decimals, decimals_of
from veselova.mechanics.core.errors import Faults
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.table import row_blocks

__all__ = ["decimal_arrays", "read_decimals", "require_arrays", "write_archive"]

#: Suffixes of the decimals of a series, and of their radii.
_DECIMAL = "decimal"
_RADIUS = "radius"

#: Level of compression: the mantissas of a motion are noise to it, and more costs seconds and saves
#: nothing.
_LEVEL = 1


def write_archive(stream: BinaryIO, arrays: Iterable[tuple[str, NDArray[Any]]]) -> None:
    """Write arrays by their names, one after the other, as ``numpy.load`` reads them."""
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL) as archive:
        for name, array in arrays:
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                _write_array(member, array)


def _write_array(member: Any, array: NDArray[Any]) -> None:
    """Write an array in NumPy's own format, a block at a time: numpy.lib.format would copy what is
    not contiguous.
    """
    header = {
        "descr": np.lib.format.dtype_to_descr(array.dtype),
        "fortran_order": False,
        "shape": array.shape,
    }
    np.lib.format.write_array_header_1_0(member, header)
    if array.ndim == 0:
        member.write(array.tobytes())
        return
    for block in row_blocks(array.shape[0], array[:1].size):
        member.write(array[block].tobytes())


def decimal_arrays(name: str, decimals: Decimals) -> Mapping[str, NDArray[Any]]:
    """Return the decimals of a series and their radii, as texts by the names that an archive has
    for them.
    """
    midpoints = decimals.midpoints[name]
    radii = decimals.radii[name]
    return {f"{name}_{_DECIMAL}": midpoints.astype(str), f"{name}_{_RADIUS}": radii.astype(str)}


def read_decimals(
    problem: Problem, archive: Mapping[str, Any], digits: int, certified: bool
) -> Decimals | None:
    """Return the decimals of an open archive, None where it has doubles alone. Raises KeyError
    where some are missing.
    """
    if f"{next(iter(problem.outputs))}_{_DECIMAL}" not in archive:
        return None
    midpoints, radii = (
        {name: decimals_of(archive[f"{name}_{kind}"]) for name in problem.outputs}
        for kind in (_DECIMAL, _RADIUS)
    )
    return Decimals(digits, certified, midpoints, radii, problem.bounded)


def require_arrays(arrays: Mapping[str, Any], problem: Problem) -> None:
    """Raise InvalidInput unless the arrays of a file are doubles of one number of times, in the
    shapes of the problem's series.
    """
    count = np.size(arrays["times"])
    shapes = {name: (count, *values.shape[1:]) for name, values in problem.start.items()}
    faults = Faults()
    for name in ("times", "error", *problem.stored):
        shape = shapes.get(name, (count,))
        found = arrays.get(name)
        if found is None:
            continue
        if found.dtype != np.float64 or found.shape != shape or not count:
            given = f"{found.dtype} of shape {found.shape}"
            faults.add(("source", name), f"doubles of shape {shape}", given)
        elif not np.isfinite(found).all():
            faults.add(("source", name), "finite numbers", "others")
    faults.require_none()
