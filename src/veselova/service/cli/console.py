"""What the command line prints: tables on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from veselova.mechanics.core.problem import CONDITIONING
from veselova.mechanics.results.comparison import Comparison
from veselova.mechanics.results.drift import Drift
from veselova.mechanics.results.ensemble import Ensemble
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import encode

__all__ = [
    "heading",
    "make_table",
    "print_comparison",
    "print_ensemble",
    "print_json",
    "print_torus",
    "print_trajectory",
    "terminal",
]

#: Rows of a trajectory that a terminal is shown; files and JSON have all.
_SHOWN_TIMES = 12

#: Components of the series shown.
_SHOWN_COMPONENTS = 6


def terminal() -> Console:
    """Return standard output. Tables keep their columns when it is a file; a terminal's own width
    is taken as it is.
    """
    return Console(width=None if sys.stdout.isatty() else 120)


def print_json(document: Mapping[str, Any]) -> None:
    """Print a document on one line."""
    sys.stdout.buffer.write(encode(document) + b"\n")
    sys.stdout.buffer.flush()


def make_table(*columns: str) -> Table:
    """Return an empty table with these headings, the first column to the left."""
    table = Table(header_style="dim", pad_edge=False, box=None, show_header=any(columns))
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right", no_wrap=True)
    return table


def heading(console: Console, text: str) -> None:
    """Print a heading after an empty line."""
    console.print(f"\n{text}", style="bold", highlight=False)


def _describe(trajectory: Trajectory) -> str:
    problem = trajectory.problem
    provenance = trajectory.provenance
    count = trajectory.times.size
    shown = _format_distinct(np.array([trajectory.times.min(), trajectory.times.max()]))
    span = f"{count} times from {shown[0]} to {shown[1]}" if count > 1 else f"one time, {shown[0]}"
    return (
        f"{problem.title}, {span}; {provenance.engine} ({provenance.method}), "
        f"{provenance.seconds:.3g} s"
    )


def _format_distinct(times: Any) -> list[str]:
    """Return times in the fewest digits, six or more, in which no two are the same."""
    different = np.unique(times).size
    for digits in range(6, 18):
        texts = [f"{time:z.{digits}g}" for time in times.tolist()]
        if len(set(texts)) == different:
            break
    return texts


def print_trajectory(
    console: Console, trajectory: Trajectory, outputs: Iterable[str] | None = None
) -> None:
    """Print the motion at some of its times, the error and the drift of the integrals; the
    conditioning too where it is among the outputs that were asked for.
    """
    console.print(_describe(trajectory), highlight=False)
    problem = trajectory.problem
    series = trajectory.series(problem.tabulated)
    rows = series.reshape(series.shape[0], -1)
    names = [
        problem.tabulated + "".join(f"_{i + 1}" for i in index)
        for index in np.ndindex(series.shape[1:])
    ]
    more = ["…"] if len(names) > _SHOWN_COMPONENTS else []
    further = [CONDITIONING] if CONDITIONING in (outputs or ()) else []
    neumann_time = ["tau1"] if "tau1" in problem.outputs else []
    shown_names = names[:_SHOWN_COMPONENTS]
    table = make_table(problem.time, *neumann_time, *shown_names, *more, "error", *further)
    error = trajectory.error if trajectory.decimals is None else trajectory.decimals.error
    shown = np.unique(np.linspace(0, trajectory.times.size - 1, _SHOWN_TIMES).astype(int))
    for i, time in zip(shown, _format_distinct(trajectory.times[shown]), strict=True):
        components = [
            *(f"{trajectory.series(name)[i]:z.6f}" for name in neumann_time),
            *(f"{x: z.9f}" for x in rows[i, :_SHOWN_COMPONENTS]),
        ]
        bounds = [f"{error[i]:.1e}", *(f"{trajectory.series(name)[i]:.1e}" for name in further)]
        table.add_row(time, *components, *more, *bounds)
    console.print(table)
    _print_drift(console, {trajectory.provenance.engine: trajectory})


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
    console.print(_describe(comparison.first), highlight=False)
    console.print(_describe(comparison.second), highlight=False)
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


def print_torus(console: Console, torus: Torus, time: str) -> None:
    """Print the torus: constants, branch points, frequencies per τ₁ and per the problem's own
    ``time``, periods.
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
    heading(console, "Phases (cycles)")
    table = make_table("s", "z⁰", "per unit τ₁", f"per unit {time}", "action J_s")
    columns = torus.phases, torus.frequencies_tau1, torus.frequencies_t, torus.actions
    for s, row in enumerate(zip(*columns, strict=True), start=1):
        table.add_row(str(s), *(f"{x:.15g}" for x in row))
    console.print(table)
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
    table = make_table(*(f"along e_{k}" for k in range(2, 2 + drift.velocity.size)), "resonance M")
    resonance = "none" if drift.resonance is None else " ".join(map(str, drift.resonance))
    table.add_row(*(f"{x: z.12g}" for x in drift.velocity), resonance)
    console.print(table)


def _print_matrix(console: Console, title: str, matrix: Any) -> None:
    heading(console, title)
    table = make_table(*("" for _ in range(matrix.shape[1])))
    for row in matrix:
        table.add_row(*(f"{x: .12g}" for x in row))
    console.print(table)
