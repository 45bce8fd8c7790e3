"""Arguments at the door: arrays and numbers of other libraries become NumPy's and Python's, and a
call with arguments that fit no parameter is refused by the name that was called. Lists, names,
truth values, whole numbers and digits are read here as they are given; ``exact_input`` reads
numbers exactly.
"""

from __future__ import annotations

import inspect
from abc import ABCMeta
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from decimal import Decimal
from fractions import Fraction
from functools import cache, wraps
from numbers import Integral
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import Faults, InvalidInput, did_you_mean, show, unknown_name

__all__ = [
    "FEWEST_DIGITS",
    "LARGEST_WHOLE_DOUBLE",
    "MOST_DIGITS",
    "CheckedCall",
    "Path",
    "as_doubles",
    "as_given",
    "beyond_double",
    "entry_count",
    "has_doubles",
    "has_entries",
    "is_matrix",
    "list_items",
    "read_only",
    "read_precision",
    "require_each",
    "require_name",
    "require_names",
    "require_truth_value",
    "takes_arrays",
    "whole_number",
]

Path = tuple[str | int, ...]

P = ParamSpec("P")
T = TypeVar("T")

#: Digits that can be asked for; the fewest are those of double precision.
FEWEST_DIGITS = 15
MOST_DIGITS = 1000

#: Whole numbers up to here are doubles.
LARGEST_WHOLE_DOUBLE = 2**53

#: Types that are taken as they are.
_PLAIN = frozenset({bool, int, float, complex, str, bytes, type(None), Fraction, Decimal})

#: Lists and dictionaries are not looked into any deeper: no argument is.
_DEEPEST = 6

#: NumPy's scalars that Python has no number for.
_KEPT = (np.longdouble, np.clongdouble, np.timedelta64)


def as_given(value: Any, depth: int = _DEEPEST) -> Any:
    """Return a value with arrays of other libraries, such as a Series or a DataArray, as NumPy's,
    and arrays without axes, NumPy's numbers and truth values as Python's; in lists, tuples and
    dictionaries too.
    """
    if type(value) in _PLAIN or not depth:
        return value
    if type(value) in (list, tuple):
        plain = _PLAIN.issuperset(map(type, value))
        return value if plain else type(value)(as_given(item, depth - 1) for item in value)
    if type(value) is dict:
        return {name: as_given(item, depth - 1) for name, item in value.items()}
    if isinstance(value, np.generic):
        known = isinstance(value, (np.bool_, np.number, np.str_)) and not isinstance(value, _KEPT)
        return value.item() if known else value
    if isinstance(value, type) or not hasattr(type(value), "__array__"):
        return value
    try:
        array = np.asanyarray(value)
    except Exception:  # a library's own refusal, of whatever kind: the value is refused by its door
        return value
    return array if array.ndim or np.ma.is_masked(array) else as_given(array[()], depth - 1)


def takes_arrays(call: Callable[P, T]) -> Callable[P, T]:
    """Return a function that takes its arguments ``as_given``."""

    @wraps(call)
    def taken(*arguments: P.args, **options: P.kwargs) -> T:
        return _call(call, call, arguments, options)

    return taken


class CheckedCall(ABCMeta):
    """The class of classes that take the arguments of their constructor ``as_given``."""

    if not TYPE_CHECKING:  # type checkers read the constructors

        def __call__(cls, *arguments: Any, **options: Any) -> Any:
            return _call(super().__call__, cls, arguments, options)

    @property
    def __signature__(cls) -> inspect.Signature:
        return _signature(cls)


@cache
def _signature(kind: CheckedCall) -> inspect.Signature:
    """Return the signature of a class: that of its constructor without ``self``."""
    own: Any = kind.__init__  # type: ignore[misc]
    signature = inspect.signature(own)
    return signature.replace(parameters=list(signature.parameters.values())[1:])


def _call(
    call: Callable[..., T], named: Any, arguments: tuple[Any, ...], options: Mapping[str, Any]
) -> T:
    """Call with arguments as given; raises TypeError, which says what is wrong with them."""
    try:
        return call(*map(as_given, arguments), **{k: as_given(x) for k, x in options.items()})
    except TypeError:
        signature = inspect.signature(named)
        try:
            signature.bind(*arguments, **options)
        except TypeError as error:
            names = list(signature.parameters)
            unknown = [name for name in options if name not in names]
            reason = f"it has no argument {unknown[0]!r}" if unknown else str(error)
            hint = did_you_mean(unknown[0], names) if unknown else ""
            shown = f"{named.__name__}({', '.join(name for name in names if name != 'self')})"
            raise TypeError(f"{shown}: {reason}{hint}") from None
        raise


def list_items(values: Any, path: Path, required: str) -> list[Any]:
    """Return the entries of a list or an array; raises InvalidInput, with what is ``required``."""
    if np.ma.is_masked(values):
        raise InvalidInput(path, required, "an array with masked entries")
    values = as_given(values)
    if isinstance(values, np.ndarray) and values.dtype.kind not in "mM":  # no dates
        values = values.tolist()
    if isinstance(values, (str, bytes)) or not isinstance(values, Sequence):
        raise InvalidInput(path, required, show(values))
    return list(values)


def require_each(call: Callable[[Any, Path], T], items: Sequence[Any], path: Path) -> tuple[T, ...]:
    """Return what a call gives for each item and its path; raises InvalidRequest with the faults of
    all.
    """
    faults = Faults()
    found = [faults.attempt(call, item, (*path, i)) for i, item in enumerate(items)]
    faults.require_none()
    return tuple(found)


def has_entries(value: Any) -> bool:
    """Return whether a value has a length, and is neither text nor a mapping; an array of no
    dimension has none.
    """
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return hasattr(value, "__len__") and not isinstance(value, (str, bytes, Mapping))


def entry_count(values: Any, otherwise: Any = ()) -> int:
    """Return how many entries a list has, or the other one where the first is none."""
    return next(map(len, filter(has_entries, (values, otherwise))), 0)


def is_matrix(values: Any) -> bool:
    """Return whether the value is a list of lists: only the outermost shape is looked at."""
    return has_entries(values) and len(values) > 0 and has_entries(next(iter(values)))


def has_doubles(values: Any) -> bool:
    """Return whether a number in nested lists is a binary floating-point number, which may be the
    rounding of another; text, whole numbers and ratios are what they state.
    """
    if has_entries(values):
        return any(map(has_doubles, values))
    return isinstance(values, (float, np.floating))


def as_doubles(array: NDArray[Any]) -> NDArray[np.float64] | None:
    """Return a copy of an array whose numbers doubles hold as they stand; None for any other, such
    as one with masked entries, truth values, complex or longer numbers.
    """
    if np.ma.is_masked(array):
        return None
    kind = array.dtype.kind
    held = kind == "f" and array.dtype.itemsize <= np.dtype(np.float64).itemsize
    if kind in "iu" and array.size:
        held = max(-int(array.min()), int(array.max())) <= LARGEST_WHOLE_DOUBLE
    return np.array(array, dtype=np.float64, subok=False) if held else None


def read_only(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the array, no longer writable."""
    array.setflags(write=False)
    return array


def whole_number(value: Any, path: Path, least: int, most: int) -> int:
    """Return a whole number between bounds; raises InvalidInput for anything else, booleans and 3.0
    included.
    """
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not is_whole or not least <= int(value) <= most:
        raise InvalidInput(path, f"a whole number from {least} to {most}", show(value))
    return int(value)


def require_truth_value(value: Any, name: str) -> None:
    """Raise InvalidInput, located at ``name``, for anything but true or false."""
    if not isinstance(value, (bool, np.bool_)):
        raise InvalidInput((name,), "true or false", show(value))


def require_name(value: Any, path: Path, names: Sequence[str], scope: str = "") -> str:
    """Return a name among those known; raises InvalidInput for anything else, lists and arrays
    included.
    """
    if not isinstance(value, str) or value not in names:
        raise unknown_name(path, value, names, scope)
    return value


def require_names(values: Any, path: Path, names: Sequence[str]) -> tuple[str, ...]:
    """Return one or more names among those known, from anything that lists them; raises
    InvalidInput for anything else, and for none.
    """
    required = f"a list of one or more of {', '.join(names)}"
    if isinstance(values, (Mapping, Set, Iterator)):
        values = list(values)
    chosen = list_items(values, path, required)
    if not chosen:
        raise InvalidInput(path, required, show(values))
    return require_each(lambda name, place: require_name(name, place, names), chosen, path)


def beyond_double(digits: int, certified: bool) -> bool:
    """Return whether an answer with so many digits, or with certified errors, has decimals and
    takes its data exactly.
    """
    return digits > FEWEST_DIGITS or certified


def read_precision(digits: Any, certified: Any, most: int = MOST_DIGITS) -> bool:
    """Return whether ``digits``, at most ``most``, or ``certified`` go beyond doubles; raises
    InvalidInput with the faults of both.
    """
    faults = Faults()
    faults.attempt(whole_number, digits, ("digits",), FEWEST_DIGITS, most)
    faults.attempt(require_truth_value, certified, "certified")
    faults.require_none()
    return beyond_double(digits, certified)
