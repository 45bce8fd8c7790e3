"""Numbers as given: every number becomes an exact rational before anything is rounded.

A decimal string ("0.7") or a ratio ("7/10") is the number it writes; a float is the dyadic rational
that it stores. The engines round these rationals once, to the precision they work in.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from numbers import Rational, Real
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.mechanics.core.arguments import (
    LARGEST_WHOLE_DOUBLE,
    Path,
    as_doubles,
    as_given,
    list_items,
    read_only,
    require_each,
)
from veselova.mechanics.core.errors import InvalidInput, show

__all__ = [
    "Number",
    "Numbers",
    "double_array",
    "exact_matrix",
    "exact_number",
    "exact_vector",
    "is_double",
    "plain",
    "positive_number",
    "require_moderate",
    "round_to_text",
    "scale_number",
    "square_root",
    "to_float",
]

#: A number, and numbers in lists or arrays, as they may be given.
Number: TypeAlias = ArrayLike | Fraction | Decimal
Numbers: TypeAlias = ArrayLike | Sequence[Any]

#: A decimal literal or a ratio of two; Python's own parsers also take underscores, "inf" and other
#: alphabets.
_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,4})?", re.ASCII)

#: Decimal exponents beyond this leave the range of a float anyway, and 10**huge would fill the
#: memory.
_LARGEST_EXPONENT = 400

#: Sizes of bodies and velocities, as texts and as doubles: products of a few of them are floats.
_LEAST_SIZE, _LARGEST_SIZE = Fraction(1, 10**30), Fraction(1e30)

#: Longest accepted numeral: 1000 digits with sign, point, exponent, twice for a ratio.
_LONGEST_NUMERAL = 2100

_REQUIRED = (
    "a finite real number within the range of a float (a JSON number, or a string such as "
    '"0.7" or "7/10")'
)


def exact_number(value: Any, path: Path) -> Fraction:
    """Return the rational number that ``value`` states exactly.

    Accepts int, float, NumPy real scalars, Fraction, Decimal and strings ("0.7", "-1e-3", "7/10").
    Raises InvalidInput for booleans, NaN, infinities, anything that is not a number, and numbers
    beyond float range.
    """
    try:
        if type(value) is float:
            return Fraction(value)
        number = _parse(value)
        float(number)
    except (ValueError, OverflowError, ZeroDivisionError, InvalidOperation, TypeError):
        raise InvalidInput(path, _REQUIRED, show(value)) from None
    return number


def _parse(value: Any) -> Fraction:
    value = as_given(value)
    if isinstance(value, bool):
        raise TypeError("a boolean is not a number")
    if isinstance(value, str):
        return _parse_numeral(value)
    if isinstance(value, Decimal):
        return _within_range(value)
    if isinstance(value, Rational):
        return Fraction(int(value.numerator), int(value.denominator))
    if isinstance(value, np.floating):  # of any width: longdouble has more digits than a float
        return Fraction(*value.as_integer_ratio())
    if isinstance(value, Real):
        return Fraction(float(value))
    raise TypeError("not a number")


def _within_range(number: Decimal) -> Fraction:
    if number and abs(number.adjusted()) > _LARGEST_EXPONENT:
        raise OverflowError("beyond float range")
    return Fraction(number)


def _parse_numeral(text: str) -> Fraction:
    if len(text) > _LONGEST_NUMERAL:
        raise ValueError("numeral too long")
    parts = text.strip().split("/")
    if len(parts) > 2 or not all(_DECIMAL.fullmatch(part.strip()) for part in parts):
        raise ValueError("not a decimal or a ratio")
    values = [_within_range(Decimal(part.strip())) for part in parts]
    return values[0] if len(values) == 1 else values[0] / values[1]


def is_double(value: Any) -> bool:
    """Return whether a value is a number that a double holds as it stands, or the double of none
    (NaN, infinity).
    """
    if isinstance(value, (int, np.integer)):
        return not isinstance(value, bool) and abs(int(value)) <= LARGEST_WHOLE_DOUBLE
    return isinstance(value, (float, np.float32, np.float16))


def double_array(
    values: Any,
    path: Path,
    required: str = "an array of numbers that doubles hold, rows of one length",
) -> NDArray[np.float64]:
    """Return numbers, or rows of them of one length, as a new array of doubles that holds them as
    they stand; raises InvalidInput, with what is ``required``.
    """
    listed = isinstance(values, (list, tuple))
    try:
        found = np.asanyarray(values, dtype=object if listed else None)
    except ValueError:  # rows of different lengths
        found = np.empty(0, dtype=object)
    if listed and not any(map(np.ma.is_masked, values)) and all(map(is_double, found.flat)):
        found = found.astype(np.float64)
    doubles = as_doubles(found)
    if doubles is None:
        raise InvalidInput(path, required, show(values))
    return doubles


def positive_number(value: Any, path: Path) -> Fraction:
    """Return the number greater than zero that ``value`` states exactly; raises InvalidInput."""
    number = exact_number(value, path)
    if number <= 0 or float(number) == 0:
        raise InvalidInput(path, "a finite number greater than 0", show(value))
    return number


def scale_number(value: Any, path: Path) -> Fraction:
    """Return the number from 1e-30 to 1e30 that ``value`` states exactly; raises InvalidInput."""
    number = positive_number(value, path)
    require_moderate([number], path)
    return number


def require_moderate(
    values: Iterable[Fraction | float], path: Path, *, has_scale: bool = False
) -> None:
    """Raise InvalidInput unless the largest of the numbers is from 1e-30 to 1e30 in size, or zero.

    ``has_scale``: something else has the same unit, so that numbers may be as small as they like.
    """
    largest = max(abs(Fraction(x)) for x in values)
    least = 0 if has_scale else _LEAST_SIZE
    if largest and not least <= largest <= _LARGEST_SIZE:
        required = "a size up to 1e30" if has_scale else "a size from 1e-30 to 1e30"
        raise InvalidInput(path, f"{required} (choose other units)", round_to_text(largest))


def exact_vector(
    values: Any,
    path: Path,
    length: int | None = None,
    entry: Callable[[Any, Path], Fraction] = exact_number,
) -> tuple[Fraction, ...]:
    """Return the entries of a vector as exact rationals, each read by ``entry``; raises
    InvalidInput when the length is not ``length``, InvalidRequest with the faults of all entries.
    """
    required = "a list of numbers" if length is None else f"a list of {length} numbers"
    items = list_items(values, path, required)
    if length is not None and len(items) != length:
        raise InvalidInput(path, required, f"{len(items)} entries")
    return require_each(entry, items, path)


def exact_matrix(
    values: Any, path: Path, size: int, columns: int | None = None
) -> tuple[tuple[Fraction, ...], ...]:
    """Return the rows of a matrix as exact rationals; raises InvalidInput when it has not ``size``
    rows and as many columns.

    ``columns`` is their number where the matrix is not square.
    """
    width = size if columns is None else columns
    required = f"{size} rows of {width} numbers"
    rows = list_items(values, path, required)
    if len(rows) != size:
        raise InvalidInput(path, required, f"{len(rows)} rows")
    return require_each(lambda row, place: exact_vector(row, place, width), rows, path)


def plain(value: Any) -> Any:
    """Return accepted numbers, vectors, matrices and objects in JSON types, without rounding:
    ratios become strings, and complex numbers pairs.
    """
    if type(value) in (float, bool, str) or (type(value) is int and abs(value) < 2**63):
        return value
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(item) for item in value]
    if isinstance(value, np.longdouble) and np.isfinite(value):
        value = Fraction(*value.as_integer_ratio())
    if isinstance(value, (Fraction, Decimal)) or type(value) is int:
        try:
            return str(value)
        except ValueError:  # more digits than Python is willing to print
            raise InvalidInput((), "numbers that can be printed", show(value)) from None
    if isinstance(value, (complex, np.complexfloating)):
        return [plain(value.real), plain(value.imag)]
    known = as_given(value)
    return known if known is value else plain(known)


def to_float(values: Sequence[Fraction] | Sequence[Sequence[Fraction]]) -> NDArray[np.float64]:
    """Return exact numbers as a read-only float64 array, each entry correctly rounded."""
    return read_only(np.array(values, dtype=np.float64))


def square_root(square: Fraction) -> float:
    """Return the square root of a positive rational, whose float may be out of range."""
    shift = (square.numerator.bit_length() - square.denominator.bit_length()) // 2
    return float(np.ldexp(np.sqrt(float(square / Fraction(4) ** shift)), shift))


def round_to_text(number: Fraction) -> str:
    """Return a rational to three digits, beyond the range of floats too."""
    return f"{Decimal(number.numerator) / Decimal(number.denominator):.3g}"
