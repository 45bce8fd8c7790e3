"""The one result type of both engines."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import Progress, limits
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.errors import (
    BackendMissing,
    InvalidInput,
    Unsolved,
    did_you_mean,
    show,
    unknown_name,
)
from veselova.mechanics.core.problem import CONDITIONING, Problem, Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.npz import decimal_arrays, read_decimals, write_archive
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.table import Table, Target, flat_columns, open_target, row_blocks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Trajectory"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """A motion at given times. Its series are attributes: those of ``problem.outputs``, such as
    ``trajectory.q``.

    - times: (N,)
    - error: (N,) bounds the true error of every component of the problem's ``bounded`` series:
      true ≤ error
    - arrays: the series that do not follow from others, by name; the first axis is the times,
      which may be the last in memory
    - decimals: the same series to more digits, or with certified errors; None unless requested
    - remainders: (N,) the exact times less ``times``; None where the exact times are doubles
    """

    problem: Problem
    times: Array
    error: Array
    arrays: Series
    provenance: Provenance
    dense: Callable[[Any], Trajectory] | None = field(default=None, repr=False)
    decimals: Decimals | None = None
    remainders: Array | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "arrays", dict(self.arrays))
        for array in (self.times, self.error, self.remainders, *self.arrays.values()):
            if array is not None:
                array.setflags(write=False)

    @classmethod
    def on_grid(
        cls,
        problem: Problem,
        grid: TimeGrid,
        error: Array,
        arrays: Series,
        provenance: Provenance,
        dense: Callable[[Any], Trajectory] | None = None,
    ) -> Trajectory:
        """Return the trajectory at the times asked for, in their order, from what is known at those
        of a grid.
        """
        if grid.places is not None:
            error = error[grid.places]
            arrays = {name: values[grid.places] for name, values in arrays.items()}
        return cls(
            problem, grid.asked, error, arrays, provenance, dense, remainders=grid.asked_remainders
        )

    @classmethod
    def at_rest(
        cls,
        problem: Problem,
        grid: TimeGrid,
        provenance: Provenance,
        dense: Callable[[Any], Trajectory],
    ) -> Trajectory:
        """Return the trajectory of a problem that does not move: its start, to rounding."""
        arrays = {
            name: np.repeat(values, grid.doubles.size, axis=0)
            for name, values in problem.start.items()
        }
        return cls.on_grid(
            problem,
            grid,
            np.full(grid.doubles.size, np.finfo(float).eps),
            arrays,
            provenance,
            dense,
        )

    @classmethod
    def of_decimals(
        cls,
        problem: Problem,
        times: Array,
        decimals: Decimals,
        provenance: Provenance,
        dense: Callable[[Any], Trajectory] | None = None,
        remainders: Array | None = None,
    ) -> Trajectory:
        """Return the trajectory whose arrays are the decimals rounded to doubles, which its error
        includes.
        """
        arrays = {name: decimals.midpoints[name].astype(np.float64) for name in problem.stored}
        error = np.nextafter(decimals.error.astype(np.float64), np.inf) + np.finfo(float).eps / 2
        return cls(problem, times, error, arrays, provenance, dense, decimals, remainders)

    def series(self, name: str) -> Array:
        """Return one of the problem's outputs, or ``conditioning``, by name; raises InvalidInput
        for another.
        """
        if name == CONDITIONING:
            return self.conditioning
        if name not in self.arrays:
            self._choose([name])
            values = self.problem.derive(name, self.arrays)
            values.setflags(write=False)
            self.arrays[name] = values  # type: ignore[index]
        return self.arrays[name]

    def __getattr__(self, name: str) -> Array:
        problem: Problem | None = self.__dict__.get("problem")
        if problem is None or name not in problem.outputs:  # no problem yet: while a pickle is read
            system = f" of system {problem.system}" if problem else ""
            # Names with underscores are asked for by protocols (copy, pickle, notebooks), and not
            # by people.
            hint = did_you_mean(name, dir(self)) if problem and not name.startswith("_") else ""
            raise AttributeError(f"a trajectory{system} has no {name!r}{hint}")
        return self.series(name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.problem.outputs]

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

    @cached_property
    def conditioning(self) -> Array:
        """Return how far a bounded component may have moved by each time when the data move by one
        rounding, (N,).

        One rounding: 2^−53 of a number, or one unit of the last digit of a text with more digits
        than a double; whole numbers and ratios are exact. On each side of t = 0 it never falls with
        |t|, and depends on the problem and the time alone. From a tenth of the state's extent on it
        stays as it is: no digit is determined there. It is measured by motions from moved data, so
        it takes some solves when it is first asked for. ``error`` is that of the motion of exactly
        these data; this says how much of the motion is that of others that read the same.
        ``problem.conditioning_floor`` is the formula for doubles in a motion that loses nothing.
        """
        # By name, as engines are: what solves stands above results, and is loaded when it is asked
        # for.
        found: Array = import_module("veselova.conditioning").conditioning(self)
        found.setflags(write=False)
        return found

    @property
    def drift(self) -> dict[str, float]:
        """Return, per integral of motion, its largest change against the first time, relative to
        its size there (or to 1).
        """
        return {
            name: _drift(values, vanishes=name in self.problem.vanishing)
            for name, values in self.integrals.items()
        }

    def with_conditioning(self, values: Array | None) -> Trajectory:
        """Return the trajectory itself, which now knows its conditioning (N,) without solving."""
        if values is not None:
            vars(self)[CONDITIONING] = values
        return self

    def at(
        self, times: Any, *, budget_s: float | None = None, progress: Progress = None
    ) -> Trajectory:
        """Return the same motion at other times; raises Unsolved without a dense answer."""
        if self.dense is None:
            raise Unsolved(
                "no-dense-answer",
                f"a trajectory of method {self.provenance.method} is known at its times "
                "only; solve again",
            )
        with limits(budget_s, progress):
            return self.dense(times)

    def columns(self, outputs: Iterable[str] | None = None) -> dict[str, Array]:
        """Return the flat table of all or the chosen series: time, error, every component, named
        like ``frame_1_2`` (from 1), and every integral of motion, like ``integral_energy``.
        """
        return self._table(self.error, {name: self.series(name) for name in self._choose(outputs)})

    def _choose(self, outputs: Iterable[str] | None) -> tuple[str, ...]:
        """Return the names of the chosen series, all of the problem's where none are named; raises
        InvalidInput for others, and for none.
        """
        names = self.problem.output_names()
        chosen = tuple(self.problem.outputs if outputs is None else outputs)
        if isinstance(outputs, str) or not chosen:
            raise InvalidInput(
                ("outputs",), f"a list of one or more of {', '.join(names)}", show(outputs)
            )
        for i, name in enumerate(chosen):
            if name not in names:
                raise unknown_name(("outputs", i), name, names)
        return chosen

    def _table(
        self, error: NDArray[Any], series: Mapping[str, NDArray[Any]]
    ) -> dict[str, NDArray[Any]]:
        table: dict[str, NDArray[Any]] = {self.problem.time: self.times}
        if self.remainders is not None:
            table[f"{self.problem.time}_remainder"] = self.remainders
        table["error"] = error
        for name, values in series.items():
            table |= flat_columns(name, values)
        for name, values in self.integrals.items():
            table |= flat_columns(f"integral_{name}", values)
        return table

    def to_npz(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write series, integrals and provenance to a NumPy archive; decimals as texts (q_decimal,
        q_radius …).
        """
        chosen = self._choose(outputs)
        with open_target(target) as stream:
            write_archive(stream, self._archive(chosen))

    def _archive(self, outputs: Iterable[str]) -> Iterator[tuple[str, NDArray[Any]]]:
        yield "provenance", np.array(json.dumps(self.provenance.as_dict()))
        yield from self.named_arrays(outputs)
        for name, values in self.integrals.items():
            yield f"integral_{name}", values

    def named_arrays(self, outputs: Iterable[str]) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield times, error and the chosen series by the names that an archive has for them,
        decimals as texts.
        """
        yield "times", self.times
        if self.remainders is not None:
            yield "remainders", self.remainders
        yield "error", self.error
        for name in outputs:
            yield name, self.series(name)
            if self.decimals is not None and name in self.problem.outputs:
                yield from decimal_arrays(name, self.decimals).items()

    @classmethod
    def from_arrays(cls, problem: Problem, archive: Mapping[str, Any]) -> Trajectory:
        """Return the trajectory of an open archive, or of such arrays by name with the dictionary
        of their ``provenance``.

        Raises KeyError unless it has every series that does not follow from others, and all
        decimals or none.
        """
        found = archive["provenance"]
        provenance = Provenance(**(found if isinstance(found, dict) else json.loads(str(found))))
        decimals = read_decimals(
            problem, archive, provenance.digits, bool(provenance.details.get("certified"))
        )
        # An open archive of NumPy has no ``get``.
        remainders, known = (
            archive[name] if name in archive else None  # noqa: SIM401
            for name in ("remainders", CONDITIONING)
        )
        series = {name: archive[name] for name in problem.stored}
        return cls(
            problem,
            archive["times"],
            archive["error"],
            series,
            provenance,
            None,
            decimals,
            remainders,
        ).with_conditioning(known)

    def in_order_of_time(self) -> Trajectory:
        """Return the trajectory with its times in increasing order: itself, or its
        doubles alone.
        """
        order = np.argsort(self.times, kind="stable")
        if (np.diff(order) == 1).all():
            return self
        arrays = {name: values[order] for name, values in self.arrays.items()}
        times = self.times[order]
        error = self.error[order]
        return replace(
            self, times=times, error=error, arrays=arrays, decimals=None, remainders=None
        )

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
        Table(table, self.provenance.as_dict()).to_csv(target)

    def to_parquet(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write the flat table and the provenance as Parquet, doubles only; raises BackendMissing
        without pyarrow.
        """
        Table(self.columns(outputs), self.provenance.as_dict()).to_parquet(target)

    def to_arrow(self, target: Target, outputs: Iterable[str] | None = None) -> None:
        """Write the flat table and the provenance as an Arrow IPC stream, doubles only; raises
        BackendMissing without pyarrow.
        """
        Table(self.columns(outputs), self.provenance.as_dict()).to_arrow(target)

    def to_xarray(self, outputs: Iterable[str] | None = None) -> Any:
        """Return an xarray Dataset of all or the chosen series, doubles, with the time as its
        coordinate; raises BackendMissing without xarray.

        Its attributes are the provenance. Texts and numbers stand as they are, anything else as
        JSON, as NetCDF asks: ``to_netcdf(path)`` writes it.
        """
        try:
            from xarray import Dataset
        except ImportError:
            raise BackendMissing("xarray", "Dataset output", "pip install xarray") from None
        axes = self.problem.outputs
        variables: dict[str, Any] = {
            name: (("time", *axes.get(name, ())), self.series(name))
            for name in self._choose(outputs)
        }
        variables["error"] = (("time",), self.error)
        if self.remainders is not None:
            variables["time_remainder"] = (("time",), self.remainders)
        return Dataset(
            variables, coords={"time": self.times}, attrs=_attributes(self.provenance.as_dict())
        )

    def plot(self) -> Figure:
        """Return a matplotlib figure of the motion; raises BackendMissing without matplotlib."""
        from veselova.mechanics.results.plot import picture

        return picture(self.in_order_of_time())

    def __repr__(self) -> str:
        span = f"{self.times.size} times from {self.times.min():g} to {self.times.max():g}"
        how = f"{self.provenance.engine} ({self.provenance.method})"
        return (
            f"<Trajectory: {self.problem.title}, {span}, {how}, error ≤ {np.max(self.error):.2g}>"
        )

    def _repr_html_(self) -> str:
        rows = {
            "system": self.problem.title,
            "engine": f"{self.provenance.engine} ({self.provenance.method})",
            "times": f"{self.times.size} from {self.times.min():g} to {self.times.max():g}",
            "largest error": f"{np.max(self.error):.2g}",
            "seconds": f"{self.provenance.seconds:.3g}",
            **{f"drift of {name}": f"{value:.2g}" for name, value in self.drift.items()},
        }
        body = "".join(
            f"<tr><th style='text-align:left'>{key}</th><td>{value}</td></tr>"
            for key, value in rows.items()
        )
        return f"<table>{body}</table>"


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


def _drift(values: Array, vanishes: bool) -> float:
    """Return the largest change against the largest component at the first time; against 1 for what
    vanishes, or is at rest.
    """
    scale = float(np.abs(values[:1]).max(initial=0.0))
    change = float(np.abs(values - values[:1]).max(initial=0.0))
    return change if vanishes or scale == 0 else change / scale
