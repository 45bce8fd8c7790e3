"""Many motions by the compiled loops of analytic.compiled: the arrays that these take, and those
that they give.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.motion.torus_stack import TorusStack, origins_of
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.times import TimeGrid

if TYPE_CHECKING:
    from veselova.analytic.compiled.states import Motions, Places, Results, Times

__all__ = ["Interpolation", "states_by_interpolation", "states_compiled"]

Array = NDArray[np.float64]

#: Budget: states that are computed between two looks at the clock: some ten milliseconds.
_BLOCK = 1_000


@dataclass(frozen=True)
class Interpolation:
    """The tables of motions as values of interpolants; names as in ``Panel`` of the loops.

    - terms: of the angle series; highest: of the box of modes
    - off: by how much each mode is off
    """

    coefficients: Array
    x: Array
    scale: Array
    modes: NDArray[np.intp]
    terms: int
    highest: int
    off: float


def states_compiled(
    A: Array,
    q: Array,
    q_dot: Array,
    frames: Array | None,
    times: TimeGrid,
    reach: tuple[float, ...],
    limits: tuple[float, ...],
) -> Iterator[tuple[NDArray[np.intp], Results]]:
    """Yield the states of starts that can be served, block by block, with their places among all;
    arguments as ``states_of_starts`` has them; ``reach`` and ``limits`` are the constants of
    ``Reach`` and ``Limits``.
    """
    from veselova.analytic.compiled.starts import Reach, Starts, states_of
    from veselova.analytic.compiled.states import Limits

    axes = np.argsort(-A, axis=1, kind="stable")
    rows = np.arange(len(A))[:, None]
    A, q, q_dot = (x[rows, axes] for x in (A, q, q_dot))
    sorted_ = np.full((len(A), 1, 1), np.nan) if frames is None else frames[rows, axes]
    arrays = A, q, q_dot, np.argsort(axes, axis=1), sorted_
    layouts = _layouts(A.shape[1] - 1)

    def fill(part: slice, given: Times, found: Results) -> None:
        starts = Starts(*(np.ascontiguousarray(x[part]) for x in arrays), *layouts)
        states_of(starts, given, Reach(*reach), Limits(*limits), found)

    yield from _in_blocks(len(A), A.shape[1], times, fill)


def states_by_interpolation(
    stack: TorusStack, tables: Interpolation, times: TimeGrid, limits: tuple[float, ...]
) -> Iterator[tuple[NDArray[np.intp], Results]]:
    """Yield the states of the motions of a stack that can be served, block by block, with their
    places in it; ``limits`` are the constants of ``Limits``.
    """
    from veselova.analytic.compiled.states import Limits, states

    motions = _motions(stack, tables)

    def fill(part: slice, given: Times, found: Results) -> None:
        states(_part(motions, part), given, Limits(*limits), found)

    yield from _in_blocks(stack.rows.size, stack.periods.genus + 1, times, fill)


def _in_blocks(
    total: int, n: int, times: TimeGrid, fill: Callable[[slice, Times, Results], None]
) -> Iterator[tuple[NDArray[np.intp], Results]]:
    """Yield the places and states of those motions that are right, block by block."""
    from veselova.analytic.compiled.states import Results, Times

    doubles = times.doubles
    remainders = np.zeros_like(doubles) if times.remainders is None else times.remainders
    number = doubles.size
    size = max(1, _BLOCK // number)
    for first in range(0, total, size):
        checkpoint()
        part = slice(first, min(first + size, total))
        count = part.stop - first
        found = Results(
            np.empty((count, number)),
            np.empty((count, number, n)),
            np.empty((count, number, n, n)),
            np.empty((count, number)),
            np.empty((count, number)),
            np.empty(count, dtype=np.bool_),
        )
        fill(part, Times(doubles, remainders), found)
        served = np.flatnonzero(found.served)
        if served.size == count:
            yield served + first, found
        elif served.size:
            yield served + first, Results(*(values[served] for values in found))


def _part(given: Motions, part: slice) -> Motions:
    """Return some of the motions."""
    from veselova.analytic.compiled.states import Panel

    panel = given.panel
    arrays = {
        name: values if name in _SHARED else values[part]
        for name, values in given._asdict().items()
        if name != "panel"
    }
    panel = Panel(panel.coefficients, panel.x[part], panel.scale[part], panel.modes)
    return given._replace(**arrays, panel=panel)


#: What motions have in common: layouts, and the tables of one of them at a time.
_SHARED = ("of_I", "of_c", "series", "values", "frequencies", "mean")


def _motions(stack: TorusStack, tables: Interpolation) -> Motions:
    """Return what the loops take of the motions of a stack."""
    from veselova.analytic.compiled.states import Motions, Panel

    spectra = stack.spectra
    count = stack.rows.size
    rows = tables.highest + 1
    arrays = (
        *stack.on_cuts,
        spectra.increasing,
        stack.base_rounding,
        stack.curve.differences,
        stack.signs,
        spectra.time_rate,
        spectra.unit,
        1 / spectra.inverse.high,
        np.argsort(spectra.axes, axis=1),
        np.full((count, 1, 1), np.nan),
        np.empty((2, 2, tables.terms)),
        np.zeros((rows, 2 * rows - 1)),
        np.full(count, tables.off),
        np.empty(2),
        np.empty(1),
        stack.rate_rounding,
        stack.phase_error,
    )
    contiguous = [np.ascontiguousarray(array) for array in arrays]
    panel = Panel(tables.coefficients, tables.x, tables.scale, tables.modes)
    return Motions._make([*(_places(stack.curve, kind) for kind in _KINDS), *contiguous, panel])


#: The two kinds of branch points.
_KINDS: tuple[Literal["I", "c"], ...] = ("I", "c")


@cache
def _layouts(genus: int) -> tuple[tuple[Places, Places], ...]:
    """Return the layouts of I's and of c's, each of curves with c_2 > I_2 and with c_2 < I_2."""
    none = np.empty(0)
    curves = [
        Curve(DOUBLE, none, none, origins_of(np.full(genus - 1, lower))) for lower in (False, True)
    ]
    return tuple((_places(curves[0], kind), _places(curves[1], kind)) for kind in _KINDS)


def _places(curve: Curve, kind: Literal["I", "c"]) -> Places:
    """Return a layout with the ends of cuts as arrays."""
    from veselova.analytic.compiled.attitudes import Places

    layout = curve.layout(kind)
    ends = np.full((2, layout.places.size), -1)
    for k, cut, mate in layout.ends:
        ends[:, k] = cut, mate
    arrays = layout.places, layout.sides, layout.beyond, layout.partners, *ends
    return Places(*(np.array(array, dtype=np.int64) for array in arrays))
