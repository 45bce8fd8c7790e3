"""Names among those known: an output, a method, a formulation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from typing import Any

from veselova.mechanics.core.errors import InvalidInput, show, unknown_name
from veselova.mechanics.core.exact_input import list_items, require_each

__all__ = ["require_name", "require_names"]

Path = tuple[str | int, ...]


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
