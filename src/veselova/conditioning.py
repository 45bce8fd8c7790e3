"""How far the state of a motion moves when its data move by one rounding: no method is better.

The data are moved by multiples of one rounding each, in two patterns of signs and both ways, in
exact rationals. Half the difference of the two motions, with their errors, is divided by the
multiple. As long as the difference is small it grows in proportion. Where it is no longer small,
the next smaller multiple takes over.

The differences are those at fixed instants, and the largest so far counts. Neighbouring motions
that dwell at the same equilibrium come near each other again, but what was lost stays lost.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.engines import solve
from veselova.mechanics.core.errors import OverBudget, Unsolved, VeselovaError
from veselova.mechanics.core.exact_input import exact_number
from veselova.mechanics.core.fixed_instants import fixed_instants
from veselova.mechanics.core.problem import NO_DIGIT, Problem
from veselova.mechanics.results.trajectory import Trajectory

__all__ = ["conditioning", "perturb_by_roundings", "rounding_of"]

Array = NDArray[np.float64]

#: One rounding of a double.
_ROUNDING = Fraction(1, 2**53)

#: Multiples of a rounding are powers of this, up to those that move the data by so much of
#: themselves. The error of a motion in double precision, over the largest, is far below a rounding.
_LADDER = 10**3
_LARGEST = Fraction(1, 10**9)

#: Instants evaluated at once.
_BLOCK = 32

#: Fields of a problem that are data, and the names of those in which a whole number is no
#: measurement.
_DATA = (
    *("A", "q", "q_dot", "q_prime", "X", "X_dot", "inertia", "gamma", "Omega"),
    *("mass", "radius", "position", "potential"),
)

#: What stands in a mapping of data and is none: powers of monomials, and what follows from others.
_NO_DATA = ("powers", "companion")


def conditioning(trajectory: Trajectory) -> Array:
    """Return how far a bounded component may have moved by each time (N,) when all data move by
    one rounding, potentials, masses and radii of balls among them.

    One rounding is 2^−53 of a number, or of the largest of its vector where it is smaller (but for
    the numbers of a potential). Where a
    text or a Decimal has more digits than a double, it is one unit of the last digit given. Whole
    numbers and ratios are exact, and stay where they are, unless all data are.
    On each side of t = 0 the result never falls with |t|, and no other time enters it. It is
    measured until it reaches a tenth of the state's size: beyond, no digit is determined, and it
    stays as it is. Problems whose data cannot be moved (rest, systems without a closed form) have
    the formula ``problem.conditioning_floor``.
    """
    problem = trajectory.problem
    times = trajectory.times
    if "analytic" not in problem.engines or not problem.moves:
        return problem.conditioning_floor(times)
    found = np.empty(times.size)
    for side, rows in ((1.0, times >= 0), (-1.0, times < 0)):
        if rows.any():
            found[rows] = _Departure(problem, side).at(np.abs(times[rows]))
    return found


@dataclass(frozen=True)
class _Departure:
    """How far moved motions part from each other on one side of t = 0."""

    problem: Problem
    side: float

    def at(self, elapsed: Array) -> Array:
        """Return what one rounding of the data has made at times |t| (N,)."""
        instants, bounds, multiple, pairs = self._until(float(np.max(elapsed)))
        if not bounds.size:
            return self.problem.conditioning_floor(elapsed)
        places = np.searchsorted(instants, elapsed)
        found = bounds[np.minimum(places, bounds.size - 1)]
        lost = self.problem.extent * NO_DIGIT
        if bounds[-1] < lost:  # the motions could not be followed: they end, or no digit is left
            for i in np.flatnonzero(places == bounds.size):
                here = self._apart(pairs, elapsed[i : i + 1])
                found[i] = max(found[i], here[0] / multiple if here.size else self.problem.extent)
        return found

    def _until(self, farthest: float) -> tuple[Array, Array, float, list[_Pair]]:
        """Return the instants to the first after a time, or to where nothing is known any more, and
        the bounds there; the multiple, and the pairs of motions, that were used last."""
        instants = np.empty(0)
        bounds = np.empty(0)
        lost = self.problem.extent * NO_DIGIT
        turning = max(self.problem.turning, float(np.finfo(float).tiny))
        used = 1
        pairs = list[_Pair]()
        for multiple in self._multiples():
            if instants.size and instants[-1] >= farthest:
                break
            used = multiple
            pairs = self._pairs(multiple) or pairs
            small = _BLOCK
            while pairs and small == _BLOCK and not (instants.size and instants[-1] >= farthest):
                block = fixed_instants(instants.size, _BLOCK) / turning
                apart = self._apart(pairs, block)
                small = int(np.argmin(np.append(apart < lost, False)))
                kept = small + (multiple == 1 and small < apart.size)
                instants = np.append(instants, block[:kept])
                bounds = np.append(bounds, apart[:kept] / multiple)
        return instants, np.maximum.accumulate(bounds), float(used), pairs

    def _multiples(self) -> list[int]:
        """Return the multiples of a rounding by which data are moved, the largest first."""
        finest = max(_relative_roundings(self.problem.given), default=_ROUNDING)
        multiples = [1]
        while finest * multiples[0] * _LADDER <= _LARGEST:
            multiples.insert(0, multiples[0] * _LADDER)
        return multiples

    def _pairs(self, multiple: int) -> list[_Pair]:
        """Return the motions of the moved data, for each pattern of signs the two ways."""
        pairs = []
        for pattern in (0, 1):
            try:
                moved = (
                    perturb_by_roundings(self.problem, sign * multiple, pattern) for sign in (1, -1)
                )
                one, other = map(self._motion, moved)
                pairs.append((one, other))
            except OverBudget:
                raise
            except VeselovaError:  # the data have no such neighbour
                continue
        return pairs

    def _motion(self, problem: Problem) -> Trajectory:
        """Return a motion that can be asked for times, by the first engine that serves it."""
        for engine in dict.fromkeys((problem.default_engine, *problem.engines)):
            try:
                return solve(problem, [0.0], engine)
            except Unsolved as error:
                refusal = error
        raise refusal

    def _apart(self, pairs: list[_Pair], instants: Array) -> Array:
        """Return half the largest difference in any pair, errors included, at the leading instants
        at which all motions are known."""
        try:
            found = [[motion.at(self.side * instants) for motion in pair] for pair in pairs]
        except OverBudget:
            raise
        except VeselovaError:
            half = instants.size // 2
            first = self._apart(pairs, instants[:half]) if half else np.empty(0)
            if first.size < half or not half:
                return first
            return np.append(first, self._apart(pairs, instants[half:]))
        each = [_largest_difference(*pair) + pair[0].error + pair[1].error for pair in found]
        return np.asarray(np.max(each, axis=0) / 2)


_Pair = tuple[Trajectory, Trajectory]


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
        moved = (x + step for (x, _), step in zip(values, steps, strict=True))
        given[name] = _with_steps(given[name], moved)
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
        if name == "potential":  # each has a unit of its own, and zero is none
            largest = Fraction(0)
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
    """Return the numbers of a field: of a symmetric matrix those on and above its diagonal, of a
    skew one those above; none where there is no such datum.
    """
    if values is None:
        return []
    if isinstance(values, Mapping):
        values = [part for name, part in values.items() if name not in _NO_DATA]
        return [x for part in values for x in _flat(part)]
    if not isinstance(values, (list, tuple)):
        return [values]
    if not values or not isinstance(values[0], (list, tuple)):
        return [x for part in values for x in _flat(part)]
    first = int(_is_skew(values))
    return [x for i, row in enumerate(values) for x in row[i + first :]]


def _with_steps(values: Any, numbers: Iterator[Fraction]) -> Any:
    """Return the field whose ``_flat`` entries these are."""
    if values is None:
        return None
    if isinstance(values, Mapping):
        # a companion belongs to the polynomial as it was
        parts = {name: part for name, part in values.items() if name != "companion"}
        return {
            name: part if name in _NO_DATA else _with_steps(part, numbers)
            for name, part in parts.items()
        }
    if not isinstance(values, (list, tuple)):
        return next(numbers)
    if not values or not isinstance(values[0], (list, tuple)):
        return [_with_steps(part, numbers) for part in values]
    size = len(values)
    skew = _is_skew(values)
    upper = {(i, j): next(numbers) for i in range(size) for j in range(i + skew, size)}
    if not skew:
        return [[upper[min(i, j), max(i, j)] for j in range(size)] for i in range(size)]
    upper |= {(j, i): -x for (i, j), x in upper.items()}
    return [[upper.get((i, j), Fraction(0)) for j in range(size)] for i in range(size)]


def _is_skew(rows: Any) -> bool:
    """Return whether the diagonal of a matrix is zero."""
    return not any(exact_number(row[i], ()) for i, row in enumerate(rows))


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
