"""The path of a ball of radius one: a uniform part, and integrals of functions on the torus.

    ∫(e_k, q̇) dt = Σ_j y_j ℜ_jk,  y_j = ± ∫(q',n_j) dτ₁,  y_γ = speed·t,
    [μ1k_h t − across ∫odd dτ₁] n + ς ∫(q',u) dτ₁ e_⊥      with an area constant

``odd`` is the part of dt/dτ₁ that is odd in n_2. ``RollingVeselova`` and ``AreaVeselova`` say how
both make the path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.systems.area_veselova import RollingAreaVeselova
from veselova.mechanics.systems.rolling_veselova import CommutingVeselova, RollingVeselova
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["BallPath", "path_of"]

Array = NDArray[np.float64]

#: Derived: roundings of a displacement in ε: of the speed, of its product with the time, and of the
#: sums.
_ROUNDINGS = 6.0


@dataclass(frozen=True)
class BallPath:
    """A displacement, (D,) components.

    - uniform: (D,) per unit of time; factors: (K, D) of the integrals
    """

    uniform: Array
    factors: Array

    def at(
        self, times: Array, integrals: Array, errors: Array, late: float | Array = 0.0
    ) -> tuple[Array, Array]:
        """Return the displacement (T, D) and its error (T,) from the integrals and their errors
        (K, T); ``late``: what the times are off by.
        """
        along, across = times[:, None] * self.uniform, integrals.T @ self.factors
        sizes = np.abs(along) + np.abs(integrals.T) @ np.abs(self.factors)
        errors = errors.T @ np.abs(self.factors) + _ROUNDINGS * np.finfo(float).eps * sizes
        loose = np.max(np.abs(self.uniform), initial=0.0) * late
        return along + across, np.max(errors, axis=1) + loose


def path_of(problem: TorusProblem, turn: Array, side: float) -> BallPath | None:
    """Return the path of a ball, None of a body that does not roll; turn: ℜ (g, n−1)."""
    if isinstance(problem, RollingAreaVeselova):
        uniform = np.array([float(problem.uniform), 0.0])
        rows = [[0.0, problem.sign * side], [-float(problem.across), 0.0]]
        return BallPath(uniform, np.array(rows if len(turn) > 1 else []).reshape(-1, 2))
    if isinstance(problem, RollingVeselova):
        # across the momentum Chaplygin's ball in ℝⁿ moves by −q̇
        across = -1.0 if isinstance(problem, CommutingVeselova) else 1.0
        return BallPath(problem.speed * turn[-1], across * turn[:-1])
    return None
