"""Many problems of one system, read from a list or from arrays of their fields."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import double_array, require_truth_value
from veselova.mechanics.core.names import require_name
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.systems.catalogue import class_of, require_fields
from veselova.mechanics.systems.veselova import Veselova
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["Starts"]

Array = NDArray[np.float64]

#: A start this near to the bound of the tolerance is left to the problem itself, which refuses or
#: takes it.
_SURELY = INPUT_TOLERANCE / 2

#: A relative (Ω,γ) that counts as zero for every body, and sizes that every problem has.
_SURELY_ZERO = 4 * np.finfo(float).eps
_LEAST, _LARGEST = 1e-29, 1e29

#: N = n rows that are a symmetric matrix may be meant as one.
_ONE_MEANING = "n numbers, N rows, or matrices with three axes: (1, n, n) for all, or (N, n, n)"

#: Systems whose starts are given as arrays, with the vectors of a state.
_STATES: Mapping[str, tuple[str, str]] = {
    "veselova": ("q", "q_dot"),
    "veselova-so3": ("gamma", "Omega"),
    "rubber-ball": ("gamma", "Omega"),
    "chaplygin-ball": ("gamma", "Omega"),
    "neumann": ("q", "q_prime"),
    "ellipsoid-geodesic": ("X", "X_dot"),
}

#: Fields that only one of these systems has, or that balls share.
_TELLING = {
    "mass": "",
    "radius": "",
    "inertia": "veselova-so3",
    "gamma": "veselova-so3",
    "Omega": "veselova-so3",
    "q_prime": "neumann",
    "X": "ellipsoid-geodesic",
    "X_dot": "ellipsoid-geodesic",
}

#: Fields that are one for all problems, and not read as arrays.
_FOR_ALL = ("normalize", "strict", "potential")


@dataclass(frozen=True)
class Starts:
    """N problems of one system.

    - system, n: their system and dimension
    - count: N
    - A, q, q_dot: (N, n) doubles, exact where ``surely`` (N,); of bodies in space I, γ and Ω
    - frames: (N, n, n) at the start, NaN for natural ones; None where all are
    - problem: the i-th problem; raises InvalidInput where it is none
    - normalize: whether it scales q and projects q_dot
    """

    system: type[Problem]
    n: int
    count: int
    A: Array
    q: Array
    q_dot: Array
    surely: NDArray[np.bool_]
    frames: Array | None
    problem: Callable[[int], Problem]
    normalize: bool = False

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
        require_truth_value(normalize, "normalize")
        faults = Faults()
        found = [
            faults.attempt(double_array, value, (name,))
            for name, value in (("A", A), ("q", q), ("q_dot", q_dot))
        ]
        faults.require_none()
        masses, position, velocity = (np.asarray(x) for x in found)
        if position.ndim != 2:
            raise InvalidInput(("q",), "an array of N rows of n numbers", _shape(position))
        count, n = position.shape
        if count == 0:
            raise InvalidInput(("q",), "one row at least", "no row")
        if n < 2:
            raise InvalidInput(("q",), "rows of at least 2 numbers", _shape(position))
        if velocity.shape != position.shape:
            required = f"an array of {count} rows of {n} numbers, as q is"
            faults.add(("q_dot",), required, _shape(velocity))
        if masses.shape not in ((n,), position.shape, (1, n, n), (count, n, n)):
            required = f"{n} numbers, or {count} rows of {n}, as q has them"
            faults.add(("A",), required, _shape(masses))
        else:
            _require_one_meaning(faults, "A", masses)
        faults.require_none()
        given = np.broadcast_to(masses, (count, n) if masses.ndim < 3 else (count, n, n))
        masses = given if masses.ndim < 3 else _diagonals(given)

        def problem(i: int) -> Problem:
            row = masses[i] if np.isfinite(masses[i]).all() else given[i]
            return Veselova(
                row.tolist(),
                position[i].tolist(),
                velocity[i].tolist(),
                normalize=bool(normalize),
            )

        surely = _are_starts(masses, position, velocity, bool(normalize))
        return cls(
            Veselova,
            n,
            count,
            masses,
            position,
            velocity,
            surely,
            None,
            problem,
            bool(normalize),
        )


def _system_of(fields: Mapping[str, Any]) -> str:
    """Return the system that is named, or whose fields these are. Raises InvalidInput."""
    if "system" in fields:
        return require_name(fields["system"], ("problems", "system"), list(_STATES))
    system = next((name for field, name in _TELLING.items() if field in fields), "veselova")
    if not system:
        required = "'rubber-ball' or 'chaplygin-ball': a ball with these fields may be either"
        raise InvalidInput(("problems", "system"), required, "nothing")
    return system


def _of_fields(problems: Mapping[str, Any]) -> Starts:
    """Return the problems whose fields are arrays by name. Raises InvalidInput."""
    system = _system_of(problems)
    kind = class_of(system)
    fields = {name: value for name, value in problems.items() if name != "system"}
    require_fields(kind, fields, "problems")
    faults = Faults()
    for name in ("normalize", "strict"):
        if fields.get(name) is not None:
            faults.attempt(require_truth_value, fields[name], name)
    common = {name: fields.pop(name) for name in _FOR_ALL if name in fields}
    arrays = {
        name: faults.attempt(double_array, fields[name], (name,))
        for name in dict.fromkeys((*_STATES[system], *fields))
        if fields[name] is not None
    }
    faults.require_none()
    body = "A" if kind is Veselova else "inertia"
    rows = _rows({name: np.asarray(x) for name, x in arrays.items()}, body)
    if kind is Veselova and "frame" not in rows:
        normalize = common.get("normalize", False)
        return Starts.of_arrays(arrays["A"], rows["q"], rows["q_dot"], normalize)

    def problem(i: int) -> Problem:
        return kind(**{name: values[i].tolist() for name, values in rows.items()}, **common)

    vectors = [rows[name] for name in _STATES[system]]
    masses: Array = np.full(vectors[0].shape, np.nan)
    surely = np.zeros(len(masses), dtype=bool)
    free = kind is VeselovaSO3 and common.get("potential") is None and "frame" not in rows
    if free and rows["inertia"].ndim == 2:
        masses = rows["inertia"]
        surely = _are_bodies(masses, vectors[0], vectors[1], common)
    normalize = bool(common.get("normalize", False))
    n = vectors[0].shape[-1]
    return Starts(
        kind, n, len(masses), masses, vectors[0], vectors[1], surely, None, problem, normalize
    )


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
    if not counts:
        required = f"an array of N rows of {n} numbers, or rows in another field"
        raise InvalidInput((first,), required, _shape(arrays[first]))
    if not counts[0]:
        raise InvalidInput((first,), "one row at least", "no row")
    faults = Faults()
    for name, values in arrays.items():
        allowed = [shapes[name], (counts[0], *shapes[name])]
        if name == body and values.ndim == 3:
            allowed[0] = (1, n, n)
        if values.shape not in allowed:
            required = " or ".join(map(str, allowed))
            faults.add((name,), f"an array of shape {required}", _shape(values))
        elif name == body:
            _require_one_meaning(faults, name, values)
    faults.require_none()
    return {name: np.broadcast_to(x, (counts[0], *shapes[name])) for name, x in arrays.items()}


def _require_one_meaning(faults: Faults, name: str, bodies: Array) -> None:
    """Add a fault for n rows that may be meant as one matrix."""
    n = bodies.shape[-1]
    if bodies.shape == (n, n) and _may_be_inertia(bodies):
        faults.add((name,), _ONE_MEANING, f"a symmetric matrix of shape {bodies.shape}")


def _shape(array: Array) -> str:
    return f"an array of shape {array.shape}"


def _may_be_inertia(A: Array) -> bool:
    """Return whether a matrix is symmetric, and positive definite or no rows of positive numbers:
    rows of it may be meant as those of one matrix.
    """
    symmetric = np.isfinite(A).all() and np.array_equal(A, A.T)
    return bool(symmetric and (np.all(np.linalg.eigvalsh(A) > 0) or not np.all(A > 0)))


def _diagonals(matrices: Array) -> Array:
    """Return the diagonals of matrices (N, n, n), NaN for those that have other entries."""
    found = np.diagonal(matrices, axis1=1, axis2=2)
    others = matrices - found[:, :, None] * np.eye(found.shape[1])
    return np.where(np.any(others != 0, axis=(1, 2))[:, None], np.nan, found)


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


def _are_bodies(
    inertia: Array, gamma: Array, Omega: Array, common: Mapping[str, Any]
) -> NDArray[np.bool_]:
    """Return which rows are surely bodies in space that move with (Ω,γ) = 0, (N,)."""
    known = _are_starts(inertia, gamma, Omega, bool(common.get("normalize", False)))
    with np.errstate(all="ignore"):
        if common.get("strict") is not False:
            known &= 2 * np.max(inertia, axis=1) <= np.sum(inertia, axis=1)
        sizes = np.linalg.norm(gamma, axis=1) * np.linalg.norm(Omega, axis=1)
        known &= np.abs(np.sum(gamma * Omega, axis=1)) <= _SURELY_ZERO * sizes
    return np.asarray(known)


def _of_list(problems: Sequence[Any]) -> Starts:
    if not problems:
        raise InvalidInput(("problems",), "one problem at least", "none")
    for i, problem in enumerate(problems):
        if not isinstance(problem, Problem):
            required = "a problem, such as veselova.Veselova(A, q, q_dot)"
            raise InvalidInput(("problems", i), required, show(problem))
    first = problems[0]
    system = type(first)
    n = getattr(first, "n", 3)
    for i, problem in enumerate(problems):
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
            vectors = (exact.A, exact.q, exact.q_dot)
            numbers[:, i] = [[float(x) for x in vector] for vector in vectors]
            surely[i] = all(
                Fraction(x) == y
                for row, vector in zip(numbers[:, i].tolist(), vectors, strict=True)
                for x, y in zip(row, vector, strict=True)
            )
            if not exact.natural:
                frames[i] = problem.frame
    A, q, q_dot = numbers
    return Starts(system, n, count, A, q, q_dot, surely, frames, problems.__getitem__, True)
