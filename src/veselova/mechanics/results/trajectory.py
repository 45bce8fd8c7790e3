"""The one result type of both engines."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import Progress, limits
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.errors import (
    Unsolved,
    did_you_mean,
)
from veselova.mechanics.core.problem import CONDITIONING, Problem, Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.npz import read_decimals
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.sampled_motion import SampledMotion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Trajectory"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(SampledMotion):
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
            answer: Trajectory = self.dense(times)
        return answer

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


def _drift(values: Array, vanishes: bool) -> float:
    """Return the largest change against the largest component at the first time; against 1 for what
    vanishes, or is at rest.
    """
    scale = float(np.abs(values[:1]).max(initial=0.0))
    change = float(np.abs(values - values[:1]).max(initial=0.0))
    return change if vanishes or scale == 0 else change / scale
