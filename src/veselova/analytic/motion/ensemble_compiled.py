"""Many motions by the compiled loops of analytic.compiled: the arrays that these take, and those
that they give.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.motion.torus_stack import TorusStack, origins_of
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.times import TimeGrid

if TYPE_CHECKING:
    from veselova.analytic.compiled.rooms import Results, Times

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
    starts = np.stack([A, q, q_dot], axis=1)
    # a copy, for which no other machine code is made
    frames = _natural(len(A)) if frames is None else np.array(frames)
    fill_states = _states_of(A.shape[1] - 1, reach, limits)

    def fill(part: slice, given: Times, found: Results) -> None:
        fill_states(starts[part], frames[part], given, found)

    yield from _in_blocks(len(A), A.shape[1], times, fill)


def _natural(count: int) -> Array:
    """Return frames that say that all are natural."""
    return np.full((count, 1, 1), np.nan)


@cache
def _states_of(
    genus: int, reach: tuple[float, ...], limits: tuple[float, ...]
) -> Callable[[Array, Array, Times, Results], None]:
    """Return what fills the states of starts with their frames at times."""
    from veselova.analytic.compiled.rooms import Limits
    from veselova.analytic.compiled.starts import Reach, states_of

    return partial(states_of, _layouts(genus), Reach(*reach), Limits(*limits))


def states_by_interpolation(
    stack: TorusStack, tables: Interpolation, times: TimeGrid, limits: tuple[float, ...]
) -> Iterator[tuple[NDArray[np.intp], Results]]:
    """Yield the states of the motions of a stack that can be served, block by block, with their
    places in it; ``limits`` are the constants of ``Limits``.
    """
    from veselova.analytic.compiled.rooms import Limits, Panel
    from veselova.analytic.compiled.states import states

    motions = _motions(stack, tables.off)
    layout = _layout(stack.curve)[0]
    sizes = tables.terms, tables.highest + 1
    numbers = np.empty(tables.coefficients.shape[1])

    def fill(part: slice, given: Times, found: Results) -> None:
        own = tables.x[part], tables.scale[part]
        panel = Panel(tables.coefficients, *own, tables.modes, numbers)
        states(motions[part], panel, sizes, layout, given, Limits(*limits), found)

    yield from _in_blocks(stack.rows.size, stack.periods.genus + 1, times, fill)


def _in_blocks(
    total: int, n: int, times: TimeGrid, fill: Callable[[slice, Times, Results], None]
) -> Iterator[tuple[NDArray[np.intp], Results]]:
    """Yield the places and states of those motions that are right, block by block."""
    from veselova.analytic.compiled.rooms import Results

    given = _times(times)
    number = given.doubles.size
    size = max(1, _BLOCK // number)
    for first in range(0, total, size):
        checkpoint()
        part = slice(first, min(first + size, total))
        count = part.stop - first
        found = _results(count, number, n)
        fill(part, given, found)
        served = np.flatnonzero(found.served)
        if served.size == count:
            yield served + first, found
        elif served.size:
            yield served + first, Results(*(values[served] for values in found))


def _times(times: TimeGrid) -> Times:
    from veselova.analytic.compiled.rooms import Times

    doubles, remainders = times.doubles, times.remainders
    return Times(doubles, np.zeros(doubles.size) if remainders is None else remainders)


def _results(count: int, number: int, n: int) -> Results:
    """Return room for the states of so many motions at so many times."""
    from veselova.analytic.compiled.rooms import Results

    return Results(
        np.empty((count, number)),
        np.empty((count, number, n)),
        np.empty((count, number, n, n)),
        np.empty((count, number)),
        np.empty((count, number)),
        np.empty(count, dtype=np.bool_),
    )


def _motions(stack: TorusStack, off: float) -> Any:
    """Return the records that the loops take of the motions of a stack."""
    from veselova.analytic.compiled.rooms import motion_type

    spectra = stack.spectra
    below, above = stack.on_cuts
    fields = {
        "below": below,
        "above": above,
        "increasing": spectra.increasing,
        "base": stack.base_rounding,
        "differences": stack.curve.differences,
        "signs": stack.signs,
        "time_rate": spectra.time_rate,
        "unit": spectra.unit,
        "A": 1 / spectra.inverse.high,
        "places": np.argsort(spectra.axes, axis=1),
        "off": off,
        "rate_rounding": stack.rate_rounding,
        "phase_error": stack.phase_error,
    }
    motions = np.empty(stack.rows.size, motion_type(stack.periods.genus))
    for name, values in fields.items():
        motions[name] = values
    return motions


@cache
def _layouts(genus: int) -> Any:
    """Return the layouts of curves by the sum of 2^(s−2) over the s with c_s < I_s."""
    none = np.empty(0)
    return np.concatenate(
        [
            _layout(Curve(DOUBLE, none, none, origins_of((order >> np.arange(genus - 1)) & 1 > 0)))
            for order in range(2 ** (genus - 1))
        ]
    )


def _layout(curve: Curve) -> Any:
    """Return a layout of branch points with the ends of cuts as arrays, (1,)."""
    from veselova.analytic.compiled.attitudes import layout_type

    result = np.zeros(1, layout_type(curve.genus))
    for kind in _KINDS:
        layout, row = curve.layout(kind), result[f"of_{kind}"][0]
        for name in ("places", "sides", "beyond"):
            row[name] = getattr(layout, name)
        row["partners"][:, : layout.partners.shape[1]] = layout.partners
        row["ends"], row["mates"] = -1, -1
        for k, cut, mate in layout.ends:
            row["ends"][k], row["mates"][k] = cut, mate
    return result


#: The two kinds of branch points.
_KINDS: tuple[Literal["I", "c"], ...] = ("I", "c")
