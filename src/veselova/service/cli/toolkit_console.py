"""What the command line prints of a curve and of theta functions: tables on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from veselova.service.cli.console import heading, number, print_rows
from veselova.service.cli.fitted_tables import make_table, print_fitted

__all__ = ["print_curve", "print_theta"]

#: Matrices of a curve by their fields, with headings.
_MATRICES = {
    "riemann_matrix": "T, Riemann matrix iT",
    "a_periods": "Periods ∮ λ^(k−1)dλ/w over a_s, column s",
    "b_periods": "The same over b_s, without the factor i",
    "normalized_differentials": "Normalised differentials c_jk",
}

#: Points of theta functions that a terminal is shown; JSON has all.
_SHOWN_POINTS = 12


def print_curve(console: Console, document: Mapping[str, Any]) -> None:
    """Print a curve as ``POST /v1/curves`` describes it."""
    console.print(
        f"genus {document['genus']}, w² = {'−' if document['sign'] < 0 else ''}Π(λ−b_j), "
        f"error of T {document['riemann_matrix_error']:.1e}",
        highlight=False,
    )
    points = ", ".join(f"{point:.15g}" for point in document["branch_points"])
    console.print(f"branch points {points}", highlight=False)
    for name, title in _MATRICES.items():
        if document.get(name) is not None:
            _print_rows(console, title, document[name])
    if "abel" in document:
        _print_rows(console, "Abel–Jacobi map, one row a point", document["abel"])
    if "points" in document:
        _print_rows(console, "Points λ_s on the cuts, one row for each z", document["points"])
        _print_rows(console, "Signs of w there", document["signs"])
    for name, matrix in (document.get("quasi_periods") or {}).items():
        _print_rows(console, f"Quasi-periods {name}", matrix)
    if "thomae" in document:
        heading(console, "Thomae's formula")
        print_fitted(console, lambda digits, _: _thomae(document["thomae"], digits), 12, 0)


def _thomae(entries: Sequence[Mapping[str, Any]], digits: int) -> Table:
    table = make_table("subset of the b_j", "2·characteristic", "|θ(0)|⁴")
    for entry in entries:
        halves = ("".join(f"{2 * x:g}" for x in row) for row in entry["characteristic"])
        subset = " ".join(map(str, entry["subset"]))
        table.add_row(subset, "; ".join(halves), number(entry["fourth_power"], digits))
    return table


def print_theta(console: Console, document: Mapping[str, Any]) -> None:
    """Print theta functions at the first points as ``POST /v1/theta`` gives them: θ = value ·
    exp(exponent).
    """
    values = np.asarray(document["values"], dtype=np.float64)
    exponents = np.asarray(document["exponent"], dtype=np.float64)
    errors = np.asarray(document["error"], dtype=np.float64)
    shown = list(np.ndindex(exponents.shape))[:_SHOWN_POINTS]
    part = f", the first {len(shown)}" if len(shown) < exponents.size else ""
    console.print(f"{exponents.size} values θ = value · exp(exponent){part}", highlight=False)
    parts = values.reshape(*exponents.shape, -1, 2)

    def make(digits: int, columns: int) -> Table:
        rows = make_table("point", "value", "exponent", "error")
        for index in shown:
            pairs = [number(pair.tolist(), digits) for pair in parts[index][:columns]]
            more = ["…"] if columns < len(parts[index]) else []
            label = " ".join(str(i + 1) for i in index)
            error = f"{np.max(errors[index]):.1e}"
            rows.add_row(label, "  ".join(pairs + more), f"{exponents[index]:g}", error)
        return rows

    print_fitted(console, make, 12, parts.shape[-2])


def _print_rows(console: Console, title: str, matrix: Sequence[Sequence[Any]]) -> None:
    heading(console, title)
    print_rows(console, matrix)
