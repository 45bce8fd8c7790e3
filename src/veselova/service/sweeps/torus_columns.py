"""What the table of a sweep says of tori: of one, or of many that are computed at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.results.torus import Torus
from veselova.service.api.sweep_parameters import Path, components, is_double, replace_values
from veselova.service.api.sweep_request import SweepRequest

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from veselova.analytic.motion.invariant_torus_batch import Tori

__all__ = ["columns_at_once", "columns_of_torus"]

Columns = dict[str, Any]

#: What a torus has to say in numbers, and how each is called in the table.
_NUMBERS = (
    "energy",
    "constants",
    "branch_points",
    "frequencies_tau1",
    "frequencies_t",
    "rotation_numbers",
    "actions",
    "phases",
)

#: A start this near to the bound of the tolerance is left to the problem itself, which refuses or
#: takes it.
_SURELY = INPUT_TOLERANCE / 2


def columns_of_torus(found: Torus) -> Iterator[tuple[str, Any]]:
    """Yield the columns of one torus."""
    for name in _NUMBERS:
        if (value := getattr(found, name)) is not None:
            yield from components(name, np.asarray(value).tolist())
    yield "mean_rate", found.mean_rate
    yield "regime", found.regime
    yield "origins", " ".join(found.origins)


def columns_at_once(
    sweep: SweepRequest, values: Mapping[int, Mapping[Path, Any]]
) -> dict[int, Columns]:
    """Return the columns of the tori of those problems that can be computed together, by their
    rows.

    ``values``: what the parameters of the sweep are in each row. A row that is missing in the
    answer is for ``torus``, or is no valid problem.
    """
    if not sweep.tori_at_once:
        return {}
    from veselova.analytic.motion.invariant_torus_batch import tori

    stated = sweep.problem.model_dump(exclude_none=True)
    rows = []
    starts = []
    for row, places in values.items():
        if (start := _start(replace_values(stated, places))) is not None:
            rows.append(row)
            starts.append(start)
    if not rows:
        return {}
    A, q, q_dot = np.moveaxis(np.array(starts, dtype=np.float64), 1, 0)
    return _columns(rows, tori(A, q, q_dot))


def _start(problem: Mapping[str, Any]) -> Sequence[Sequence[float]] | None:
    """Return A, q and q_dot where all are lists of doubles of one length and surely a valid start,
    and no frame is given.
    """
    start = [problem["A"], problem["q"], problem["q_dot"]]
    sizes = {
        len(vector) if isinstance(vector, list) and all(map(is_double, vector)) else 0
        for vector in start
    }
    if (
        len(sizes) > 1
        or min(sizes) < 2
        or "frame" in problem
        or not isinstance(problem["normalize"], bool)
    ):
        return None
    return start if problem["normalize"] or _is_on_sphere(start[1], start[2]) else None


def _is_on_sphere(q: list[float], velocity: list[float]) -> bool:
    with np.errstate(over="ignore", invalid="ignore"):
        position = np.array(q, dtype=np.float64)
        speed = np.array(velocity, dtype=np.float64)
        length = abs(float(np.linalg.norm(position)) - 1)
        along = abs(float(position @ speed))
        return length < _SURELY and along < _SURELY * float(np.linalg.norm(speed))


def _columns(rows: list[int], found: Tori) -> dict[int, Columns]:
    numbers: list[NDArray[np.float64]] = [getattr(found, name) for name in (*_NUMBERS, "mean_rate")]
    names = [
        column
        for name in _NUMBERS
        for column, _ in components(name, getattr(found, name)[0].tolist())
    ] + ["mean_rate"]
    table = np.concatenate([values.reshape(len(rows), -1) for values in numbers], axis=1).tolist()
    return {
        rows[i]: {
            **dict(zip(names, table[i], strict=True)),
            "regime": "generic",
            "origins": " ".join(found.origins[i]),
        }
        for i in np.flatnonzero(found.known).tolist()
    }
