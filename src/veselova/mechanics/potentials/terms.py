"""Terms {"coefficient": c, "powers": …} of the potentials that users give, read."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    missing_fields,
    show,
    unknown_fields,
)
from veselova.mechanics.core.exact_input import (
    Path,
    exact_number,
    list_items,
    require_each,
    whole_number,
)

__all__ = ["FIELDS", "read_list", "read_terms", "read_whole_numbers"]

#: The fields of a term.
FIELDS = ("coefficient", "powers")

Powers = TypeVar("Powers")


def read_list(given: Any, path: Path, least: int, most: int, required: str) -> list[Any]:
    """Return a list of so many entries; raises InvalidInput."""
    listed = list_items(given, path, required)
    if not least <= len(listed) <= most:
        raise InvalidInput(path, required, f"{len(listed)} of them")
    return listed


def read_terms(
    given: Any, path: Path, most: int, form: str, read_powers: Callable[[Any, Path], Powers]
) -> tuple[tuple[float, Powers], ...]:
    """Return coefficients and powers of 1 to ``most`` terms; raises InvalidInput.

    form: what a term is, in words
    """

    def read(item: Any, place: Path) -> tuple[float, Powers]:
        if not isinstance(item, Mapping):
            raise InvalidInput(place, f"a term {form}", show(item))
        faults = Faults()
        faults.found += unknown_fields(place, item, FIELDS) + missing_fields(place, item, FIELDS)
        values: dict[str, Any] = {
            name: faults.attempt(call, item[name], (*place, name))
            for name, call in zip(FIELDS, (exact_number, read_powers), strict=True)
            if name in item
        }
        faults.require_none()
        return float(values["coefficient"]), values["powers"]

    terms = read_list(given, path, 1, most, f"a list of 1 to {most} terms {form}")
    return require_each(read, terms, path)


def read_whole_numbers(
    given: Any, path: Path, ranges: Sequence[tuple[int, int]]
) -> tuple[int, ...]:
    """Return as many whole numbers as there are ranges, each in its own; raises InvalidInput."""
    count = len(ranges)
    listed = read_list(given, path, count, count, f"a list of {count} whole numbers")

    def read(entry: Any, place: Path) -> int:
        return whole_number(entry, place, *ranges[int(place[-1])])

    return require_each(read, listed, path)
