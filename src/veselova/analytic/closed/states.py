"""States of one motion at times by the kernel: along panels or from Fourier modes, one by one or by
series of states.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.kernel import coefficients as kernel_coefficients
from veselova.analytic.kernel import dense as kernel_dense
from veselova.analytic.kernel import frame as kernel_frame
from veselova.analytic.kernel import modes as kernel_modes
from veselova.analytic.kernel import panels as kernel_panels
from veselova.analytic.kernel.rate import ARC
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["Found", "Modes", "OrbitFiller", "Plan", "StateFiller", "States", "blocks"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Budget: cycles of the fastest phase to which panels go where nothing else serves.
MOST_CYCLES_ON_PANELS = 5e4

#: Method: cycles after which a walk begins anew from Fourier modes.
ANEW = 16.0

#: Calibrated: the error of a state by series in what they leave out, and in ε.
BY_SERIES, SUM_ROUNDING = 8.0, 4.0

_OF_MODES = ("sway", "blur")

#: Method: modes that are looked at for slow ones, those of the largest amplitudes.
_SLOWEST = 32

#: Budget: panels, times, terms of modes and times by series between two checkpoints.
PANELS_AT_ONCE, TIMES_AT_ONCE, TERMS_AT_ONCE, SERIES_AT_ONCE = 100, 2000, 4_000_000, 50_000


class States(NamedTuple):
    """States at T times along the principal axes.

    - tau1: (T,) in units of the kernel; frames: (T, n, n)
    - velocities: (T, n), in the problem's time
    - errors: (2, T) of the frame and of X; size: panels or modes
    - psi: (T, g) modulo 4π, of a place nearby where series have the states
    - paths, errors_of_paths: (K, T) integrals, of (q',n_k) and of the odd part of dt/dτ₁
    """

    tau1: Array
    frames: Array
    velocities: Array
    errors: Array
    size: int
    psi: Array
    paths: Array
    errors_of_paths: Array


class Modes(NamedTuple):
    """Fourier modes of the rate, of its odd part, and of the components (q',n_k) of a path."""

    rate: Any
    odd: Any
    components: list[Any]

    @property
    def all(self) -> list[Any]:
        """Return all of them."""
        return [self.rate, self.odd, *self.components]

    @property
    def serve(self) -> bool:
        """Return whether they suffice, and none is near a resonance."""
        return not any(x.reach[0] < 0 for x in self.all)

    @property
    def blur(self) -> float:
        """Return the error that the modes of the time map leave in t."""
        return _EPSILON * float(self.rate.blur[0] + self.odd.blur[0])


class Plan(NamedTuple):
    """The time map: its name, Fourier modes, None for panels, and whether Ω has guard digits; where
    times lie densely, and whether all of them do; modes of the rate, some of which are slow, None
    where panels have none to fear.
    """

    name: str
    modes: Modes | None
    exact: bool
    runs: list[slice]
    dense: bool
    slow: Any = None


@dataclass(frozen=True)
class OrbitFiller:
    """What fills in τ₁, ψ and integrals along an orbit: their number, the kernel's torus, room."""

    paths: int
    torus: Any
    room: Any

    def along_panels(self, found: Found, most: float = math.inf) -> int:
        """Fill them by panels; return how many, −1 where they do not serve, or are more than
        ``most`` one way.
        """
        size, places = 0, np.arange(found.times.size)
        for direction, part in found.ways:
            order, reached = places[part][::direction].copy(), 0
            walk = kernel_panels.make_walk(self.torus, direction, self.paths)
            while reached < order.size:
                checkpoint("time map")
                reached = kernel_panels.follow(
                    *(self.torus, walk, found.times, order, reached, PANELS_AT_ONCE),
                    *(found.tau1, found.psi, found.off, found.path, self.room),
                )
                if reached < 0 or walk.lost[kernel_panels.PANELS] > most:
                    return -1
            size += int(walk.lost[kernel_panels.PANELS])
        return size

    def jump_to(self, found: Found, part: slice, modes: Modes) -> bool:
        """Fill τ₁, ψ and the integrals at times from Fourier modes; return whether they serve."""
        torus, times, tau1, psi = self.torus, found.times[part], found.tau1[part], found.psi[part]
        z = np.empty((times.size if modes.components else 0, psi.shape[1]))
        if kernel_modes.jump(torus, modes.rate, modes.odd, times, tau1, psi, z, self.room):
            return False
        for k, component in enumerate(modes.components):
            kernel_modes.set_integrals(component, z, found.path[k, part])
        if self.paths > len(modes.components):
            kernel_modes.set_integrals(modes.odd, z, found.path[-1, part])
        return True


@dataclass(frozen=True)
class StateFiller(OrbitFiller):
    """What fills in states.

    - fastest: cycles of the fastest phase in a unit of time
    - semiaxes: (n,) √A; directions, turn: of ``set_entries``
    - frozen: (n, n−1) what stays of e_2 … e_n, None for nothing
    """

    fastest: float
    semiaxes: Array
    directions: Array
    turn: Array
    frozen: Array | None

    def at(self, times: Array, plan: Plan, late: Array) -> States:
        """Return the states at increasing times, one by one where series do not serve, on panels
        where modes do not; ``late``: (T,) what times are off by. Raises Unsolved (``narrow-gap``).
        """
        found = Found.make(times, self.torus.z.size, self.semiaxes.size, self.paths)
        size = self._follow(found, plan) if plan.modes is None else self._jump(found, plan)
        if size < 0:
            if plan.dense or plan.runs:
                return self.at(times, plan._replace(runs=[], dense=False), late)
            if plan.name != "fourier":
                raise Unsolved("narrow-gap", "angles in doubles do not resolve the orbit")
            slow = None if plan.modes is None else plan.modes.rate
            if self.fastest * float(np.max(np.abs(times))) > MOST_CYCLES_ON_PANELS:
                raise Unsolved("too-far", "Fourier modes do not lead to these times")
            return self.at(times, Plan("panels", None, False, [], False, slow), late)
        found.off[:] += late
        if plan.slow is not None:
            found.off[:] += self._of_slow_modes(plan.slow, found.tau1)
        errors = np.empty((4, times.size))
        anew = found.since, found.advance
        since, advance = anew if plan.exact else (found.times, found.tau1)
        kernel_frame.set_errors(
            self.torus, since, advance, found.psi, found.off, False, self.room, errors
        )
        if found.left_out:
            self._add_errors_of_series(found, errors)
        off = np.empty((0, times.size))
        if self.paths:
            off = self._errors_of_paths(found, plan, errors[2], errors[3])
        states = found.tau1, found.frames, found.velocities
        return States(*states, errors[:2], size, found.psi, found.path, off)

    def _errors_of_paths(self, found: Found, plan: Plan, of_tau1: Array, of_phases: Array) -> Array:
        """Return the errors of the integrals (K, T): along the orbit, of phases on the panels since
        the place where modes are known, and of these.
        """
        peaks = np.empty(self.paths)
        kernel_coefficients.set_peaks(self.torus, peaks)
        errors = peaks[:, None] * (of_tau1 + np.abs(found.walked) * of_phases)
        if plan.modes is not None:
            loose = 0.0 if plan.exact else kernel_frame.FLOW * self._fastest_in_tau1
            factor = kernel_frame.PHASE + loose * np.abs(found.tau1)
            factor = np.max(self.torus.cancellation) * factor
            modes = [*plan.modes.components, plan.modes.odd][: self.paths]
            sway, blur = (np.array([getattr(x, name)[0] for x in modes]) for name in _OF_MODES)
            errors += _EPSILON * (sway[:, None] * factor + kernel_frame.MAP * blur[:, None])
        return np.asarray(errors)

    def _of_slow_modes(self, modes: Any, tau1: Array) -> Array:
        """Return the errors of the time from those of phases, (T,): near a resonance some m·z
        hardly changes, and its part of dt/dτ₁ keeps its sign.
        """
        sizes, slopes = np.abs(modes.amplitudes), np.abs(modes.slopes)
        squares = np.zeros(tau1.size)
        for k in np.argsort(-sizes)[:_SLOWEST].tolist():
            squares += np.minimum(sizes[k], slopes[k] * np.abs(tau1)) ** 2
        factor = kernel_frame.PHASE + kernel_frame.FLOW * np.abs(tau1) * self._fastest_in_tau1
        swayed = 2 * np.pi * float(np.max(modes.sides)) * np.max(self.torus.cancellation) * factor
        return np.asarray(_EPSILON * swayed * np.sqrt(squares))

    @cached_property
    def _fastest_in_tau1(self) -> float:
        return float(np.max(np.abs(self.torus.frequencies)))

    def _add_errors_of_series(self, found: Found, errors: Array) -> None:
        """Add what series of states leave out: X of a geodesic has it relative to √(q,Aq)."""
        error = BY_SERIES * max(found.left_out) + SUM_ROUNDING * _EPSILON
        errors[0] += error
        if self.torus.time[0] == ARC:
            relative = found.frames[:, :, 0] * (self.semiaxes / np.max(self.semiaxes))
            errors[1] += error / np.sqrt(np.sum(relative * relative, axis=1))

    def _one_by_one(self, found: Found, part: slice) -> None:
        """Fill states at times whose ψ are known."""
        m, psi = self.directions.shape[1], found.psi[part]
        order, identity = np.arange(m), np.eye(self.torus.z.size)
        for few in blocks(psi.shape[0], TIMES_AT_ONCE):
            count = psi[few].shape[0]
            frames, velocities = np.empty((count, m, m)), np.empty((count, m))
            kernel_frame.set_frames(
                self.torus, psi[few], order, identity, frames, velocities, self.room
            )
            frames, velocities = self.to_principal_axes(frames, velocities)
            found.frames[part][few], found.velocities[part][few] = frames, velocities

    def to_principal_axes(self, frames: Array, velocities: Array) -> tuple[Array, Array]:
        """Return frames and velocities along the principal axes, from those along what moves."""
        directions, n = self.directions, self.semiaxes.size
        count, m = velocities.shape
        found = np.empty((count, n, n))
        found[:, :, 0] = frames[:, :, 0] @ directions.T
        rotated = np.ascontiguousarray(frames[:, :, 1:]).reshape(-1, m - 1) @ self.turn
        found[:, :, 1:] = directions @ rotated.reshape(count, m, n - 1)
        if self.frozen is not None:
            found[:, :, 1:] += self.frozen
        return found, velocities @ directions.T

    def _follow(self, found: Found, plan: Plan) -> int:
        """Fill the states by panels; return how many, −1 where they do not serve."""
        farthest = float(np.max(np.abs(found.times), initial=0.0))
        most = kernel_panels.most_panels(self.fastest * farthest)
        size = 0 if plan.dense else self.along_panels(found, most)
        if not plan.dense and size >= 0:
            self._one_by_one(found, slice(found.times.size))
        for direction, part in found.ways if plan.dense else ():
            walk = self._dense_walk(direction)
            if not self._follow_densely(found, walk, part, most):
                return -1
            size += int(walk.lost[kernel_panels.PANELS])
        found.walked[:] = found.tau1
        return size

    def _dense_walk(self, direction: int) -> Any:
        """Return a walk with series of states along the principal axes."""
        directions, n = self.directions, self.semiaxes.size
        rest = np.zeros((n, n - 1)) if self.frozen is None else self.frozen
        where = (np.ascontiguousarray(x) for x in (directions, self.turn, rest))
        return kernel_panels.make_dense_walk(self.torus, direction, self.paths, *where)

    def _follow_densely(self, found: Found, walk: Any, part: slice, most: float) -> bool:
        """Fill the states by series on panels; return whether these serve."""
        low, high, _ = part.indices(found.times.size)
        forward = walk.left[kernel_panels.NEXT] > 0
        before = walk.lost[kernel_panels.PANELS]
        total = found.times.size
        while low < high:
            checkpoint("motion", low if forward else total - high, total)
            first = low if forward else max(low, high - SERIES_AT_ONCE)
            last = min(high, low + SERIES_AT_ONCE) if forward else high
            a, b = kernel_dense.follow_densely(
                *(self.torus, walk, found.times, first, last, PANELS_AT_ONCE),
                *(found.states, found.psi, found.off, found.path, self.room),
            )
            if a < 0 or walk.lost[kernel_panels.PANELS] - before > most:
                return False
            low, high = (a, high) if forward else (low, b)
        found.left_out.append(float(walk.lost[kernel_panels.STATES]))
        return True

    def _jump(self, found: Found, plan: Plan) -> int:
        """Fill the states from Fourier modes; return how many, −1 where they do not serve."""
        modes = plan.modes
        assert modes is not None
        size = sum(x.amplitudes.size for x in modes.all)
        at_once = min(TIMES_AT_ONCE, 1 + TERMS_AT_ONCE // (1 + size))
        walk = self._dense_walk(1) if plan.runs else None
        end, reached = found.times.size, 0
        for run in (*plan.runs, slice(end, end)):
            sparse = slice(reached, run.start)
            for few in blocks(run.start - reached, at_once):
                part = slice(reached + few.start, min(reached + few.stop, run.start))
                if not self.jump_to(found, part, modes):
                    return -1
            self._one_by_one(found, sparse)
            found.off[sparse] = modes.blur
            if run.start < end and not self._begin_anew(found, walk, run, modes):
                return -1
            reached = run.stop
        return int(size)

    def _begin_anew(self, found: Found, walk: Any, run: slice, modes: Modes) -> bool:
        """Fill the states of a run by a walk from its first time; return whether it serves."""
        first = slice(run.start, run.start + 1)
        if not self.jump_to(found, first, modes):
            return False
        begin, at = float(found.times[run.start]), float(found.tau1[run.start])
        path = found.path[:, run.start].copy()
        kernel_dense.begin(walk, at, begin, self.room.target, found.psi[run.start], path)
        if not self._follow_densely(found, walk, run, kernel_panels.most_panels(ANEW)):
            return False
        found.off[run] += modes.blur
        found.walked[run] = found.tau1[run] - at
        found.since[run] = found.times[run] - begin
        found.advance[run] = found.tau1[run] - at
        return True


class Found(NamedTuple):
    """States at increasing times while they are filled in, the entries by long rows.

    - states: (1 + n + n², T), and its parts: tau1 (T,), velocities (T, n), frames (T, n, n)
    - psi: (T, g), off: (T,) what the time map leaves in t
    - path: (K, T) integrals; walked: (T,) τ₁ since panels began
    - since, advance: (T,) t and τ₁ since the place that is known with guard digits, if any is
    - left_out: of series of states
    """

    times: Array
    states: Array
    tau1: Array
    velocities: Array
    frames: Array
    psi: Array
    off: Array
    path: Array
    walked: Array
    since: Array
    advance: Array
    left_out: list[float]

    @property
    def ways(self) -> list[tuple[int, slice]]:
        """Return the directions away from zero in which times lie, and which these are."""
        first, count = int(np.searchsorted(self.times, 0.0)), self.times.size
        return [(1, slice(first, count))] * (first < count) + [(-1, slice(first))] * (first > 0)

    @classmethod
    def make(cls, times: Array, genus: int, n: int, paths: int) -> Found:
        """Return room for the states."""
        count = times.size
        states, psi = np.empty((1 + n + n * n, count)), np.empty((count, genus))
        frames = states[1 + n :].reshape(n, n, count).transpose(2, 0, 1)
        parts = states[0], states[1 : 1 + n].T, frames
        off, walked, since, advance = np.zeros((4, count))
        path = np.zeros((paths, count))
        # a writable copy of the times: the kernel is compiled once
        return cls(np.array(times), states, *parts, psi, off, path, walked, since, advance, [])


def blocks(count: int, at_once: int) -> Iterator[slice]:
    """Yield parts of so many times, with a checkpoint before each."""
    for first in range(0, count, at_once):
        checkpoint("motion", first, count)
        yield slice(first, first + at_once)
