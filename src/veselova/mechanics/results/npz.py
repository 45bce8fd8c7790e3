"""The NumPy archive of a trajectory, and its decimals read back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import Decimals, decimals_of
from veselova.mechanics.core.errors import Faults
from veselova.mechanics.core.problem import Problem

__all__ = ["decimal_arrays", "read_decimals", "require_arrays", "write_archive"]

#: Suffixes of the decimals of a series, and of their radii.
_DECIMAL = "decimal"
_RADIUS = "radius"


def write_archive(stream: BinaryIO, arrays: Iterable[tuple[str, NDArray[Any]]]) -> None:
    """Write arrays by their names, as ``numpy.load`` reads them; the mantissas of a motion are
    noise, which nothing compresses.
    """
    named: dict[str, Any] = dict(arrays)
    np.savez(stream, **named)


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
