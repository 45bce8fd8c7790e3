"""How far the state of a motion moves when its data move by one rounding: what no method can
better.

The data are moved by one rounding each, in two patterns of signs and both ways, in exact rationals.
Half the difference of the two motions is measured. Where that is below their errors, the data are
moved by a multiple of a rounding instead, and the
difference is divided by it: as long as it is small it grows in proportion.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.engines import solve
from veselova.mechanics.core.errors import VeselovaError
from veselova.mechanics.core.exact_input import exact_number
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.trajectory import Trajectory

__all__ = ["conditioning", "perturb_by_roundings", "rounding_of"]

Array = NDArray[np.float64]

#: One rounding of a double.
_ROUNDING = Fraction(1, 2**53)

#: Multiples of a rounding go up by this until the data move by so much of themselves.
_LADDER = 10**6
_LARGEST = Fraction(1, 10**9)

#: A difference counts where it is so many times the errors of the two motions.
_VISIBLE = 4.0

#: Fields of a problem that are data, and the names of those in which a whole number is no
#: measurement.
_DATA = ("A", "q", "q_dot", "q_prime", "X", "X_dot", "inertia", "gamma", "Omega")


def conditioning(trajectory: Trajectory) -> Array:
    """Return the largest change of a bounded component at each time (N,) when all data move by one
    rounding.

    One rounding is 2^−53 of a number, or of the largest of its vector where it is smaller; where a
    text or a Decimal has more digits than a double, it is one unit of the last digit given. Whole
    numbers and ratios are exact, and stay where they are, unless all data are. Problems whose data
    cannot be moved (systems without a closed form) have ε·max(1, turning·|t|).
    """
    problem = trajectory.problem
    times = trajectory.times
    engine = trajectory.provenance.engine
    if "analytic" not in problem.engines or not problem.moves:
        return problem.conditioning_floor(times)
    found = np.zeros(times.size)
    finest = max(_relative_roundings(problem.given), default=_ROUNDING)
    scale = 1
    seen = False
    while True:
        for pattern in (0, 1) if scale == 1 else (0,):
            pair = []
            for side in (1, -1):
                try:
                    pair.append(
                        solve(perturb_by_roundings(problem, side * scale, pattern), times, engine)
                    )
                except VeselovaError:
                    break
            if len(pair) == 2:
                seen = True
                difference = _largest_difference(*pair) / 2
                visible = (difference >= _VISIBLE * (pair[0].error + pair[1].error)) | (
                    finest * scale * _LADDER > _LARGEST
                )
                found = np.maximum(found, np.where(visible, difference / float(scale), 0.0))
        if finest * scale * _LADDER > _LARGEST:
            break
        scale *= _LADDER
    return found if seen else problem.conditioning_floor(times)


def _largest_difference(one: Trajectory, other: Trajectory) -> Array:
    """Return the largest difference of the bounded series at each time."""
    differences = [one.series(name) - other.series(name) for name in one.problem.bounded]
    return np.asarray(
        np.max([np.max(np.abs(d.reshape(len(d), -1)), axis=1) for d in differences], axis=0)
    )


def perturb_by_roundings(problem: Problem, multiple: int, pattern: int) -> Problem:
    """Return the problem with every number of its data moved by a multiple of one rounding, up or
    down by a pattern of signs.
    """
    signs = _signs(pattern)
    given = dict(problem.given)
    for name, values in _data(given).items():
        steps = [multiple * next(signs) * rounding for _, rounding in values]
        given[name] = _with_steps(
            given[name], [x + step for (x, _), step in zip(values, steps, strict=True)]
        )
    if "gamma" in given and "constraint" in problem.vanishing:
        given["Omega"] = _across(given["Omega"], given["gamma"])
    return type(problem)(**{**given, "normalize": True})


def _across(vector: list[Fraction], direction: list[Fraction]) -> list[Fraction]:
    """Return the part of a vector that is orthogonal to a direction."""
    along = sum((x * y for x, y in zip(vector, direction, strict=True)), Fraction(0))
    square = sum((x * x for x in direction), Fraction(0))
    return [x - along / square * y for x, y in zip(vector, direction, strict=True)]


def _data(given: Mapping[str, Any]) -> dict[str, list[tuple[Fraction, Fraction]]]:
    """Return the numbers of every field of data, each with one rounding of it; of matrices those on
    and above the diagonal.
    """
    fields = {name: _flat(given[name]) for name in _DATA if name in given}
    all_exact = all(_is_exact(x) for values in fields.values() for x in values)
    found = {}
    for name, values in fields.items():
        numbers = [exact_number(x, (name,)) for x in values]
        largest = max(map(abs, numbers), default=Fraction(0))
        exact = [not all_exact and _is_exact(x) for x in values]
        roundings = [
            Fraction(0) if fixed else rounding_of(x, largest)
            for x, fixed in zip(values, exact, strict=True)
        ]
        found[name] = list(zip(numbers, roundings, strict=True))
    return found


def _relative_roundings(given: Mapping[str, Any]) -> Iterator[Fraction]:
    """Yield the roundings of all data, relative to the largest number of their field."""
    for values in _data(given).values():
        largest = max((abs(x) for x, _ in values), default=Fraction(0))
        if largest:
            yield from (rounding / largest for _, rounding in values)


def _flat(values: Any) -> list[Any]:
    """Return the entries of a vector, or those of a symmetric matrix on and above its diagonal."""
    rows = list(values)
    if rows and isinstance(rows[0], (list, tuple)):
        return [x for i, row in enumerate(rows) for x in row[i:]]
    return rows


def _with_steps(values: Any, numbers: list[Fraction]) -> list[Any]:
    """Return the vector, or the symmetric matrix, whose ``_flat`` entries these are."""
    size = len(values)
    entries = iter(numbers)
    if not isinstance(values[0], (list, tuple)):
        return numbers
    upper = {(i, j): next(entries) for i in range(size) for j in range(i, size)}
    return [[upper[min(i, j), max(i, j)] for j in range(size)] for i in range(size)]


def _is_exact(given: Any) -> bool:
    """Return whether a number is whole or a ratio, so that it is meant as it stands; zero is no
    measurement of anything else.
    """
    if isinstance(given, str):
        return "/" in given or Decimal(given.strip()) == int(Decimal(given.strip()))
    return isinstance(given, (int, Fraction))


def rounding_of(given: Any, largest: Fraction) -> Fraction:
    """Return one rounding of a number of a vector whose largest entry is known."""
    rounding = max(abs(exact_number(given, ())), largest) * _ROUNDING
    last = _last_digit(given)
    return rounding if last is None else min(rounding, last)


def _last_digit(given: Any) -> Fraction | None:
    """Return one unit of the last digit of a decimal text or a Decimal, None for numbers of another
    kind.
    """
    if isinstance(given, str) and "/" not in given:
        given = Decimal(given.strip())
    if not isinstance(given, Decimal):
        return None
    exponent = given.as_tuple().exponent
    return Fraction(10) ** exponent if isinstance(exponent, int) else None


def _signs(pattern: int) -> Iterator[int]:
    """Yield the signs of the Thue–Morse sequence, or those of every other one changed."""
    number = 0
    while True:
        odd = bin(number).count("1") + (number % 2 if pattern else 0)
        yield -1 if odd % 2 else 1
        number += 1
