"""The arguments of the toolkit: complex numbers, one or nested in lists, with every fault named by
its place; those of hyperelliptic curves with real branch points, and points on them; those of theta
functions: points, a matrix of the Siegel half space, characteristics.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from numbers import Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import (
    Path,
    as_given,
    list_items,
    require_each,
    require_name,
    whole_number,
)
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import exact_number, exact_vector

__all__ = [
    "CURVE_OUTPUTS",
    "LARGEST_GENUS",
    "ThetaArguments",
    "complex_array",
    "complex_number",
    "curve_arguments",
    "curve_outputs",
    "exact_points",
    "points_with_sheets",
    "rows_of_points",
    "siegel_matrix",
    "torus_points",
]

Parsed = TypeVar("Parsed")

Complex = NDArray[np.complex128]

#: Lists are not looked into any deeper: no argument has as many axes.
_DEEPEST = 4

#: Genera of curves that are served; higher ones are right too, but were not tested.
LARGEST_GENUS = 16

#: What a curve's data have when it is asked for.
CURVE_OUTPUTS = ("quasi_periods",)

#: τ may be off its transpose by this part of its largest entry; it is made symmetric.
_SYMMETRY = 1e-12

#: Beyond it a double is a whole number, and nothing is known modulo 1.
_LARGEST_REAL_PART = 2.0**53

#: Genera of theta functions that are served.
_LARGEST_THETA = 8


def complex_number(value: Any, path: Path) -> complex:
    """Return a number in double precision; texts ("0.7", "7/10") are rounded once.

    Raises InvalidInput for anything that is not a finite number.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if type(value) is complex:
        if cmath.isfinite(value):
            return value
        raise InvalidInput(path, "a finite number", show(value))
    return complex(float(exact_number(value, path)))


def complex_array(value: Any, path: Path, required: str) -> Complex:
    """Return nested lists of numbers, or an array, as a complex array of any shape.

    Raises InvalidInput, with all faults, where an entry is no finite number, or with what is
    ``required`` where the lists are ragged.
    """
    value = as_given(value)
    numbers = isinstance(value, np.ndarray) and value.dtype.kind in "iufc"
    if numbers and not np.ma.is_masked(value) and np.all(np.isfinite(value)):
        return np.array(value, dtype=complex, subok=False)
    faults = Faults()
    entries = _entries(value, path, faults, _DEEPEST)
    faults.require_none()
    try:
        return np.array(entries, dtype=complex)
    except (TypeError, ValueError):
        raise InvalidInput(path, required, f"lists of different lengths: {show(value)}") from None


def _entries(value: Any, path: Path, faults: Faults, depth: int) -> Any:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Sequence) and not isinstance(value, (str, bytes)) and depth:
        return [_entries(item, (*path, i), faults, depth - 1) for i, item in enumerate(value)]
    return faults.attempt(complex_number, value, path)


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


def points_with_sheets(points: Any, w: Any) -> tuple[list[Fraction | complex], list[complex]]:
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
    return found, sheets.tolist()


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


@dataclass(frozen=True, eq=False)
class ThetaArguments:
    """What a theta function is asked for: τ (g, g), points (N, g), characteristics (C, 2, g), the
    order of derivatives.

    ``single_point`` and ``single_characteristic``: one was given by itself, so that the values have
    no axis for it.
    """

    tau: Complex
    points: Complex
    characteristics: NDArray[np.float64]
    derivatives: int
    single_point: bool
    single_characteristic: bool

    @classmethod
    def of(
        cls, z: Any, tau: Any, characteristic: Any, derivatives: Any, T: Any = None
    ) -> ThetaArguments:
        """Return the arguments; raises InvalidInput, with all faults. ``T``: the real matrix of
        τ = iT, in the place of τ.
        """
        faults = Faults()
        matrix = faults.attempt(siegel_matrix, tau if T is None else T, T is not None)
        genus = None if matrix is None else len(matrix)
        points = faults.attempt(_points, z, genus)
        if genus is None and points is not None:
            genus = points.shape[-1]
        halves = faults.attempt(_characteristics, characteristic, genus)
        order = faults.attempt(whole_number, derivatives, ("derivatives",), 0, 2)
        faults.require_none()
        several = halves.reshape(-1, 2, len(matrix))
        rows = np.atleast_2d(points)
        return cls(matrix, rows, several, order, points.ndim == 1, halves.ndim == 2)


def siegel_matrix(given: Any, real: bool = False) -> Complex:
    """Return τ as a symmetric complex matrix; raises InvalidInput outside the Siegel half space.

    ``real``: T was given, with τ = iT.
    """
    path = ("T" if real else "tau",)
    required = f"a g × g matrix, g = 1 … {_LARGEST_THETA}"
    matrix = complex_array(given, path, required)
    if (
        matrix.ndim != 2
        or matrix.shape[0] != matrix.shape[1]
        or not 1 <= len(matrix) <= _LARGEST_THETA
    ):
        raise InvalidInput(path, required, f"shape {matrix.shape}")
    if real:
        if np.any(matrix.imag):
            raise InvalidInput(path, "a real matrix", show(given))
        matrix = np.asarray(1j * matrix.real, dtype=complex)
    largest = float(np.max(np.abs(matrix.real)))
    if largest > _LARGEST_REAL_PART:
        required = "real parts up to 2^53, beyond which they have no fractions"
        raise InvalidInput(path, required, f"{largest:.3g}")
    # halves, whose differences and sums stay in range
    half = matrix / 2
    defect = 2 * float(np.max(np.abs(half - half.T)))
    if defect > _SYMMETRY * float(np.max(np.abs(matrix))):
        raise InvalidInput(
            path, "a symmetric matrix", f"one that differs from its transpose by {defect:.3g}"
        )
    matrix = half + half.T
    least = float(np.linalg.eigvalsh(matrix.imag)[0])
    if not least > 0:
        required = "a positive definite " + ("matrix" if real else "imaginary part")
        raise InvalidInput(path, required, f"one with least eigenvalue {least:.6g}")
    return matrix


def _points(z: Any, genus: int | None) -> Complex:
    """Return points, (N, g), or (g,) where one was given by itself."""
    required = f"a vector of {genus or 'g'} numbers, or rows of them"
    points = complex_array(z, ("z",), required)
    if points.ndim not in (1, 2) or points.shape[-1] != (genus or points.shape[-1]):
        raise InvalidInput(("z",), required, f"shape {points.shape}")
    return points


def _characteristics(given: Any, genus: int | None) -> NDArray[np.float64]:
    """Return characteristics, (C, 2, g), or (2, g) where one was given by itself."""
    if given is None:
        return np.zeros((2, genus or 1))
    required = f"[ε, δ] of {genus or 'g'} real numbers each, or a list of those"
    halves = complex_array(given, ("characteristic",), required)
    if halves.ndim not in (2, 3) or halves.shape[-2] != 2 or np.any(halves.imag):
        raise InvalidInput(("characteristic",), required, show(given))
    if halves.shape[-1] != (genus or halves.shape[-1]) or not halves.size:
        raise InvalidInput(("characteristic",), required, f"shape {halves.shape}")
    return halves.real
