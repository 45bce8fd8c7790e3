"""The motions of many Veselova problems at the same times, side by side: what
analytic.motion.torus_solution and its evaluators do for one, by the Fourier time map and in angles.

No number depends on which other problems are in the arrays. What is not of this kind (equal A's,
directions at rest, narrow cuts and gaps, too many modes, times at which doubles leave fewer than
six digits) is left to the solution of one problem.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.attitude.frame import STEP, Attitude
from veselova.analytic.attitude.frame_batch import attitudes
from veselova.analytic.attitude.sensitivity_sampling import BETWEEN
from veselova.analytic.compiled.compiler import ready
from veselova.analytic.motion.ensemble_compiled import states_compiled
from veselova.analytic.motion.torus_stack import (
    MOST_BINARY_DIGITS,
    NARROWEST,
    NODES_PER_WAVE,
    RATE_ROUNDING,
    SPARE_NODES,
    TorusStack,
    torus_stacks,
)
from veselova.analytic.time_map.mode_tables import ModeTables, TimeMaps
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.times import TimeGrid

__all__ = ["LIMITS", "States", "states_of_stack", "states_of_starts"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Method: largest |m_k| of the boxes of modes that are tried, by genus; who needs more is left out.
_BOXES = {1: (12, 18, 28, 42), 2: (12, 18, 28, 42)}

#: Method: numbers of nodes of an interval, and the radians that e^{2πim·z} with all |m_k| ≤ 1 then
#: turns by one of ψ, but for few tori; the fewest choices make the fewest stacks.
_NODE_COUNTS = (16, 24, 36, 64)
_PACES = (1.6, 2.6, 4.0, 7.0)

#: Budget: entries of tables formed at once, and points of motions: temporaries of a few megabytes.
_TABLE_BLOCK = 200_000
_POINT_BLOCK = 3_000

#: Calibrated: narrowest cut and gap against what is around them, and the most cancellation in the
#: Abel map.
_NARROWEST_CUT = 1e-6
_NARROWEST_GAP = 1e-4
_MOST_CANCELLATION = 10.0

#: Calibrated: a component of q' along a normal from which its sign is certain, relative to |q'|.
_CERTAIN = 1e-9

#: The constants of analytic.motion.error_bound and analytic.motion.base, in ε where they are
#: roundings: of a phase, of the start's phases, of one evaluation, and the factor of the whole.
_PHASE, _START_PHASE, _EVALUATION, _SAFETY = 4.0, 4.0, 9.0, 2.0

#: Derived: errors above this are left out: second orders would count, and one problem has guard
#: digits.
_LARGEST_ERROR = 1e-6

#: Derived: cycles of the fastest phase at which doubles leave an error of about that.
_MOST_CYCLES = 1e9


#: Method: the largest n of compiled loops.
_MOST_COMPILED = 4

#: What compiled loops take of these constants, in the order of their ``Limits`` and ``Reach``.
LIMITS = (_CERTAIN, _PHASE, _START_PHASE, _EVALUATION, _SAFETY, _LARGEST_ERROR, _MOST_CYCLES)
_REACH = (
    MOST_BINARY_DIGITS,
    NARROWEST,
    _NARROWEST_CUT,
    _NARROWEST_GAP,
    _MOST_CANCELLATION,
    RATE_ROUNDING * DOUBLE.epsilon,
    NODES_PER_WAVE,
    SPARE_NODES,
)


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


def states_of_starts(
    A: Array, q: Array, q_dot: Array, times: TimeGrid, frames: Array | None = None
) -> Iterator[States]:
    """Yield the states of Veselova problems given by arrays (N, n) of doubles, exact as they stand,
    at the times of a grid, for as many of the problems as can be served side by side.

    frames: (N, n, n) at the start, columns, NaN for the natural one; None where all are natural
    """
    if ready() and A.shape[1] <= _MOST_COMPILED:
        for places, found in states_compiled(A, q, q_dot, frames, times, _REACH, LIMITS):
            yield States(places, found.tau1, found.q_dot, found.frame, found.error)
        return
    if A.shape[1] - 1 not in _BOXES:
        return
    for stack in torus_stacks(A, q, q_dot, _NODE_COUNTS):
        vars(stack)["mean"] = stack.mean  # parts of a stack would form it anew
        for part, tables in _tables(stack):
            yield from states_of_stack(part, tables, times, frames)


def _tables(stack: TorusStack) -> Iterator[tuple[TorusStack, ModeTables]]:
    """Yield parts of a stack with their mode tables."""
    wide = _is_wide(stack)
    place = _NODE_COUNTS.index(stack.periods.longest)
    boxes = _BOXES[stack.periods.genus]
    for pace, above in ((_PACES[place], 0.0), (2 * _PACES[place], _PACES[place])):
        remaining = np.flatnonzero(wide & (stack.maps.paces > above) & (stack.maps.paces <= pace))
        for highest in boxes[min(place, len(boxes) - 2) :]:
            later = [remaining[:0]]
            for part in _blocks(remaining, stack.periods.genus, highest):
                checkpoint()
                few = stack.part(part)
                tables = few.mode_tables(pace * highest, highest)
                if tables.fits.any():
                    chosen = np.flatnonzero(tables.fits)
                    yield few.part(chosen), tables.part(chosen)
                later.append(part[~tables.fits])
            remaining = np.concatenate(later)


def _blocks(rows: NDArray[np.intp], genus: int, highest: int) -> Iterator[NDArray[np.intp]]:
    """Yield so many of the rows that the determinants of their tables stay small."""
    entries = genus * genus * (highest + 1) * (2 * highest + 1) ** (genus - 1)
    size = max(1, _TABLE_BLOCK // entries)
    for first in range(0, rows.size, size):
        yield rows[first : first + size]


def _is_wide(stack: TorusStack) -> NDArray[np.bool_]:
    """Return which tori have neither narrow cuts nor gaps, nor much cancellation, (N,)."""
    widths = np.diagonal(stack.curve.differences, 1, 1, 2)
    around = np.pad(widths, ((0, 0), (1, 1)), constant_values=np.inf)
    shares = widths / (widths + np.minimum(around[:, :-2], around[:, 2:]))
    # b_0 = 0 is never met
    least = np.where(np.arange(widths.shape[1]) % 2 == 1, _NARROWEST_CUT, _NARROWEST_GAP)
    largest = np.max(stack.periods.cancellation, axis=1)
    return np.asarray(np.all(shares > least, axis=1) & (largest < _MOST_CANCELLATION))


def states_of_stack(
    stack: TorusStack, tables: ModeTables, times: TimeGrid, frames: Array | None
) -> Iterator[States]:
    """Yield the states at the times of a grid of those problems of a stack that can be served."""
    maps = TimeMaps(tables, stack.phases, stack.frequencies, stack.mean)
    cycles = maps.fastest / maps.mean * np.max(np.abs(times.doubles))
    rows = np.flatnonzero(~maps.has_slow_modes & (cycles < _MOST_CYCLES))
    size = max(1, _POINT_BLOCK // times.doubles.size)
    for first in range(0, rows.size, size):
        checkpoint()
        part = rows[first : first + size]
        small = _Motions(stack.part(part), maps.part(part), frames)
        found, served = small.at(times)
        if served.all():
            yield found
        elif served.any():
            yield States(*(getattr(found, name)[served] for name in States.__annotations__))


@dataclass(frozen=True)
class _Motions:
    """N motions of one stack."""

    stack: TorusStack
    maps: TimeMaps
    frames: Array | None

    @cached_property
    def _at_start(self) -> Attitude:
        return self._attitudes(self.stack.angles[:, None])

    def _attitudes(self, psi: Array) -> Attitude:
        stack = self.stack
        return attitudes(stack.curve, stack.periods.cuts, stack.signs, psi)

    @cached_property
    def _is_natural(self) -> NDArray[np.bool_]:
        if self.frames is None:
            return np.ones(self.stack.rows.size, dtype=bool)
        return np.asarray(np.isnan(self.frames[self.stack.rows, 0, 0]))

    @cached_property
    def is_certain(self) -> NDArray[np.bool_]:
        """Return whose natural frame has signs that rounding leaves no doubt of, (N,)."""
        sizes = np.abs(self._at_start.components)
        known = np.min(sizes, axis=1) > _CERTAIN * np.max(sizes, axis=1)
        return np.asarray(known | ~self._is_natural)

    @cached_property
    def _rotation(self) -> Array:
        """Return ℜ of (orth, printed 7.6): e_2 … e_n = (n_2 … γ)(t) ℜ, (N, g, g)."""
        start = self._at_start
        genus = self.stack.periods.genus
        signs = np.where(start.components < 0, -1.0, 1.0)
        along = np.concatenate([start.q[:, :, None], start.normals * signs[:, None]], axis=2)
        to_body = np.argsort(self.stack.spectra.axes, axis=1)
        in_body = np.take_along_axis(along, to_body[:, :, None], axis=1)
        signs[:, 0] *= np.where(np.linalg.det(in_body) < 0, -1.0, 1.0)
        result = signs[:, None] * np.eye(genus)
        if self.frames is None or self._is_natural.all():
            return np.asarray(result)
        frames = self.frames[self.stack.rows]
        sorted_ = np.take_along_axis(frames, self.stack.spectra.axes[:, :, None], axis=1)
        given = np.swapaxes(start.normals, 1, 2) @ sorted_[:, :, 1:]
        return np.where(self._is_natural[:, None, None], result, given)

    def at(self, grid: TimeGrid) -> tuple[States, NDArray[np.bool_]]:
        """Return the states at times (T,), and which problems they are right for, (N,)."""
        stack = self.stack
        times = grid.doubles
        tau1, z, slopes, converged = self.maps.tau1(times, grid.remainders)
        psi, inverted = stack.maps.invert(z)
        served = converged & inverted & self.is_certain
        count, number, genus = psi.shape
        inverses = np.linalg.inv(stack.maps.slopes(psi))  # ∂ψ/∂z
        steps = STEP / np.maximum(1.0, np.max(np.abs(inverses), axis=2))  # (N, T, g)
        shifted = psi[:, None] + np.moveaxis(inverses * steps[:, :, None], 3, 1)
        ends = np.concatenate([psi[:, None], shifted], axis=1).reshape(count, -1, genus)
        at = self._attitudes(ends)
        entries = np.concatenate([at.q[:, :, None], at.normals], axis=2)
        entries = entries.reshape(count, 1 + genus, number, -1)
        quotients = np.moveaxis(entries[:, 1:] - entries[:, :1], 1, 3) / steps[:, :, None]
        error = self._error(times, tau1, slopes, BETWEEN * quotients)
        served &= np.max(error, axis=1) < _LARGEST_ERROR  # no number is not less
        frame = entries[:, 0].reshape(count, number, genus + 1, genus + 1).copy()
        first = at.components.reshape(count, 1 + genus, number, genus)[:, 0]
        rate = self._time_rate(frame[..., 0])
        q_dot = (frame[..., 1:] @ (first * rate[..., None])[..., None])[..., 0]
        frame[..., 1:] = frame[..., 1:] @ self._rotation[:, None]
        axes = np.argsort(stack.spectra.axes, axis=1)
        found = States(
            stack.rows,
            tau1 * np.sqrt(stack.spectra.unit)[:, None],
            np.take_along_axis(q_dot, axes[:, None], axis=2),
            np.take_along_axis(frame, axes[:, None, :, None], axis=2),
            error,
        )
        return found, served

    def _time_rate(self, q: Array) -> Array:
        """Return dτ₁/dt at positions (N, T, n), (N, T): from (q,Aq), relative to itself."""
        spectra = self.stack.spectra
        A = 1 / spectra.inverse.high
        at_start = np.sum(A * self._at_start.q**2, axis=1)
        ratio = at_start[:, None] / np.sum(A[:, None] * q * q, axis=2)
        return np.asarray(spectra.time_rate[:, None] * np.sqrt(ratio))

    def _error(self, times: Array, tau1: Array, slopes: Array, quotients: Array) -> Array:
        """Return the bound at each time, (N, T), as analytic.motion.error_bound makes it of the
        sensitivities at the times; quotients are those of the frame, (N, T, n², g).
        """
        maps = self.maps
        rounding = self.stack.rate_rounding[:, None]
        frequencies = np.abs(maps.frequencies)
        of_map, drift = maps.error(
            np.max(np.abs(tau1), axis=1),
            _START_PHASE * _EPSILON + self.stack.start_rounding,
            rounding * frequencies,
        )
        lag = np.abs(times) / maps.mean[:, None] * (rounding + drift[:, None])
        lag += of_map[:, None]
        with np.errstate(divide="ignore"):
            lag *= np.maximum(1.0, 1 / slopes)
        sizes = np.abs(quotients)
        along = np.max(np.abs(quotients @ maps.frequencies[:, None, :, None]), axis=(2, 3))
        by_rates = np.max(sizes @ frequencies[:, None, :, None], axis=(2, 3))
        together = np.max(np.sqrt(np.sum(quotients * quotients, axis=3)), axis=2)
        result = lag * along + rounding * np.abs(tau1) * by_rates
        evaluation = max(_EVALUATION, 3.0 * quotients.shape[3] + 3.0)
        result += (_PHASE * _EPSILON + 2 * self.stack.phase_error[:, None]) * together
        result += evaluation * _EPSILON
        return np.asarray(_SAFETY * result)
