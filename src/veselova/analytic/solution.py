"""The closed-form motion of one problem: everything that does not depend on the times, and the states at any of them."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.abel_jacobi import AbelJacobi
from veselova.analytic.clock import Clock, ClockRate
from veselova.analytic.curve import Curve
from veselova.analytic.fourier_clock import FourierClock
from veselova.analytic.frame import Attitude, Frame
from veselova.analytic.orbit import LinearFlow
from veselova.analytic.panel_clock import PanelClock
from veselova.analytic.periods import Periods
from veselova.analytic.precision import DOUBLE, extended
from veselova.analytic.quotients import ThetaQuotients
from veselova.analytic.spectrum import Spectrum, spectrum
from veselova.analytic.start import Start, start
from veselova.analytic.theta import Theta
from veselova.mechanics.errors import InternalContradiction, Unsolved
from veselova.mechanics.spheroconic import to_spheroconic
from veselova.mechanics.veselova import Veselova

__all__ = ["METHODS", "Solution"]

Array = NDArray[np.float64]

#: The two routes from phases to attitude.
METHODS = ("theta", "angles")

#: Largest genus at which theta quotients cost no more than inversion in angles (g = 3: 15 µs a point both; g = 4: 80 against 15).
_THETA_GENUS = 3

#: Digits of the spectra: double precision for differences down to 1e-25 of the largest branch point.
_SPECTRUM_DIGITS = 40

#: Intervals narrower than this fraction of the largest branch point count as closed: the spectra cannot resolve them.
_CLOSED = 1e-24

#: Cycles of the fastest phase from which frequencies are computed with guard digits: before, one rounding of them is below 1e-13.
_GUARDED_FROM = 200.0
_GUARD_DIGITS = 30

#: Cycles from which the Fourier clock is cheaper than panels, by genus (set-up of the modes against inversions along the orbit).
_FOURIER_FROM = {1: 3.0, 2: 10.0, 3: 100.0, 4: 2e3, 5: 2e4}

#: Cycles that panels are willing to cover: about a minute at g = 7.
_PANEL_CYCLES = 5e4


#: Angles at which the steepness of the attitude is sampled.
_SAMPLES = 48


class Solution:
    """The closed-form motion of a moving body in the generic regime; raises Unsolved with the reason for any other."""

    def __init__(self, problem: Veselova) -> None:
        if not problem.moves:
            raise Unsolved(
                "at-rest", "q_dot = 0: the body rests, and Neumann time does not run; the numeric engine returns the rest state"
            )
        self.problem = problem
        self.spectrum: Spectrum = spectrum(problem, extended(_SPECTRUM_DIGITS))
        self.curve = Curve.of(self.spectrum, DOUBLE)
        _require_generic(self.curve)
        self.periods = Periods(self.curve)
        self.inversion = AbelJacobi(self.periods)
        self.start: Start = start(self.spectrum, self.curve)
        self.frame = Frame(self.periods, self.start.signs)
        self._origin: Array = self.inversion.map(self.start.angles[None, :])[0]

    def _mean(self, inversion: AbelJacobi) -> Any:
        """Return F_0 in the arithmetic of an inversion."""
        return self._rate(inversion).mean

    def _rate(self, inversion: AbelJacobi) -> ClockRate:
        """Return dt/dτ₁ = √((q,Aq)/W) = Π√(λ_s/b_{2s}) · scale; the scale follows from the value at the start."""
        xp = inversion.arithmetic
        spectrum, curve = self.spectrum, inversion.periods.curve
        squared: Any = spectrum.arithmetic.number(1)
        for s, point in enumerate(spectrum.spheroconic):
            squared = squared * point / spectrum.arithmetic.number(curve.branch_points[2 * s + 2])
        return ClockRate(inversion, xp.number(1 / (spectrum.clock_rate * spectrum.arithmetic.sqrt(squared))))

    @cached_property
    def rate(self) -> ClockRate:
        """Return dt/dτ₁ on the torus, in double precision."""
        return self._rate(self.inversion)

    @cached_property
    def mean_rate(self) -> float:
        """Return F_0, the mean of dt/dτ₁ over the torus."""
        return float(self.rate.mean)

    @cached_property
    def in_tau1(self) -> LinearFlow:
        """Return z(τ₁) = z⁰ + fτ₁ in double precision."""
        return LinearFlow.of(self._origin, self.periods.frequencies)

    @cached_property
    def in_time(self) -> LinearFlow:
        """Return the uniform part z⁰ + Ωt, Ω = f/F_0, in double precision."""
        return LinearFlow.of(self._origin, self.periods.frequencies / self.rate.mean)

    @cached_property
    def _guarded(self) -> tuple[LinearFlow, LinearFlow, float]:
        """Return both flows and F_0 with guard digits, for times far out."""
        periods = Periods(Curve.of(self.spectrum, extended(_GUARD_DIGITS)))
        mean = self._mean(AbelJacobi(periods, coarse=self.inversion))
        flows = (LinearFlow.of(self._origin, periods.frequencies), LinearFlow.of(self._origin, periods.frequencies / mean))
        return flows[0], flows[1], float(mean)

    def clock(self, times: Array, name: str | None = None) -> Clock:
        """Return a clock for the given times: ``fourier`` or ``panels``, by cost where no name is given."""
        earliest, latest = float(times[0]), float(times[-1])
        cycles, guarded = self.cycles(times), self.is_guarded(times)
        if name is None:
            name = "fourier" if cycles > _FOURIER_FROM.get(self.curve.genus, np.inf) else "panels"
        if name == "fourier":
            return self._fourier(guarded)
        if cycles > _PANEL_CYCLES:
            limit = f"panels go to {_PANEL_CYCLES:.0e} and Fourier clocks to n = 6"
            raise Unsolved("too-far", f"{cycles:.3g} cycles of the fastest phase at n = {self.problem.n}; {limit}")
        return PanelClock(self.rate, self._guarded[0] if guarded else self.in_tau1, earliest, latest)

    def _fourier(self, guarded: bool) -> FourierClock:
        if guarded not in self._fourier_clocks:
            flows = self._guarded if guarded else (self.in_tau1, self.in_time, self.mean_rate)
            self._fourier_clocks[guarded] = FourierClock(self.rate, *flows)
        return self._fourier_clocks[guarded]

    @cached_property
    def _fourier_clocks(self) -> dict[bool, FourierClock]:
        return {}

    def is_guarded(self, times: Array) -> bool:
        """Return whether frequencies for these times carry guard digits."""
        return self.cycles(times) > _GUARDED_FROM

    def cycles(self, times: Array) -> float:
        """Return the most cycles that any phase makes between t = 0 and the times."""
        return float(np.max(np.abs(self.in_time.rates)) * np.max(np.abs(times)))

    @cached_property
    def steepness(self) -> Array:
        """Return ∂(frame entry)/∂z_k at sampled angles, doubled for what lies between, a row per sample and entry, (·, g)."""
        sample = np.random.default_rng(self.curve.genus).uniform(0.0, 2 * np.pi, (_SAMPLES, self.curve.genus))
        psi = np.concatenate([sample, self.start.angles[None, :]])
        slopes = self.frame.slopes(psi) @ np.linalg.inv(self.inversion.jacobian(psi))
        return np.asarray(2 * slopes.reshape(-1, self.curve.genus))

    @cached_property
    def quotients(self) -> ThetaQuotients:
        """Return the theta route of this torus."""
        return ThetaQuotients(Theta(np.asarray(self.periods.riemann_matrix, dtype=np.float64)), self.frame)

    def default_method(self) -> str:
        """Return the cheaper route."""
        return "theta" if self.curve.genus <= _THETA_GENUS else "angles"

    def attitude(self, z: Array, method: str) -> Attitude:
        """Return the attitude at phases z (N, g), along sorted axes, by theta quotients or by Abel–Jacobi inversion."""
        return self.quotients.at(z) if method == "theta" else self.frame.at(self.inversion.invert(z))

    @cached_property
    def rotation(self) -> Array:
        """Return the constant ℜ of (orth): frame(0) = [q, (n_2 … γ)ℜ]. For the natural frame it is a matrix of signs, exactly."""
        normals = self.frame.at(self.start.angles[None, :]).normals[0]
        raw = normals.T @ self.problem.frame[list(self.spectrum.order), 1:]
        if not self.problem.exact.natural:
            return np.asarray(raw)
        signs = np.rint(raw)
        if np.max(np.abs(raw - signs)) > 1e-3:  # eigenvectors of clustered constants are only known to ε/gap
            raise InternalContradiction("the natural frame of the problem is not the one of the curve")
        return np.asarray(signs)

    def states(self, attitude: Attitude) -> tuple[Array, Array, Array]:
        """Return (q̇, frame, λ) along the problem's principal axes."""
        n, order = self.problem.n, np.argsort(self.spectrum.order)
        frame = np.empty((attitude.q.shape[0], n, n))
        frame[:, :, 0] = attitude.q
        frame[:, :, 1:] = attitude.normals @ self.rotation
        frame = frame[:, order]
        # dτ₁/dt = √(W/(q,Aq)), W fixed by the start; q' = Σ v_k n_k.
        weight = np.sum(frame[:, :, 0] ** 2 * self.problem.A, axis=1)
        start_weight = np.sum(self.problem.q**2 * self.problem.A)
        rate = float(self.spectrum.clock_rate) * np.sqrt(start_weight / weight)
        q_dot = attitude.q_prime[:, order] * rate[:, None]
        spheroconic = attitude.spheroconic if attitude.spheroconic.size else to_spheroconic(self.problem.A, frame[:, :, 0])
        return q_dot, frame, spheroconic


def _require_generic(curve: Curve) -> None:
    widths = np.asarray(curve.relative_widths(), dtype=np.float64)
    for j in np.flatnonzero(widths <= _CLOSED):
        ends = " = ".join(f"{o.kind}_{o.index + 1}" for o in curve.origins[j : j + 2])
        kind = "closed-cut" if j % 2 == 1 else "closed-gap"
        raise Unsolved(
            kind, f"branch points coincide ({ends}, axes sorted by decreasing A); the numeric engine solves this start"
        )
