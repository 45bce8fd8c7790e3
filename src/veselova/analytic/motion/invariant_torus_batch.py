"""The invariant tori of many Veselova problems of one dimension at once: what
analytic.motion.invariant_torus finds for one, without its matrices.

Curves whose branch points come in one order, with one number of nodes, are computed as one stack of
arrays. No number depends on which other problems are in it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.motion.invariant_torus import actions
from veselova.analytic.motion.torus_stack import TorusStack, torus_stacks

__all__ = ["Tori", "tori"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tori:
    """What tori have in numbers, first axis the N problems; g = n−1. Names and units are those of
    ``Torus``.

    known (N,) which problems were computed; the others have NaN
    """

    known: NDArray[np.bool_]
    energy: Array
    constants: Array
    branch_points: Array
    origins: NDArray[np.str_]
    actions: Array
    rotation_numbers: Array
    frequencies_tau1: Array
    frequencies_t: Array
    phases: Array
    mean_rate: Array


def tori(A: Any, q: Any, q_dot: Any) -> Tori:
    """Return the tori of Veselova problems given by arrays (N, n) of doubles, exact as they stand.

    q needs no length, and q̇ may have a part along q. Equal A's, directions that do not move or
    start at q_i = 0, branch points nearer than 1e-12 of the largest, and dimensions above nine are
    not for this function. Digits: those of ``torus``, to 1e-14 of every number (of a cycle for
    phases), tested for n = 2…7. Where A's are orders of magnitude apart the map to phases
    cancels, here as there: over nine of them phases differ by 2e-13.
    """
    A, q, q_dot = (np.asarray(x, dtype=np.float64) for x in (A, q, q_dot))
    count, n = A.shape
    found = _nothing(count, n)
    for stack in torus_stacks(A, q, q_dot):
        for name, values in _numbers(stack).items():
            getattr(found, name)[stack.rows] = values
    return found


def _nothing(count: int, n: int) -> Tori:
    """Return the tori of no problem out of so many."""
    shapes = {"energy": (), "mean_rate": (), "constants": (n - 2,), "branch_points": (2 * n - 1,)}
    values: dict[str, Any] = {
        field.name: np.full((count, *shapes.get(field.name, (n - 1,))), np.nan)
        for field in fields(Tori)
        if field.name not in ("known", "origins")
    }
    return Tori(
        known=np.zeros(count, dtype=bool),
        origins=np.zeros((count, 2 * n - 1), dtype="U3"),
        **values,
    )


def _numbers(stack: TorusStack) -> dict[str, Any]:
    """Return the fields of ``Tori`` for the members of one stack."""
    spectra = stack.spectra
    periods = stack.periods
    unit = spectra.unit[:, None]
    root = np.sqrt(unit)
    in_time = stack.frequencies / stack.mean[:, None]
    axes = spectra.axes + 1
    numbers = [
        axes[:, o.index] if o.kind == "I" else np.full(axes.shape[0], o.index + 1)
        for o in periods.curve.origins
    ]
    kinds = [origin.kind for origin in periods.curve.origins]
    return {
        "known": True,
        "energy": spectra.energy,
        "constants": spectra.constants.high[:, 1:] / unit,
        "branch_points": periods.curve.branch_points / unit,
        "origins": np.char.add(kinds, np.stack(numbers, axis=1).astype("U2")),
        "actions": actions(periods) / root,
        "rotation_numbers": in_time / in_time[:, :1],
        "frequencies_tau1": stack.frequencies / root,
        "frequencies_t": in_time,
        "phases": np.mod(np.mod(stack.phases, 1.0), 1.0),
        "mean_rate": stack.mean / root[:, 0],
    }
