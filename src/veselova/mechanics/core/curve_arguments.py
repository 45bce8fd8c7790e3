"""The arguments of a hyperelliptic curve with real branch points, and points on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import pairwise
from numbers import Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import as_given
from veselova.mechanics.core.complex_input import complex_array, complex_number
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import (
    exact_number,
    exact_vector,
    list_items,
    require_each,
    require_name,
)

__all__ = [
    "CURVE_OUTPUTS",
    "LARGEST_GENUS",
    "curve_arguments",
    "curve_outputs",
    "exact_points",
    "points_with_sheets",
    "rows_of_points",
    "torus_points",
]

Parsed = TypeVar("Parsed")

Path = tuple[str | int, ...]

#: Genera that are served; higher ones are right too, but were not tested.
LARGEST_GENUS = 16

#: What a curve's data have when it is asked for.
CURVE_OUTPUTS = ("quasi_periods",)


def curve_outputs(given: Any) -> tuple[str, ...]:
    """Return the names of further outputs of a curve's data; raises InvalidInput for others."""
    required = f"a list of {' and '.join(CURVE_OUTPUTS)}"
    names = list_items(given, ("outputs",), required)
    known = require_each(
        lambda name, place: require_name(name, place, CURVE_OUTPUTS), names, ("outputs",)
    )
    return tuple(dict.fromkeys(known))


def curve_arguments(branch_points: Any, sign: Any) -> tuple[tuple[Fraction, ...], int]:
    """Return branch points as rationals, increasing, and the sign of w² = sign·Π(λ−b_j).

    Raises InvalidInput, with all faults.
    """
    faults = Faults()
    points = faults.attempt(_branch_points, branch_points)
    if isinstance(sign, bool) or not isinstance(sign, Real) or sign not in (-1, 1):
        faults.add(("sign",), "1 or −1", show(sign))
    faults.require_none()
    return points, int(sign)


def _branch_points(given: Any) -> tuple[Fraction, ...]:
    path: Path = ("branch_points",)
    required = f"3 to {2 * LARGEST_GENUS + 2} real numbers"
    items = list_items(given, path, required)
    if not 3 <= len(items) <= 2 * LARGEST_GENUS + 2:
        raise InvalidInput(path, required, f"{len(items)} entries")
    numbers = exact_vector(items, path)
    order = sorted(range(len(items)), key=numbers.__getitem__)
    faults = Faults()
    for i, j in pairwise(order):
        if numbers[i] == numbers[j]:
            first, second = sorted((i, j))
            required = (
                "distinct numbers (drop a pair: the curve of the others has the same differentials)"
            )
            given = f"{float(numbers[i]):.6g} twice, as entry {first} too"
            faults.add((*path, second), required, given)
    faults.require_none()
    return tuple(numbers[i] for i in order)


def exact_points(given: Any, path: Path = ("points",)) -> list[Fraction | complex]:
    """Return points λ: exact where they are real, else complex; raises InvalidInput, with all
    faults.
    """
    given = as_given(given)
    if isinstance(given, (int, float, complex, str, np.generic)):
        given = [given]
    return list(require_each(_point, list_items(given, path, "a list of numbers"), path))


def _point(item: Any, path: Path) -> Fraction | complex:
    if isinstance(item, (complex, np.complexfloating)):
        number = complex_number(item, path)
        return number if number.imag else Fraction(number.real)
    return exact_number(item, path)


def points_with_sheets(
    points: Any, w: Any
) -> tuple[list[Fraction | complex], NDArray[np.complex128]]:
    """Return points λ and the w that name their sheets, one for each; raises InvalidInput, with all
    faults.
    """
    faults = Faults()
    found = faults.attempt(exact_points, points)
    sheets = faults.attempt(complex_array, w, ("w",), "a list of numbers")
    if found is not None and sheets is not None:
        sheets = np.atleast_1d(sheets)
        if sheets.shape != (len(found),):
            required = f"{len(found)} numbers, one for each point"
            faults.add(("w",), required, f"shape {sheets.shape}")
    faults.require_none()
    return found, sheets


def rows_of_points(given: Any) -> tuple[list[list[Fraction | complex]], bool]:
    """Return rows of points λ, and whether one alone was given; raises InvalidInput, with all
    faults.
    """
    return _rows_of(exact_points, given, ("points",), "a list of numbers, or rows of them")


def _rows_of(
    read: Callable[[Any, Path], Parsed], given: Any, path: Path, required: str
) -> tuple[list[Parsed], bool]:
    """Return rows that are each read, and whether one alone was given."""
    rows = list_items(given, path, required)
    nested = (isinstance(x, (Sequence, np.ndarray)) and not isinstance(x, str) for x in rows)
    if not any(nested):
        return [read(rows, path)], True
    return list(require_each(read, rows, path)), False


def torus_points(z: Any, genus: int) -> tuple[list[tuple[Fraction, ...]], bool]:
    """Return points of R^g/Z^g, exact, and whether one alone was given; raises InvalidInput, with
    all faults.
    """
    required = f"a vector of {genus} finite real numbers, or rows of them"
    return _rows_of(lambda row, path: exact_vector(row, path, genus), z, ("z",), required)
