"""What the command line prints: tables on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.comparison import Comparison
from veselova.mechanics.results.drift import Drift
from veselova.mechanics.results.ensemble import Ensemble
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import encode
from veselova.service.cli.fitted_tables import make_table, print_fitted

__all__ = [
    "heading",
    "number",
    "print_comparison",
    "print_ensemble",
    "print_json",
    "print_rows",
    "print_torus",
    "print_trajectory",
    "terminal",
]

#: Rows of a trajectory that a terminal is shown; files and JSON have all.
_SHOWN_TIMES = 12

#: Components of the series shown.
_SHOWN_COMPONENTS = 6


def terminal() -> Console:
    """Return standard output, a terminal in its own width and anything else 80 columns wide."""
    return Console(width=None if sys.stdout.isatty() else 80)


def print_json(document: Mapping[str, Any]) -> None:
    """Print a document on one line."""
    sys.stdout.buffer.write(encode(document) + b"\n")
    sys.stdout.buffer.flush()


def heading(console: Console, text: str) -> None:
    """Print a heading after an empty line."""
    console.print(f"\n{text}", style="bold", highlight=False)


def _describe(console: Console, trajectory: Trajectory) -> str:
    """Return what was solved and how, in two lines where one is too narrow."""
    problem = trajectory.problem
    provenance = trajectory.provenance
    count = trajectory.times.size
    shown = _format_distinct(np.array([trajectory.times.min(), trajectory.times.max()]))
    span = f"{count} times from {shown[0]} to {shown[1]}" if count > 1 else f"one time, {shown[0]}"
    how = [provenance.method]
    if "formulation" in provenance.details:
        how.append(provenance.details["formulation"])
    what = f"{problem.title}, {span};"
    engine = f"{provenance.engine} ({', '.join(how)}), {provenance.seconds:.3g} s"
    fits = len(what) + len(engine) < console.width
    return f"{what} {engine}" if fits else f"{what}\n{engine}"


def _format_distinct(times: Any) -> list[str]:
    """Return times in the fewest digits, six or more, in which no two are the same."""
    different = np.unique(times).size
    for digits in range(6, 18):
        texts = [f"{time:z.{digits}g}" for time in times.tolist()]
        if len(set(texts)) == different:
            break
    return texts


def print_trajectory(console: Console, trajectory: Trajectory) -> None:
    """Print the motion at some of its times, the error and the drift of the integrals."""
    console.print(_describe(console, trajectory), highlight=False)
    problem = trajectory.problem
    series = trajectory.series(problem.tabulated)
    rows = series.reshape(series.shape[0], -1)
    names = [
        problem.tabulated + "".join(f"_{i + 1}" for i in index)
        for index in np.ndindex(series.shape[1:])
    ]
    neumann_time = ["tau1"] if "tau1" in problem.outputs else []
    error = trajectory.error if trajectory.decimals is None else trajectory.decimals.error
    shown = np.unique(np.linspace(0, trajectory.times.size - 1, _SHOWN_TIMES).astype(int))
    times = _format_distinct(trajectory.times[shown])
    largest = np.max(np.abs(rows[shown]), initial=0.0)
    form = "f" if largest == 0 or 1e-3 <= largest < 1e6 else "e"

    def make(digits: int, columns: int) -> Table:
        more = ["…"] if len(names) > columns else []
        table = make_table(problem.time, *neumann_time, *names[:columns], *more, "error")
        for i, time in zip(shown, times, strict=True):
            components = [
                *(f"{trajectory.series(name)[i]:z.{min(digits, 6)}f}" for name in neumann_time),
                *(f"{x: z.{digits}{form}}" for x in rows[i, :columns]),
            ]
            table.add_row(time, *components, *more, f"{error[i]:.1e}")
        return table

    if print_fitted(console, make, 9, min(len(names), _SHOWN_COMPONENTS)) < len(names):
        _print_largest(console, trajectory)
    _print_drift(console, {trajectory.provenance.engine: trajectory})


def _print_largest(console: Console, trajectory: Trajectory) -> None:
    heading(console, "Largest over all times")
    table = make_table("series", "components", "absolute value", "error")
    problem = trajectory.problem
    for name in problem.outputs:
        if (series := trajectory.series(name)).size:
            is_bounded = name in (problem.tabulated, *problem.bounded)
            error = f"{np.max(trajectory.error):.1e}" if is_bounded else ""
            largest = f"{np.max(np.abs(series)):.6g}"
            table.add_row(name, str(series[0].size), largest, error)
    console.print(table)


def print_ensemble(console: Console, ensemble: Ensemble) -> None:
    """Print how many of many starts were solved, with which errors, and why the others were not."""
    console.print(
        f"{len(ensemble)} starts at {ensemble.times.size} times, "
        f"{np.count_nonzero(ensemble.together)} side by side; {ensemble.provenance.seconds:.3g} s",
        highlight=False,
    )
    table = make_table("outcome", "starts", "largest error")
    for outcome in np.unique(ensemble.outcome).tolist():
        rows = ensemble.outcome == outcome
        errors = ensemble.error[rows]
        largest = f"{np.max(errors):.1e}" if np.isfinite(errors).all() else ""
        table.add_row(outcome, str(np.count_nonzero(rows)), largest)
    console.print(table)


def _print_drift(console: Console, trajectories: dict[str, Trajectory]) -> None:
    heading(console, "Drift of the integrals of motion")
    table = make_table("integral", *trajectories)
    drifts = [trajectory.drift for trajectory in trajectories.values()]
    for name in drifts[0]:
        table.add_row(name, *(f"{drift[name]:.1e}" for drift in drifts))
    console.print(table)


def print_comparison(console: Console, comparison: Comparison) -> None:
    """Print how the engines agree, quantity by quantity, against their errors and the conditioning
    floor.
    """
    of_engines = comparison.names == ("analytic", "numeric")
    kind = "engines" if of_engines else f"formulations {' and '.join(comparison.names)}"
    for trajectory in (comparison.first, comparison.second):
        console.print(_describe(console, trajectory), highlight=False)
    heading(console, f"Largest difference of the two {kind}")
    table = make_table("output", "deviation")
    for name, value in comparison.deviation.items():
        table.add_row(name, f"{value:.1e}")
    console.print(table)
    heading(console, "Bounds")
    table = make_table("bound", "largest value")
    for name, found in comparison.trajectories.items():
        table.add_row(f"error bound, {name}", f"{np.max(found.error):.1e}")
    table.add_row(
        "conditioning floor (one rounding of the data)",
        f"{np.max(comparison.conditioning_floor):.1e}",
    )
    console.print(table)
    _print_drift(console, comparison.trajectories)
    verdict = (
        f"The {kind} agree within their error bounds."
        if comparison.agrees
        else f"The {kind} DISAGREE beyond their error bounds."
    )
    console.print(f"\n{verdict}", highlight=False)


def _explain_moments(torus: Torus, system: str) -> str:
    """Return what the I_k are among the branch points of the torus of a system."""
    in_space = torus.n == 3
    if torus.jacobi_integral is not None or (system == "chaplygin-ball" and in_space):
        return "I_k = 1/A_k of the rank-one problem with this torus, the largest scaled to 1"
    if system == "rubber-ball" and in_space:
        return "I_k: principal moment k plus m r²"
    if system == "veselova-so3":
        return "I_k: principal moment k"
    return "I_k = 1/A_k" + (", J_ij = A_i A_j/det A" if system.endswith("-ball") else "")


def print_torus(console: Console, torus: Torus, system: type[Problem]) -> None:
    """Print the torus of a problem of a system: constants, branch points, frequencies per τ₁ and
    per the problem's own time, periods.
    """
    energy = "energy beyond the range of a float"
    for name in ("energy", "jacobi_integral"):
        if (value := getattr(torus, name)) is not None:
            energy = f"{name.replace('_', ' ')} {value:.12g}"
    console.print(
        f"n = {torus.n}, genus {torus.phases.size}, {energy}, regime {torus.regime}",
        highlight=False,
    )
    heading(console, "Branch points")
    table = make_table("b", "origin", "value")
    for j, (origin, value) in enumerate(zip(torus.origins, torus.branch_points, strict=True)):
        table.add_row(f"b_{j}", origin, f"{value:.15g}")
    console.print(table)
    console.print(_explain_moments(torus, system.system), highlight=False)
    heading(console, "Phases (cycles)")
    columns = {"z⁰": torus.phases, "per unit τ₁": torus.frequencies_tau1}
    if system.time != "tau1":
        columns[f"per unit {system.time}"] = torus.frequencies_t
    columns["action J_s"] = torus.actions
    print_rows(console, list(zip(*columns.values(), strict=True)), list(columns), 15)
    if torus.drift is not None:
        _print_mean_velocity(console, torus.drift)
    if torus.periods is not None:
        _print_matrix(console, "Periods a (basis λ^(k−1)dλ/2w)", torus.periods)
    _print_matrix(
        console,
        f"T, Riemann matrix iT (asymmetry {torus.riemann_matrix_residual:.1e})",
        torus.riemann_matrix,
    )


def _print_mean_velocity(console: Console, drift: Drift) -> None:
    heading(console, "Mean velocity of the contact point")
    table = make_table("along", "velocity")
    for k, x in enumerate(drift.velocity.tolist(), start=2):
        table.add_row(f"e_{k}", f"{x: z.12g}")
    console.print(table)
    resonance = "none" if drift.resonance is None else " ".join(map(str, drift.resonance))
    console.print(f"resonance M: {resonance}", highlight=False)


def _print_matrix(console: Console, title: str, matrix: Any) -> None:
    heading(console, title)
    print_rows(console, matrix)


def print_rows(
    console: Console, matrix: Any, names: Sequence[str] = (), most_digits: int = 12
) -> None:
    """Print rows of numbers, decimal texts or pairs [real, imaginary], in fewer digits and then
    fewer columns where the width asks for it; with ``names`` of columns, rows are counted.
    """

    def make(digits: int, columns: int) -> Table:
        more = ["…"] if columns < len(matrix[0]) else []
        counted = ["s"] if names else []
        heads = names[:columns] if names else [""] * columns
        table = make_table(*counted, *heads, *(more if names else [""] * len(more)))
        for s, row in enumerate(matrix, start=1):
            cells = [number(entry, digits) for entry in list(row)[:columns]]
            table.add_row(*([str(s)] if names else []), *cells, *more)
        return table

    texts = (
        len(x) for row in matrix for entry in row for x in np.ravel(entry) if isinstance(x, str)
    )
    print_fitted(console, make, max(most_digits, *texts, 0), len(matrix[0]))


def number(value: Any, digits: int = 12) -> str:
    """Return a number, a decimal text, or a pair [real, imaginary] as a cell."""
    if isinstance(value, str):
        return value if len(value) <= digits else f"{Decimal(value):.{digits}g}"
    if isinstance(value, Iterable):
        real, imaginary = (number(part, digits) for part in value)
        return f"{real} {imaginary}i" if imaginary.startswith("-") else f"{real} +{imaginary}i"
    return f"{value:.{digits}g}"
