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
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import Balls, Values
from veselova.analytic.curve.hyperelliptic import Curve, Interval, narrowest_gap
from veselova.analytic.curve.kernel_text import text_over, zeros
from veselova.analytic.kernel.abel import AngleSeries, abel, invert_all
from veselova.analytic.kernel.torus import make_room
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["AbelInDoubles", "AbelJacobi", "Periods"]

Array = NDArray[np.float64]

#: Calibrated: nodes beyond those that the convergence rate asks for: the constant in front of it.
_EXTRA_NODES = 4

#: Derived: terms of an angle series in doubles are larger.
_SMALLEST = 1e-18

#: Budget: nodes of an interval in balls: a minute.
_MOST_NODES = 100_000

#: Derived: digits of the angles from which an inversion in balls starts, and those that a doubling
#: by Newton's method loses to the slopes.
_COARSE_DIGITS = 12
_LOST_DIGITS = 2

#: Budget: points inverted between two checkpoints.
_BLOCK = 100


class Periods:
    """The period data of a curve: cycles a, frequencies f, the Riemann matrix, and the series of
    the Abel–Jacobi map.
    """

    def __init__(self, curve: Curve) -> None:
        self.curve = curve
        self.arithmetic = curve.arithmetic
        self.genus = curve.genus

    @cached_property
    def cycles(self) -> Values:
        """Return a, shape (g, g)."""
        signs = (-1) ** np.arange(self.genus - 1, -1, -1)
        return np.asarray(self._means(self.cuts) * signs * (2 * self.arithmetic.pi))

    @cached_property
    def inverse_cycles(self) -> Values:
        """Return a⁻¹."""
        return self.arithmetic.inverse(self.cycles)

    @property
    def frequencies(self) -> Values:
        """Return f = a⁻¹e_g, cycles per unit of τ: z(τ) = z⁰ + fτ."""
        return self.inverse_cycles[:, self.genus - 1]

    @cached_property
    def angle_series(self) -> tuple[Values, ...]:
        """Return, per cut, the g_{ksm} of dz_k/dψ_s = Σ_m g_{ksm} cos mψ_s, shape (g, N_s)."""
        return tuple(self.inverse_cycles @ series for series in self.cut_series)

    @property
    def narrowest_gap(self) -> float:
        """Return the least gap that can close, relative to what is around it."""
        return narrowest_gap(self.curve.differences, self.curve.branch_points[0] != 0)

    @cached_property
    def intervals(self) -> tuple[Interval, ...]:
        """Return [b_j, b_{j+1}], gaps and cuts in turn."""
        return tuple(Interval(self.curve, j) for j in range(2 * self.genus))

    @property
    def cuts(self) -> tuple[Interval, ...]:
        """Return the cuts s = 1…g."""
        return self.intervals[1::2]

    def roots_on_cuts(self, psi: Values) -> tuple[Values, Values]:
        """Return the ``roots`` of every cut at angles (N, g), each (g, N)."""
        below, above = zip(*(cut.roots(psi[:, s]) for s, cut in enumerate(self.cuts)), strict=True)
        return np.stack(below), np.stack(above)

    def node_count(self, interval: Interval) -> int:
        """Return the number of midpoint nodes whose interpolating cosine series holds the forms to
        the working precision; raises Unsolved (``narrow-gap``) where it takes minutes in balls.

        Coefficients fall like e^(−π m K'/K); the means, with error e^(−2πN K'/K), have twice the
        digits. Where errors are to be bounded, half the strip is given up: the forms are unbounded
        at its edge.
        """
        rate = interval.strip if self.arithmetic.certified else 2 * interval.strip
        count = _EXTRA_NODES + math.ceil(self.arithmetic.nats / rate)
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
        forms = interval.forms(xp.nodes(self.node_count(interval)))[1]
        checkpoint()
        coefficients = xp.cosine_series(forms)
        if xp.certified:
            coefficients[:, 0] = xp.add_error(coefficients[:, 0], self._bound(interval, 2))
        return coefficients

    def _at_nodes_of_mean(self, interval: Interval) -> tuple[Values, Values]:
        """Return λ−b_left (N,) and the forms (g, N) at nodes whose mean has the working precision:
        half of those of a series do, unless what they leave out is to be bounded.
        """
        xp, count = self.arithmetic, self.node_count(interval)
        count = count if xp.certified else count // 2 + _EXTRA_NODES
        return interval.forms(xp.nodes(count))

    def _means(self, intervals: Sequence[Interval]) -> Values:
        """Return the means of the forms over intervals, without signs, shape (g, g)."""
        xp, found = self.arithmetic, []
        for interval in intervals:
            checkpoint()
            forms = self._at_nodes_of_mean(interval)[1]
            means = np.sum(forms, axis=-1) / forms.shape[-1]
            found.append(xp.add_error(means, self._bound(interval, 2)) if xp.certified else means)
        return np.stack(found, axis=-1)

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
        means = self._means(self.intervals[::2])
        signs = (-1) ** (self.genus + 1 - np.arange(self.genus))
        return np.cumsum(signs * (2 * self.arithmetic.pi) * means, axis=-1)

    def mean_flow(self, time: int, flow: Values) -> tuple[Values, Any]:
        """Return f = a⁻¹flow (g,), and the mean over the torus of Π_s ``rate_factor`` of the
        kernel's time, det ã/det a, where ã has the factors: by means over cuts alone.
        """
        xp, points, rows = self.arithmetic, self.curve.branch_points, []
        for s, cut in enumerate(self.cuts):
            below, forms = self._at_nodes_of_mean(cut)
            forms = (-1) ** (self.genus - s - 1) * forms * (2 * xp.pi / len(below))
            factors = text_over(xp).rate_factor(points, time, s, below)
            rows.append(np.sum([forms, forms * factors], axis=-1))
        a, of_rate = np.stack(rows, axis=-1)
        return xp.inverse(a) @ flow, xp.determinant(of_rate) / xp.determinant(a)

    @cached_property
    def riemann_matrix(self) -> Values:
        """Return T, symmetric, with Riemann matrix τ = iT."""
        raw = self.inverse_cycles @ self.conjugate_cycles
        return np.asarray((raw + raw.T) / 2)


class AbelInDoubles:
    """The Abel–Jacobi map in doubles, by the kernel.

    - angle_series: as of ``Periods``, its numbers of any kind
    - narrowest_gap: the least gap between cuts, relative to what is around it
    """

    def __init__(self, angle_series: Sequence[Values], narrowest_gap: float) -> None:
        self._gap, series = narrowest_gap, [x.astype(np.float64) for x in angle_series]
        counts = [1 + int(np.flatnonzero(np.max(np.abs(x), 0) > _SMALLEST)[-1]) for x in series]
        self.genus = g = len(series)
        slopes = np.zeros((g, g, max(counts)))
        for s, (count, known) in enumerate(zip(counts, series, strict=True)):
            slopes[:, s, :count] = known[:, :count]
        sines = slopes / np.maximum(1, np.arange(slopes.shape[2]))
        terms = np.array(counts)
        self.angles = AngleSeries(terms, terms, slopes, sines, np.zeros((2, max(4, *counts))))

    def at(self, psi: Array) -> tuple[Array, Array]:
        """Return z, (N, g), and ∂z_k/∂ψ_s, (N, g, g), at angles (N, g)."""
        z, slopes = np.empty(psi.shape), np.empty((*psi.shape, self.genus))
        for point in zip(np.array(psi), z, slopes, strict=True):
            abel(self.angles, *point)
        return z, slopes

    def invert(self, z: Array) -> Array:
        """Return the angles ψ of phases z, (N, g), continuous in z on the whole of ℝ^g.

        Raises Unsolved (``narrow-gap``) where the iteration does not settle: next to a narrow gap
        phases hardly move with the angles.
        """
        room, cycles = make_room(self.genus), np.floor(z)
        targets = np.ascontiguousarray(z - cycles)
        psi = 2 * np.pi * targets
        for i in range(0, len(z), _BLOCK):
            checkpoint()
            part = targets[i : i + _BLOCK]
            if invert_all(self.angles, part, psi[i : i + _BLOCK], room) < len(part):
                why = f"angles are ill-conditioned at a relative gap of {self._gap:.2g}; "
                raise Unsolved("narrow-gap", f"{why}integrate numerically, or take theta functions")
        return np.asarray(psi + 2 * np.pi * cycles)


@dataclass(frozen=True)
class AbelJacobi:
    """The map of one curve."""

    periods: Periods

    @property
    def arithmetic(self) -> Balls:
        """Return the arithmetic of the periods."""
        return self.periods.arithmetic

    @cached_property
    def in_doubles(self) -> AbelInDoubles:
        """Return the same map in doubles, from which inversion starts."""
        return AbelInDoubles(self.periods.angle_series, self.periods.narrowest_gap)

    @cached_property
    def _series(self) -> tuple[Values, Values]:
        """Return the coefficients of the sines of z_k and of the cosines of ∂z_k/∂ψ_s, (g, g, M)
        each with the axes s, m, k.
        """
        series, g = self.periods.angle_series, self.periods.genus
        cosines = zeros((g, max(x.shape[1] for x in series), g))
        for s, known in enumerate(series):
            cosines[s, : known.shape[1]] = known.T
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
        of ℝ^g. Raises Unsolved as ``AbelInDoubles``, and where no box encloses them.
        """
        cycles = self.arithmetic.floor(z)
        return np.asarray(self._enclose(z - cycles) + 2 * self.arithmetic.pi * cycles)

    def _enclose(self, z: Values) -> Values:
        """Newton's method on midpoints, then Krawczyk's: a box that must hold a solution, and the
        map has but one.
        """
        xp = self.arithmetic
        # series are kept with the digits in which they are first formed: all of them, not the few
        # of an early step
        _ = self._series, self.periods.series_truncation
        centre = xp.midpoints(z)
        nearest = self.in_doubles.invert(centre.astype(np.float64))
        psi = xp.array(nearest)
        inverses = xp.array(np.linalg.inv(self.in_doubles.at(nearest)[1]))
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
