"""Tables that fit a terminal: digits go first, then columns, and an error never."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console
from rich.table import Table

__all__ = ["make_table", "print_fitted"]

#: Fewest significant digits before columns go.
_FEWEST_DIGITS = 5


def make_table(*columns: str) -> Table:
    """Return an empty table with these headings, the first column to the left."""
    table = Table(header_style="dim", pad_edge=False, box=None, show_header=any(columns))
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right", no_wrap=True)
    return table


def print_fitted(
    console: Console, make: Callable[[int, int], Table], digits: int, columns: int
) -> int:
    """Print the first table ``make(digits, columns)`` that fits the width: with fewer digits, then
    with fewer columns, down to none; return how many columns it has.
    """
    few = min(digits, _FEWEST_DIGITS)
    unbounded = console.options.update(width=10_000)
    choices = [
        *((shown, columns) for shown in range(digits, few, -1)),
        *((few, shown) for shown in range(columns, -1, -1)),
    ]
    for choice in choices:
        table = make(*choice)
        if console.measure(table, options=unbounded).maximum <= console.width:
            break
    console.print(table)
    return choice[1]
