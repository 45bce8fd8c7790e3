"""A motion at given times: its series by name, its integrals, how it was computed, and the tables
and files of them.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import FEWEST_DIGITS, require_name, require_names
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.errors import InvalidInput, needs
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.results.table import (
    Target,
    flat_columns,
    open_target,
    row_blocks,
    write_arrow,
    write_csv,
    write_parquet,
)
from veselova.version import __version__

__all__ = ["Provenance", "SampledMotion"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Provenance:
    """How a trajectory was computed. ``details`` are figures of the method: nodes,
    modes, steps …
    """

    engine: str
    method: str
    digits: int
    version: str
    seconds: float
    details: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def since(
        cls, began: float, engine: str, method: str, details: Mapping[str, Any]
    ) -> Provenance:
        """Return the provenance of an answer in double precision that was begun at a reading of
        ``time.perf_counter``.
        """
        return cls(engine, method, FEWEST_DIGITS, __version__, time.perf_counter() - began, details)

    def as_dict(self) -> dict[str, Any]:
        """Return the provenance as a JSON-ready dictionary."""
        return {**vars(self), "details": dict(self.details)}


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
        return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}

    def relative_change(self, name: str) -> Array:
        """Return the largest change of an integral against its first value, at each time, (N,):
        relative to the largest component there; to 1 for what vanishes, or is at rest.
        """
        values = self.integrals[require_name(name, ("name",), list(self.integrals))]
        change = np.abs(values - values[:1]).reshape(len(values), -1).max(axis=1, initial=0.0)
        scale = float(np.abs(values[:1]).max(initial=0.0))
        return np.asarray(change if name in self.problem.vanishing or not scale else change / scale)

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
        named: dict[str, Any] = {"times": self.times, "error": self.error}
        named |= {name: np.array(json.dumps(fact)) for name, fact in self.facts.items()}
        for name in self._choose(outputs):
            named[name] = self.series(name)
            if self.decimals is not None:
                named[f"{name}_decimal"] = self.decimals.midpoints[name].astype(str)
                named[f"{name}_radius"] = self.decimals.radii[name].astype(str)
        named |= {f"integral_{name}": values for name, values in self.integrals.items()}
        with open_target(target) as stream:
            np.savez(stream, **named)

    @property
    def facts(self) -> dict[str, Any]:
        """Return the provenance, and the problem where a document states it."""
        facts: dict[str, Any] = {"provenance": self.provenance.as_dict()}
        with suppress(InvalidInput):
            facts["problem"] = self.problem.as_request()
        return facts

    def to_csv(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write the flat table as comma-separated values, one row per time: doubles to the last
        bit, or all of the decimals.
        """
        table: Mapping[str, NDArray[Any]] = self.columns(outputs)
        if self.decimals is not None:
            series = {name: self.decimals.midpoints[name] for name in self._choose(outputs)}
            table = self._table(self.decimals.error, series)
        write_csv(table, target)

    def to_parquet(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write the flat table, the provenance and the problem as Parquet, doubles only; raises
        BackendMissing without pyarrow.
        """
        write_parquet(self.columns(outputs), self.facts, target)

    def to_arrow(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write the flat table, the provenance and the problem as an Arrow IPC stream, doubles
        only; raises BackendMissing without pyarrow.
        """
        write_arrow(self.columns(outputs), self.facts, target)

    def to_dataframe(self, outputs: Iterable[str] | None = None) -> Any:
        """Return a pandas DataFrame of the flat table, doubles, with the time as its index; raises
        BackendMissing without pandas. ``attrs`` has the provenance and the problem.
        """
        with needs("pandas", "DataFrame output"):
            from pandas import DataFrame, Index
        columns = self.columns(outputs)
        index = Index(columns.pop(self.problem.time), name=self.problem.time)
        table = DataFrame(columns, index=index)
        table.attrs = self.facts
        return table

    def to_xarray(self, outputs: Iterable[str] | None = None) -> Any:
        """Return an xarray Dataset of all or the chosen series, doubles, with the time as its
        coordinate; raises BackendMissing without xarray.

        Its attributes are the provenance, the details as JSON, as NetCDF asks: ``to_netcdf(path)``
        writes it.
        """
        with needs("xarray", "Dataset output"):
            from xarray import Dataset
        axes = self.problem.outputs
        variables: dict[str, Any] = {
            name: (("time", *axes.get(name, ())), self.series(name))
            for name in self._choose(outputs)
        }
        variables["error"] = (("time",), self.error)
        facts = self.provenance.as_dict()
        attributes = {**facts, "details": json.dumps(facts["details"])}
        return Dataset(variables, coords={"time": self.times}, attrs=attributes)
