"""The motions and tori of many starts in doubles by the kernel's loops: in blocks of some ten
milliseconds, on all processors. No number depends on which other starts are in the arrays.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.kernel import many
from veselova.analytic.kernel.compiler import prepare
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.torus import TorusNumbers

__all__ = ["KnownTori", "States", "states_of_starts", "tori"]

Array = NDArray[np.float64]
Found = TypeVar("Found")

#: Budget: seconds of a block, starts of the first one, and of any.
_BLOCK_S, _FIRST, _MOST = 0.02, 4, 5000


@dataclass(frozen=True)
class States:
    """The states of N problems at T times, along the body axes; names as in ``Trajectory``.

    - rows: (N,) their places among all problems
    - tau1, error: (N, T)
    - q_dot: (N, T, n)
    - frame: (N, T, n, n)
    """

    rows: NDArray[np.intp]
    tau1: Array
    q_dot: Array
    frame: Array
    error: Array


@dataclass(frozen=True, kw_only=True)
class KnownTori(TorusNumbers):
    """The numbers of tori, and which of them were computed, (N,)."""

    known: NDArray[np.bool_]


def states_of_starts(
    A: Array, q: Array, q_dot: Array, times: TimeGrid, frames: Array | None = None
) -> Iterator[States]:
    """Yield the states of Veselova problems given by arrays (N, n) of doubles, exact as they stand,
    at the times of a grid, block by block, for as many of them as the loops serve; q needs no
    length, and q̇ may have a part along q.

    frames: (N, n, n) at the start, columns, NaN for the natural one; None where all are natural
    """
    prepare()
    A, q, q_dot = _arrays(A, q, q_dot)
    frames = np.full((len(A), 1, 1), np.nan) if frames is None else np.array(frames)
    doubles = np.array(times.doubles)
    n, number = A.shape[1], doubles.size

    def solve(part: slice) -> States:
        count = part.stop - part.start
        found = (
            np.empty((count, number)),
            np.empty((count, number, n)),
            np.empty((count, number, n, n)),
            np.empty((count, number)),
        )
        served = np.empty(count, np.bool_)
        starts = A[part], q[part], q_dot[part], frames[part]
        many.solve_starts(*starts, doubles, times.late, *found, served)
        rows = np.flatnonzero(served)
        if rows.size < count:
            tau1, velocity, frame, error = (x[rows] for x in found)
        else:
            tau1, velocity, frame, error = found
        tau1 *= np.sqrt(np.min(A[part][rows], axis=1, initial=math.inf))[:, None]
        return States(rows + part.start, tau1, velocity, frame, error)

    for states in _in_blocks(len(A), solve):
        if states.rows.size:
            yield states


def tori(A: Any, q: Any, q_dot: Any) -> KnownTori:
    """Return the tori of Veselova problems given by arrays (N, n) of doubles, exact as they stand.

    q needs no length, and q̇ may have a part along q. Equal A's, directions that do not move or
    start at q_i = 0, and branch points nearer than 1e-13 of the largest are not for this function.
    Digits: those of ``torus``, to 1e-14 of every number (of a cycle
    for phases), tested for n = 2…7. Where A's are orders of magnitude apart the map to phases
    cancels, here as there: over nine of them phases differ by 2e-13.
    """
    prepare()
    A, q, q_dot = _arrays(A, q, q_dot)
    blocks = list(_in_blocks(len(A), lambda part: _tori(A[part], q[part], q_dot[part])))
    blocks = blocks or [_tori(A, q, q_dot)]
    names = [entry.name for entry in fields(KnownTori)]
    parts = {name: [getattr(block, name) for block in blocks] for name in names}
    return KnownTori(**{name: np.concatenate(part) for name, part in parts.items()})


def _tori(A: Array, q: Array, q_dot: Array) -> KnownTori:
    count, n = A.shape
    g = n - 1
    labels = np.zeros((count, 2 * g + 1), np.int64)
    points, constants = np.full(labels.shape, np.nan), np.full((count, n - 2), np.nan)
    rates, means = np.full((2, count), np.nan)
    frequencies, phases, actions = np.full((3, count, g), np.nan)
    numbers = points, constants, rates, means, frequencies, phases, actions
    many.set_tori(A, q, q_dot, labels, *numbers)
    names = ["", *(f"I{i + 1}" for i in range(n)), *(f"c{k}" for k in range(g, 0, -1))]
    with np.errstate(all="ignore"):  # what is not known is no number
        unit = np.min(A, axis=1, keepdims=True)
        root = np.sqrt(unit)
        energy = np.sum(A * q * q, axis=1) / np.sum(q * q, axis=1) * (unit[:, 0] / 2)
        for i in range(n):  # (q,Aq)(dτ₁/dt)²/(2 det A), equation (4.6, printed 6.15)
            energy = energy / A[:, i]
        in_time = frequencies / means[:, None]
        return KnownTori(
            known=labels[:, 0] != 0,
            energy=energy / rates / rates,
            constants=constants / unit,
            branch_points=points / unit,
            origins=np.array(names, "U3")[labels],
            actions=actions / root,
            rotation_numbers=in_time / in_time[:, :1],
            frequencies_tau1=frequencies / root,
            frequencies_t=in_time,
            phases=np.mod(np.mod(phases, 1.0), 1.0),  # the first mod of −1e-20 is 1.0
            mean_rate=means / root[:, 0],
        )


def _arrays(*given: Any) -> Any:
    """Return arrays of doubles as the loops take them."""
    return (np.ascontiguousarray(x, dtype=np.float64) for x in given)


def _in_blocks(total: int, work: Callable[[slice], Found]) -> Iterator[Found]:
    """Yield what ``work`` gives of parts of so many starts, in their order, with a checkpoint
    between blocks, from as many threads as there are processors. Raises OverBudget.
    """

    def timed(part: slice) -> tuple[Found, float]:
        began = time.thread_time()
        found = work(part)
        return found, (time.thread_time() - began) / (part.stop - part.start)

    # a process beside others, as those of the service are, has one processor
    threads = 1 if multiprocessing.parent_process() else os.cpu_count() or 1
    size, first, ahead = _FIRST, 0, deque[Future[tuple[Found, float]]]()
    pool = ThreadPoolExecutor(threads)
    try:
        while first < total or ahead:
            checkpoint()
            while first < total and len(ahead) < 2 * threads:
                part = slice(first, min(first + size, total))
                ahead.append(pool.submit(timed, part))
                first = part.stop
            found, seconds = ahead.popleft().result()
            # by steps: the first call may have compiled
            size = max(1, min(int(_BLOCK_S / max(seconds, 1e-9)), 8 * size, _MOST))
            yield found
    finally:
        pool.shutdown(cancel_futures=True)
