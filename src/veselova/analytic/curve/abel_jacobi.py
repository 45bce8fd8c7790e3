"""The Abel–Jacobi map in real angles, both ways: ψ ↦ z = Σ_s G_s(ψ_s) and Newton's method back.

ψ_s is the elliptic angle of λ_s on its cut. The map is a real-analytic diffeomorphism of the torus,
z_k = ψ_k/2π plus a periodic part, so ψ = 2πz starts the iteration. In doubles the kernel inverts
it; in balls Newton's and Krawczyk's methods start from there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Arithmetic, Values
from veselova.analytic.curve.periods import AngleSeries
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["AbelJacobi", "kernel_series"]

#: Derived: digits of the angles from which an inversion in balls starts, and those that a doubling
#: by Newton's method loses to the slopes.
_COARSE_DIGITS = 12
_LOST_DIGITS = 2

#: Budget: points inverted between two checkpoints.
_BLOCK = 100

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
        reduced = z - cycles
        psi = (
            self._in_doubles(reduced)
            if self.coarse is None
            else self._enclose(reduced, self.coarse)
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
