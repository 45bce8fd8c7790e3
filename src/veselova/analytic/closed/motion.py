"""One motion on a torus by the kernel: from a problem to its series at times, with their error.

What does not depend on times is kept: the torus and its modes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.closed.area_veselova import AreaVeselova
from veselova.analytic.closed.base import Motion
from veselova.analytic.closed.quotients import ByTheta
from veselova.analytic.closed.start import (
    MovingStart,
    departure,
    exact_start,
    flow_of,
    scale_of,
    start_of,
    start_of_doubles,
)
from veselova.analytic.closed.states import (
    ANEW,
    MOST_CYCLES_ON_PANELS,
    Modes,
    Plan,
    StateFiller,
    States,
)
from veselova.analytic.curve.branch_points import Spectrum, spectrum
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.moving_part import moving_part
from veselova.analytic.curve.periods import Periods
from veselova.analytic.kernel import coefficients
from veselova.analytic.kernel import modes as kernel_modes
from veselova.analytic.kernel import rate as kernel_rate
from veselova.analytic.kernel import torus as kernel_torus
from veselova.analytic.kernel.compiler import prepare
from veselova.analytic.kernel.frame import LARGEST_ERROR, set_frame
from veselova.analytic.kernel.start import WIDEST
from veselova.mechanics.bodies.principal_inertia import AXES_KNOWN
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.systems.rolling_veselova import (
    BallPath,
    CommutingVeselova,
    WithDisplacement,
)
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["KernelMotion", "TorusMotion", "kernel_motion"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Derived: cycles beyond which Ω = f/F_0 is computed in balls of so many digits, those of two
#: doubles; with guard digits 127 bits, and Arb keeps 128 without memory of their own.
EXACT_FROM, EXACT_DIGITS = 200.0, 32

#: Calibrated: times in a cycle of the fastest phase from which series of states on panels cost less
#: than states one by one, and than Fourier modes.
DENSE = 16.0

#: Calibrated: the error in cycles that modes near a resonance leave, from which panels are better.
BLURRED = 1e-10

#: Calibrated: a rotation this near to a matrix of signs, in every entry and per dimension, is one.
SIGN_ROUNDING = 32 * _EPSILON

#: Calibrated: rounding of the principal axes, and of each term of a scalar product, in ε.
AXES_ROUNDING = 8.0

#: Calibrated: Σ|a⁻¹||du| over |f| from which frequencies, which have cancelled, come from balls.
CANCELLED = 4.0

#: Derived: digits of du/dτ₁, in which the branch points of such an A' cancel.
_FLOW_DIGITS = 300

TIMES = {"t": kernel_rate.PHYSICAL, "s": kernel_rate.ARC, "tau1": kernel_rate.NEUMANN}


def kernel_motion(problem: TorusProblem, proven: bool = True) -> KernelMotion:
    """Return the motion of a problem; ``proven``: whether the errors of states are to be.

    Raises Unsolved where nothing moves, or one direction alone (``at-rest``), and where branch
    points are no doubles, or errors are not proven for them (``beyond-floats``).
    """
    if not problem.moves:
        raise Unsolved("at-rest", "nothing moves, so there is neither a curve nor a torus")
    prepare()
    start = start_of_doubles(problem)
    motion = start and KernelMotion(problem, start)
    if motion is None or not kernel_torus.is_regular(motion.torus):
        motion = KernelMotion(problem, exact_start(moving_part(problem)))
        if not kernel_torus.is_regular(motion.torus):
            raise Unsolved("beyond-floats", "periods of the curve leave the range of a double")
    torus = motion.torus
    if proven and not torus.points[torus.of_I[0]] * WIDEST >= 1:
        raise Unsolved(
            "beyond-floats",
            f"the A's are too far apart: their ratio is above {WIDEST:.0e}",
        )
    return motion


class KernelMotion:
    """A motion on the torus of its start.

    - fastest: cycles of the fastest phase in a unit of time
    - side: the sign of u against n_2, zero without an area constant and where no u moves
    """

    def __init__(self, problem: TorusProblem, moving: MovingStart) -> None:
        self.problem, self.moving, self.genus = problem, moving, moving.size - 1
        self.room = kernel_torus.make_room(self.genus)
        self._flow: list[Any] = [0] * (self.genus - 1) + [1]
        is_directed = isinstance(problem, (AreaVeselova, CommutingVeselova))
        if is_directed:  # another direction on the torus than Neumann's flow
            with balls(_FLOW_DIGITS):
                self._flow = flow_of(problem, self._spectrum.points, moving.unit, moving.frozen)
        time, flow = np.array([TIMES[problem.time]]), np.array(self._flow, dtype=np.float64)
        self.torus = kernel_torus.make_torus(moving.start, time, flow)
        if is_directed and self._is_cancelled(flow):
            self.torus = self.torus._replace(frequencies=self.exact_flow[2])
        self.side, self.on_separatrix = 0.0, moving.moved > 0
        if problem.axes is not None:  # c_k is an I_i as far as the axes are known
            gaps = np.diagonal(self.torus.d, 1)[2::2]
            self.on_separatrix |= bool(np.min(gaps, initial=1.0) < AXES_KNOWN)
        if isinstance(problem, AreaVeselova):
            if self.genus > 1:
                self.side = problem.side_of(moving.directions @ self._frame()[:, 1])
            self.torus = self.torus._replace(tilt=np.array([self.side * float(problem.tilt)]))
            self.on_separatrix = self.on_separatrix or problem.joins(self.torus)
        self.fastest = kernel_torus.fastest_phase(self.torus)
        self._kept_modes: dict[bool, Modes | None] = {}

    def _frame(self) -> Array:
        """Return [q n_2 … γ] at the start along what moves, (m, m)."""
        frame = np.empty((self.moving.size, self.moving.size))
        set_frame(self.torus, self.torus.psi, self.room, frame, np.empty(self.moving.size))
        return frame

    def _is_cancelled(self, flow: Array) -> bool:
        """Return whether frequencies in doubles have lost digits in another direction."""
        added = np.abs(self.torus.inverse) @ np.abs(flow)
        return bool(np.any(added > CANCELLED * np.abs(self.torus.frequencies)))

    @cached_property
    def _spectrum(self) -> Spectrum:
        """Return the spectrum in balls."""
        known = self.moving.spectrum
        return known or spectrum(moving_part(self.problem), EXACT_DIGITS // 2)

    @property
    def regime(self) -> str:
        """Return ``separatrix``, ``closed-cut`` (two A's coincide, or some direction is frozen) or
        ``generic``.
        """
        if self.on_separatrix:
            return "separatrix"
        return "closed-cut" if self.moving.rotated or self.moving.frozen else "generic"

    @cached_property
    def turn(self) -> Array:
        """Return ℜ: the moving part of e_2 … e_n = (n_2 … γ)(t) ℜ, (g, n−1); see ``frame``."""
        problem, (n, size) = self.problem, self.moving.directions.shape
        along = self._frame()[:, 1:].T @ self.moving.directions.T
        if problem.exact.frame is None and n == size:
            # The last bits of the frame are asked for only where those of a double leave a doubt.
            for name in ("near_frame", "frame"):
                raw = along @ getattr(problem, name)[:, 1:]
                signs = np.rint(raw)
                if np.max(np.abs(raw - signs)) <= SIGN_ROUNDING * n:
                    return np.asarray(signs)
        return np.asarray(along @ problem.frame[:, 1:])

    @property
    def frozen_part(self) -> Array:
        """Return what stays of e_2 … e_n: components along directions that do not move."""
        directions, normals = self.moving.directions, self.problem.frame[:, 1:]
        return np.asarray(normals - directions @ (directions.T @ normals))

    @cached_property
    def path(self) -> BallPath | None:
        """Return the path of a ball of radius one, None of a body that does not roll."""
        if not isinstance(self.problem, WithDisplacement):
            return None
        return self.problem.path(self.turn, self.side)

    @cached_property
    def filler(self) -> StateFiller:
        """Return what fills in states."""
        return StateFiller(
            0 if self.path is None else len(self.path.factors),
            self.torus,
            self.room,
            self.fastest,
            np.sqrt(self.problem.A),
            self.moving.directions,
            self.turn,
            self.frozen_part if self.moving.frozen else None,
        )

    @cached_property
    def exact_flow(self) -> tuple[Array, Array, Array, float]:
        """Return Ω = f/F_0 as sums of two doubles, and f, (g,) each, and F_0, by periods in
        balls.
        """
        start, xp = start_of(self._spectrum), balls(EXACT_DIGITS, False)
        time = int(self.torus.time[0])
        with xp:
            curve = Curve(xp, start.points + 0, start.d + 0)  # rounded
            f, mean = Periods(curve).mean_flow(time, np.array(self._flow))
            mean *= scale_of(start, time, xp)
            high = (f / mean).astype(np.float64)
            low = (f / mean - high).astype(np.float64)
            return high, low, f.astype(np.float64), float(mean)

    def _modes(self, exact: bool) -> Modes | None:
        """Return the Fourier modes of the time map and of the path, with Ω from balls if ``exact``;
        None where they do not suffice.
        """
        if exact not in self._kept_modes:
            torus, g = self.torus, self.genus
            flow = self.exact_flow[:2] if exact else (torus.frequencies / torus.mean, np.zeros(g))
            few = g < len(kernel_modes.SIDES)
            self._kept_modes[exact] = None
            if few or self.problem.time == "tau1":
                most = (x[g] if few else 0 for x in (kernel_modes.SIDES, kernel_modes.MOST_MODES))
                given = *flow, *most

                def modes_of(which: int) -> Any:
                    return kernel_modes.make_modes(torus, which, *given)

                odd = modes_of(coefficients.ODD) if torus.tilt[0] else kernel_modes.no_modes(g)
                paths = [modes_of(k + 1) for k in range(min(self.filler.paths, g - 1))]
                found = Modes(modes_of(coefficients.RATE), odd, paths)
                if not any(x.reach[0] == kernel_modes.INSUFFICIENT for x in found.all):
                    self._kept_modes[exact] = found
        return self._kept_modes[exact]

    def _plan(self, times: Array, time_map: str | None) -> Plan:
        """Return how to follow the orbit to these times by the time map that is named, None for
        the cheaper that serves. Raises Unsolved (``too-far``).

        Where DENSE times lie in every cycle, walks with series of states on their panels serve
        them: one from t = 0 where panels are the time map, as they are then up to EXACT_FROM cycles
        for all genera; else one in each run of ANEW cycles, from the modes. All other times are
        done one by one.
        """
        cycles = self.fastest * float(np.max(np.abs(times), initial=0.0))
        if not cycles <= kernel_torus.MOST_CYCLES:
            served = f"{kernel_torus.MOST_CYCLES:.0e} are served"
            raise Unsolved("too-far", f"{cycles:.3g} cycles of the fastest phase; {served}")
        uniform = self.problem.time == "tau1"
        dense, exact = self._is_dense(times, 0.0), cycles > EXACT_FROM
        far = kernel_torus.is_far(self.genus, cycles, times.size) and not (dense and not exact)
        far = far or cycles > MOST_CYCLES_ON_PANELS
        slow = None
        if uniform or time_map == "fourier" or (time_map is None and far):
            modes = self._modes(exact)
            slow = modes.rate if modes else None
            near = time_map is None and cycles <= MOST_CYCLES_ON_PANELS and not uniform
            if modes and modes.serve and not (near and modes.blur * self.fastest > BLURRED):
                name = "uniform" if uniform else "fourier"
                return Plan(name, modes, exact, self._runs(times), False)
        if uniform or time_map == "fourier" or cycles > MOST_CYCLES_ON_PANELS:
            raise Unsolved(
                "too-far",
                f"{cycles:.3g} cycles of the fastest phase at n = {self.problem.n}: Fourier modes "
                f"are too many, or near a resonance; panels reach {MOST_CYCLES_ON_PANELS:.0e}",
            )
        return Plan("panels", None, False, [], dense, slow)

    def _is_dense(self, times: Array, begin: float) -> bool:
        """Return whether increasing times lie densely between ``begin`` and themselves."""
        if times.size < DENSE:
            return False
        span = max(times[-1], begin) - min(times[0], begin)
        return bool(times.size >= DENSE * (1 + self.fastest * span))

    def _runs(self, times: Array) -> list[slice]:
        """Return the runs in which increasing times lie densely, of ANEW cycles at most."""
        if times.size < DENSE:  # as of one attitude: no part of them is dense
            return []
        starts = np.flatnonzero(np.diff(np.floor(times * (self.fastest / ANEW)), prepend=-np.inf))
        parts = map(slice, starts.tolist(), [*starts[1:].tolist(), times.size])
        return [x for x in parts if self._is_dense(times[x], times[x.start])]

    def states(
        self,
        times: Array,
        late: Array,
        time_map: str | None = None,
        other: Callable[[States], States] | None = None,
    ) -> tuple[States, dict[str, Any]]:
        """Return the states at increasing times, and details for provenance.

        late: (T,) what the times are off by · time_map: as in ``solve`` · other: makes of states by
        angles those of another method. Raises Unsolved (``too-far``, ``narrow-gap``).
        """
        plan = self._plan(times, time_map)
        if other is not None:  # series of states have no ψ of their own
            plan = plan._replace(runs=[], dense=False)
        found = self.filler.at(times, plan, late)
        details = {"time_map": plan.name, "guard_digits": plan.exact}
        return found if other is None else other(found), details

    def series(self, grid: TimeGrid, found: States) -> tuple[Series, Array, dict[str, Any]]:
        """Return the series of states at validated times along the principal axes, their error, and
        details for provenance. Raises Unsolved (``no-digit-left``).
        """
        times = grid.doubles
        series = {
            "tau1": found.tau1 * math.sqrt(self.moving.unit),
            "q_dot": found.velocities,
            "frame": found.frames,
        }
        error = self.to_axes(found.errors)
        if self.on_separatrix:
            error = error + self._departed(found.tau1)
        sizes = np.ones(times.size)
        if self.path is not None:
            path, off = self.path.at(times, found.paths, found.errors_of_paths, grid.late)
            series["displacement"], error = path, np.maximum(error, off)
            sizes = np.maximum(1.0, np.max(np.abs(path), axis=1))
        error = error * (1 + error / (LARGEST_ERROR * self.problem.extent * sizes))
        self._require_digit(times, error / sizes)
        return series, error, {"regime": self.regime, "time_map_size": found.size}

    def _require_digit(self, times: Array, error: Array) -> None:
        problem, cause = self.problem, "doubles do not hold the motion there"
        if problem.axes is None and not (self.path and problem.n > 3):
            cause += "; ask for more digits"
        problem.require_digit(times, error, cause)

    def require_known(self, times: Array) -> None:
        """Raise Unsolved (``no-digit-left``) where a start on a separatrix is surely too coarse,
        before the orbit is followed there: |τ₁| is at least |t| over the largest dt/dτ₁.
        """
        if self.on_separatrix:
            slowest = float(self.torus.scale[0]) * (1 + abs(float(self.torus.tilt[0])))
            self._require_digit(times, self._departed(times / slowest))

    def _departed(self, tau1: Array) -> Array:
        """Return how far a start on a separatrix, as far as its data tell, may part from the motion
        until τ₁ (T,).
        """
        problem, points = self.problem, self.torus.points
        known = max(self.moving.moved, AXES_KNOWN if problem.axes is not None else 0)
        if isinstance(problem, AreaVeselova):
            known = max(known, problem.told_apart)
        energy = float(np.sum(points[self.torus.of_I]) - np.sum(points[self.torus.of_c]))
        width = self.torus.d[self.torus.of_I[0], self.torus.of_I[-1]]
        given = min(float(width), 1 - 1 / WIDEST), energy, float(known)
        return np.array([departure(*given, abs(x)) for x in tau1.tolist()])

    def to_axes(self, errors: Array) -> Array:
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


@dataclass(frozen=True)
class TorusMotion(Motion[TorusProblem]):
    """The motion by ``method`` and ``time_map`` of ``solve``; ``proven``: of ``kernel_motion``."""

    method: str | None = None
    time_map: str | None = None
    proven: bool = True

    @cached_property
    def kernel(self) -> KernelMotion:
        """Return the motion by the kernel."""
        return kernel_motion(self.problem, self.proven)

    def states(self, times: Array, late: Array) -> tuple[States, str, dict[str, Any]]:
        """Return the states at increasing times, the method, and details of it: by ψ, and by theta
        functions beside a separatrix, where ψ says too little; ``late``: what times are off by.
        """
        if not self.kernel.on_separatrix:
            try:
                other = self._theta if self.method == "theta" else None
                found, details = self.kernel.states(times, late, self.time_map, other)
                if other is not None:
                    details["theta_terms"] = other.terms
                return found, self.method or "angles", details
            except Unsolved as refusal:
                if refusal.outcome != "narrow-gap":
                    raise
        if self.method == "angles":
            reason = "angles in doubles do not resolve the orbit; theta quotients do, for n ≤ 8"
            raise Unsolved("narrow-gap", reason)
        return self._theta.on_panels(times, late), "theta", {"time_map": "panels"}

    def _evaluate(self, grid: TimeGrid) -> tuple[Series, Array, str, Mapping[str, Any]]:
        self.kernel.require_known(grid.doubles)
        found, method, details = self.states(grid.doubles, grid.late)
        series, error, of_motion = self.kernel.series(grid, found)
        return self.problem.complete(series), error, method, {**of_motion, **details}

    @cached_property
    def _theta(self) -> ByTheta:
        return ByTheta(self.kernel.filler)
