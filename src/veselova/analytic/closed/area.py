"""Motions with another direction on the torus than that of the rank-one problem: bodies with an
area constant, and Chaplygin's ball in ℝⁿ; and the paths of balls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb
from numpy.typing import NDArray

from veselova.analytic.closed.area_veselova import AreaVeselova, RollingAreaVeselova
from veselova.analytic.spectrum.moving_part import Moving, rational
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.systems.rolling_veselova import CommutingVeselova, RollingVeselova
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["BallPath", "flow_of", "joins", "path_of", "side_of"]

Array = NDArray[np.float64]

#: Derived: roundings of a displacement in ε: of the speed, of its product with the time, and of the
#: sums.
_ROUNDINGS = 6.0


def flow_of(problem: TorusProblem, moving: Moving, points: Sequence[arb]) -> list[arb]:
    """Return du/dτ₁ = L(p_k) for the nodal differentials p_k dλ/2w, (g,), from branch points."""
    g = moving.size - 1
    first, last = (arb(rational(x)) for x in _functional(problem, moving))
    nodes = [(points[2 * k] + points[2 * k + 1]) / 2 for k in range(1, g)]
    flow = [
        first * math.prod((-x for j, x in enumerate(nodes) if j != k), start=arb(1))
        for k in range(g)
    ]
    flow[-1] += last
    return flow


def _functional(problem: TorusProblem, moving: Moving) -> tuple[Fraction, Fraction]:
    """Return L(1) and L(λ^(g−1)), which add up where g = 1; L is zero for powers between them. A
    has its smallest entry as its unit.

    Where a direction is frozen λ stays at its I, and L of what is left is P ↦ L((λ−I)P).
    """
    g = moving.size - 1
    if isinstance(problem, AreaVeselova):  # du = (−μ2, ς) dτ₁ for dλ/2w, λdλ/2w
        last = Fraction(problem.sign)
        if g == 1:
            return problem.mu2 / moving.frozen[0], last
        return -problem.mu2 / moving.unit, last
    if isinstance(problem, CommutingVeselova):  # du = ((−1)^(n−2)/D, 0, …, 0, −1) dτ₁
        whole = problem.n - 1
        first = Fraction((-1) ** (whole - 1)) / (problem.added * moving.unit ** (whole - 1))
        return first * math.prod(-moving.unit / a for a in moving.frozen), Fraction(-1)
    return Fraction(0), Fraction(1)


def joins(problem: TorusProblem, torus: Any) -> bool:
    """Return whether c_2 is I_2, a separatrix, as far as the data of an area constant tell."""
    if not isinstance(problem, AreaVeselova) or torus.of_c.size < 2:
        return False
    first, middle, last = torus.of_I
    distance = torus.d[min(middle, torus.of_c[1]), max(middle, torus.of_c[1])]
    return bool(distance < float(problem.told_apart) * torus.d[first, last])


def side_of(problem: TorusProblem, n_2: Array) -> float:
    """Return the sign of u against n_2 at the start; zero without an area constant."""
    if not isinstance(problem, AreaVeselova):
        return 0.0
    return float(np.sign(n_2 @ to_float(problem.columns[1])))


@dataclass(frozen=True)
class BallPath:
    """The displacement of a ball of radius one, (D,) components: a uniform part, and integrals of
    functions on the torus.

        ∫(e_k, q̇) dt = Σ_j y_j ℜ_jk,  y_j = ± ∫(q',n_j) dτ₁,  y_γ = speed·t,
        [μ1k_h t − across ∫odd dτ₁] n + ς ∫(q',u) dτ₁ e_⊥      with an area constant

    ``odd`` is the part of dt/dτ₁ that is odd in n_2. ``RollingVeselova`` and ``AreaVeselova`` say
    how both make the path.

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
