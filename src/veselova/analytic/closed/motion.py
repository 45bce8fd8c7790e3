"""One motion on a torus by the kernel: from a problem to its series at times, with their error.

What does not depend on times is kept: the torus and its modes.
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
from veselova.analytic.closed.over_arb import over_arb
from veselova.analytic.closed.spectrum import Start, exact_start, to_doubles
from veselova.analytic.kernel import error as kernel_error
from veselova.analytic.kernel import modes as kernel_modes
from veselova.analytic.kernel import motion as kernel_frames
from veselova.analytic.kernel import panels as kernel_panels
from veselova.analytic.kernel import rate as kernel_rate
from veselova.analytic.kernel import rule
from veselova.analytic.kernel import start as kernel_start
from veselova.analytic.kernel import torus as kernel_torus
from veselova.analytic.spectrum.moving_part import Moving, moving_part
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.systems.ellipsoid import EllipsoidGeodesic
from veselova.mechanics.systems.neumann import NeumannSystem
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova import Veselova
from veselova.tunings import COMPILED_TERMS, COMPILED_TIMES

__all__ = ["KernelMotion", "States", "kernel_motion"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Derived: cycles beyond which Ω = f/F_0 is computed in balls of so many digits.
EXACT_FROM, EXACT_DIGITS = 200.0, 40

#: Budget: panels and times between two checkpoints.
PANELS_AT_ONCE, TIMES_AT_ONCE = 200, 2000

#: Calibrated: a rotation this near to a matrix of signs, in every entry and per dimension, is one.
SIGN_ROUNDING = 32 * _EPSILON

#: Calibrated: rounding of the principal axes, and of each term of a scalar product, in ε.
AXES_ROUNDING = 8.0

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
    if not rule.is_proven(start.d, start.points, start.of_I, start.on_cuts, start.rate):
        return None
    motion = KernelMotion(problem, moving, start, exact)
    return motion if rule.is_regular(motion.torus) else None


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
        self.fastest = rule.fastest_phase(self.torus)
        self._kept_modes: dict[bool, Any] = {}

    @cached_property
    def _turn(self) -> Array:
        """Return ℜ: the moving part of e_2 … e_n = (n_2 … γ)(t) ℜ, (g, n−1); see ``frame``."""
        problem, identity = self.problem, np.eye(self.genus)
        m = self.moving.size
        frames, velocities, order = np.empty((1, m, m)), np.empty((1, m)), np.arange(m)
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
    def _exact_flow(self) -> tuple[Array, Array] | None:
        """Return Ω = f/F_0 as sums of two doubles, (g,) each, by the kernel over balls; None where
        branch points coincide.
        """
        exact = self._exact or exact_start(self.moving)
        if exact is None:
            return None
        g, time = self.genus, _TIMES[self.problem.time]
        over = over_arb(EXACT_DIGITS)
        with balls(EXACT_DIGITS):
            cuts = np.full((g, over.elliptic.ROOM), over.arithmetic.number(0), dtype=object)
            counts, f = np.zeros(g, np.int64), over.arithmetic.zeros(g)
            over.periods.set_cuts(exact.d, cuts, counts)
            mean = over.rate.mean_flow(exact.d, exact.points, time, cuts, counts, f) * exact.rate[0]
            for s in range(g):
                mean = mean / over.rate.rate_factor(exact.points, time, s, exact.on_cuts[0, s])
            high = np.array([float(x / mean) for x in f])
            low = np.array([float(x / mean - y) for x, y in zip(f, high.tolist(), strict=True)])
        return high, low

    def _modes(self, exact: bool) -> Any:
        """Return the Fourier modes of the time map, with Ω from balls if ``exact``; None where they
        do not serve.
        """
        if exact not in self._kept_modes:
            torus, found = self.torus, None
            rounded = torus.frequencies / torus.mean, np.zeros(self.genus)
            flow = self._exact_flow if exact else rounded
            few = self.genus < len(rule.SIDES)
            if flow is not None and (few or self.problem.time == "tau1"):
                side, most = (x[self.genus] if few else 0 for x in (rule.SIDES, rule.MOST_MODES))
                found = kernel_modes.make_modes(torus, flow[0], flow[1], side, most)
                found = None if found.reach[0] < 0 else found
            self._kept_modes[exact] = found
        return self._kept_modes[exact]

    def _plan(self, times: Array, time_map: str | None) -> _Plan | None:
        """Return how to follow the orbit to these times by the time map that is named, None for
        the cheaper; None where it does not serve.
        """
        cycles = self.fastest * float(np.max(np.abs(times), initial=0.0))
        uniform = self.problem.time == "tau1"
        if time_map is None and not uniform:
            time_map = "fourier" if rule.is_far(self.genus, cycles) else "panels"
            if time_map == "fourier" and self._modes(cycles > EXACT_FROM) is None:
                time_map = "panels"
        if time_map == "panels" and not uniform:
            near = cycles <= rule.MOST_CYCLES_ON_PANELS
            return _Plan("panels", None, False) if near else None
        exact = cycles > EXACT_FROM
        modes = self._modes(exact)
        name = "uniform" if uniform else "fourier"
        if modes is None or modes.amplitudes.size * times.size > COMPILED_TERMS:
            return None
        return _Plan(name, modes, exact) if cycles <= rule.MOST_CYCLES else None

    def at(
        self, grid: TimeGrid, time_map: str | None = None
    ) -> tuple[Series, Array, dict[str, Any]] | None:
        """Return the series at validated times along the principal axes, their error and details
        for provenance; None where the time map does not serve. ``time_map``: as in ``solve``.
        """
        if grid.doubles.size > COMPILED_TIMES:
            return None
        plan = self._plan(grid.doubles, time_map)
        found = self._states(grid.doubles, plan, grid.remainders) if plan else None
        if plan is None or found is None:
            return None
        series = {
            "tau1": found.tau1 * math.sqrt(self.moving.unit),
            "q_dot": found.velocities,
            "frame": found.frames,
        }
        details = {
            "regime": "closed-cut" if self.moving.rotated or self.moving.frozen else "generic",
            "time_map": plan.name,
            "time_map_size": found.size,
            "guard_digits": plan.exact,
            "compiled": True,
        }
        error = self._to_axes(found.errors)
        if not np.max(error) <= rule.LARGEST_ERROR * self.problem.extent:
            return None
        return series, error, details

    def _to_axes(self, errors: Array) -> Array:
        """Return the error of all bounded series along the body axes, (T,), from those of frame and
        X (2, T): of scalar products of n terms.
        """
        problem = self.problem
        largest = math.sqrt(float(np.max(problem.A))) if problem.time == "s" else 0.0
        error = np.maximum(errors[0], largest * errors[1])
        terms = float(self.moving.size if self.moving.rotated else 0)
        if problem.axes is not None:
            terms += problem.n + AXES_ROUNDING
        return np.asarray(error + terms * _EPSILON * max(1.0, largest))

    def _states(self, times: Array, plan: _Plan, remainders: Array | None) -> States | None:
        """Return the states at increasing times; None where the time map fails."""
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
        kernel_error.set_errors(self.torus, times, tau, psi, off, plan.exact, self.room, errors)
        frames, velocities = self._to_principal_axes(frames, velocities)
        return States(tau, frames, velocities, errors, size)

    def _to_principal_axes(self, frames: Array, velocities: Array) -> tuple[Array, Array]:
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
            cycles = self.fastest * float(np.max(np.abs(times), initial=0.0))
            most = rule.most_panels(cycles)
            where = self.torus, walk, times, order
            while reached < order.size:
                checkpoint()
                reached = kernel_panels.follow(
                    *where, reached, PANELS_AT_ONCE, tau, psi, off, self.room
                )
                if reached < 0 or walk.lost[kernel_panels.PANELS] > most:
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


class _Plan(NamedTuple):
    """The time map: its name, Fourier modes, None for panels, and whether Ω has guard digits."""

    name: str
    modes: Any
    exact: bool


def _blocks(count: int) -> Iterator[slice]:
    """Yield parts of so many times, with a checkpoint before each."""
    for first in range(0, count, TIMES_AT_ONCE):
        checkpoint()
        yield slice(first, first + TIMES_AT_ONCE)
