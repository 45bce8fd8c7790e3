"""One motion on a torus by the kernel: from a problem to its series at times, with their error.

What does not depend on times is kept: the torus, its modes, the walks along the orbit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.closed.spectrum import Start, exact_start, to_doubles
from veselova.analytic.kernel import error as kernel_error
from veselova.analytic.kernel import modes as kernel_modes
from veselova.analytic.kernel import motion as kernel_frames
from veselova.analytic.kernel import panels as kernel_panels
from veselova.analytic.kernel import rate as kernel_rate
from veselova.analytic.kernel import series as kernel_series
from veselova.analytic.kernel import start as kernel_start
from veselova.analytic.kernel import torus as kernel_torus
from veselova.analytic.kernel import windows as kernel_windows
from veselova.analytic.kernel.over import over_arb
from veselova.analytic.spectrum.moving_part import Moving, moving_part
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.systems.ellipsoid import EllipsoidGeodesic
from veselova.mechanics.systems.neumann import NeumannSystem
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova import Veselova

__all__ = ["KernelMotion", "States", "kernel_motion"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Calibrated: cycles of the fastest phase beyond which Fourier modes serve, by genus; panels else.
FAR = {1: 4.0, 2: 6.0, 3: 120.0}

#: Budget: largest |m_k| and number of modes, by genus.
SIDES, MOST_MODES = {1: 64, 2: 48, 3: 20}, {1: 64, 2: 4000, 3: 16000}

#: Derived: cycles beyond which Ω = f/F_0 is computed in balls of so many digits, and those beyond
#: which they leave no digit of a phase.
GUARDED, GUARD_DIGITS, MOST_CYCLES = 200.0, 40, 1e12

#: Budget: panels of one walk, and panels and times between two checkpoints.
MOST_PANELS, PANELS_AT_ONCE, TIMES_AT_ONCE = 200_000, 200, 2000

#: Budget: times from which windows are thought of, the cycles of the fastest phase in one, and how
#: many times more than nodes there are for them to pay; halvings of windows that do not settle.
MANY, CYCLES_IN_WINDOW, PAYS, MOST_HALVINGS = 10_000, 0.7, 3, 8

#: Calibrated: size of the last coefficients of a window in ε, and what they leave out of its sums.
RESOLVED, TRUNCATION = 64.0, 4.0

#: A rotation this near to a matrix of signs, in every entry and per dimension, is one.
SIGN_ROUNDING = 32 * _EPSILON

#: Calibrated: rounding of the principal axes, and of each term of a scalar product, in ε.
AXES_ROUNDING = 8.0

#: Derived: the narrowest cut or gap whose products with others are doubles.
NARROWEST = 1e-140

_TIMES = {"t": kernel_rate.PHYSICAL, "s": kernel_rate.ARC, "tau1": kernel_rate.NEUMANN}

#: The systems that the kernel serves. The others have a direction of flow or a path of their own.
_SERVED = (Veselova, NeumannSystem, EllipsoidGeodesic)


def kernel_motion(problem: TorusProblem) -> KernelMotion | None:
    """Return the motion of a problem that moves; None for a kind of start that the kernel does not
    serve: a separatrix, or one direction alone.
    """
    if type(problem) not in _SERVED or not problem.moves:
        return None
    moving = moving_part(problem)
    if moving.size < 2:
        return None
    # A's nearer than that are told apart by their perturbation alone
    moving = moving.separate(Fraction(1, 10**40), Fraction(1, 10**30))
    start = _start_of_doubles(problem, moving)
    exact = None
    if start is None:
        exact = exact_start(moving)
        if exact is None:
            return None
        start = to_doubles(exact)
    if np.min(np.diagonal(start.d, 1)) < NARROWEST:
        return None
    return KernelMotion(problem, moving, start, exact)


def _start_of_doubles(problem: TorusProblem, moving: Moving) -> Start | None:
    """Return the start of data that are doubles, all of them moving, None for others and where
    branch points are near one another.
    """
    n, exact = problem.n, problem.exact
    if problem.time != "t" or problem.axes is not None or moving.size < n or moving.rotated:
        return None
    A, q, v = (to_float(x) for x in (exact.A, exact.q, exact.q_dot))
    if not all(
        double == number
        for doubles, numbers in ((A, exact.A), (q, exact.q), (v, exact.q_dot))
        for double, number in zip(doubles.tolist(), numbers, strict=True)
    ):
        return None
    order = np.argsort(-A, kind="stable")
    signs = np.where(q < 0, -1.0, 1.0)
    room = new_start(n)
    if not np.all(q) or not kernel_start.set_start(
        A[order], (q * signs)[order], (v * signs)[order], *room
    ):
        return None
    return room


def new_start(n: int) -> Start:
    """Return room for the start of a motion in n dimensions."""
    g = n - 1
    return Start(
        np.zeros((2 * g + 1, 2 * g + 1)),
        np.zeros(2 * g + 1),
        np.zeros(n, np.int64),
        np.zeros(g, np.int64),
        np.zeros(n),
        np.zeros((2, g)),
        np.zeros(g, np.bool_),
        np.zeros(1),
    )


class States(NamedTuple):
    """States at T times along the principal axes.

    - tau1: (T,) in units of the kernel; frames: (T, n, n)
    - velocities: (T, n), in the problem's time
    - errors: (2, T) of the frame and of X; size: panels or modes
    """

    tau1: Array
    frames: Array
    velocities: Array
    errors: Array
    size: int


class KernelMotion:
    """A motion on the torus of its start."""

    def __init__(
        self, problem: TorusProblem, moving: Moving, start: Start, exact: Start | None
    ) -> None:
        self.problem = problem
        self.moving = moving
        self._exact = exact
        self.genus = moving.size - 1
        self.torus = kernel_torus.make_torus(
            *start[:4], np.array([_TIMES[problem.time]]), *start[4:]
        )
        self.room = kernel_torus.make_room(self.genus)
        self.fastest = float(np.max(np.abs(self.torus.frequencies / self.torus.mean)))

    @cached_property
    def _turn(self) -> Array:
        """Return ℜ: the moving part of e_2 … e_n = (n_2 … γ)(t) ℜ, (g, n−1); see ``frame``."""
        problem, identity = self.problem, np.eye(self.genus)
        frames, velocities = np.empty((1, *2 * (self.moving.size,))), np.empty((1, self.moving.size))
        order = np.arange(self.moving.size)
        kernel_frames.set_frames(
            self.torus, self.torus.psi[None], order, identity, frames, velocities, self.room
        )
        along = frames[0, :, 1:].T @ self.moving.directions.T
        if problem.exact.natural and self.genus == problem.n - 1:
            # The last bits of the frame are asked for only where those of a double leave a doubt.
            for name in ("near_frame", "frame"):
                raw = along @ getattr(problem, name)[:, 1:]
                signs = np.rint(raw)
                if np.max(np.abs(raw - signs)) <= SIGN_ROUNDING * problem.n:
                    return np.asarray(signs)
        return np.asarray(along @ problem.frame[:, 1:])

    @cached_property
    def _frozen_part(self) -> Array:
        """Return what stays of e_2 … e_n: components along directions that do not move."""
        directions, normals = self.moving.directions, self.problem.frame[:, 1:]
        return np.asarray(normals - directions @ (directions.T @ normals))

    @cached_property
    def _guarded_flow(self) -> tuple[Array, Array]:
        """Return Ω = f/F_0 as sums of two doubles, (g,) each, from the same text over balls."""
        exact = self._exact or exact_start(self.moving)
        assert exact is not None
        g, time = self.genus, _TIMES[self.problem.time]
        text = over_arb(GUARD_DIGITS)
        with balls(GUARD_DIGITS):
            cuts = np.full((g, text.elliptic.ROOM), text.arithmetic.number(0), dtype=object)
            counts, f = np.zeros(g, np.int64), text.arithmetic.zeros(g)
            text.periods.set_cuts(exact.d, cuts, counts)
            mean = text.rate.mean_flow(exact.d, exact.points, time, cuts, counts, f) * exact.rate[0]
            for s in range(g):
                mean = mean / text.rate.rate_factor(exact.points, time, s, exact.on_cuts[0, s])
            high = np.array([float(x / mean) for x in f])
            low = np.array([float(x / mean - y) for x, y in zip(f, high.tolist(), strict=True)])
        return high, low

    def _modes(self, guarded: bool) -> Any:
        """Return the Fourier modes of the time map, None where they do not serve."""
        if guarded not in self._kept_modes:
            torus, found = self.torus, None
            if self.genus in SIDES or self.problem.time == "tau1":
                flow = (torus.frequencies / torus.mean, np.zeros(self.genus))
                flow = self._guarded_flow if guarded else flow
                limits = SIDES.get(self.genus, 0), MOST_MODES.get(self.genus, 0)
                found = kernel_modes.make_modes(torus, *flow, *limits)
                found = None if found.reach[0] < 0 else found
            self._kept_modes[guarded] = found
        return self._kept_modes[guarded]

    @cached_property
    def _kept_modes(self) -> dict[bool, Any]:
        return {}

    def at(self, grid: TimeGrid) -> tuple[Series, Array, dict[str, Any]] | None:
        """Return the series at validated times along the principal axes, their error and details
        for provenance; None where no time map serves.
        """
        times = grid.doubles
        cycles = self.fastest * float(np.max(np.abs(times)))
        guarded = cycles > GUARDED
        modes = None
        if self.problem.time == "tau1" or cycles > FAR.get(self.genus, math.inf):
            modes = self._modes(guarded)
        if cycles > (MOST_PANELS / 4 if modes is None else MOST_CYCLES):
            return None
        plan = _Plan(modes, guarded and modes is not None)
        found = self._on_windows(times, plan) if times.size >= MANY else None
        found = found or self._states(times, plan, grid.remainders)
        if found is None:
            return None
        series = {
            "tau1": found.tau1 * math.sqrt(self.moving.unit),
            "q_dot": found.velocities,
            "frame": found.frames,
        }
        details = {
            "regime": "closed-cut" if self.moving.rotated or self.moving.frozen else "generic",
            "time_map": "panels" if modes is None else "fourier",
            "time_map_size": found.size,
            "guard_digits": guarded,
        }
        return series, self._to_axes(found.errors), details

    def _to_axes(self, errors: Array) -> Array:
        """Return the error of all bounded series along the body axes, (T,), from those of frame and
        X (2, T): of scalar products of n terms.
        """
        problem = self.problem
        largest = math.sqrt(float(np.max(problem.A))) if problem.time == "s" else 0.0
        error = np.maximum(errors[0], largest * errors[1])
        terms = self.moving.size if self.moving.rotated else 0
        if problem.axes is not None:
            terms += problem.n + AXES_ROUNDING
        return np.asarray(error + terms * _EPSILON * max(1.0, largest))

    def _states(
        self, times: Array, plan: _Plan, remainders: Array | None = None
    ) -> States | None:
        """Return the states at increasing times, each by itself; None where the time map fails."""
        g, m = self.genus, self.moving.size
        tau, psi, off = np.empty(times.size), np.empty((times.size, g)), np.zeros(times.size)
        size = self._follow(times, tau, psi, off) if plan.modes is None else 0
        if plan.modes is not None:
            size = self._jump(times, plan.modes, tau, psi, off)
        if size < 0:
            return None
        frames, velocities = np.empty((times.size, m, m)), np.empty((times.size, m))
        order, identity = np.arange(m), np.eye(g)
        for part in _blocks(times.size):
            kernel_frames.set_frames(
                self.torus, psi[part], order, identity, frames[part], velocities[part], self.room
            )
        if remainders is not None:  # a time is taken as its nearest double
            off += np.abs(remainders)
        errors = np.empty((2, times.size))
        kernel_error.set_errors(
            self.torus, times, tau, psi, off, plan.guarded, self.room, errors
        )
        frames, velocities = self._along_axes(frames, velocities)
        return States(tau, frames, velocities, errors, size)

    def _along_axes(self, frames: Array, velocities: Array) -> tuple[Array, Array]:
        """Return frames and velocities along the principal axes, from those along what moves."""
        directions, n = self.moving.directions, self.problem.n
        count, m = velocities.shape
        found = np.empty((count, n, n))
        found[:, :, 0] = frames[:, :, 0] @ directions.T
        rotated = np.ascontiguousarray(frames[:, :, 1:]).reshape(-1, m - 1) @ self._turn
        found[:, :, 1:] = directions @ rotated.reshape(count, m, n - 1)
        if self.moving.frozen:
            found[:, :, 1:] += self._frozen_part
        return found, velocities @ directions.T

    def _follow(self, times: Array, tau: Array, psi: Array, off: Array) -> int:
        """Fill τ₁, ψ and what is left in t at increasing times by panels; return how many, −1 where
        they do not serve.
        """
        first, size = int(np.searchsorted(times, 0.0)), 0
        for direction, order in ((1, np.arange(first, times.size)), (-1, np.arange(first)[::-1])):
            walk, reached = kernel_panels.make_walk(self.torus, direction), 0
            order = np.ascontiguousarray(order)
            while reached < order.size:
                checkpoint()
                reached = kernel_panels.follow(
                    self.torus, walk, times, order, reached, PANELS_AT_ONCE, tau, psi, off, self.room
                )
                if reached < 0 or walk.lost[kernel_panels.PANELS] > MOST_PANELS:
                    return -1
            size += int(walk.lost[kernel_panels.PANELS])
        return size

    def _jump(self, times: Array, modes: Any, tau: Array, psi: Array, off: Array) -> int:
        """Fill the same by Fourier modes; return how many, −1 where they do not serve."""
        for part in _blocks(times.size):
            if kernel_modes.jump(self.torus, modes, times[part], tau[part], psi[part], self.room):
                return -1
        off[:] = _EPSILON * modes.blur[0]
        return int(modes.amplitudes.size)

    def _on_windows(self, times: Array, plan: _Plan) -> States | None:
        """Return the states at many increasing times as Chebyshev series on windows; None where
        that does not pay, or some window does not resolve the motion.
        """
        first, last, nodes = float(times[0]), float(times[-1]), kernel_series.chebyshev_nodes()
        count = math.ceil((last - first) * self.fastest / CYCLES_IN_WINDOW) + 1
        if count * nodes * PAYS > times.size:
            return None
        lefts = first + (last - first) * np.arange(count) / count
        lengths = np.full(count, (last - first) / count)
        settled: list[tuple[Array, Array, Array, Array]] = []
        scales: Array | None = None
        for _ in range(MOST_HALVINGS):
            at = np.empty((lefts.size, nodes))
            kernel_windows.set_window_times(lefts, lengths, at)
            found = self._states(at.ravel(), plan)
            if found is None:
                return None
            errors = np.max(found.errors.reshape(2, lefts.size, nodes), axis=2)
            values = self._entries(at.ravel(), found)
            if scales is None:  # entries of order one, the same for all windows
                scales = np.maximum(np.max(np.abs(values), axis=0), 1e-300)
            values = values / scales
            series = np.empty((lefts.size, nodes, values.shape[1]))
            tails = np.empty(lefts.size)
            kernel_windows.set_window_series(values.reshape(series.shape), series, tails)
            good = tails < RESOLVED * _EPSILON + errors[0]
            errors += TRUNCATION * tails
            settled.append((lefts[good], lengths[good], series[good], errors[:, good].T))
            if good.all():
                break
            halves = lengths[~good] / 2
            lefts = np.sort(np.concatenate([lefts[~good], lefts[~good] + halves]))
            lengths = np.repeat(halves, 2)
        else:
            return None
        lefts, lengths, series, errors = (np.concatenate(x) for x in zip(*settled, strict=True))
        order = np.argsort(lefts)
        lefts, lengths, series = lefts[order], lengths[order], np.ascontiguousarray(series[order])
        entries, window = np.empty((times.size, series.shape[2])), 0
        for part in _blocks(times.size):
            window = kernel_windows.sum_windows(
                series, lefts, lengths, times[part], window, entries[part]
            )
        places = np.searchsorted(lefts, times, side="right") - 1
        entries *= scales
        n = self.problem.n
        tau = entries[:, 0] + times / self.torus.mean[0]
        frames = entries[:, 1 : 1 + n * n].reshape(-1, n, n)
        return States(
            tau, frames, entries[:, 1 + n * n :], errors[order][places].T, found.size
        )

    def _entries(self, times: Array, states: States) -> Array:
        """Return the entries of states that have a series: the periodic part of τ₁, (T, E)."""
        periodic = states.tau1 - times / self.torus.mean[0]
        rows = [periodic[:, None], states.frames.reshape(times.size, -1), states.velocities]
        return np.concatenate(rows, axis=1)


class _Plan(NamedTuple):
    """Fourier modes, None for panels; and whether Ω has guard digits."""

    modes: Any
    guarded: bool


def _blocks(count: int) -> Iterator[slice]:
    """Yield parts of so many times, with a checkpoint before each."""
    for first in range(0, count, TIMES_AT_ONCE):
        checkpoint()
        yield slice(first, first + TIMES_AT_ONCE)
