"""Arguments at the door: arrays and numbers of other libraries become NumPy's and Python's, and a
call with arguments that fit no parameter is refused by the name that was called.
"""

from __future__ import annotations

import inspect
from abc import ABCMeta
from collections.abc import Callable, Mapping
from decimal import Decimal
from fractions import Fraction
from functools import cache, wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

from veselova.mechanics.core.errors import did_you_mean

__all__ = ["CheckedCall", "as_given", "takes_arrays"]

P = ParamSpec("P")
T = TypeVar("T")

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
