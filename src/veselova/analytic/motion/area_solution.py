"""The closed-form motion of a body with an area constant, on the torus of its rank-one problem.

``AreaVeselova`` has the formulas. The curve, the phases at the start and the frame {v, u, n} are
those of the rank-one problem. The direction of the flow and the time differ.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.attitude.sensitivity_sampling import sample_phases
from veselova.analytic.motion.directed_solution import CommutingSolution, DirectedSolution
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.spectrum.branch_points import Spectrum, resolve_spectrum
from veselova.analytic.spectrum.moving_part import Moving, moving_part
from veselova.analytic.time_map.cross_component import CrossComponent
from veselova.analytic.time_map.fourier_modes import TorusSeries
from veselova.analytic.time_map.torus_series import find_series
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.commuting_veselova import CommutingVeselova
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["AreaSolution", "solution_of"]

Array = NDArray[np.float64]

#: Derived: a variation of dt/dτ₁ below this is mild, whatever samples add to it.
_MILD = 5.0

#: Calibrated: by how much more than at the sampled phases dt/dτ₁ may vary.
_BETWEEN = 2.0


class AreaSolution(DirectedSolution):
    """The solution of an ``AreaVeselova`` problem: f = a⁻¹(−μ2, ς) for the forms dλ/2w, λdλ/2w,
    dt/dτ₁ = dt'/dτ₁ (1 − tilt (u,A'v)/(v,A'v)).
    """

    problem: AreaVeselova

    def __init__(self, problem: AreaVeselova, distance: Fraction | None = None) -> None:
        super().__init__(problem, distance)
        if not self.separatrices and self._joins(self.spectrum, problem):
            self.separatrices = (self.moving.axes[1],)

    def _moving_part(self, problem: TorusProblem, distance: Fraction | None) -> Moving:
        """Return what moves, by ``distance`` off a separatrix that the digits of the data leave
        open.
        """
        assert isinstance(problem, AreaVeselova)
        moving = moving_part(problem)
        if distance is None or moving.size < 3:
            return moving
        found = resolve_spectrum(moving, DOUBLE.digits)
        joins = not found.separatrices and self._joins(found.spectrum, problem)
        return moving.perturb(1, distance) if joins else moving

    @staticmethod
    def _joins(spectrum: Spectrum, problem: AreaVeselova) -> bool:
        """Return whether c_2 is I_2, as far as the data tell."""
        if len(spectrum.inverse) < 3:
            return False
        lowest, middle, highest = map(Fraction, spectrum.inverse)
        distance = abs(Fraction(spectrum.constants[1]) - middle)
        return distance < problem.told_apart * (highest - lowest)

    @property
    def direction(self) -> list[Fraction]:
        """Return du/dτ₁ for the nodal differentials, exact but for the branch points.

        Where one direction is frozen λ_2 stays at its I, and du = ς + μ2 I for what is left.
        """
        problem = self.problem
        mu2 = problem.mu2 / self.moving.unit
        if self.curve.genus == 1:
            return [problem.sign + mu2 * self.moving.unit / self.moving.frozen[0]]
        (node,) = self._nodes
        return [-mu2, problem.sign + node * mu2]

    @cached_property
    def side(self) -> float:
        """Return the sign of u against n_2, 0 where no u moves."""
        if self.curve.genus == 1:
            return 0.0
        n_2 = self.moving.directions @ self._sampling.start.normals[0][:, 0]
        return float(np.sign(n_2 @ self.problem.u))

    @cached_property
    def _A(self) -> Array:
        return to_float(self.moving.A)

    @cached_property
    def _excess(self) -> Array:
        """Return A' less its least entry, which (u,A'v) does not have: it would cancel."""
        return to_float([a - 1 for a in self.moving.A])

    def _ratio(self, attitude: Attitude) -> Array:
        """Return tilt (u,A'v)/(v,A'v), which is between −1 and 1."""
        if self.curve.genus == 1:
            return np.zeros(len(attitude.q))
        across = np.asarray((attitude.normals[:, :, 0] * attitude.q) @ self._excess)
        along = (attitude.q * attitude.q) @ self._A
        return np.asarray(self.side * self.problem.tilt * across / along)

    def rate_at(self, z: Array, in_angles: bool) -> Array:
        """Return dt/dτ₁ at phases z (N, g), inverted to angles or by theta functions."""
        return self.rate_of(self.attitude(z, "angles" if in_angles else "theta"))

    def rate_of(self, attitude: Attitude) -> Array:
        """Return dt/dτ₁ at attitudes."""
        return np.asarray((1 - self._ratio(attitude)) / self._rate_of_position(attitude.q))

    def odd_rate_of(self, attitude: Attitude) -> Array:
        """Return that part of dt/dτ₁ which changes sign with u."""
        return np.asarray(-self._ratio(attitude) / self._rate_of_position(attitude.q))

    def states(self, attitude: Attitude) -> tuple[Array, Array, Array]:
        """Return dτ₁/dt, dq/dt and the frame along the problem's principal axes."""
        rate, velocity, frame = super().states(attitude)
        faster = 1 / (1 - self._ratio(attitude))
        return rate * faster, velocity * faster[:, None], frame

    @cached_property
    def rate_variation(self) -> float:
        """Return by how much dt/dτ₁ may vary: from its values at sampled phases, or a bound where
        that is below what any decision asks for.
        """
        if (widest := self._widest_variation) < _MILD:
            return widest
        z = np.concatenate([sample_phases(self.curve.genus), self._origin[None, :]])
        rates = self.rate_at(z, in_angles=not self.near_separatrix)
        spread = _BETWEEN * float(np.max(rates) / np.min(rates))
        return max(super().rate_variation, spread)

    @property
    def _widest_variation(self) -> float:
        """Return a bound: |(u,A'v)|/(v,A'v) ≤ (κ−1)/2√κ for orthonormal u, v, κ the ratio of the
        largest A' to the least.
        """
        root = super().rate_variation
        odd = abs(self.problem.tilt) * (root * root - 1) / (2 * root)
        return root * (1 + odd) / (1 - odd) if odd < 1 else np.inf

    @cached_property
    def at_half_periods(self) -> tuple[Array, Attitude]:
        """Return the half periods in angles, (N, g), and the attitudes there."""
        psi = np.pi * np.asarray(self.frame.half_periods, dtype=np.float64)
        return psi, self.frame.at(psi)

    @cached_property
    def odd_peak(self) -> float:
        """Return the largest odd part of dt/dτ₁ at the half periods; zero where there is none."""
        return float(np.max(np.abs(self.odd_rate_of(self.at_half_periods[1]))))

    @cached_property
    def odd_series(self) -> TorusSeries:
        """Return the Fourier series of the odd part of dt/dτ₁ over ``odd_peak``, not zero."""
        psi, attitude = self.at_half_periods
        values = self.odd_rate_of(attitude)
        best = int(np.argmax(np.abs(values)))
        component = CrossComponent.of(self.frame, self.inversion)
        scale = self._unit_of_odd_part(component) / self.odd_peak
        series = find_series(replace(component, scale=scale))
        if float(series.at(psi[best : best + 1] / (2 * np.pi))[0]) * values[best] < 0:
            series = series.scaled(-1.0)
        return series

    def _unit_of_odd_part(self, component: CrossComponent) -> float:
        """Return what determinants of scaled rows are multiplied with: tilt dt'/dτ₁ over
        √(c_2λ_1λ_2), and the sizes of the rows over det a.
        """
        curve = self.curve
        psi = np.full((1, 2), np.pi / 2)
        lower = np.array([curve.point(1), curve.point(3)], dtype=np.float64)
        coordinates = lower + self.inversion.periods.roots_on_cuts(psi)[0][:, 0] ** 2
        c_2 = float(curve.point(component.place))
        unit = float(self.rate.at(psi)[0]) / np.sqrt(c_2 * np.prod(coordinates))
        determinant = float(np.linalg.det(self.periods.cycles))
        return float(abs(self.problem.tilt * unit * np.prod(component.row_sizes) / determinant))

    @property
    def odd_part_of_rate(self) -> TorusSeries | None:
        """Return the series of the odd part of dt/dτ₁, None where there is none."""
        return self.odd_series.scaled(self.odd_peak) if self.odd_peak else None


def solution_of(problem: TorusProblem, distance: Fraction | None = None) -> Solution:
    """Return the solution of a problem on a torus; ``distance`` as ``Solution`` takes it."""
    if isinstance(problem, AreaVeselova):
        return AreaSolution(problem, distance)
    if isinstance(problem, CommutingVeselova):
        return CommutingSolution(problem, distance)
    return Solution(problem, distance)
