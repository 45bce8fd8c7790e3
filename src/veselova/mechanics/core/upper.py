"""Functions of upper parts that methods of this part call. The upper parts register them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

__all__ = ["call_upper", "register"]

_FUNCTIONS: dict[str, Callable[..., Any]] = {}


def register(**functions: Callable[..., Any]) -> None:
    """Register functions by the names under which ``call_upper`` finds them."""
    _FUNCTIONS.update(functions)


def call_upper(name: str, *arguments: Any) -> Any:
    """Return what a registered function gives; raises KeyError for a name that none has."""
    return _FUNCTIONS[name](*arguments)
