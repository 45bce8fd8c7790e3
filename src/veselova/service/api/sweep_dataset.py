"""The results of a sweep as an xarray Dataset: the axes of the sweep are its dimensions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from veselova.mechanics.core.errors import needs
from veselova.mechanics.core.installation import install_extra
from veselova.service.api.request_models import time_grid
from veselova.service.api.sweep_request import SweepRequest


def sweep_dataset(sweep: SweepRequest, table: Path, trajectories: Path | None = None) -> Any:
    """Return the Dataset of a sweep's table (Parquet) and of its kept trajectories (Zarr in one
    file).

    Dimensions: each parameter with given values, by its name (``A_1``), with them as coordinate
    where they are numbers, and
    ``sample`` where some are drawn. Variables: the columns of the table, which are the drawn
    parameters, ``outcome``, ``detail`` and the findings; then the outputs, as ``trajectory.q``,
    with further dimensions ``time`` and their own. Raises BackendMissing without xarray.
    """
    with needs("xarray", "The Dataset of a sweep", install_extra("sweeps")):
        import xarray
        from pyarrow import parquet
    dimensions = [axis.name for axis in sweep.axes] + (["sample"] if sweep.draws else [])
    coordinates, variables, given = _of_axes(sweep)
    columns = parquet.read_table(table)
    for name in columns.column_names:
        if name not in given:
            values = columns[name].to_numpy()
            variables[name] = (dimensions, values.reshape(sweep.shape))
    if trajectories is not None:
        coordinates["time"] = time_grid(sweep.times).asked
        variables |= _outputs(sweep, dimensions, trajectories)
    return xarray.Dataset(variables, coordinates, {"request": sweep.canonical.decode()})


def _of_axes(sweep: SweepRequest) -> tuple[dict[str, Any], dict[str, Any], set[str]]:
    """Return coordinates and variables of the axes, and the columns of the table that they stand
    for.
    """
    coordinates: dict[str, Any] = {}
    variables: dict[str, Any] = {}
    given = {"row"}
    for axis in sweep.axes:
        rows = [dict(sweep.columns({axis.path: value})) for value in axis.values]
        given |= set(rows[0])
        kind = coordinates if list(rows[0]) == [axis.name] else variables
        for name in rows[0]:
            values = [row[name] for row in rows]
            kind[name] = ((axis.name,), np.array(values, dtype=np.float64))
    return coordinates, variables, given


def _outputs(sweep: SweepRequest, dimensions: list[str], path: Path) -> dict[str, Any]:
    import zarr

    axes = {**sweep.problem.outputs, "error": ()}
    group = zarr.open_group(zarr.storage.ZipStore(path, mode="r"), mode="r")
    return {
        f"trajectory.{name}": (
            [*dimensions, "time", *axes[name]],
            np.asarray(array[:]).reshape(*sweep.shape, *array.shape[1:]),
        )
        for name, array in group.arrays()
    }
