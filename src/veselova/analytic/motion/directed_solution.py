"""Closed-form motions whose direction on the torus is another than that of the rank-one problem."""

from __future__ import annotations

import math
from abc import abstractmethod
from fractions import Fraction
from functools import cached_property

import numpy as np

from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.time_map.guard_digits import extended_precision_flows
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.systems.commuting_veselova import CommutingVeselova

__all__ = ["CommutingSolution", "DirectedSolution"]


#: Calibrated: Σ|a⁻¹||du| over |f| from which frequencies, which have cancelled, are those of
#: extended precision.
_CANCELLED = 8.0


class DirectedSolution(Solution):
    """A solution with f = a⁻¹ du/dτ₁ for another du/dτ₁ than e_g."""

    @property
    @abstractmethod
    def direction(self) -> list[Fraction]:
        """Return du/dτ₁ for the nodal differentials, exact but for the branch points, (g,)."""

    @cached_property
    def _direction(self) -> list[Fraction]:
        return self.direction

    @property
    def _nodes(self) -> list[Fraction]:
        """Return the zeros ζ_1 … ζ_{g−1} of the last nodal differential."""
        points = self.spectrum.branch_points
        with self.spectrum.working():
            return [
                Fraction((points[2 * s][0] + points[2 * s + 1][0]) / 2)
                for s in range(1, self.curve.genus)
            ]

    @cached_property
    def _flows(self) -> tuple[LinearFlow, LinearFlow]:
        direction = to_float(self._direction)
        inverse = self.periods.inverse_cycles
        f = inverse @ direction
        if np.any(np.abs(inverse) @ np.abs(direction) > _CANCELLED * np.abs(f)):
            return self.precise_flows[:2]
        return LinearFlow.of(self._origin, f), LinearFlow.of(self._origin, f / self.rate.mean)

    @cached_property
    def in_tau1(self) -> LinearFlow:
        """Return z(τ₁) = z⁰ + fτ₁."""
        return self._flows[0]

    @cached_property
    def in_time(self) -> LinearFlow:
        """Return the uniform part z⁰ + Ωt, Ω = f/F_0."""
        return self._flows[1]

    @cached_property
    def precise_flows(self) -> tuple[LinearFlow, LinearFlow, float]:
        """Return both flows and F_0 with guard digits."""
        return extended_precision_flows(
            self.spectrum, self._origin, self.problem.time, self._direction
        )


class CommutingSolution(DirectedSolution):
    """The solution of a ``CommutingVeselova`` problem: du/dτ₁ = ((−1)^(g−1)/D, 0, …, 0, −1) for the
    forms λ^(k−1)dλ/2w.
    """

    problem: CommutingVeselova

    @property
    def direction(self) -> list[Fraction]:
        """Return L(p_k) of the polynomials p_k of the nodal differentials, L(λ^(k−1)) = du_k.

        Where a direction is frozen λ stays at its I, and L of what is left is P ↦ L((λ−I)P).
        """
        unit = self.moving.unit
        g = self.problem.n - 1
        constant = Fraction((-1) ** (g - 1)) / (self.problem.added * unit ** (g - 1))
        constant *= math.prod(-unit / a for a in self.moving.frozen)
        nodes = self._nodes
        without_one = [
            constant * math.prod(-node for j, node in enumerate(nodes) if j != k)
            for k in range(len(nodes))
        ]
        return [*without_one, constant * math.prod(-node for node in nodes) - 1]
