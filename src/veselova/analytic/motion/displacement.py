"""Where a rolling ball goes, from integrals of functions on the torus along its orbit."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.motion.area_motion import largest_component
from veselova.analytic.motion.area_solution import AreaSolution
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.time_map.fourier_modes import TorusSeries
from veselova.analytic.time_map.torus_series import NormalComponent, find_series
from veselova.mechanics.systems.area_veselova import RollingAreaVeselova
from veselova.mechanics.systems.commuting_veselova import CommutingVeselova
from veselova.mechanics.systems.rolling_veselova import RollingVeselova

__all__ = ["Displacement", "WithAreaConstant", "displacement_of"]

Array = NDArray[np.float64]

#: Derived: roundings of a displacement: of the speed, of its product with the time, and of those
#: with ℜ.
_ROUNDINGS = 6.0

#: Calibrated: how large a function may be that is at most one at the half periods.
_BETWEEN = 2.0


@dataclass(frozen=True)
class Displacement(ABC):
    """The series ``displacement`` of a problem: a uniform part, and integrals of functions on the
    torus of order one.
    """

    solution: Solution

    @property
    @abstractmethod
    def count(self) -> int:
        """Return the number of functions."""

    @property
    @abstractmethod
    def series(self) -> list[TorusSeries]:
        """Return their Fourier series."""

    @abstractmethod
    def integrands(self, attitude: Attitude) -> Array:
        """Return the functions at attitudes, (N, K)."""

    @property
    @abstractmethod
    def bounds(self) -> Array:
        """Return how large they may be, (K,)."""

    @property
    @abstractmethod
    def speed(self) -> float:
        """Return the speed of the uniform part."""

    def at(self, times: Array, remainders: Array | None, integrals: Array) -> Array:
        """Return the displacement at times, from the integrals (N, K)."""
        along = self.speed * times
        if remainders is not None:
            along = along + self.speed * remainders
        return self._combine(along, integrals)

    @abstractmethod
    def _combine(self, along: Array, integrals: Array) -> Array:
        """Return the displacement from the lengths of the uniform part and the integrals."""

    @staticmethod
    def _rounding(displacement: Array) -> Array:
        """Return the rounding of the products and sums that a displacement is made of."""
        size = largest_component(displacement)
        return np.asarray(_ROUNDINGS * np.finfo(float).eps * size)

    @abstractmethod
    def error(self, displacement: Array, errors: Array) -> Array:
        """Return the error of a displacement (N, 2), from those of the integrals (N, K)."""


class AlongMomentum(Displacement):
    """Without an area constant: uniform along γ of the natural frame, (q',n_k) across it.

    ``RollingVeselova`` says how both make the path.
    """

    @property
    def count(self) -> int:
        """Return g−1."""
        return self.solution.curve.genus - 1

    @property
    def series(self) -> list[TorusSeries]:
        """Return those of (q',n_k), k = 2 … g."""
        solution = self.solution
        return [
            find_series(NormalComponent.of(solution.frame, solution.inversion, k))
            for k in range(1, solution.curve.genus)
        ]

    def integrands(self, attitude: Attitude) -> Array:
        """Return (q',n_k)."""
        return np.asarray(attitude.components[:, : self.count])

    @property
    def bounds(self) -> Array:
        """Return ones: |q'| ≤ 1 in these units."""
        return np.ones(self.count)

    @property
    def speed(self) -> float:
        """Return the speed along the momentum."""
        problem = self.solution.problem
        assert isinstance(problem, RollingVeselova)
        return problem.speed

    def _combine(self, along: Array, integrals: Array) -> Array:
        """Return ∫(e_k, q̇) dt = Σ_j y_j ℜ_jk, y_γ growing with the speed."""
        across = self.side * integrals
        return np.concatenate([across, along[:, None]], axis=1) @ self.solution.rotation

    @property
    def side(self) -> float:
        """Return −1 for Chaplygin's ball in ℝⁿ: across the momentum it moves by −q̇."""
        return -1.0 if isinstance(self.solution.problem, CommutingVeselova) else 1.0

    def error(self, displacement: Array, errors: Array) -> Array:
        """Return √g of the largest error, and the rounding of the products with ℜ and the speed."""
        across = np.max(errors, axis=1, initial=0.0)
        scale = math.sqrt(self.solution.curve.genus)
        return np.asarray(scale * across + self._rounding(displacement))


class WithAreaConstant(Displacement):
    """With an area constant: uniform along n, with the odd part of the time; (q',u) along e_⊥.

    ``AreaVeselova`` has the formula.
    """

    solution: AreaSolution

    @cached_property
    def peaks(self) -> Array:
        """Return the largest values of (q',n_2) and of the odd part at the half periods, or those
        that move a ball by |Ω| where they are less: below their rounding they are noise.

        Where K is nearly along γ both are small, and the unit of τ₁ is large.
        """
        solution = self.solution
        if not solution.side:
            return np.zeros(0)
        across = float(np.max(np.abs(solution.at_half_periods[1].components[:, 0])))
        usual = abs(solution.problem.spin * solution.mean_rate)
        peaks = [max(across, usual)]
        if solution.odd_peak:
            peaks.append(max(solution.odd_peak, usual / abs(solution.problem.across)))
        return np.array(peaks)

    @property
    def count(self) -> int:
        """Return 2, or fewer where u is frozen or the time has no odd part."""
        return self.peaks.size

    @property
    def series(self) -> list[TorusSeries]:
        """Return those of (q',n_2) and of the odd part of dt/dτ₁, over their peaks."""
        solution = self.solution
        if not self.count:
            return []
        component = NormalComponent.of(solution.frame, solution.inversion, 1)
        across = find_series(replace(component, scale=component.scale / self.peaks[0]))
        if not solution.odd_peak:
            return [across]
        return [across, solution.odd_series.scaled(solution.odd_peak / float(self.peaks[1]))]

    def integrands(self, attitude: Attitude) -> Array:
        """Return (q',n_2) and the odd part of dt/dτ₁, over their peaks."""
        found = [attitude.components[:, 0], self.solution.odd_rate_of(attitude)]
        return np.stack(found[: self.count], axis=-1) / self.peaks

    @property
    def bounds(self) -> Array:
        """Return more than one for what is one at half periods."""
        return np.full(self.count, _BETWEEN)

    @property
    def _factors(self) -> Array:
        """Return what the integrals are multiplied with, (K,)."""
        problem = self.solution.problem
        factors = np.array([problem.sign * self.solution.side, -problem.across])
        return factors[: self.count] * self.peaks

    @property
    def speed(self) -> float:
        """Return μ1k_h."""
        return self.solution.problem.uniform

    def _combine(self, along: Array, integrals: Array) -> Array:
        """Return the coefficients of n and e_⊥."""
        result = np.stack([along, np.zeros_like(along)], axis=1)
        for k, factor in enumerate(self._factors):
            result[:, 1 - k] += factor * integrals[:, k]
        return result

    def error(self, displacement: Array, errors: Array) -> Array:
        """Return the errors of the integrals with their factors, and the rounding of the sums."""
        return np.asarray(errors @ np.abs(self._factors) + self._rounding(displacement))


def displacement_of(solution: Solution) -> Displacement | None:
    """Return the displacement of a ball; None for a body that does not roll."""
    if isinstance(solution.problem, RollingAreaVeselova):
        assert isinstance(solution, AreaSolution)
        return WithAreaConstant(solution)
    return AlongMomentum(solution) if isinstance(solution.problem, RollingVeselova) else None
