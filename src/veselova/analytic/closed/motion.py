"""One motion on a torus by the kernel: from a problem to its series at times, with their error.

What does not depend on times is kept: the torus and its modes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.closed.over_arb import over_arb
from veselova.analytic.closed.spectrum import Start, exact_start, to_doubles
from veselova.analytic.kernel import dense as kernel_dense
from veselova.analytic.kernel import error as kernel_error
from veselova.analytic.kernel import modes as kernel_modes
from veselova.analytic.kernel import motion as kernel_frames
from veselova.analytic.kernel import panels as kernel_panels
from veselova.analytic.kernel import rate as kernel_rate
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

__all__ = ["KernelMotion", "States", "kernel_motion"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Calibrated: cycles of the fastest phase beyond which Fourier modes serve, by genus; panels else.
FAR = {1: 4.0, 2: 6.0, 3: 120.0}

#: Budget: largest |m_k| and number of modes, by genus.
SIDES, MOST_MODES = {1: 64, 2: 48, 3: 20}, {1: 64, 2: 4000, 3: 16000}

#: Derived: cycles beyond which Ω = f/F_0 is computed in balls of so many digits, and those beyond
#: which they leave no digit of a phase.
EXACT_FROM, EXACT_DIGITS, MOST_CYCLES = 200.0, 40, 1e12

#: Calibrated: cycles of the fastest phase that panels serve, and how many panels one of them takes
#: where rounding does not keep a panel from being resolved, beside a first few.
MOST_CYCLES_ON_PANELS, PANELS_OF_A_CYCLE, FIRST_PANELS = 3000.0, 8.0, 200

#: Calibrated: times in a cycle of the fastest phase from which series of states on panels cost less
#: than states one by one, and than Fourier modes; cycles after which a walk begins anew from these.
DENSE, ANEW = 16.0, 16.0

#: Calibrated: the error of a state by series in what they leave out, and in ε.
BY_SERIES, SUM_ROUNDING = 8.0, 4.0

#: Budget: panels, times, terms of modes and times by series between two checkpoints.
PANELS_AT_ONCE, TIMES_AT_ONCE, TERMS_AT_ONCE, SERIES_AT_ONCE = 100, 2000, 4_000_000, 50_000

#: Calibrated: a rotation this near to a matrix of signs, in every entry and per dimension, is one.
SIGN_ROUNDING = 32 * _EPSILON

#: Calibrated: rounding of the principal axes, and of each term of a scalar product, in ε.
AXES_ROUNDING = 8.0

#: Derived: the narrowest cut or gap whose products with others are doubles.
NARROWEST = 1e-140

#: Calibrated: the narrowest inner gap against the narrower of the cuts beside it: nearer to a
#: separatrix, panels do not settle and n ≥ 4 loses digits; the frozen motions fail from 8e-7 down.
NARROWEST_GAP = 1e-4

#: Calibrated: the largest ratio of two A's; the frozen motions fail from 3e7 up.
WIDEST = 1e6

#: Derived: errors above this part of the extent hand over: second orders would count.
LARGEST_ERROR = 1e-6

#: Budget: terms of an angle series; 60 are many, gaps of 1e-28 take 270.
MOST_TERMS = 400

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
    if not _is_proven(start):
        return None
    motion = KernelMotion(problem, moving, start, exact)
    return motion if motion.is_regular else None


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


def _is_proven(start: Start) -> bool:
    """Return whether the estimates of errors were compared with true ones for such branch points;
    no array of the kernel is too short for them.
    """
    widths = np.diagonal(start.d, 1)  # gap, cut, gap, cut …
    inner, beside = widths[2::2], np.minimum(widths[1:-1:2], widths[3::2])
    numbers = (start.points, start.on_cuts, start.rate)
    return bool(
        all(np.all(np.isfinite(x)) for x in numbers)
        and np.all(widths >= NARROWEST)
        and np.all(inner >= NARROWEST_GAP * beside)
        and np.min(start.points[start.of_I]) * WIDEST >= 1
    )


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
        self._kept_modes: dict[bool, Any] = {}

    @property
    def is_regular(self) -> bool:
        """Return whether all numbers of the torus are finite, and its series not too long."""
        torus = self.torus
        numbers = (torus.psi, torus.z, torus.scale, torus.norms_I, torus.norms_c, torus.inverse)
        finite = all(np.all(np.isfinite(x)) for x in numbers) and math.isfinite(self.fastest)
        return finite and self.fastest > 0 and int(torus.angles.counts.max()) <= MOST_TERMS

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
            if flow is not None and (self.genus in SIDES or self.problem.time == "tau1"):
                side, most = SIDES.get(self.genus, 0), MOST_MODES.get(self.genus, 0)
                found = kernel_modes.make_modes(torus, flow[0], flow[1], side, most)
                found = None if found.reach[0] < 0 else found
            self._kept_modes[exact] = found
        return self._kept_modes[exact]

    def _plan(self, times: Array, time_map: str | None) -> _Plan | None:
        """Return how to follow the orbit to these times by the time map that is named, None for
        the cheaper; None where it does not serve.

        Where DENSE times lie in every cycle, walks with series of states on their panels serve
        them: one from t = 0 where panels are the time map, as they are then up to EXACT_FROM cycles
        for all genera; else one in each stretch of ANEW cycles, from the modes. All other times are
        done one by one.
        """
        cycles = self.fastest * float(np.max(np.abs(times), initial=0.0))
        uniform = self.problem.time == "tau1"
        dense = self._is_dense(times, 0.0)
        if time_map is None and not uniform:
            far = FAR.get(self.genus, math.inf)
            time_map = "fourier" if cycles > (max(far, EXACT_FROM) if dense else far) else "panels"
            if time_map == "fourier" and self._modes(cycles > EXACT_FROM) is None:
                time_map = "panels"
        if time_map == "panels" and not uniform:
            if cycles > MOST_CYCLES_ON_PANELS:
                return None
            return _Plan("panels", None, False, [], dense)
        exact = cycles > EXACT_FROM
        modes = self._modes(exact)
        if modes is None or cycles > MOST_CYCLES:
            return None
        return _Plan("uniform" if uniform else "fourier", modes, exact, self._stretches(times), True)

    def _is_dense(self, times: Array, begin: float) -> bool:
        """Return whether increasing times lie densely between ``begin`` and themselves."""
        span = max(times[-1], begin) - min(times[0], begin)
        return bool(times.size >= DENSE * (1 + self.fastest * span))

    def _stretches(self, times: Array) -> list[slice]:
        """Return the stretches in which increasing times lie densely, of ANEW cycles at most."""
        if times.size < DENSE:
            return []
        borders = np.flatnonzero(np.diff(np.floor(times * (self.fastest / ANEW)))) + 1
        ends = [0, *borders.tolist(), times.size]
        parts = (slice(*pair) for pair in itertools.pairwise(ends))
        return [x for x in parts if self._is_dense(times[x], times[x.start])]

    def at(
        self, grid: TimeGrid, time_map: str | None = None
    ) -> tuple[Series, Array, dict[str, Any]] | None:
        """Return the series at validated times along the principal axes, their error and details
        for provenance; None where the time map does not serve. ``time_map``: as in ``solve``.
        """
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
        if not np.max(error) <= LARGEST_ERROR * self.problem.extent:
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
        found = _Found.make(times, self.genus, self.problem.n)
        size = self._follow(found, plan) if plan.modes is None else self._jump(found, plan)
        if size < 0:
            return None
        if remainders is not None:  # a time is taken as its nearest double
            found.off += np.abs(remainders)
        errors = np.empty((2, times.size))
        since, advance = (found.since, found.advance) if plan.exact else (times, found.tau1)
        kernel_error.set_errors(
            self.torus, since, advance, found.psi, found.off, False, self.room, errors
        )
        self._add_errors_of_series(found, errors)
        return States(found.tau1, found.frames, found.velocities, errors, size)

    def _add_errors_of_series(self, found: _Found, errors: Array) -> None:
        """Add what series of states leave out: X of a geodesic has it relative to √(q,Aq)."""
        if not found.left_out:
            return
        error = BY_SERIES * max(found.left_out) + SUM_ROUNDING * _EPSILON
        errors[0] += error
        if self.problem.time == "s":
            A = self.problem.A
            q = found.frames[:, :, 0]
            errors[1] += error * np.sqrt(np.max(A) / np.sum(A * q * q, axis=1))

    def _one_by_one(self, found: _Found, part: slice) -> None:
        """Fill states at times whose ψ are known."""
        m, psi = self.moving.size, found.psi[part]
        order, identity = np.arange(m), np.eye(self.genus)
        for few in _blocks(psi.shape[0], TIMES_AT_ONCE):
            count = psi[few].shape[0]
            frames, velocities = np.empty((count, m, m)), np.empty((count, m))
            kernel_frames.set_frames(
                self.torus, psi[few], order, identity, frames, velocities, self.room
            )
            frames, velocities = self._to_principal_axes(frames, velocities)
            found.frames[part][few], found.velocities[part][few] = frames, velocities

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

    def _follow(self, found: _Found, plan: _Plan) -> int:
        """Fill the states by panels; return how many, −1 where they do not serve."""
        times, tau1 = found.times, found.tau1
        first, size = int(np.searchsorted(times, 0.0)), 0
        most = FIRST_PANELS + PANELS_OF_A_CYCLE * self.fastest * float(np.max(np.abs(times)))
        for direction, part in ((1, slice(first, times.size)), (-1, slice(first))):
            order = np.arange(times.size)[part][::direction].copy()
            if plan.dense and order.size:
                walk = self._dense_walk(direction)
                if not self._follow_densely(found, walk, part, most):
                    return self._follow(found, plan._replace(dense=False))
            else:
                walk, reached = kernel_panels.make_walk(self.torus, direction), 0
                while reached < order.size:
                    checkpoint()
                    reached = kernel_panels.follow(
                        *(self.torus, walk, times, order, reached, PANELS_AT_ONCE),
                        *(tau1, found.psi, found.off, self.room),
                    )
                    if reached < 0 or walk.lost[kernel_panels.PANELS] > most:
                        return -1
                self._one_by_one(found, part)
            size += int(walk.lost[kernel_panels.PANELS])
        return size

    def _dense_walk(self, direction: int) -> Any:
        """Return a walk with series of states along the principal axes."""
        directions, n = self.moving.directions, self.problem.n
        rest = self._frozen_part if self.moving.frozen else np.zeros((n, n - 1))
        where = (np.ascontiguousarray(x) for x in (directions, self._turn, rest))
        return kernel_panels.make_dense_walk(self.torus, direction, *where)

    def _follow_densely(self, found: _Found, walk: Any, part: slice, most: float) -> bool:
        """Fill the states by series on panels; return whether these serve."""
        low, high, _ = part.indices(found.times.size)
        forward = walk.left[kernel_panels.NEXT] > 0
        before = walk.lost[kernel_panels.PANELS]
        while low < high:
            checkpoint()
            first = low if forward else max(low, high - SERIES_AT_ONCE)
            last = min(high, low + SERIES_AT_ONCE) if forward else high
            a, b = kernel_dense.follow_densely(
                *(self.torus, walk, found.times, first, last, PANELS_AT_ONCE),
                *(found.states, found.psi, found.off, self.room),
            )
            if a < 0 or walk.lost[kernel_panels.PANELS] - before > most:
                return False
            low, high = (a, high) if forward else (low, b)
        found.left_out.append(float(walk.lost[kernel_panels.STATES]))
        return True

    def _jump(self, found: _Found, plan: _Plan) -> int:
        """Fill the states from Fourier modes; return how many, −1 where they do not serve."""
        torus, modes, size = self.torus, plan.modes, plan.modes.amplitudes.size
        at_once = min(TIMES_AT_ONCE, 1 + TERMS_AT_ONCE // (1 + size))
        walk = self._dense_walk(1) if plan.stretches else None
        last = slice(found.times.size, None)
        reached = 0
        for stretch in (*plan.stretches, last):
            sparse = slice(reached, stretch.start)
            for few in _blocks(stretch.start - reached, at_once):
                part = slice(reached + few.start, min(reached + few.stop, stretch.start))
                there = found.times[part], found.tau1[part], found.psi[part]
                if kernel_modes.jump(torus, modes, *there, self.room):
                    return -1
            self._one_by_one(found, sparse)
            found.off[sparse] = _EPSILON * modes.blur[0]
            if stretch is last:
                return int(size)
            if not self._begin_anew(found, walk, stretch, modes):
                return self._jump(found, plan._replace(stretches=[]))
            reached = stretch.stop
        return int(size)

    def _begin_anew(self, found: _Found, walk: Any, stretch: slice, modes: Any) -> bool:
        """Fill the states of a stretch by a walk from its first time; return whether it serves."""
        first = slice(stretch.start, stretch.start + 1)
        time, tau1, psi = found.times[first], found.tau1[first], found.psi[first]
        if kernel_modes.jump(self.torus, modes, time, tau1, psi, self.room):
            return False
        begin, at = float(time[0]), float(tau1[0])
        kernel_dense.begin(walk, at, begin, self.room.target, psi[0])
        most = FIRST_PANELS + PANELS_OF_A_CYCLE * ANEW
        if not self._follow_densely(found, walk, stretch, most):
            return False
        found.off[stretch] += _EPSILON * modes.blur[0]
        found.since[stretch] = found.times[stretch] - begin
        found.advance[stretch] = found.tau1[stretch] - at
        return True


class _Plan(NamedTuple):
    """The time map: its name, Fourier modes, None for panels, and whether Ω has guard digits; where
    times lie densely, and whether all of them do.
    """

    name: str
    modes: Any
    exact: bool
    stretches: list[slice]
    dense: bool


@dataclass(frozen=True)
class _Found:
    """States at increasing times while they are filled in, the entries by long rows.

    - states: (1 + n + n², T) τ₁, velocities and frames
    - psi: (T, g), off: (T,) what the time map leaves in t
    - since, advance: (T,) t and τ₁ since the place that is known with guard digits, if any is
    - left_out: of series of states
    """

    times: Array
    states: Array
    psi: Array
    off: Array
    since: Array
    advance: Array
    left_out: list[float]

    @classmethod
    def make(cls, times: Array, genus: int, n: int) -> _Found:
        """Return room for the states."""
        count = times.size
        rows = np.empty((1 + n + n * n, count)), np.empty((count, genus))
        return cls(times, *rows, np.zeros(count), np.zeros(count), np.zeros(count), [])

    @property
    def tau1(self) -> Array:
        """Return τ₁ (T,)."""
        return self.states[0]

    @property
    def velocities(self) -> Array:
        """Return velocities (T, n)."""
        return self.states[1 : 1 + self._n].T

    @property
    def frames(self) -> Array:
        """Return frames (T, n, n)."""
        n = self._n
        return np.moveaxis(self.states[1 + n :].reshape(n, n, -1), -1, 0)

    @property
    def _n(self) -> int:
        return math.isqrt(self.states.shape[0])


def _blocks(count: int, at_once: int) -> Iterator[slice]:
    """Yield parts of so many times, with a checkpoint before each."""
    for first in range(0, count, at_once):
        checkpoint()
        yield slice(first, first + at_once)
