"""One orbit of a separable motion: its torus as the kernel's, which has the time maps, and what
rounding of phases does to positions.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed import states
from veselova.analytic.closed.base import BETWEEN, MOST_LOCAL, Attitude, combine_bounds, sensitivity
from veselova.analytic.kernel import modes
from veselova.analytic.kernel.coefficients import RATE
from veselova.analytic.kernel.compiler import prepare
from veselova.analytic.kernel.rate import PHYSICAL
from veselova.analytic.kernel.torus import Torus, fastest_phase, is_far, make_room
from veselova.analytic.separable.inversion import SeparableMotion
from veselova.analytic.time_map.modes import LinearFlow
from veselova.mechanics.core.errors import Unsolved

__all__ = ["Course", "SeparableOrbit"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Calibrated: rounding in ε: of one evaluation; of a phase; of frequencies, relative; of the time
#: map, relative.
_EVALUATION = 16.0
_PHASE = 8.0
_RATE = 4.0
_TIME = 8.0

#: Budget: points at which slopes are sampled.
_SAMPLES = 48

#: Derived: step of the difference quotients of attitudes: truncation and rounding both near 1e-8.
_DIFFERENCE = 1e-8

#: Derived: step of those of τ by phases and frequencies.
_STEP = 1e-7


class Course(NamedTuple):
    """The orbit at T times: τ (T,), angles φ (T, g) modulo 4π, dt/dτ (T,), and the error of τ,
    (T,); the time map and its size.
    """

    tau: Array
    phi: Array
    rate: Array
    lag: Array
    name: str
    size: int


class SeparableOrbit:
    """The orbit of a motion on its torus."""

    def __init__(self, motion: SeparableMotion) -> None:
        prepare()
        self.motion, self.inversion = motion, motion.inversion
        origin = self.inversion.at(motion.angles[None, :])[0][0]
        self.in_tau = LinearFlow(origin, motion.periods.frequencies)

    @cached_property
    def torus(self) -> Any:
        """Return the torus as the kernel has it: of dt/dτ = Π √λ_s, and without a frame."""
        motion, periods, none = self.motion, self.motion.periods, np.zeros(0)
        points = np.array([0.0, *(float(x) for cut in motion.cuts for x in cut.ends)])
        sizes = sum(np.sum(np.abs(x), axis=1) for x in periods.cut_series)
        cancelled = max(1.0, float(np.max(np.abs(periods.inverse_cycles) @ sizes)))
        mean, terms = motion.mean_rate
        angles = self.inversion.angles
        harmonics = np.zeros((2, max(terms, angles.harmonics.shape[1])))
        return Torus(
            np.zeros((0, 0)),
            points,
            np.zeros(0, np.int64),
            np.zeros(0, np.int64),
            np.array([PHYSICAL]),
            np.array([cut.interval for cut in motion.cuts]),
            angles._replace(harmonics=harmonics),
            np.ascontiguousarray(periods.inverse_cycles),
            np.array(periods.frequencies),
            none,
            none,
            np.array([np.prod(np.sqrt(points[2::2]))]),
            np.array([mean]),
            np.zeros(1),
            motion.angles,
            np.array(self.in_tau.start),
            np.array([cancelled]),
        )

    def course(self, times: Array, late: Array) -> Course:
        """Return the orbit at increasing times, which are off by ``late`` (T,), by the cheaper time
        map. Raises Unsolved (``too-far``, ``narrow-gap``).
        """
        g, mean = self.motion.periods.genus, float(self.torus.mean[0])
        found = self._jump(times) if is_far(g, self._cycles(times), times.size) else None
        name, moved = "fourier", np.zeros(1)
        if found is None:
            self.require_panels(times)
            found = self._walk(self.torus, times)
            name, moved = "panels", self._moved(times, found[0].tau1)
        at, size = found
        rate = self.motion.rate(at.psi)
        off = at.off + _TIME * _EPSILON * np.abs(times)
        lag = off / np.minimum(rate, mean) + late / rate + moved
        return Course(at.tau1, at.psi, rate, lag, name, size)

    def _jump(self, times: Array) -> tuple[states.Found, int] | None:
        """Return τ, φ and the error of t at times by Fourier modes, and how many these are; None
        where they do not serve.
        """
        torus, g = self.torus, self.motion.periods.genus
        flow = torus.frequencies / torus.mean, np.zeros(g)
        rate = modes.make_modes(torus, RATE, *flow, modes.SIDES[g], modes.MOST_MODES[g])
        if rate.reach[0] < 0:
            return None
        found = states.Found.make(times, g, 0, 0)
        filler = states.OrbitFiller(0, torus, make_room(g))
        for few in states.blocks(times.size, states.TIMES_AT_ONCE):
            if not filler.jump_to(found, few, states.Modes(rate, modes.no_modes(g), [])):
                return None
        found.off[:] = float(np.max(self.start_rounding) * rate.blur[0])
        return found, 1 + rate.amplitudes.size

    def _walk(self, torus: Any, times: Array) -> tuple[states.Found, int]:
        """Return the same by panels. Raises Unsolved (``narrow-gap``)."""
        found = states.Found.make(times, torus.z.size, 0, 0)
        size = states.OrbitFiller(0, torus, make_room(torus.z.size)).along_panels(found)
        if size < 0:
            reason = "angles in doubles do not resolve the orbit; integrate numerically"
            raise Unsolved("narrow-gap", reason)
        return found, size

    def _moved(self, times: Array, tau: Array) -> Array:
        """Return how far errors of phases at the start and of frequencies move τ, (T,)."""
        torus, moved = self.torus, np.zeros(times.size)
        for k, unit in enumerate(np.eye(torus.z.size)):
            size = abs(float(torus.frequencies[k]))
            for name, rounding, step in (
                ("z", self.start_rounding[k], _STEP),
                ("frequencies", self.rate_rounding[k], _STEP * size),
            ):
                beside = torus._replace(**{name: getattr(torus, name) + step * unit})
                moved += rounding / step * np.abs(self._walk(beside, times)[0].tau1 - tau)
        return moved

    def require_panels(self, times: Array) -> None:
        """Raise Unsolved (``too-far``) where times are farther off than panels along the orbit are
        made.
        """
        cycles, most = self._cycles(times), states.MOST_CYCLES_ON_PANELS
        if not cycles <= most:
            reason = f"{cycles:.3g} cycles of the fastest phase; panels along the orbit go to"
            raise Unsolved("too-far", f"{reason} {most:.0e}")

    def _cycles(self, times: Array) -> float:
        return float(fastest_phase(self.torus) * np.max(np.abs(times)))

    def state_at(self, phi: Array, rate: Array) -> tuple[Attitude, Array]:
        """Return positions and coordinate lines at angles (N, g), and q̇ = q'/(dt/dτ), (N, n)."""
        at = self.motion.attitude(phi)
        return at, at.q_prime / rate[:, None]

    @cached_property
    def sample(self) -> Array:
        """Return the points of the torus at which slopes are sampled, phases modulo 2."""
        genus = self.motion.periods.genus
        return np.random.default_rng(3).uniform(0.0, 2.0, (_SAMPLES, genus))

    def _sensitivities(self, z: Array, values: Callable[[Attitude], Array]) -> Array:
        """Return how fast numbers of the attitudes change with the phases (N, g), and more between
        them, (4, N) of ``sensitivity``.
        """
        steps = _DIFFERENCE * np.eye(z.shape[1])
        ends = np.concatenate([z, *(z + step for step in steps)])
        found = values(self.motion.attitude(self.inversion.invert(ends)))
        found = found.reshape(1 + len(steps), len(z), -1)
        slopes = BETWEEN / _DIFFERENCE * np.moveaxis(found[1:] - found[0], 0, 2)
        return sensitivity(slopes, self.in_tau.rates, np.diag(self.start_rounding))

    @cached_property
    def start_rounding(self) -> Array:
        """Return the rounding of the phases at the start, (g,)."""
        return np.asarray(_PHASE * _EPSILON + self.motion.periods.series_truncation)

    @property
    def rate_rounding(self) -> Array:
        """Return the rounding of the frequencies, (g,)."""
        return np.asarray(_RATE * _EPSILON * np.abs(self.in_tau.rates))

    def error(
        self, course: Course, values: Callable[[Attitude], Array], turning: Array | None = None
    ) -> Array:
        """Return a bound on the error of numbers (N, …) of the attitudes, (T,): by the largest
        sensitivity over the torus and at some of the times, half of them where ``turning`` (T,) is
        largest, and of few times by that at each.
        """
        phi, few = course.phi, len(course.phi) <= MOST_LOCAL
        rows = np.linspace(0, len(phi) - 1, min(len(phi), MOST_LOCAL)).astype(int)
        if turning is not None and not few:
            steepest = np.argpartition(turning, -MOST_LOCAL // 2)[-MOST_LOCAL // 2 :]
            rows = np.concatenate([rows[::2], steepest])
        z = np.concatenate([self.sample, self.inversion.at(phi[rows])[0]])
        found = self._sensitivities(z, values)

        def by(sensitivities: Array) -> Array:
            along_flow, _, by_rates, by_start = sensitivities
            moved = _RATE * _EPSILON * np.abs(course.tau) * by_rates
            at_once = _EVALUATION * _EPSILON + by_start
            return np.asarray(at_once + moved + course.lag * along_flow)

        largest = by(np.max(found, axis=1))
        return combine_bounds(largest, by(found[:, _SAMPLES:])) if few else largest
