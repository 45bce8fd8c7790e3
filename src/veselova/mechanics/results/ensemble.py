"""The motions of many problems of one system at the same times, as arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import require_names
from veselova.mechanics.core.errors import InvalidInput, did_you_mean, needs
from veselova.mechanics.core.exact_input import positive_number
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.sampled_motion import Provenance
from veselova.mechanics.results.table import Target, flat_columns, open_target

__all__ = ["SOLVED", "Ensemble", "allocate", "chosen_outputs"]

Array = NDArray[np.float64]

#: What ``outcome`` says of a problem that was solved; else it names the reason, and ``detail``
#: explains it.
SOLVED = "solved"

#: What series are, and their units in those of the problem.
_LONG_NAMES = {
    "error": ("bound on the error of the bounded series", "of the series"),
    "q": ("position on the unit sphere", "1"),
    "q_dot": ("velocity of q", "1/time"),
    "q_prime": ("velocity of q in Neumann time", "1/tau1"),
    "frame": ("frame, columns e_i along the body axes", "1"),
    "gamma": ("vertical e_1 along the body axes", "1"),
    "Omega": ("angular velocity along the body axes", "1/time"),
    "omega": ("angular velocity, a skew matrix", "1/time"),
    "momentum": ("angular momentum along the body axes", "inertia/time"),
    "multiplier": ("multiplier of the constraint", "inertia/time**2"),
    "position": ("contact point on the plane", "length"),
    "velocity": ("velocity of the centre", "length/time"),
    "force": ("force at the contact point", "mass*length/time**2"),
    "spheroconic": ("spheroconic coordinates", "1/A"),
    "X": ("point of the ellipsoid", "sqrt(A)"),
    "X_dot": ("unit tangent of the geodesic", "1"),
    "t": ("time", "time of the problem"),
    "s": ("arc length", "sqrt(A)"),
    "tau1": ("Neumann time", "sqrt(A)"),
}

#: Series that are kept only where they are named: they follow from the frame, and would double
#: arrays that are computed side by side.
_ON_DEMAND = {"veselova": ("q", "omega", "spheroconic")}


@dataclass(frozen=True, eq=False, repr=False)
class Ensemble:
    """The motions of N problems of one system and dimension at T times. Its series are attributes
    with the axes problem, time, …, such as ``ensemble.frame`` (N, T, n, n).

    - times: (T,)
    - error: (N, T) bounds the true error of every component of the bounded series at each time:
      true ≤ error; bounded are q and frame
    - outcome: (N,) ``solved``, or the name of the reason; numbers of such a problem are NaN
    - detail: (N,) the reason in a sentence, empty where the problem was solved
    - together: (N,) which problems were computed side by side; the others by ``solve``
    - arrays: the series by name; axes: what theirs are called after problem and time
    - time: what ``times`` are: t, Neumann's tau1 or the arc length s
    """

    times: Array
    error: Array
    outcome: NDArray[np.str_]
    detail: tuple[str, ...]
    together: NDArray[np.bool_]
    arrays: Mapping[str, Array]
    provenance: Provenance
    axes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    time: str = "t"

    def __len__(self) -> int:
        return int(self.error.shape[0])

    def __getattr__(self, name: str) -> Array:
        arrays = self.__dict__.get("arrays", {})
        if name in arrays:
            found: Array = arrays[name]
            return found
        if name == "q" and "frame" in arrays:
            return np.asarray(arrays["frame"][..., 0])
        hint = "" if name.startswith("_") else did_you_mean(name, arrays)
        raise AttributeError(f"this ensemble has no {name!r}{hint}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.arrays]

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Return which problems were solved, (N,)."""
        return np.asarray(self.outcome == SOLVED)

    def to_npz(self, target: Target) -> None:
        """Write times, error, outcome, detail and the series to a NumPy archive."""
        parts: dict[str, NDArray[Any]] = {"times": self.times, "error": self.error}
        parts |= {"outcome": self.outcome, "detail": np.array(self.detail)}
        named: dict[str, Any] = {**parts, **self.arrays}
        with open_target(target) as stream:
            np.savez(stream, **named)

    def to_dataframe(self) -> Any:
        """Return a pandas DataFrame with the error and all components, its index problem and time;
        raises BackendMissing without pandas.
        """
        with needs("pandas", "DataFrame output"):
            from pandas import DataFrame, MultiIndex
        index = MultiIndex.from_product([range(len(self)), self.times], names=["problem", "time"])
        columns = {"error": self.error.ravel()}
        for name, values in self.arrays.items():
            columns |= flat_columns(name, values.reshape(-1, *values.shape[2:]))
        return DataFrame(columns, index=index)

    def to_xarray(self) -> Any:
        """Return an xarray Dataset with long names and units, its axes problem, time and those of
        each series; raises BackendMissing without xarray.
        """
        with needs("xarray", "Dataset output"):
            from xarray import Dataset
        variables: dict[str, Any] = {}
        for name, values in {"error": self.error, **self.arrays}.items():
            others = [f"{name}_{k}" for k in range(values.ndim - 2)]
            named, unit = _LONG_NAMES.get(name, (name, "of the problem"))
            facts = {"long_name": named, "units": unit}
            variables[name] = (("problem", "time", *self.axes.get(name, others)), values, facts)
        variables["outcome"] = (("problem",), self.outcome)
        named, unit = _LONG_NAMES[self.time]
        time = (("time",), self.times, {"long_name": named, "units": unit})
        return Dataset(variables, coords={"time": time})

    def __repr__(self) -> str:
        solved = int(np.count_nonzero(self.solved))
        largest = np.nanmax(self.error, initial=0.0)
        return (
            f"<Ensemble: {len(self)} problems, {solved} solved, {self.times.size} times, "
            f"error ≤ {largest:.2g}>"
        )


def chosen_outputs(system: type[Problem], outputs: Iterable[str] | None) -> tuple[str, ...]:
    """Return the names of the series that are kept: those named, or all but those that are kept on
    demand. Raises InvalidInput for other names, and for none.
    """
    if outputs is None:
        on_demand = _ON_DEMAND.get(system.system, ())
        return tuple(name for name in system.outputs if name not in on_demand)
    return require_names(outputs, ("outputs",), list(system.outputs))


def allocate(
    system: type[Problem], outputs: Iterable[str], count: int, times: int, n: int, most_bytes: int
) -> dict[str, Array]:
    """Return NaN arrays for the series and the error of so many problems of dimension n.

    Raises InvalidInput (``times``) where they are larger than ``most_bytes``, before any work, and
    for another ``most_bytes`` than a number greater than 0.
    """
    most = positive_number(most_bytes, ("most_bytes",))
    sizes = {"coordinate": n - 1, "horizontal": n - 1}
    shapes: dict[str, tuple[int, ...]] = {"error": (count, times)}
    for name in outputs:
        axes = system.outputs[name]
        shapes[name] = (count, times, *(sizes.get(axis, n) for axis in axes))
    total = 8 * sum(int(np.prod(shape, dtype=object)) for shape in shapes.values())
    if total > most:
        required = f"arrays of at most {_gigabytes(float(most))} (see most_bytes and outputs)"
        given = f"{count} problems at {times} times: {_gigabytes(total)}"
        raise InvalidInput(("times",), required, given)
    return {name: np.full(shape, np.nan) for name, shape in shapes.items()}


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"
