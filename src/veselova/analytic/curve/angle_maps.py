"""The Abel–Jacobi maps of many tori in double precision, both ways: what analytic.curve.abel_jacobi
does for one, for T points on each of N tori.

No number depends on which other tori, or points, are in the arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.mechanics.core.budget import checkpoint

__all__ = ["AngleMaps"]

Array = NDArray[np.float64]

#: Budget: Newton's steps: from ψ = 2πz four to eight are usual. Points that need more are named.
MOST_STEPS = 24

#: Calibrated: a residual of this many ε is rounding; one of this many times that, which no step
#: betters, is that of long sums (as in analytic.curve.abel_jacobi).
CONVERGED = 8.0
STALLED = 1e3

#: Method: radians by which one step may move an angle: far from the solution slopes say little.
LONGEST_STEP = 1.5


@dataclass(frozen=True)
class AngleMaps:
    """ψ ↦ z = ψ/2π + Σ_s Σ_m g_{ksm} sin(mψ_s)/m on N tori.

    series: (N, g, g, M) the g_{ksm}, dz_k/dψ_s = Σ_m g_{ksm} cos mψ_s
    """

    series: Array

    @cached_property
    def _of_sines(self) -> Array:
        """Return g_{ksm}/m, m ≥ 1, (N, s, k, m)."""
        orders = np.arange(1, self.series.shape[3])
        return np.ascontiguousarray(np.swapaxes(self.series[..., 1:] / orders, 1, 2))

    @cached_property
    def _of_cosines(self) -> Array:
        """Return g_{ksm}, m ≥ 1, (N, s, k, m)."""
        return np.ascontiguousarray(np.swapaxes(self.series[..., 1:], 1, 2))

    @cached_property
    def paces(self) -> Array:
        """Return the most radians that 2πm·z with all |m_k| ≤ 1 turns by one of any ψ_s, (N,)."""
        highest = self.series.shape[3] - 1
        psi = np.linspace(0.0, np.pi, 2 * highest + 1)
        powers = np.cos(np.outer(np.arange(1, highest + 1), psi))
        slopes = self._of_cosines @ powers + np.swapaxes(self.series[..., :1], 1, 2)
        return np.asarray(2 * np.pi * np.max(np.sum(np.abs(slopes), axis=2), axis=(1, 2)))

    def part(self, rows: NDArray[np.intp]) -> AngleMaps:
        """Return the maps of some of the tori."""
        return AngleMaps(self.series[rows])

    def map(self, psi: Array) -> Array:
        """Return z for angles (N, T, g)."""
        _, sines = _cosines_and_sines(psi, self.series.shape[3] - 1)
        return self._phases(psi, sines)

    def slopes(self, psi: Array) -> Array:
        """Return ∂z_k/∂ψ_s for angles (N, T, g), shape (N, T, g, g), k before s."""
        cosines, _ = _cosines_and_sines(psi, self.series.shape[3] - 1)
        return self._slopes(cosines)

    def _phases(self, psi: Array, sines: Array) -> Array:
        return np.asarray(
            psi / (2 * np.pi) + np.einsum("nskm,nstm->ntk", self._of_sines, sines, optimize=False)
        )

    def _slopes(self, cosines: Array) -> Array:
        found = np.einsum("nskm,nstm->ntks", self._of_cosines, cosines, optimize=False)
        return np.asarray(found + self.series[:, None, :, :, 0])

    def invert(self, z: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the angles ψ with map(ψ) = z for z (N, T, g), continuous in z, and of which tori
        (N,) all have converged.
        """
        cycles = np.floor(z)
        reduced = z - cycles
        psi = 2 * np.pi * reduced
        last = np.full(z.shape[:2], np.inf)
        maps = self
        rows = np.arange(z.shape[0])
        converged = np.zeros(z.shape[0], dtype=bool)
        for _ in range(MOST_STEPS):
            checkpoint()
            cosines, sines = _cosines_and_sines(psi[rows], self.series.shape[3] - 1)
            residual = maps._phases(psi[rows], sines) - reduced[rows]
            size = np.max(np.abs(residual), axis=2)
            tolerance = CONVERGED * DOUBLE.epsilon
            stays = (size >= last[rows] / 2) & (size <= STALLED * tolerance)
            done = np.all((size <= tolerance) | stays, axis=1)
            converged[rows[done]] = True
            if done.all():
                break
            step = _solve(maps._slopes(cosines), residual)
            longest = np.max(np.abs(step), axis=2, keepdims=True)
            step *= np.minimum(1.0, LONGEST_STEP / np.maximum(longest, LONGEST_STEP))
            keep = ~done
            psi[rows[keep]] -= step[keep]
            last[rows] = size
            if 2 * np.count_nonzero(keep) <= rows.size:
                rows = rows[keep]
                maps = self.part(rows)
        return psi + 2 * np.pi * cycles, converged


def _cosines_and_sines(psi: Array, highest: int) -> tuple[Array, Array]:
    """Return cos mψ and sin mψ, m = 1 … highest, for angles (N, T, g), shape (N, g, T, M)."""
    angles = np.swapaxes(psi, 1, 2)
    result = np.empty((*angles.shape, highest), dtype=np.complex128)
    result[..., 0].real = np.cos(angles)
    result[..., 0].imag = np.sin(angles)
    known = 1
    while known < highest:
        more = min(known, highest - known)
        np.multiply(
            result[..., :more],
            result[..., known - 1 : known],
            out=result[..., known : known + more],
        )
        known += more
    return result.real, result.imag


def _solve(matrices: Array, vectors: Array) -> Array:
    """Return the solutions of (N, T, g, g) systems; of two unknowns by Cramer's rule, which is ten
    times as fast.
    """
    if vectors.shape[2] == 1:
        return np.asarray(vectors / matrices[..., 0])
    if vectors.shape[2] > 2:
        return np.asarray(np.linalg.solve(matrices, vectors[..., None])[..., 0])
    (a, b), (c, d) = (
        (matrices[..., 0, 0], matrices[..., 0, 1]),
        (matrices[..., 1, 0], matrices[..., 1, 1]),
    )
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([d * x - b * y, a * y - c * x], axis=-1) / (a * d - b * c)[..., None]
