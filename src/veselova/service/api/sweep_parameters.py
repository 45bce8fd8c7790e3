"""What a sweep varies: each parameter a place in the JSON of the problem, with the values that it
takes there.
"""

from __future__ import annotations

import copy
import math
import re
from abc import ABC
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from veselova.mechanics.core.errors import Faults, InvalidInput, did_you_mean, show, unknown_name
from veselova.mechanics.core.exact_input import exact_number, require_each, whole_number

__all__ = [
    "Axis",
    "Draw",
    "Parameter",
    "Path",
    "column_name",
    "components",
    "is_double",
    "parameters",
    "replace_values",
    "to_table_value",
]

Path = tuple[str | int, ...]

#: No problem has as many places, and the product of so many axes has no name.
_MOST_PARAMETERS = 64
#: Axes of more values, all together, are none, whatever the server allows.
_MOST_VALUES = 1_000_000

#: Larger integers need not be doubles.
_LARGEST_INTEGER = 2**53

#: A place in a list, in digits.
_PLACE = re.compile("[0-9]{1,5}")

_DISTRIBUTIONS = ("uniform", "log_uniform", "normal")
_SPACINGS = ("linear", "log")

#: The fields of a grid, the last of which may be left out.
_GRID = ("start", "stop", "count", "spacing")


def column_name(path: Path) -> str:
    """Return the name of a column: fields joined by dots, and places in lists counted from 1, as in
    the table of a trajectory.
    """
    return "".join(f"_{part + 1}" if isinstance(part, int) else f".{part}" for part in path)[1:]


@dataclass(frozen=True)
class Parameter(ABC):
    """A place in the problem, by the parts of its JSON pointer."""

    path: Path

    @property
    def name(self) -> str:
        """Return the place as tables name it: ``A_1`` for /A/0."""
        return column_name(self.path)


@dataclass(frozen=True)
class Axis(Parameter):
    """A parameter that takes each of its values, in combination with those of every other axis."""

    values: Sequence[Any]


@dataclass(frozen=True)
class Draw(Parameter):
    """A parameter that is drawn at random, each of its components independently of the others."""

    distribution: str
    bounds: tuple[float, float]
    shape: tuple[int, ...]

    def draw(self, random: np.random.Generator) -> Any:
        """Return one draw: a number, or nested lists of numbers."""
        first, second = self.bounds
        if self.distribution == "normal":
            return random.normal(first, second, self.shape).tolist()
        if self.distribution == "log_uniform":
            return np.exp(random.uniform(math.log(first), math.log(second), self.shape)).tolist()
        return random.uniform(first, second, self.shape).tolist()


def parameters(vary: Any, problem: Mapping[str, Any]) -> list[Parameter]:
    """Return the parameters of a sweep over a problem, in the order given.

    Raises InvalidInput for a place that the problem has not, for two places one inside the other,
    and for values, grids and distributions that are none.
    """
    if not isinstance(vary, Mapping) or not vary or len(vary) > _MOST_PARAMETERS:
        raise InvalidInput(
            ("vary",),
            f"an object of 1 to {_MOST_PARAMETERS} JSON pointers into the problem",
            show(vary),
        )
    faults = Faults()
    found: list[Parameter] = []
    for pointer, stated in vary.items():
        parameter = faults.attempt(_parameter_at, str(pointer), stated, problem)
        if parameter is None:
            continue
        path = parameter.path
        if other := next(
            (p for p in found if p.path[: len(path)] == path or path[: len(p.path)] == p.path), None
        ):
            given = f"a place that overlaps with {other.name}"
            faults.add(("vary", pointer), "a place of its own", given)
        found.append(parameter)
    count = sum(len(parameter.values) for parameter in found if isinstance(parameter, Axis))
    if count > _MOST_VALUES:
        required = f"lists and grids of at most {_MOST_VALUES} values, all together"
        faults.add(("vary",), required, str(count))
    faults.require_none()
    return found


def _parameter_at(pointer: str, stated: Any, problem: Mapping[str, Any]) -> Parameter:
    where = ("vary", pointer)
    path = _path(pointer, problem, where)
    return _parameter(path, stated, _value_at(problem, path), where)


def _value_at(document: Any, path: Path) -> Any:
    """Return the value at a place of a document; raises KeyError or IndexError."""
    for part in path:
        document = document[part]
    return document


def replace_values(document: Mapping[str, Any], values: Mapping[Path, Any]) -> dict[str, Any]:
    """Return the document with the values at their places."""
    changed: dict[str, Any] = copy.deepcopy(dict(document))
    for path, value in values.items():
        _value_at(changed, path[:-1])[path[-1]] = value
    return changed


def components(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the scalars of a value by the names of their columns: ``q_1``, ``q_2`` …"""
    if isinstance(value, (list, tuple)):
        for i, item in enumerate(value):
            yield from components(f"{name}_{i + 1}", item)
    else:
        yield name, value


def is_double(value: Any) -> bool:
    """Return whether a value of the JSON is a number that a double holds exactly."""
    return (type(value) is float and math.isfinite(value)) or (
        type(value) is int and abs(value) <= _LARGEST_INTEGER
    )


def to_table_value(value: Any) -> float | str | None:
    """Return a scalar of the JSON as tables hold it: a number wherever it states one."""
    if is_double(value):
        return float(value) + 0.0  # a zero has no sign
    try:
        return float(exact_number(value, ()))
    except InvalidInput:
        return value if isinstance(value, str) or value is None else str(value).lower()


def _path(pointer: Any, problem: Mapping[str, Any], where: Path) -> Path:
    """Return the parts of an RFC 6901 pointer to a value that the problem states."""
    required = (
        "a JSON pointer to a value that the problem states, such as "
        f'"/{next(iter(k for k in problem if k != "system"))}"'
    )
    parts = str(pointer).split("/")
    place: Any = problem
    path: list[str | int] = []
    for part in parts[1:]:
        name = part.replace("~1", "/").replace("~0", "~")
        if isinstance(place, Mapping) and name in place and name != "system":
            path.append(name)
        elif isinstance(place, list) and _PLACE.fullmatch(name) and int(name) < len(place):
            path.append(int(name))
        else:
            known = [key for key in place if key != "system"] if isinstance(place, Mapping) else []
            near = did_you_mean(name, known)
            raise InvalidInput(where, required, show(pointer) + near)
        place = place[path[-1]]
    if parts[0] or not path:
        raise InvalidInput(where, required, show(pointer))
    return tuple(path)


def _parameter(path: Path, stated: Any, base: Any, where: Path) -> Parameter:
    if isinstance(stated, list):
        return Axis(path, _values(stated, base, where))
    if isinstance(stated, Mapping) and len(stated) == 1 and next(iter(stated)) in _DISTRIBUTIONS:
        ((distribution, bounds),) = stated.items()
        return Draw(
            path,
            distribution,
            _bounds(distribution, bounds, (*where, distribution)),
            _shape(base, where),
        )
    if isinstance(stated, Mapping) and set(_GRID[:3]) <= set(stated) <= set(_GRID):
        if _shape(base, where):
            raise InvalidInput(
                where,
                "a list of values (a grid is for one number, and this place holds a list)",
                show(stated),
            )
        return Axis(path, _grid(stated, where))
    forms = (
        "a list of values, a grid (start, stop, count, spacing), or one of "
        f"{', '.join(_DISTRIBUTIONS)} with two numbers"
    )
    names = (*_DISTRIBUTIONS, *_GRID)
    unknown = [name for name in stated if name not in names] if isinstance(stated, Mapping) else []
    near = did_you_mean(unknown[0], names) if unknown else ""
    raise InvalidInput(where, forms, show(stated) + near)


def _values(stated: list[Any], base: Any, where: Path) -> list[Any]:
    if not 1 <= len(stated) <= _MOST_VALUES:
        raise InvalidInput(where, f"1 to {_MOST_VALUES} values", str(len(stated)))
    names = [name for name, _ in components("", base)]
    faults = Faults()
    for i, value in enumerate(stated):
        faults.attempt(_require_like, value, names, (*where, i))
    faults.require_none()
    return stated


def _require_like(value: Any, names: Sequence[str], where: Path) -> None:
    """Raise InvalidInput unless a value has these components, all finite."""
    scalars = dict(components("", value))
    if list(scalars) != names or isinstance(value, Mapping):
        raise InvalidInput(where, "a value of the same shape as in the problem", show(value))
    if not all(math.isfinite(scalar) for scalar in scalars.values() if isinstance(scalar, float)):
        raise InvalidInput(where, "finite numbers", show(value))


def _grid(stated: Mapping[str, Any], where: Path) -> list[float]:
    faults = Faults()
    spacing = stated.get("spacing", "linear")
    number = faults.attempt(whole_number, stated["count"], (*where, "count"), 1, _MOST_VALUES)
    if spacing not in _SPACINGS:
        faults.found.append(unknown_name((*where, "spacing"), spacing, _SPACINGS))
    ends = [faults.attempt(exact_number, stated[key], (*where, key)) for key in ("start", "stop")]
    faults.require_none()
    start, stop = (float(end) for end in ends if end is not None)
    count = number or 1
    if not math.isfinite(stop - start):
        raise InvalidInput(
            where, "ends whose distance is within the range of a float", f"{start:g} and {stop:g}"
        )
    if spacing == "log" and min(start, stop) <= 0:
        raise InvalidInput(
            where, "positive ends of a grid with logarithmic spacing", f"{start:g} and {stop:g}"
        )
    values = (np.geomspace if spacing == "log" else np.linspace)(start, stop, count)
    return [float(value) for value in values]


def _bounds(distribution: str, stated: Any, where: Path) -> tuple[float, float]:
    if not isinstance(stated, list) or len(stated) != 2:
        raise InvalidInput(where, "two numbers", show(stated))
    first, second = map(float, require_each(exact_number, stated, where))
    if distribution == "normal":
        if second < 0:
            raise InvalidInput((*where, 1), "a standard deviation of at least 0", f"{second:g}")
    elif not first <= second:
        raise InvalidInput(where, "the lower bound first", f"{first:g}, {second:g}")
    elif not math.isfinite(second - first):
        raise InvalidInput(
            where, "bounds whose distance is within the range of a float", f"{first:g}, {second:g}"
        )
    elif distribution == "log_uniform" and first <= 0:
        raise InvalidInput((*where, 0), "a positive bound", f"{first:g}")
    return first, second


def _shape(base: Any, where: Path) -> tuple[int, ...]:
    """Return the shape of the numbers at a place; raises InvalidInput where it holds something
    else.
    """
    if isinstance(base, list):
        inner = {_shape(item, where) for item in base}
        if len(inner) != 1:
            raise InvalidInput(
                where, "a place that holds a number, a vector or a matrix", show(base)
            )
        return (len(base), *inner.pop())
    exact_number(base, where)
    return ()
