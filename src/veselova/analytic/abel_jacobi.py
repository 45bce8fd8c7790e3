"""The Abel–Jacobi map in real angles, both ways: ψ ↦ z = Σ_s G_s(ψ_s) and Newton's method back.

ψ_s is the elliptic angle of λ_s on its cut. The map is a real-analytic diffeomorphism of the torus, z_k = ψ_k/2π plus a
periodic part, so ψ = 2πz starts the iteration.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.periods import Periods
from veselova.analytic.precision import DOUBLE, Arithmetic, Values
from veselova.mechanics.errors import InternalContradiction, Unsolved

__all__ = ["NARROW_GAP", "AbelJacobi"]

#: Newton steps before giving up; 4 to 8 are usual, a few dozen appear where a cut nearly reaches its neighbour.
_MOST_STEPS = 100

#: Relative gaps from which a failure to settle is the curve's, not ours: with both neighbours near such a gap, phases hardly
#: move with the angles.
NARROW_GAP = 1e-6

#: A residual of this many ε per unit of z is rounding.
_SETTLED = 8.0


@dataclass(frozen=True)
class AbelJacobi:
    """The map of one curve; ``coarse`` is the same map in double precision, from which a finer one starts."""

    periods: Periods
    coarse: AbelJacobi | None = None

    @property
    def arithmetic(self) -> Arithmetic:
        """Return the arithmetic of the periods."""
        return self.periods.arithmetic

    @cached_property
    def _sines(self) -> Values:
        """Return the coefficients of sin(mψ_s) in z_k, m ≥ 1, shape (g·M, g): rows (s, m), columns k."""
        series = self.periods.angle_series[:, :, 1:]
        orders = self.arithmetic.array(list(range(1, series.shape[2] + 1)))
        return np.ascontiguousarray((series / orders).transpose(1, 2, 0).reshape(-1, self.periods.genus))

    @cached_property
    def _cosines(self) -> Values:
        """Return the coefficients of cos(mψ_s) in dz_k/dψ_s, shape (g, M, g): s, m, k."""
        return np.ascontiguousarray(self.periods.angle_series.transpose(1, 2, 0))

    def _waves(self, psi: Values, first: int) -> Values:
        orders = self.arithmetic.array(list(range(first, self.periods.angle_series.shape[2])))
        return psi[..., None] * orders

    def map(self, psi: Values) -> Values:
        """Return z for angles ψ of shape (N, g); ψ_s + 2π adds one to z_s."""
        xp, shape = self.arithmetic, psi.shape
        waves = xp.sin(self._waves(psi, 1)).reshape(shape[0], -1)
        return np.asarray(psi / (2 * xp.pi) + waves @ self._sines)

    def jacobian(self, psi: Values) -> Values:
        """Return ∂z_k/∂ψ_s for angles of shape (N, g), shape (N, g, g) with k before s."""
        waves = self.arithmetic.cos(self._waves(psi, 0))
        return np.stack([waves[:, s] @ self._cosines[s] for s in range(self.periods.genus)], axis=2)

    def invert(self, z: Values) -> Values:
        """Return the angles ψ with map(ψ) = z for z of shape (N, g), continuous in z on the whole of ℝ^g.

        Raises Unsolved where the iteration does not settle for a gap that is too narrow (InternalContradiction otherwise).
        """
        xp = self.arithmetic
        cycles = xp.floor(z)
        reduced = z - cycles
        psi = self._newton(reduced) if self.coarse is None else self._refine(reduced, self.coarse)
        return np.asarray(psi + 2 * xp.pi * cycles)

    def _newton(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        psi = 2 * np.pi * z
        residual = self.map(psi) - z
        open_ = np.arange(z.shape[0])
        step_fraction = np.ones(z.shape[0])
        tolerance = _SETTLED * DOUBLE.epsilon
        for _ in range(_MOST_STEPS):
            size = np.max(np.abs(residual[open_]), axis=1)
            open_ = open_[size > tolerance]
            if open_.size == 0:
                return psi
            try:
                step = np.linalg.solve(self.jacobian(psi[open_]), residual[open_][:, :, None])[:, :, 0]
            except np.linalg.LinAlgError:
                break
            trial = psi[open_] - step_fraction[open_, None] * step
            trial_residual = self.map(trial) - z[open_]
            better = np.max(np.abs(trial_residual), axis=1) < np.max(np.abs(residual[open_]), axis=1)
            accepted = open_[better]
            psi[accepted], residual[accepted] = trial[better], trial_residual[better]
            step_fraction[accepted] = np.minimum(1.0, 4 * step_fraction[accepted])
            step_fraction[open_[~better]] /= 4
            # A full step that no longer improves has met the rounding of the sums, which grows with their length.
            stalled = open_[~better & (np.max(np.abs(residual[open_]), axis=1) < 1e4 * tolerance)]
            open_ = np.setdiff1d(open_, stalled, assume_unique=True)
        gap = self.periods.curve.narrowest_gap
        if gap < NARROW_GAP:
            raise Unsolved(
                "narrow-gap", f"angles are ill-conditioned at a relative gap of {gap:.2g}; theta quotients serve to n = 8"
            )
        raise InternalContradiction(f"the Abel–Jacobi inversion left a residual of {np.max(np.abs(residual)):.2g}")

    def _refine(self, z: Values, coarse: AbelJacobi) -> Values:
        """Newton's method with the double-precision Jacobian: each step adds some fourteen digits."""
        xp = self.arithmetic
        start = coarse.invert(DOUBLE.array(z))
        slopes = xp.array(np.linalg.inv(coarse.jacobian(start)))
        psi = xp.array(start)
        for _ in range(2 + self.arithmetic.digits // 10):
            residual = self.map(psi) - z
            psi = psi - np.stack([slope @ row for slope, row in zip(slopes, residual, strict=True)])
            if np.max(np.abs(residual)) <= _SETTLED * xp.epsilon:
                return np.asarray(psi)
        raise InternalContradiction("the Abel–Jacobi inversion did not settle in extended precision")
