"""The records in which compiled loops keep the numbers of a motion, and what they are given.

A record is one argument, however many arrays it has; their lengths are those of the largest torus
that is served.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from veselova.analytic.compiled.attitudes import torus_type
from veselova.analytic.compiled.compiler import Record, compiled
from veselova.analytic.compiled.spectra import found_type
from veselova.analytic.compiled.time_maps import Modes
from veselova.analytic.compiled.tori import BOXES, COUNTS, cube, part, tables_type

__all__ = [
    "NODES",
    "Fitted",
    "Limits",
    "Panel",
    "Results",
    "Series",
    "Times",
    "fit",
    "fit_series",
    "motion_type",
    "room_type",
]


#: Method: nodes of a panel.
NODES = 48


#: Of panels: how long the next one is at first; where this one begins in τ₁ and its length, t there
#: (and its rounding) and over it; what series have left out, between what t/F_0 − τ₁ has swung.
_PANEL = ("size", "left", "length", "value", "rest", "whole", "lost", "least", "most")


def motion_type(genus: int) -> np.dtype[Any]:
    """Return the record of one motion; names as in ``TorusStack``, ``ModeTables`` and ``TimeMaps``.

    - below, above, increasing: where the λ_s of the start are on their cuts
    - base: the start's roundings besides those of its angles
    - A: sorted, in any unit; places: of each body axis among sorted ones
    """
    n = genus + 1
    scalars = ("time_rate", "unit", "off", "rate_rounding", "phase_error")
    return np.dtype(
        [
            ("below", float, (genus,)),
            ("above", float, (genus,)),
            ("base", float, (genus,)),
            ("differences", float, (2 * genus + 1, 2 * genus + 1)),
            ("signs", float, (n,)),
            ("A", float, (n,)),
            ("places", np.int64, (n,)),
            *((name, float) for name in scalars),
            ("increasing", np.int8, (genus,)),
        ],
        align=True,
    )


class Panel(NamedTuple):
    """The tables of N motions by interpolation, as in analytic.motion.atlas.

    - coefficients: (D+1, L)
    - x: (N,) where each motion lies in the panel, from −1 to 1
    - scale: (N,) of F_0
    - modes: (K,) which of the box are interpolated
    - numbers: (L,) room
    """

    coefficients: Any
    x: Any
    scale: Any
    modes: Any
    numbers: Any


class Times(NamedTuple):
    """The doubles and remainders of a grid, (T,) each."""

    doubles: Any
    remainders: Any


class Limits(NamedTuple):
    """The constants of analytic.motion.ensemble."""

    certain: float
    phase: float
    start_phase: float
    evaluation: float
    safety: float
    largest_error: float
    most_cycles: float


class Results(NamedTuple):
    """The states: τ₁, error and how fast frames move along, (N, T), q̇ (N, T, n), frames (N, T, n,
    n), and which motions they are right for, (N,).
    """

    tau1: Any
    q_dot: Any
    frame: Any
    error: Any
    slopes: Any
    served: Any


class Series(NamedTuple):
    """The angle series of one torus, and what stands before sines, (g, g, M)."""

    series: Any
    of_sines: Any


class Fitted(NamedTuple):
    """Tables of one torus in as much room as they need: of M terms and modes in a box.

    - angles: the angle series
    - values: (R, 2R−1), of genus one (R, 1)
    """

    angles: Series
    values: Any
    modes: Modes


def room_type(genus: int) -> np.dtype[Any]:
    """Return the record of all numbers of one motion, and the places where its loops work.

    - motion, torus, tables, found: records of their own
    - amplitudes, cosines, sines, of_sines, …: the series at one time
    - z, psi, angles, slopes, past: where the inversion is, and the times before it
    - start, of_start, of_rates, rotation: what the start fixes, along sorted axes
    - own: as of the torus, at one time
    - turning: how fast the frame moves
    - panel, at_nodes, series, integral, polynomials: of one panel
    """
    n, terms, rows = genus + 1, COUNTS[-1], BOXES[-1] + 1
    box = rows * (2 * rows - 1) if genus < 3 else 1
    flat = {
        "amplitudes": box,
        "doubled": box,
        "cosines": 2 * rows,
        "sines": 2 * rows,
        "of_sines": genus * genus * terms,
    }
    phases = ("angles", "start", "of_start", "of_rates", "components", "uniform", "z", "psi")
    matrices: dict[str, tuple[int, ...]] = {
        "slopes": (genus, genus),
        "rotation": (genus, genus),
        "inverse": (genus, genus),
        "first": (n, n),
        "frames": (n, n, n),
        "along": (n, genus),
        "sorted": (3, 1, n),
        "past": (6, 3 + 2 * genus),
        "guess": (n,),
        "turning": (3,),
        "at_nodes": (n, NODES),
        "series": (n, NODES),
        "integral": (NODES + 1,),
        "polynomials": (NODES + 1,),
    }
    return np.dtype(
        [
            ("motion", motion_type(genus)),
            ("torus", torus_type(genus)),
            ("tables", tables_type(genus)),
            ("found", found_type(n)),
            *((name, float, (length,)) for name, length in flat.items()),
            *((name, float, (genus,)) for name in (*phases, "unit", "steps")),
            *((name, float, shape) for name, shape in matrices.items()),
            ("panel", [*((name, float) for name in _PANEL), ("tried", np.int64)]),
            ("own", float, (2 * genus + 1,)),
            ("first_places", np.intp, (rows,)),
            ("last_places", np.intp, (rows,)),
            ("counted", np.int8, (box,)),
        ],
        align=True,
    )


@compiled(inline=True)
def fit_series(room: Record, genus: int, terms: int) -> Series:
    """Return the angle series of a torus in its length."""
    return Series(cube(room.tables.series, genus, terms), cube(room.of_sines, genus, terms))


@compiled(inline=True)
def fit(room: Record, genus: int, terms: int, rows: int) -> Fitted:
    """Return the tables of a torus in their lengths."""
    columns = 2 * rows - 1 if genus == 2 else 1
    return Fitted(
        fit_series(room, genus, terms),
        part(room.tables.values, rows, columns),
        Modes(
            part(room.amplitudes, rows, columns),
            part(room.doubled, rows, columns),
            room.first_places[:rows],
            room.last_places[:rows],
            room.counted[: rows * columns].reshape(rows, columns),
            room.cosines[:columns],
            room.sines[:columns],
        ),
    )
