"""What the command line prints: JSON, or documents as lines and tables under the names of their
fields.
"""

from __future__ import annotations

import shutil
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import encode

#: Times and components of a trajectory that a terminal is shown; files and JSON have all.
_SHOWN_TIMES = 12
_SHOWN_COMPONENTS = 6

#: Significant digits, at most and at least, and characters of a number besides them.
_MOST_DIGITS = 12
_FEWEST_DIGITS = 5
_BESIDES = 9

#: Matrices of an array of them that are shown.
_SHOWN_MATRICES = 12


def print_json(document: Mapping[str, Any]) -> None:
    """Print a document on one line."""
    sys.stdout.buffer.write(encode(document) + b"\n")
    sys.stdout.buffer.flush()


def print_document(document: Mapping[str, Any], digits: int = _MOST_DIGITS, name: str = "") -> None:
    """Print a document: a line for each number, text or list, then a table for each matrix and list
    of objects, and the parts that are documents themselves.
    """
    lines = {field: value for field, value in document.items() if _is_line(value)}
    if name and lines:
        print(f"\n{name}")
    for field, value in lines.items():
        print(f"{field}: {_text(value, digits)}")
    for field, value in document.items():
        label = f"{name} {field}".strip()
        if isinstance(value, Mapping):
            print_document(value, digits, label)
        elif field not in lines and isinstance(value[0], Mapping):
            print(f"\n{label}")
            _print_table([list(value[0]), *([_text(x) for x in row.values()] for row in value)])
        elif field not in lines:
            _print_matrices(label, np.asarray(value))


def _is_line(value: Any) -> bool:
    if isinstance(value, (list, tuple)) and value and isinstance(value[0], Mapping):
        return False
    return not isinstance(value, Mapping) and np.ndim(value) < 2


def _print_matrices(label: str, array: Any) -> None:
    """Print a matrix with as many digits, and columns, as fit; the first ones of
    an array of matrices.
    """
    if array.ndim > 2:
        for i, part in enumerate(array[:_SHOWN_MATRICES], start=1):
            _print_matrices(f"{label} {i}", part)
        return
    width, columns = _width(), array.shape[1]
    shown = max(1, min(columns, width // (_FEWEST_DIGITS + _BESIDES)))
    digits = max(_FEWEST_DIGITS, min(_MOST_DIGITS, width // max(columns, 1) - _BESIDES))
    more = ["…"] * (shown < columns)
    print(f"\n{label}")
    _print_table([[*(_text(x, digits) for x in row[:shown]), *more] for row in array.tolist()])


def _print_table(rows: Sequence[Sequence[str]]) -> None:
    """Print cells in columns, numbers to the right."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    for row in rows:
        cells = (cell.rjust(width) for cell, width in zip(row, widths))
        print("  ".join(cells))


def _text(value: Any, digits: int = _MOST_DIGITS) -> str:
    if isinstance(value, float):
        return f"{value:z.{digits}g}"
    if isinstance(value, Iterable) and not isinstance(value, str):
        return " ".join(_text(part, digits) for part in value)
    return "none" if value is None else str(value)


def _width() -> int:
    """Return the columns of the terminal, 80 where there is none."""
    return shutil.get_terminal_size((80, 24)).columns


def print_counts(outcomes: Iterable[str]) -> None:
    """Print how many problems had each outcome."""
    counts = Counter(outcomes).most_common()
    _print_table([["outcome", "problems"], *([name, str(count)] for name, count in counts)])


def describe(trajectory: Trajectory) -> None:
    """Print what was solved, and how."""
    times, provenance = trajectory.times, trajectory.provenance
    span = f"{times.size} times from {times.min():z.15g} to {times.max():z.15g}"
    if times.size == 1:
        span = f"one time, {times[0]:z.15g}"
    how = ", ".join(filter(None, (provenance.method, provenance.details.get("formulation"))))
    print(f"{trajectory.problem.title}, {span};")
    print(f"{provenance.engine} ({how}), {provenance.seconds:.3g} s")


def print_trajectory(trajectory: Trajectory) -> None:
    """Print the motion at some of its times, the error and the drift of the integrals."""
    describe(trajectory)
    name = trajectory.problem.tabulated
    series = trajectory.series(name)
    names = [name + "".join(f"_{i + 1}" for i in index) for index in np.ndindex(series.shape[1:])]
    rows = series.reshape(series.shape[0], -1)[:, :_SHOWN_COMPONENTS]
    more = ["…"] * (rows.shape[1] < len(names))
    error = trajectory.error if trajectory.decimals is None else trajectory.decimals.error
    shown = np.unique(np.linspace(0, len(rows) - 1, _SHOWN_TIMES).astype(int)).tolist()
    times = [f"{trajectory.times[i]:z.15g}" for i in shown]
    largest = np.max(np.abs(rows[shown]), initial=0.0)
    form, besides = ("f", 5) if largest == 0 or 1e-3 <= largest < 1e6 else ("e", 9)
    left = _width() - max(map(len, times)) - 12
    digits = max(2, min(9, left // max(rows.shape[1], 1) - besides))
    table = [[trajectory.problem.time, *names[:_SHOWN_COMPONENTS], *more, "error"]]
    for time, i in zip(times, shown):
        numbers = (f"{x:z.{digits}{form}}" for x in rows[i])
        table.append([time, *numbers, *more, f"{error[i]:.1e}"])
    _print_table(table)
    print_document({"drift": trajectory.drift}, 2)
