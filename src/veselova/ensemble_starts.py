"""Many problems of one system, read from a list or from arrays of their fields."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import require_name, require_truth_value
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import double_array
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.systems.catalogue import class_of, require_fields
from veselova.mechanics.systems.veselova import Veselova

__all__ = ["Starts"]

Array = NDArray[np.float64]

#: A start this near to the bound of the tolerance is left to the problem itself, which refuses or
#: takes it; so are sizes beyond those that every problem has.
_SURELY = INPUT_TOLERANCE / 2
_LEAST, _LARGEST = 1e-29, 1e29

#: N = n rows that are a symmetric matrix may be meant as one.
_ONE_MEANING = "n numbers, N rows, or matrices with three axes: (1, n, n) for all, or (N, n, n)"

#: Systems whose starts are given as arrays, with the vectors of a state. Among those that have as
#: many of the given fields the first is meant.
_STATES: Mapping[str, tuple[str, str]] = {
    "veselova": ("q", "q_dot"),
    "veselova-so3": ("gamma", "Omega"),
    "rubber-ball": ("gamma", "Omega"),
    "chaplygin-ball": ("gamma", "Omega"),
    "neumann": ("q", "q_prime"),
    "ellipsoid-geodesic": ("X", "X_dot"),
}

#: Fields that are one for all problems, and not read as arrays.
_FOR_ALL = ("normalize", "strict", "potential")


@dataclass(frozen=True)
class Starts:
    """N problems of one system.

    - system, n: their system and dimension
    - count: N
    - problem: the i-th problem; raises InvalidInput where it is none
    - A, q, q_dot: (N, n) doubles of Veselova problems, exact where ``surely`` (N,), NaN elsewhere
    - frames: (N, n, n) at the start, NaN for natural ones; None where all are
    """

    system: type[Problem]
    n: int
    count: int
    problem: Callable[[int], Problem]
    A: Array
    q: Array
    q_dot: Array
    surely: NDArray[np.bool_]
    frames: Array | None = None

    @classmethod
    def of(cls, problems: Any) -> Starts:
        """Return the problems of a list, or of arrays by name. Raises InvalidInput."""
        if isinstance(problems, Mapping):
            return _of_fields(problems)
        if isinstance(problems, (str, bytes)) or not isinstance(problems, Sequence):
            required = "a list of problems, or arrays of their fields by name"
            raise InvalidInput(("problems",), required, show(problems))
        return _of_list(problems)

    @classmethod
    def of_arrays(cls, A: Any, q: Any, q_dot: Any, normalize: Any = False) -> Starts:
        """Return Veselova problems, arrays as ``solve_many`` has them. Raises InvalidInput."""
        return _of_fields({"A": A, "q": q, "q_dot": q_dot, "normalize": normalize})


def _system_of(fields: Mapping[str, Any]) -> str:
    """Return the system that is named, or whose fields these are. Raises InvalidInput."""
    if "system" in fields:
        return require_name(fields["system"], ("problems", "system"), list(_STATES))

    def known(system: str) -> int:
        return len(fields.keys() & inspect.signature(class_of(system)).parameters.keys())

    system = max(_STATES, key=known)
    if system.endswith("ball"):
        required = "'rubber-ball' or 'chaplygin-ball': a ball with these fields may be either"
        raise InvalidInput(("problems", "system"), required, "nothing")
    return system


def _of_fields(problems: Mapping[str, Any]) -> Starts:
    """Return the problems whose fields are arrays by name. Raises InvalidInput."""
    system = _system_of(problems)
    kind = class_of(system)
    fields = {name: x for name, x in problems.items() if name != "system" and x is not None}
    require_fields(kind, fields, "problems")
    faults = Faults()
    common = {name: fields.pop(name) for name in _FOR_ALL if name in fields}
    for name in common.keys() & {"normalize", "strict"}:
        faults.attempt(require_truth_value, common[name], name)
    arrays = {
        name: faults.attempt(double_array, fields[name], (name,))
        for name in dict.fromkeys((*_STATES[system], *fields))
    }
    faults.require_none()
    rows = _rows(arrays, "A" if "A" in arrays else "inertia")

    def problem(i: int) -> Problem:
        return kind(**{name: values[i].tolist() for name, values in rows.items()}, **common)

    q, q_dot = (rows[name] for name in _STATES[system])
    count, n = q.shape
    A: Array = np.full(q.shape, np.nan)
    if kind is Veselova and rows["A"].ndim == 2 and "frame" not in rows:
        A = rows["A"]
    surely = _are_starts(A, q, q_dot, bool(common.get("normalize", False)))
    return Starts(kind, n, count, problem, A, q, q_dot, surely)


def _rows(arrays: Mapping[str, Array], body: str) -> dict[str, Array]:
    """Return fields, the vectors of the state first, with a row for each problem. Raises
    InvalidInput.

    body: the field that may be matrices
    """
    first = next(iter(arrays))
    n = 3 if first == "gamma" else np.atleast_1d(arrays[first]).shape[-1]
    if n < 2:
        raise InvalidInput((first,), "rows of at least 2 numbers", _shape(arrays[first]))
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(arrays, (n,))
    others = {"mass": (), "radius": (), "position": (2,), "frame": (n, n)}
    shapes |= {name: shape for name, shape in others.items() if name in arrays}
    if body in arrays and arrays[body].ndim == 3:
        shapes[body] = (n, n)
    # a matrix for all has a first axis of 1, so it is looked at last
    in_rows = [name for name in arrays if arrays[name].ndim == len(shapes[name]) + 1]
    counts = [len(arrays[name]) for name in sorted(in_rows, key=lambda name: name == body)]
    if not any(counts):
        required = f"an array with one row at least, of {n} numbers, or rows in another field"
        raise InvalidInput((first,), required, _shape(arrays[first]))
    faults = Faults()
    for name, values in arrays.items():
        allowed = [shapes[name], (counts[0], *shapes[name])]
        if name == body and values.ndim == 3:
            allowed[0] = (1, n, n)
        if values.shape not in allowed:
            required = " or ".join(map(str, allowed))
            faults.add((name,), f"an array of shape {required}", _shape(values))
        elif name == body and values.shape == (n, n) and _may_be_inertia(values):
            faults.add((name,), _ONE_MEANING, f"a symmetric matrix of shape {values.shape}")
    faults.require_none()
    return {name: np.broadcast_to(x, (counts[0], *shapes[name])) for name, x in arrays.items()}


def _shape(array: Array) -> str:
    return f"an array of shape {array.shape}"


def _may_be_inertia(A: Array) -> bool:
    """Return whether a matrix is symmetric, and positive definite or no rows of positive numbers:
    rows of it may be meant as those of one matrix.
    """
    symmetric = np.isfinite(A).all() and np.array_equal(A, A.T)
    return bool(symmetric and (np.all(np.linalg.eigvalsh(A) > 0) or not np.all(A > 0)))


def _are_starts(A: Array, q: Array, velocity: Array, normalize: bool) -> NDArray[np.bool_]:
    """Return which rows are surely valid starts that move, (N,); no number is not."""
    with np.errstate(all="ignore"):
        length = np.linalg.norm(q, axis=1)
        speed = np.linalg.norm(velocity, axis=1)
        known = np.isfinite(length) & (length > 0)
        for sizes in (A, speed[:, None]):
            known &= np.all((sizes > _LEAST) & (sizes < _LARGEST), axis=1)
        if not normalize:
            known &= np.abs(length - 1) < _SURELY
            known &= np.abs(np.sum(q * velocity, axis=1)) < _SURELY * speed
    return np.asarray(known)


def _of_list(problems: Sequence[Any]) -> Starts:
    if not problems:
        raise InvalidInput(("problems",), "one problem at least", "none")
    system, n = type(problems[0]), getattr(problems[0], "n", 3)
    for i, problem in enumerate(problems):
        if not isinstance(problem, Problem):
            required = "a problem, such as veselova.Veselova(A, q, q_dot)"
            raise InvalidInput(("problems", i), required, show(problem))
        if type(problem) is not system or getattr(problem, "n", 3) != n:
            required = f"a problem of system {system.system} with n = {n}, as the first"
            raise InvalidInput(("problems", i), required, show(problem))
    count = len(problems)
    numbers = np.full((3, count, n), np.nan)
    frames = np.full((count, n, n), np.nan)
    surely = np.zeros(count, dtype=bool)
    for i, problem in enumerate(problems):
        if system is Veselova and problem.axes is None and problem.moves:
            exact = problem.exact
            ratios = [x.as_integer_ratio() for x in (*exact.A, *exact.q, *exact.q_dot)]
            doubles = [above / below for above, below in ratios]
            numbers[:, i] = np.array(doubles).reshape(3, n)
            surely[i] = [x.as_integer_ratio() for x in doubles] == ratios
            if not exact.natural:
                frames[i] = problem.frame
    A, q, q_dot = numbers
    return Starts(system, n, count, problems.__getitem__, A, q, q_dot, surely, frames)
