"""Many motions of one stack by the compiled loops of analytic.compiled: the arrays that these take,
and those that they give.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.motion.torus_stack import TorusStack
from veselova.analytic.time_map.mode_tables import ModeTables
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.times import TimeGrid

if TYPE_CHECKING:
    from veselova.analytic.compiled.states import Limits, Motions, Places, Results

__all__ = ["Interpolation", "compiled_states"]

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


def compiled_states(
    stack: TorusStack,
    tables: ModeTables | Interpolation,
    times: TimeGrid,
    frames: Array | None,
    limits: tuple[float, ...],
) -> Iterator[tuple[NDArray[np.intp], Results]]:
    """Yield the states of the motions of a stack that can be served, block by block, with their
    places in it; ``limits`` are the constants of ``Limits``.
    """
    from veselova.analytic.compiled.states import Limits, Results, Times, states

    constants: Limits = Limits(*limits)
    doubles = times.doubles
    remainders = np.zeros_like(doubles) if times.remainders is None else times.remainders
    given = _motions(stack, tables, frames)
    number = doubles.size
    size = max(1, _BLOCK // number)
    for first in range(0, stack.rows.size, size):
        checkpoint()
        part = slice(first, min(first + size, stack.rows.size))
        count, n = part.stop - first, stack.periods.genus + 1
        found = Results(
            np.empty((count, number)),
            np.empty((count, number, n)),
            np.empty((count, number, n, n)),
            np.empty((count, number)),
            np.empty((count, number)),
            np.empty(count, dtype=np.bool_),
        )
        states(_part(given, part), Times(doubles, remainders), constants, found)
        served = np.flatnonzero(found.served)
        if served.size == count:
            yield served + first, found
        elif served.size:
            yield served + first, Results(*(values[served] for values in found))


def _part(given: Motions, part: slice) -> Motions:
    """Return some of the motions."""
    from veselova.analytic.compiled.states import Panel

    panel = given.panel
    of_panel = panel._fields if panel.modes.size else ()
    shared = ("of_I", "of_c", *(_TABLES if of_panel else ()))
    arrays = {
        name: values if name in shared else values[part]
        for name, values in given._asdict().items()
        if name != "panel"
    }
    if of_panel:
        panel = Panel(panel.coefficients, panel.x[part], panel.scale[part], panel.modes)
    return given._replace(**arrays, panel=panel)


#: The arrays of motions that are room for one where tables are interpolated.
_TABLES = ("series", "values", "frequencies", "mean")


def _motions(
    stack: TorusStack, tables: ModeTables | Interpolation, frames: Array | None
) -> Motions:
    """Return what the loops take of the motions of a stack."""
    from veselova.analytic.compiled.states import Motions, Panel

    spectra = stack.spectra
    count, genus = stack.rows.size, stack.periods.genus
    if frames is None:
        sorted_ = np.full((count, 1, 1), np.nan)
    else:
        sorted_ = np.take_along_axis(frames[stack.rows], spectra.axes[:, :, None], axis=1)
    rows = tables.highest + 1
    columns = 2 * rows - 1 if genus == 2 else 1
    below, above = stack.on_cuts
    if isinstance(tables, Interpolation):
        series = np.empty((1, 2, 2, tables.terms))
        values, off = np.zeros((1, rows, columns)), np.full(count, tables.off)
        frequencies, mean = np.empty((1, 2)), np.empty(1)
        panel = Panel(tables.coefficients, tables.x, tables.scale, tables.modes)
    else:
        series, off = stack.periods.angle_series, tables.off
        values = tables.values.reshape(count, rows, columns)
        frequencies, mean = stack.frequencies, stack.mean
        none = np.empty(0)
        panel = Panel(np.empty((0, 0)), none, none, np.empty(0, dtype=np.intp))
    arrays = (
        below,
        above,
        spectra.increasing,
        stack.base_rounding,
        stack.curve.differences,
        stack.signs,
        spectra.time_rate,
        spectra.unit,
        1 / spectra.inverse.high,
        np.argsort(spectra.axes, axis=1),
        sorted_,
        series,
        values,
        off,
        frequencies,
        mean,
        stack.rate_rounding,
        stack.phase_error,
    )
    contiguous = [np.ascontiguousarray(array) for array in arrays]
    return Motions._make([_places(stack, "I"), _places(stack, "c"), *contiguous, panel])


def _places(stack: TorusStack, kind: Literal["I", "c"]) -> Places:
    """Return a layout with the ends of cuts as arrays."""
    from veselova.analytic.compiled.attitudes import Places

    layout = stack.curve.layout(kind)
    ends = np.full((2, layout.places.size), -1)
    for k, cut, mate in layout.ends:
        ends[:, k] = cut, mate
    arrays = layout.places, layout.sides, layout.beyond, layout.partners, *ends
    return Places(*(np.array(array, dtype=np.int64) for array in arrays))
