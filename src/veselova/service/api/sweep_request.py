"""The JSON of a sweep: a base problem, what varies, and what is asked of each problem; and its
results as an xarray Dataset."""

from __future__ import annotations

import hashlib
import math
import pathlib
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
import orjson
from pydantic import ConfigDict, Field

from veselova.mechanics.core.arguments import Path
from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    InvalidRequest,
    VeselovaError,
    install_extra,
    needs,
    select_faults,
)
from veselova.mechanics.core.exact_input import plain
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.times import as_request
from veselova.mechanics.systems.veselova import Veselova
from veselova.service.api.examples import BODY4_PROBLEM
from veselova.service.api.problem_models import Given, Grid, Pair, Times, choice_of
from veselova.service.api.request_models import (
    Engine,
    Formulation,
    Method,
    Outputs,
    TorusRequest,
    TrajectoryRequest,
    read_request,
    stated_count,
    time_grid,
)
from veselova.service.api.sweep_parameters import (
    Axis,
    Draw,
    Parameter,
    column_name,
    components,
    overlap,
    parameters,
    replace_values,
    to_table_value,
)
from veselova.version import __version__


class SpacedGrid(Grid):
    """The values of a grid."""

    spacing: Literal["linear", "log"] = "linear"


_Values = Annotated[list[Any], Field(min_length=1)]
_Distribution = choice_of("Distribution", 1, uniform=Pair, log_uniform=Pair, normal=Pair)

#: Problems of one sweep.
MOST_PROBLEMS = 1_000_000

#: How many problems of a sweep, evenly spread, are looked at before it begins: one of them must be
#: valid.
_LOOKED_AT = 16

#: Problems in one chunk: about a second of work for small n, by their number (of motions in closed
#: form, of tori that are computed together, and integrated), their times and what is kept.
_CHUNK_ROWS = 250
_CHUNK_TORI = 2000
_CHUNK_INTEGRATED = 10
_CHUNK_TIMES = 20_000
_CHUNK_VALUES = 1_000_000


class SweepRequest(TorusRequest):
    """Many problems: one base problem with every combination of the values of some of its numbers,
    or with random ones.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"problem": BODY4_PROBLEM, "vary": {"/A/0": {"start": 3, "stop": 4, "count": 11}}}
            ]
        }
    )

    vary: Given[
        Annotated[
            dict[str, _Values | SpacedGrid | _Distribution],  # type: ignore[valid-type]
            Field(min_length=1),
        ]
    ] = Field(
        description="JSON pointer into the problem → a list of values of the same shape, a grid "
        "{start, stop, count, spacing}, or a distribution {uniform: [low, high]}, {log_uniform: "
        "[low, high]}, {normal: [mean, deviation]}, of which each component is drawn; lists and "
        "grids are combined with one another"
    )
    samples: Annotated[
        int, Field(ge=1, le=MOST_PROBLEMS, description="random draws for each combination")
    ] = 1
    seed: Annotated[
        int,
        Field(
            ge=0, lt=2**63, description="of the random draws; the same seed gives the same problems"
        ),
    ] = 0
    times: Annotated[
        Times | None,
        Field(
            description="times of a motion for each problem, with its error, drift and extremes; "
            "none when left out"
        ),
    ] = None
    engine: Engine = None
    method: Method = None
    formulation: Formulation = None
    outputs: Outputs = None
    trajectories: Annotated[
        bool, Field(description="whether the outputs themselves are kept, as a Zarr store")
    ] = False

    def faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields; one problem of those looked at
        must be valid. Where there are faults, those of the base problem come along.
        """
        kind = self.problem.problem_class
        faults = Faults()
        if self.times is None and not kind.has_tori:
            required = f"this field, for system {kind.system} has no torus to summarise"
            faults.add(("times",), required, "nothing")
        for name in ("engine", "method", "formulation", "outputs", "trajectories"):
            if self.times is None and getattr(self, name):
                required = "times as well (without them no motion is computed)"
                faults.add((name,), required, "no times")
        if faults.attempt(lambda: self.varied) is not None:
            if self.total > MOST_PROBLEMS:
                faults.add(("vary",), f"at most {MOST_PROBLEMS} problems", str(self.total))
            if self.samples > 1 and not self.draws:
                faults.add(("samples",), "1 where nothing is drawn at random", str(self.samples))
        if not faults.found:
            faults.attempt(self._require_one_valid)
        if not faults.found:
            try:
                _ = self.canonical
            except TypeError as error:  # JSON can spell half of a surrogate pair, Python any object
                faults.add((), "what JSON can hold, with whole characters", str(error))
        return [*faults.found, *self._base_faults(faults.found)] if faults.found else []

    def _base_faults(self, found: Sequence[InvalidInput]) -> list[InvalidInput]:
        """Return what is wrong with the base problem and the motion asked of it, besides what was
        found, and with places that vary set aside.
        """
        faults = Faults()
        faults.attempt(self.request_of, {})
        stated = map(str, self.vary if isinstance(self.vary, dict) else ())
        aside = [("problem", *pointer.split("/")[1:]) for pointer in stated if pointer[:1] == "/"]
        aside += [tuple(map(str, single.path)) for fault in found for single in fault.faults]

        def is_fixed(fault: InvalidInput) -> bool:
            path = tuple(map(str, fault.path))
            return not any(overlap(path, place) for place in aside)

        return select_faults(faults.found, is_fixed)

    def _require_one_valid(self) -> None:
        """Raise InvalidInput unless one of some problems, evenly spread, is valid."""
        found: tuple[int, VeselovaError] | None = None
        rows = np.linspace(0, self.total - 1, min(_LOOKED_AT, self.total)).astype(int)
        for row in np.unique(rows).tolist():
            try:
                self.request_of(self.values(row))
            except VeselovaError as error:
                found = found or (row, error)
            else:
                return
        row, first = found or (0, None)
        if isinstance(first, InvalidInput):
            placed = [self._where_stated(fault, row) for fault in first.faults]
            raise InvalidRequest(placed, first.further)

    def _where_stated(self, fault: InvalidInput, row: int) -> InvalidInput:
        """Return a fault of one problem, located in the request: below ``vary`` for a place that
        varies.
        """
        position = iter(np.unravel_index(row, self.shape))
        for pointer, parameter in zip(self.vary, self.varied, strict=True):
            entry = int(next(position)) if isinstance(parameter, Axis) else 0
            depth = len(parameter.path) + 1
            if fault.path[:depth] == ("problem", *parameter.path):
                listed = isinstance(self.vary[pointer], list)
                inside = (entry, *fault.path[depth:]) if listed else ()
                return InvalidInput(("vary", pointer, *inside), fault.required, fault.given)
        return fault

    @cached_property
    def varied(self) -> list[Parameter]:
        """Return the parameters; raises InvalidInput."""
        return parameters(self.vary, self.problem.model_dump(exclude_none=True))

    @cached_property
    def axes(self) -> list[Axis]:
        """Return the parameters that take given values."""
        return [parameter for parameter in self.varied if isinstance(parameter, Axis)]

    @cached_property
    def draws(self) -> list[Draw]:
        """Return the parameters that are drawn at random."""
        return [parameter for parameter in self.varied if isinstance(parameter, Draw)]

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Return the numbers of values of the axes, the last axis running fastest, then the samples
        where there are draws.
        """
        return (*(len(axis.values) for axis in self.axes), *((self.samples,) if self.draws else ()))

    @property
    def total(self) -> int:
        """Return the number of problems."""
        return math.prod(self.shape)

    def values(self, row: int) -> dict[Path, Any]:
        """Return the values of the parameters in one problem; a draw depends on the seed and the
        row alone.
        """
        position = np.unravel_index(row, self.shape)
        random = np.random.default_rng([self.seed, row]) if self.draws else None
        found: dict[Path, Any] = {
            axis.path: axis.values[int(i)] for axis, i in zip(self.axes, position)
        }
        if random is not None:
            found |= {draw.path: draw.draw(random) for draw in self.draws}
        return {parameter.path: found[parameter.path] for parameter in self.varied}

    def columns(self, values: Mapping[Path, Any]) -> Iterator[tuple[str, float | None]]:
        """Yield the values of the parameters in one problem by the names of their columns,
        component by component.
        """
        for path, value in values.items():
            for name, scalar in components(column_name(path), value):
                yield name, to_table_value(scalar)

    def request_of(self, values: Mapping[Path, Any]) -> TorusRequest | TrajectoryRequest:
        """Return the request of one problem: for its motion where there are times, for its torus
        else. Raises InvalidRequest.
        """
        problem = replace_values(self.problem.model_dump(exclude_none=True), values)
        if self.times is None:
            return read_request(TorusRequest, {"problem": problem, "budget_s": self.budget_s})
        asked = {
            name: getattr(self, name)
            for name in ("times", "engine", "method", "formulation", "outputs", "budget_s")
        }
        return read_request(TrajectoryRequest, {"problem": problem, **asked})

    @property
    def asked_at_once(self) -> bool:
        """Return whether the problems can be computed in batches: the tori of Veselova problems,
        and their motions in closed form.
        """
        plain_motion = (
            self.engine in (None, "analytic") and self.method is None and self.formulation is None
        )
        return self.problem.system == Veselova.system and (self.times is None or plain_motion)

    @property
    def row_values(self) -> int:
        """Return how many numbers the answer to one problem has, about: columns of the table, and
        of the kept trajectories.
        """
        n = self.problem.dimension
        outputs = len(self.outputs) if self.outputs else len(self.problem.outputs)
        summary = 16 + 8 * n + (2 * outputs * n * n if self.times is not None else 0)
        return summary + (outputs * n * n * stated_count(self.times) if self.trajectories else 0)

    @property
    def chunk_rows(self) -> int:
        """Return how many problems make one chunk."""
        rows = _CHUNK_TORI if self.asked_at_once and self.times is None else _CHUNK_ROWS
        if "numeric" in (self.engine, next(iter(self.problem.problem_class.engines))):
            rows = _CHUNK_INTEGRATED
        return max(
            1,
            min(
                rows,
                _CHUNK_TIMES // max(1, stated_count(self.times)),
                _CHUNK_VALUES // self.row_values,
            ),
        )

    @cached_property
    def canonical(self) -> bytes:
        """Return the request as JSON, defaults filled in and fields sorted: equal for requests that
        mean the same.

        The places that vary keep their order, for it is that of the rows.
        """
        document = orjson.loads(orjson.dumps(plain(self.model_dump()), option=orjson.OPT_SORT_KEYS))
        document["vary"] = {place: document["vary"][place] for place in self.vary}
        return orjson.dumps(document)

    @cached_property
    def id(self) -> str:
        """Return the hash of the request and the version of the engines."""
        return hashlib.sha256(self.canonical + __version__.encode()).hexdigest()[:32]


def sweep_document(problem: Any, vary: Any, times: Any) -> dict[str, Any]:
    """Return what the JSON of a sweep says of its problems, from the arguments of Python."""
    return {
        "problem": problem.as_request() if isinstance(problem, Problem) else plain(problem),
        "vary": plain(vary),
        "times": None if times is None else as_request(times),
    }


def sweep_dataset(
    sweep: SweepRequest, table: pathlib.Path, trajectories: pathlib.Path | None = None
) -> Any:
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


def _outputs(sweep: SweepRequest, dimensions: list[str], path: pathlib.Path) -> dict[str, Any]:
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
