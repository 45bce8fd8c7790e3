"""Motions with another direction on the torus than that of the rank-one problem: bodies with an
area constant, and Chaplygin's ball in ℝⁿ.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb
from numpy.typing import NDArray

from veselova.analytic.spectrum.moving_part import Moving, rational
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.rolling_veselova import CommutingVeselova
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["flow_of", "joins", "side_of"]

Array = NDArray[np.float64]


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
