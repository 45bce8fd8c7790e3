"""Periods of the nodal differentials over cuts and gaps, the Riemann matrix, and the angle
integrals G_s(ψ).

    a_{ks} = (−1)^{g−s} ∮_{cut s} p_k dλ/(2√|R|),   B_{ks} = Σ_{gaps j<s} (−1)^{g−j+1} ∮ p_k
        dλ/(2√|R|)
    T = a⁻¹B is real, symmetric, positive definite; the Riemann matrix is τ = iT;  f = a⁻¹e_g

On cut s the integral of a⁻¹(p_1…p_g) from b_{2s−1} is g_{s0}ψ + Σ_m g_{sm} sin(mψ)/m, one cosine
series for each s.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Arithmetic, Values
from veselova.analytic.curve.branch_points import Spectrum
from veselova.analytic.curve.hyperelliptic import Curve, Interval
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["AngleSeries", "Periods"]

#: Calibrated: nodes beyond those that the convergence rate asks for: the constant in front of it.
_EXTRA_NODES = 4

#: Calibrated: rounding of an entry of T in doubles, for each unit by which its periods cancel;
#: largest seen over random curves: 6ε.
_ENTRY_ROUNDING = 16 * DOUBLE.epsilon

#: Budget: nodes of an interval in balls: a minute.
_MOST_NODES = 100_000


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
        """Return the least gap that can close against the wider of its two cuts: how near a
        separatrix is; 1 without any.

        The first gap is one between c_1 = 0 and the least I, but for Neumann's system, where it may
        close as the others may.
        """
        widths = np.diagonal(self.curve.differences, 1).tolist()
        first = 2 if self.curve.branch_points[0] == 0 else 0
        sides = [(widths[j - 1] if j else 0, widths[j + 1]) for j in range(first, len(widths), 2)]
        gaps = zip(widths[first::2], sides, strict=True)
        return min((float(gap / (gap + max(near))) for gap, near in gaps), default=1.0)

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

    def _forms_at_nodes(self, interval: Interval) -> Values:
        """Return the forms, (g, N), at the nodes of an interval's series."""
        checkpoint()
        nodes = self.arithmetic.nodes(self.node_count(interval))
        return interval.forms(*interval.distances(nodes))

    def series(self, interval: Interval) -> Values:
        """Return the cosine coefficients of the forms on a cut or gap, without the sign (−1)^{g−s},
        (g, N): value = Σ_m h_m cos mψ.
        """
        forms = self._forms_at_nodes(interval)
        checkpoint()
        coefficients = self.arithmetic.cosine_series(forms)
        coefficients[:, 0] = self._mean(interval, forms)
        return coefficients

    def truncation(self, interval: Interval, series: Values) -> Values:
        """Return what such a series leaves out of the forms at any real ψ, (g,): a bound where the
        arithmetic is certified, otherwise a multiple of the last terms.
        """
        if self.arithmetic.certified:
            return self._bound(interval, 1)
        return self.arithmetic.estimate_tail(series)

    def _mean(self, interval: Interval, forms: Values) -> Values:
        """Return h_0, shape (g,)."""
        mean = np.asarray(np.sum(forms, axis=-1) / forms.shape[-1])
        certified = self.arithmetic.certified
        return self.arithmetic.add_error(mean, self._bound(interval, 2)) if certified else mean

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
            (-1) ** (self.genus - s) * self.series(cut) for s, cut in enumerate(self.cuts, start=1)
        )

    @cached_property
    def conjugate_cycles(self) -> Values:
        """Return B, shape (g, g)."""
        gaps = self.intervals[::2]
        means = np.stack([self._mean(gap, self._forms_at_nodes(gap)) for gap in gaps], axis=-1)
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
