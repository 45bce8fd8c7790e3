"""What users call computes in the default contexts of NumPy and decimal, whatever those of the
caller are: equal data have equal results.
"""

from __future__ import annotations

from contextvars import ContextVar
from decimal import (
    ROUND_HALF_EVEN,
    Context,
    DivisionByZero,
    InvalidOperation,
    Overflow,
    localcontext,
)
from functools import cached_property, wraps
from inspect import isfunction, isgeneratorfunction
from typing import Any, TypeVar, cast

import numpy as np

__all__ = ["in_own_contexts"]

T = TypeVar("T")

#: Those that Python and NumPy begin with.
_DECIMAL = Context(
    prec=28,
    rounding=ROUND_HALF_EVEN,
    Emin=-999999,
    Emax=999999,
    capitals=1,
    clamp=0,
    traps=[DivisionByZero, InvalidOperation, Overflow],
)
_FLOATS: Any = {"divide": "warn", "over": "warn", "under": "ignore", "invalid": "warn"}

#: Whether they are in force.
_entered: ContextVar[bool] = ContextVar("veselova_own_contexts", default=False)


def in_own_contexts(door: T) -> T:
    """Return a function that runs in the default contexts, or a class whose own constructor, public
    methods and properties do.
    """
    if not isinstance(door, type):
        return cast("T", _wrap(door))
    for name, member in list(vars(door).items()):
        if name.startswith("_") and name not in ("__init__", "__getitem__", "__call__"):
            continue
        if isinstance(member, cached_property):
            member.func = _wrap(member.func)
        elif isinstance(member, property):
            setattr(door, name, property(_wrap(member.fget), doc=member.__doc__))
        elif isinstance(member, classmethod):
            setattr(door, name, classmethod(_wrap(member.__func__)))
        elif isfunction(member):
            setattr(door, name, _wrap(member))
    return door


def _wrap(function: Any) -> Any:
    if isgeneratorfunction(function):
        return function

    @wraps(function)
    def run(*arguments: Any, **named: Any) -> Any:
        if _entered.get():
            return function(*arguments, **named)
        before = _entered.set(True)
        try:
            with np.errstate(**_FLOATS), localcontext(_DECIMAL):
                return function(*arguments, **named)
        finally:
            _entered.reset(before)

    return run
