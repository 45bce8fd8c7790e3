"""Periods of the nodal differentials over cuts and gaps, the Riemann matrix, and the Abel–Jacobi
map in real angles, both ways.

    a_{ks} = (−1)^{g−s} ∮_{cut s} p_k dλ/(2√|R|),   B_{ks} = Σ_{gaps j<s} (−1)^{g−j+1} ∮ p_k
        dλ/(2√|R|)
    T = a⁻¹B is real, symmetric, positive definite; the Riemann matrix is τ = iT;  f = a⁻¹e_g

On cut s the integral of a⁻¹(p_1…p_g) from b_{2s−1} is G_s(ψ) = g_{s0}ψ + Σ_m g_{sm} sin(mψ)/m,
and ψ ↦ z = Σ_s G_s(ψ_s) with ψ_s the elliptic angle of λ_s on its cut. The map is a real-analytic
diffeomorphism of the torus, z_k = ψ_k/2π plus a periodic part, so ψ = 2πz starts the iteration. In
doubles the kernel inverts it; in balls Newton's and Krawczyk's methods start from there.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Arithmetic, Values
from veselova.analytic.curve.branch_points import Spectrum
from veselova.analytic.curve.hyperelliptic import Curve, Interval, narrowest_gap
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["AbelJacobi", "AngleSeries", "Periods", "kernel_series"]

#: Calibrated: nodes beyond those that the convergence rate asks for: the constant in front of it.
_EXTRA_NODES = 4

#: Calibrated: rounding of an entry of T in doubles, for each unit by which its periods cancel;
#: largest seen over random curves: 6ε.
_ENTRY_ROUNDING = 16 * DOUBLE.epsilon

#: Budget: nodes of an interval in balls: a minute.
_MOST_NODES = 100_000

#: Derived: digits of the angles from which an inversion in balls starts, and those that a doubling
#: by Newton's method loses to the slopes.
_COARSE_DIGITS = 12
_LOST_DIGITS = 2

#: Budget: points inverted between two checkpoints.
_BLOCK = 100


class AngleSeries(ABC):
    """What periods make of the cosine series of the forms du_1 … du_g on each of g cuts in its
    angle ψ_s: cycles a, frequencies f and the series of the Abel–Jacobi map.

    - arithmetic: of the data; genus: g
    """

    arithmetic: Arithmetic
    genus: int

    @property
    @abstractmethod
    def narrowest_gap(self) -> float:
        """Return the least gap between neighbouring cuts, relative to what is around it."""

    @property
    @abstractmethod
    def cut_series(self) -> tuple[Values, ...]:
        """Return, per cut, the cosine coefficients of du_k/dψ (signs included), shape (g, N_s)."""

    @property
    @abstractmethod
    def series_truncation(self) -> Values:
        """Return what the angle series leave out of z_k, shape (g,)."""

    @cached_property
    def cycles(self) -> Values:
        """Return a, shape (g, g)."""
        return np.stack([2 * self.arithmetic.pi * s[:, 0] for s in self.cut_series], axis=1)

    @cached_property
    def inverse_cycles(self) -> Values:
        """Return a⁻¹."""
        return self.arithmetic.inverse(self.cycles)

    @cached_property
    def frequencies(self) -> Values:
        """Return f = a⁻¹e_g, cycles per unit of τ: z(τ) = z⁰ + fτ."""
        return self.inverse_cycles[:, self.genus - 1]

    @cached_property
    def angle_series(self) -> Values:
        """Return g_{ksm}, shape (g, g, M): dz_k/dψ_s = Σ_m g_{ksm} cos mψ_s, zero-padded to the
        longest cut.
        """
        longest = max(series.shape[1] for series in self.cut_series)
        padded = np.zeros((*self.cycles.shape, longest), dtype=self.cycles.dtype)
        for s, series in enumerate(self.cut_series):
            padded[:, s, : series.shape[1]] = self.inverse_cycles @ series
        return padded


class Periods(AngleSeries):
    """The period data of a curve in the curve's arithmetic."""

    def __init__(self, curve: Curve) -> None:
        self.curve = curve
        self.arithmetic = curve.arithmetic
        self.genus = curve.genus

    @cached_property
    def narrowest_gap(self) -> float:
        """Return the least gap that can close, relative to what is around it."""
        return narrowest_gap(self.curve.differences, self.curve.branch_points[0] != 0)

    @cached_property
    def intervals(self) -> tuple[Interval, ...]:
        """Return [b_j, b_{j+1}], gaps and cuts in turn."""
        return tuple(Interval.of(self.curve, j) for j in range(2 * self.genus))

    @property
    def cuts(self) -> tuple[Interval, ...]:
        """Return the cuts s = 1…g."""
        return self.intervals[1::2]

    def roots_on_cuts(self, psi: Values) -> tuple[Values, Values]:
        """Return the ``roots`` of every cut at angles (N, g), each (g, N)."""
        below, above = zip(*(cut.roots(psi[:, s]) for s, cut in enumerate(self.cuts)), strict=True)
        return np.stack(below), np.stack(above)

    def start_angles(self, spectrum: Spectrum) -> Values:
        """Return the angles ψ_s in (−π, π] at the start, (g,), small ones to their own last bit."""
        ends = zip(self.cuts, spectrum.on_cuts, spectrum.increasing, strict=True)
        return self.arithmetic.array([cut.angle(*at, up) for cut, at, up in ends])

    def node_count(self, interval: Interval) -> int:
        """Return the number of midpoint nodes whose interpolating cosine series holds the forms to
        the working precision; raises Unsolved (``narrow-gap``) where it takes minutes in balls.

        Coefficients fall like e^(−π m K'/K); the means, with error e^(−2πN K'/K), have twice the
        digits. Where errors are to be bounded, half the strip is given up: the forms are unbounded
        at its edge.
        """
        rate = interval.strip if self.arithmetic.certified else 2 * interval.strip
        count = _EXTRA_NODES + math.ceil(self.arithmetic.nats / float(rate))
        if count > _MOST_NODES:
            wanted = (
                f"{self.arithmetic.digits} digits take series of {count} terms beside a "
                f"relative gap of {self.narrowest_gap:.2g}"
            )
            raise Unsolved("narrow-gap", f"{wanted}, {_MOST_NODES} at most are formed")
        return count

    def _series(self, interval: Interval) -> Values:
        """Return the cosine coefficients of the forms on a cut or gap, without the sign (−1)^{g−s},
        (g, N): value = Σ_m h_m cos mψ.
        """
        checkpoint()
        xp = self.arithmetic
        forms = interval.forms(*interval.distances(xp.nodes(self.node_count(interval))))
        checkpoint()
        coefficients = xp.cosine_series(forms)
        means = np.sum(forms, axis=-1) / forms.shape[-1]
        coefficients[:, 0] = (
            xp.add_error(means, self._bound(interval, 2)) if xp.certified else means
        )
        return coefficients

    def truncation(self, interval: Interval, series: Values) -> Values:
        """Return what such a series leaves out of the forms at any real ψ, (g,): a bound where the
        arithmetic is certified, otherwise a multiple of the last terms.
        """
        if self.arithmetic.certified:
            return self._bound(interval, 1)
        return self.arithmetic.estimate_tail(series)

    def _bound(self, interval: Interval, times: int) -> Values:
        """Return the bound of what the forms' series leave out after times·N coefficients, shape
        (g,).

        With times = 1 that is the error of N coefficients at any real ψ; the alias in h_0 alone is
        below that with times = 2.
        """
        count = times * self.node_count(interval)
        return np.asarray(
            self.arithmetic.bound_tail(interval.bound_in_strip(), interval.decay, count)
        )

    @cached_property
    def series_truncation(self) -> Values:
        """Return what the angle series leave out of z_k, and of ∂z_k/∂ψ_s for all s together, at
        most, shape (g,).

        A bound where the arithmetic is certified; otherwise a multiple of the last terms.
        """
        return np.asarray(
            sum(
                np.abs(self.inverse_cycles) @ self.truncation(cut, series)
                for cut, series in zip(self.cuts, self.cut_series, strict=True)
            )
        )

    @cached_property
    def cut_series(self) -> tuple[Values, ...]:
        """Return, per cut, the cosine coefficients of du_k/dψ (signs included), shape (g, N_s)."""
        return tuple(
            (-1) ** (self.genus - s) * self._series(cut) for s, cut in enumerate(self.cuts, start=1)
        )

    @cached_property
    def gap_series(self) -> tuple[Values, ...]:
        """Return the same on the gaps, without signs."""
        return tuple(self._series(gap) for gap in self.intervals[::2])

    @cached_property
    def conjugate_cycles(self) -> Values:
        """Return B, shape (g, g)."""
        means = np.stack([series[:, 0] for series in self.gap_series], axis=-1)
        signs = (-1) ** (self.genus + 1 - np.arange(self.genus))
        return np.cumsum(signs * (2 * self.arithmetic.pi) * means, axis=-1)

    @cached_property
    def _raw_riemann_matrix(self) -> Values:
        return np.asarray(self.inverse_cycles @ self.conjugate_cycles)

    @cached_property
    def riemann_matrix_residual(self) -> Any:
        """Return max |T − Tᵀ|/max |T| before symmetrisation: the bilinear relation, a check of all
        periods at once.
        """
        raw = self._raw_riemann_matrix
        return np.max(np.abs(raw - raw.T)) / np.max(np.abs(raw))

    @cached_property
    def riemann_matrix(self) -> Values:
        """Return T, symmetric, with Riemann matrix τ = iT."""
        raw = self._raw_riemann_matrix
        return np.asarray((raw + raw.T) / 2)

    @cached_property
    def riemann_matrix_error(self) -> Any:
        """Return a bound on the error of every entry of T in doubles, of which Σ|a⁻¹||coefficients|
        of the angle series says how much it cancels where branch points are over many orders.
        """
        sizes = sum(np.sum(np.abs(series), axis=1) for series in self.cut_series)
        cancelling = max(1.0, np.max(np.abs(self.inverse_cycles) @ sizes))
        relative = max(_ENTRY_ROUNDING * cancelling, 2 * self.riemann_matrix_residual)
        return np.max(np.abs(self.riemann_matrix)) * relative


P = TypeVar("P", bound=AngleSeries)


@dataclass(frozen=True)
class AbelJacobi(Generic[P]):
    """The map of one curve; ``coarse`` is the same map in double precision, from which one in balls
    starts.
    """

    periods: P
    coarse: AbelJacobi[P] | None = None

    @property
    def arithmetic(self) -> Arithmetic:
        """Return the arithmetic of the periods."""
        return self.periods.arithmetic

    @cached_property
    def _series(self) -> tuple[Values, Values]:
        """Return the coefficients of the sines of z_k and of the cosines of ∂z_k/∂ψ_s, (g, g, M)
        each with the axes s, m, k.
        """
        cosines = np.ascontiguousarray(self.periods.angle_series.transpose(1, 2, 0))
        orders = self.arithmetic.array([1, *range(1, cosines.shape[1])])
        return cosines / orders[:, None], cosines

    def map(self, psi: Values) -> Values:
        """Return z for angles ψ of shape (N, g); ψ_s + 2π adds one to z_s."""
        sines, _ = self._series
        waves = self.arithmetic.multiples(psi, sines.shape[1])[1]
        flat = sines.reshape(-1, sines.shape[2])
        sums = self.arithmetic.product(waves.reshape(len(psi), -1), flat)
        return np.asarray(psi / (2 * self.arithmetic.pi) + self._complete(sums))

    def jacobian(self, psi: Values) -> Values:
        """Return ∂z_k/∂ψ_s for angles of shape (N, g), shape (N, g, g) with k before s."""
        _, cosines = self._series
        waves = self.arithmetic.multiples(psi, cosines.shape[1])[0]
        parts = [self.arithmetic.product(waves[:, s], x) for s, x in enumerate(cosines)]
        return np.swapaxes(self._complete(np.stack(parts, axis=1)), 1, 2)

    def _complete(self, sums: Values) -> Values:
        """Return sums of series, last axis k, with what they leave out."""
        return np.asarray(self.arithmetic.add_error(sums, self.periods.series_truncation))

    def invert(self, z: Values) -> Values:
        """Return the angles ψ with map(ψ) = z for z of shape (N, g), continuous in z on the whole
        of ℝ^g.

        Raises Unsolved (``narrow-gap``) where the iteration does not settle: next to a narrow gap
        phases hardly move with the angles.
        """
        xp = self.arithmetic
        cycles = xp.floor(z)
        psi = (
            self._in_doubles(z - cycles)
            if self.coarse is None
            else self._enclose(z - cycles, self.coarse)
        )
        return np.asarray(psi + 2 * xp.pi * cycles)

    def _in_doubles(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the angles ψ with map(ψ) = z, (N, g), by iterations in doubles that begin at
        2πz.
        """
        # loads numba, and many curves do without
        from veselova.analytic.kernel.abel import invert
        from veselova.analytic.kernel.torus import make_room

        angles, room = kernel_series(self.periods), make_room(self.periods.genus)
        psi = 2 * np.pi * z
        for i, (target, found) in enumerate(zip(z, psi, strict=True)):
            if i % _BLOCK == 0:
                checkpoint()
            if not invert(angles, target, found, room):
                gap = f"a relative gap of {self.periods.narrowest_gap:.2g}"
                remedy = "integrate numerically, or take theta functions"
                raise Unsolved("narrow-gap", f"angles are ill-conditioned at {gap}; {remedy}")
        return psi

    def _enclose(self, z: Values, coarse: AbelJacobi[P]) -> Values:
        """Newton's method on midpoints, then Krawczyk's: a box that must hold a solution, and the
        map has but one.
        """
        xp: Any = self.arithmetic
        # series are kept with the digits in which they are first formed: all of them, not the few
        # of an early step
        _ = self._series, self.periods.series_truncation
        centre = xp.midpoints(z)
        nearest = coarse.invert(DOUBLE.array(centre))
        psi = xp.array(nearest)
        inverses = xp.array(np.linalg.inv(coarse.jacobian(nearest)))
        digits = known = _COARSE_DIGITS  # of the angles, and of the inverse slopes
        while 2 * digits < xp.digits + _LOST_DIGITS:
            if digits >= 2 * known:
                with xp.at(digits) as working:
                    inverses = _inverses(self.jacobian(psi), working)
                    known = digits
            digits += known - _LOST_DIGITS
            with xp.at(digits + _LOST_DIGITS) as working:
                psi = working.midpoints(psi - _apply(inverses, self.map(psi) - centre))
        excess = self.map(psi) - z
        with xp.at(digits) as working:
            reach = working.zero_ball(2 * _apply(inverses, excess))
            slopes = self.jacobian(psi + reach)
            inverses = _inverses(slopes, working)
            rest = _apply(np.eye(self.periods.genus, dtype=int) - inverses @ slopes, reach)
        step = rest - _apply(inverses, excess)
        if not xp.contained_in(step, reach).all():
            raise Unsolved(
                "not-enclosed",
                "the Abel–Jacobi inversion: no box was proven to contain the angles",
            )
        return np.asarray(psi + step)


def _inverses(matrices: Values, xp: Any) -> Values:
    return np.stack([xp.midpoints(xp.inverse(xp.midpoints(matrix))) for matrix in matrices])


def _apply(matrices: Values, vectors: Values) -> Values:
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def kernel_series(periods: AngleSeries) -> Any:
    """Return the angle series of periods in doubles as the kernel has them."""
    from veselova.analytic.kernel.abel import AngleSeries as KernelSeries

    series = periods.angle_series
    sines = series / np.maximum(1, np.arange(series.shape[2]))
    counts = np.array([x.shape[1] for x in periods.cut_series])
    harmonics = np.zeros((2, max(4, series.shape[2])))
    return KernelSeries(counts, counts, series, sines, harmonics)
