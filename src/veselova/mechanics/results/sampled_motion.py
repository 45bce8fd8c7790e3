"""A motion at given times: its series by name, its integrals, and the tables and files of
both.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.errors import InvalidInput, needs
from veselova.mechanics.core.names import require_names
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.results.npz import decimal_arrays, write_archive
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.table import Table, Target, flat_columns, open_target, row_blocks

__all__ = ["SampledMotion"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class SampledMotion:
    """The series of a motion at N times, and what is written from them. ``Trajectory`` lists the
    fields.
    """

    problem: Problem
    times: Array
    error: Array
    arrays: Series
    provenance: Provenance
    dense: Callable[[Any], Any] | None = field(default=None, repr=False)
    decimals: Decimals | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "arrays", dict(self.arrays))
        for array in (self.times, self.error, *self.arrays.values()):
            array.setflags(write=False)
        if reason := self.problem.badly_conditioned:
            details = {**self.provenance.details, "badly_conditioned": reason}
            object.__setattr__(self, "provenance", replace(self.provenance, details=details))

    def series(self, name: str) -> Array:
        """Return one of the problem's outputs by name; raises InvalidInput for another."""
        if not isinstance(name, str) or name not in self.arrays:
            self._choose([name])
        if name not in self.arrays:
            values = self.problem.derive(name, self.arrays)
            values.setflags(write=False)
            self.arrays[name] = values  # type: ignore[index]
        return self.arrays[name]

    def __getitem__(self, name: str) -> Array:
        return self.series(name)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self.problem.outputs

    def __iter__(self) -> Iterator[str]:
        return iter(self.problem.outputs)

    def keys(self) -> Iterable[str]:
        """Return the names of the series: ``dict(trajectory)`` is a dictionary of them."""
        return self.problem.outputs.keys()

    @cached_property
    def integrals(self) -> Mapping[str, Array]:
        """Return the integrals of motion at each time, by name (see the problem's
        ``integrals``).
        """
        width = sum(values[:1].size for values in self.arrays.values())
        blocks = [
            self.problem.integrals({name: values[rows] for name, values in self.arrays.items()})
            for rows in row_blocks(self.times.size, width)
        ]
        return (
            blocks[0]
            if len(blocks) == 1
            else {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
        )

    def columns(self, outputs: Iterable[str] | None = None) -> dict[str, Array]:
        """Return the flat table of all or the chosen series: time, error, every component, named
        like ``frame_1_2`` (from 1), and every integral of motion, like ``integral_energy``.
        """
        return self._table(self.error, {name: self.series(name) for name in self._choose(outputs)})

    def _choose(self, outputs: Iterable[str] | None) -> tuple[str, ...]:
        """Return the names of the chosen series, all of the problem's where none are named; raises
        InvalidInput for others, and for none.
        """
        names = list(self.problem.outputs)
        chosen = self.problem.outputs if outputs is None else outputs
        return require_names(chosen, ("outputs",), names)

    def _table(
        self, error: NDArray[Any], series: Mapping[str, NDArray[Any]]
    ) -> dict[str, NDArray[Any]]:
        table: dict[str, NDArray[Any]] = {self.problem.time: self.times}
        table["error"] = error
        for name, values in series.items():
            table |= flat_columns(name, values)
        for name, values in self.integrals.items():
            table |= flat_columns(f"integral_{name}", values)
        return table

    def to_npz(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write series, integrals, provenance and problem to a NumPy archive; decimals as texts
        (q_decimal, q_radius …).
        """
        chosen = self._choose(outputs)
        with open_target(target) as stream:
            write_archive(stream, self._archive(chosen))

    def _archive(self, outputs: Iterable[str]) -> Iterator[tuple[str, NDArray[Any]]]:
        yield "provenance", np.array(json.dumps(self.provenance.as_dict()))
        for name, fact in self._stated_problem().items():
            yield name, np.array(json.dumps(fact))
        yield from self.named_arrays(outputs)
        for name, values in self.integrals.items():
            yield f"integral_{name}", values

    def _stated_problem(self) -> dict[str, Any]:
        """Return the problem's document by its name; nothing where no document states it."""
        try:
            return {"problem": self.problem.as_request()}
        except InvalidInput:
            return {}

    def named_arrays(self, outputs: Iterable[str]) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield times, error and the chosen series by the names that an archive has for them,
        decimals as texts.
        """
        yield "times", self.times
        yield "error", self.error
        for name in outputs:
            yield name, self.series(name)
            if self.decimals is not None and name in self.problem.outputs:
                yield from decimal_arrays(name, self.decimals).items()

    def to_csv(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write the flat table as comma-separated values, one row per time: doubles to the last
        bit, or all of the decimals.
        """
        chosen = self._choose(outputs)
        table: Mapping[str, NDArray[Any]] = self.columns(chosen)
        if self.decimals is not None:
            known = self.decimals.midpoints
            series = {
                name: known[name] if name in self.problem.outputs else self.series(name)
                for name in chosen
            }
            table = self._table(self.decimals.error, series)
        Table(table, {}).to_csv(target)

    def to_parquet(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write the flat table, the provenance and the problem as Parquet, doubles only; raises
        BackendMissing without pyarrow.
        """
        facts = {"provenance": self.provenance.as_dict(), **self._stated_problem()}
        Table(self.columns(outputs), facts).to_parquet(target)

    def to_arrow(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write the flat table, the provenance and the problem as an Arrow IPC stream, doubles
        only; raises BackendMissing without pyarrow.
        """
        facts = {"provenance": self.provenance.as_dict(), **self._stated_problem()}
        Table(self.columns(outputs), facts).to_arrow(target)

    def to_dataframe(self, outputs: Iterable[str] | None = None) -> Any:
        """Return a pandas DataFrame of the flat table, doubles, with the time as its index; raises
        BackendMissing without pandas. ``attrs`` has the provenance and the problem.
        """
        with needs("pandas", "DataFrame output"):
            from pandas import DataFrame, Index
        columns = self.columns(outputs)
        index = Index(columns.pop(self.problem.time), name=self.problem.time)
        table = DataFrame(columns, index=index)
        table.attrs = {"provenance": self.provenance.as_dict(), **self._stated_problem()}
        return table

    def to_xarray(self, outputs: Iterable[str] | None = None) -> Any:
        """Return an xarray Dataset of all or the chosen series, doubles, with the time as its
        coordinate; raises BackendMissing without xarray.

        Its attributes are the provenance. Texts and numbers stand as they are, anything else as
        JSON, as NetCDF asks: ``to_netcdf(path)`` writes it.
        """
        with needs("xarray", "Dataset output"):
            from xarray import Dataset
        axes = self.problem.outputs
        variables: dict[str, Any] = {
            name: (("time", *axes.get(name, ())), self.series(name))
            for name in self._choose(outputs)
        }
        variables["error"] = (("time",), self.error)
        return Dataset(
            variables, coords={"time": self.times}, attrs=_attributes(self.provenance.as_dict())
        )


def _attributes(facts: Mapping[str, Any]) -> dict[str, str | int | float]:
    """Return facts as attributes that a file can hold; a truth value is JSON too, though Python
    counts it as a number.
    """
    plain_kinds = (str, int, float)
    return {
        name: value
        if isinstance(value, plain_kinds) and not isinstance(value, bool)
        else json.dumps(value)
        for name, value in facts.items()
    }
