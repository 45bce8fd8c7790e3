"""What a sweep varies: each parameter a place in the JSON of the problem, with the values that it
takes there.
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from veselova.mechanics.core.arguments import Path, require_each, whole_number
from veselova.mechanics.core.errors import Faults, InvalidInput, did_you_mean, show, unknown_name
from veselova.mechanics.core.exact_input import exact_number

#: No problem has as many places, and the product of so many axes has no name.
_MOST_PARAMETERS = 64
#: An axis of more values is none, whatever the server allows.
_MOST_VALUES = 1_000_000

#: A place in a list, in digits.
_PLACE = re.compile("[0-9]{1,5}")

#: Distribution → what its two numbers must be, and whether two are.
_DISTRIBUTIONS: Mapping[str, tuple[str, Callable[[float, float], bool]]] = {
    "uniform": ("two numbers, the lower first", lambda low, high: low <= high),
    "log_uniform": ("two positive numbers, the lower first", lambda low, high: 0 < low <= high),
    "normal": (
        "a mean, and a standard deviation of at least 0",
        lambda _, deviation: deviation >= 0,
    ),
}
_SPACINGS = ("linear", "log")

#: The fields of a grid, the last of which may be left out.
_GRID = ("start", "stop", "count", "spacing")


def column_name(path: Path) -> str:
    """Return the name of a column: fields joined by dots, and places in lists counted from 1, as in
    the table of a trajectory.
    """
    return "".join(f"_{part + 1}" if isinstance(part, int) else f".{part}" for part in path)[1:]


@dataclass(frozen=True)
class Parameter:
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
        parameter = faults.attempt(_parameter, str(pointer), stated, problem)
        if parameter is None:
            continue
        path = parameter.path
        if other := next((p for p in found if overlap(p.path, path)), None):
            given = f"a place that overlaps with {other.name}"
            faults.add(("vary", pointer), "a place of its own", given)
        found.append(parameter)
    faults.require_none()
    return found


def replace_values(document: Mapping[str, Any], values: Mapping[Path, Any]) -> dict[str, Any]:
    """Return the document with the values at their places."""
    changed: dict[str, Any] = copy.deepcopy(dict(document))
    for path, value in values.items():
        place: Any = changed
        for part in path[:-1]:
            place = place[part]
        place[path[-1]] = value
    return changed


def components(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the scalars of a value by the names of their columns: ``q_1``, ``q_2`` …"""
    if isinstance(value, (list, tuple)):
        for i, item in enumerate(value):
            yield from components(f"{name}_{i + 1}", item)
    else:
        yield name, value


def to_table_value(value: Any) -> float | None:
    """Return a scalar of the JSON as tables hold it: the double nearest to the number that it
    states, 1 or 0 for a truth value, None for what states no number.
    """
    try:
        return float(value if isinstance(value, bool) else exact_number(value, ())) + 0.0
    except InvalidInput:
        return None


def _parameter(pointer: str, stated: Any, problem: Mapping[str, Any]) -> Parameter:
    where = ("vary", pointer)
    path, base = _resolve(pointer, problem)
    if isinstance(stated, list):
        return Axis(path, _values(stated, base, where))
    names = list(stated) if isinstance(stated, Mapping) else []
    if len(names) == 1 and names[0] in _DISTRIBUTIONS:
        ((distribution, bounds),) = stated.items()
        shape = _shape(base, where)
        return Draw(path, distribution, _bounds(distribution, bounds, where), shape)
    if set(_GRID[:3]) <= set(names) <= set(_GRID):
        if _shape(base, where):
            required = "a list of values (a grid is for one number, and this place holds a list)"
            raise InvalidInput(where, required, show(stated))
        return Axis(path, _grid(stated, where))
    known = (*_DISTRIBUTIONS, *_GRID)
    required = (
        f"a list of values, a grid ({', '.join(_GRID)}), or one of {', '.join(_DISTRIBUTIONS)} "
        "with two numbers"
    )
    unknown = next((name for name in names if name not in known), None)
    raise InvalidInput(where, required, show(stated) + did_you_mean(unknown, known))


def _resolve(pointer: str, problem: Mapping[str, Any]) -> tuple[Path, Any]:
    """Return the parts of an RFC 6901 pointer to a value that the problem states, and the value."""
    known = [name for name in problem if name != "system"]
    example = next(iter(known), "A")
    required = f'a JSON pointer to a value that the problem states, such as "/{example}"'
    first, *parts = pointer.split("/")
    place: Any = problem
    path: list[str | int] = []
    for part in parts:
        name = part.replace("~1", "/").replace("~0", "~")
        if isinstance(place, Mapping) and name in place and name != "system":
            path.append(name)
        elif isinstance(place, list) and _PLACE.fullmatch(name) and int(name) < len(place):
            path.append(int(name))
        else:
            near = did_you_mean(name, known if place is problem else ())
            raise InvalidInput(("vary", pointer), required, show(pointer) + near)
        place = place[path[-1]]
    if first or not path:
        raise InvalidInput(("vary", pointer), required, show(pointer))
    return tuple(path), place


def _values(stated: list[Any], base: Any, where: Path) -> list[Any]:
    """Return the values of a list, each of the shape that the problem has there."""
    if not 1 <= len(stated) <= _MOST_VALUES:
        raise InvalidInput(where, f"1 to {_MOST_VALUES} values", str(len(stated)))
    names = [name for name, _ in components("", base)]
    faults = Faults()
    for i, value in enumerate(stated):
        scalars = dict(components("", value))
        if list(scalars) != names or isinstance(value, Mapping):
            faults.add((*where, i), "a value of the same shape as in the problem", show(value))
        elif not all(math.isfinite(x) for x in scalars.values() if isinstance(x, float)):
            faults.add((*where, i), "finite numbers", show(value))
    faults.require_none()
    return stated


def _grid(stated: Mapping[str, Any], where: Path) -> list[float]:
    faults = Faults()
    spacing = stated.get("spacing", "linear")
    count = faults.attempt(whole_number, stated["count"], (*where, "count"), 1, _MOST_VALUES)
    if spacing not in _SPACINGS:
        faults.found.append(unknown_name((*where, "spacing"), spacing, _SPACINGS))
    ends = [faults.attempt(exact_number, stated[key], (*where, key)) for key in ("start", "stop")]
    faults.require_none()
    start, stop = map(float, ends)
    is_log = spacing == "log"
    if not math.isfinite(stop - start) or (is_log and min(start, stop) <= 0):
        required = "positive ends" if is_log else "ends whose distance is in the range of a float"
        raise InvalidInput(where, required, f"{start:g} and {stop:g}")
    values: list[float] = (np.geomspace if is_log else np.linspace)(start, stop, count).tolist()
    return values


def _bounds(distribution: str, stated: Any, where: Path) -> tuple[float, float]:
    where = (*where, distribution)
    required, are_bounds = _DISTRIBUTIONS[distribution]
    if not isinstance(stated, list) or len(stated) != 2:
        raise InvalidInput(where, required, show(stated))
    first, second = map(float, require_each(exact_number, stated, where))
    if not are_bounds(first, second) or not math.isfinite(second - first):
        raise InvalidInput(where, f"{required}, in the range of a float", show(stated))
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


def overlap(first: Sequence[str | int], second: Sequence[str | int]) -> bool:
    """Return whether one of two places is inside the other, or the same."""
    return all(a == b for a, b in zip(first, second, strict=False))
