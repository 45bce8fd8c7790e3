"""The Abel–Jacobi map in real angles, both ways: ψ ↦ z = Σ_s G_s(ψ_s) and Newton's method back.

ψ_s is the elliptic angle of λ_s on its cut. The map is a real-analytic diffeomorphism of the torus,
z_k = ψ_k/2π plus a periodic part, so ψ = 2πz starts the iteration.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Arithmetic, Sums, Values
from veselova.analytic.curve.periods import AngleSeries
from veselova.mechanics.core.budget import checkpoint, iterate
from veselova.mechanics.core.errors import InternalContradiction, Unsolved

__all__ = ["NARROW_GAP", "AbelJacobi"]

#: Budget: Newton steps before giving up; 4 to 8 are usual, a few dozen appear where a cut nearly
#: reaches its neighbour.
_MOST_STEPS = 100

#: Calibrated: relative gaps from which a failure to settle is the curve's, not ours: with both
#: neighbours near such a gap, phases hardly move with the angles.
NARROW_GAP = 1e-6

#: Derived: digits of the angles from which an inversion in balls starts, and those that a doubling
#: by Newton's method loses to the slopes.
_COARSE_DIGITS = 12
_LOST_DIGITS = 2

#: Calibrated: a residual below the first is rounding, and so is one below the second that no step
#: betters.
_CONVERGED = 8 * DOUBLE.epsilon
_STALLED = 1e4 * _CONVERGED

#: Method: part of the way that a continuation tries at once, first and at least, and Newton's steps
#: at each of its stations.
_FIRST_STRETCH = 0.25
_LEAST_STRETCH = 1e-9
_NEAR_STEPS = 12


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
    def _sines(self) -> Sums:
        """Return ψ ↦ z − ψ/2π, whose coefficients have the axes s, m, k."""
        series = self.periods.angle_series[:, :, 1:]
        orders = self.arithmetic.array(list(range(1, series.shape[2] + 1)))
        return self.arithmetic.sine_sums(np.ascontiguousarray((series / orders).transpose(1, 2, 0)))

    @cached_property
    def _cosines(self) -> Sums:
        """Return ψ ↦ ∂z_k/∂ψ_s, whose coefficients have the axes s, m, k."""
        return self.arithmetic.cosine_sums(
            np.ascontiguousarray(self.periods.angle_series.transpose(1, 2, 0))
        )

    def map(self, psi: Values) -> Values:
        """Return z for angles ψ of shape (N, g); ψ_s + 2π adds one to z_s."""
        return np.asarray(psi / (2 * self.arithmetic.pi) + self._complete(self._sines(psi)))

    def jacobian(self, psi: Values) -> Values:
        """Return ∂z_k/∂ψ_s for angles of shape (N, g), shape (N, g, g) with k before s."""
        return np.swapaxes(self._complete(np.swapaxes(self._cosines(psi), 1, 2)), 1, 2)

    def _complete(self, sums: Values) -> Values:
        """Return sums of series, last axis k, with what they leave out."""
        return (
            self.arithmetic.add_error(sums, self.periods.series_truncation)
            if self.arithmetic.has_radii
            else sums
        )

    def invert(self, z: Values) -> Values:
        """Return the angles ψ with map(ψ) = z for z of shape (N, g), continuous in z on the whole
        of ℝ^g.

        Raises Unsolved where the iteration does not settle for a gap that is too narrow
        (InternalContradiction otherwise).
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
        """Return the angles ψ with map(ψ) = z, (N, g), by iterations in doubles that begin at 2πz;
        raises Unsolved (``narrow-gap``).
        """
        start = 2 * np.pi * z
        psi, open_ = self.settle(start, z, _MOST_STEPS)
        for i in iterate(open_.tolist()):
            psi[i] = self._continue_angles(z[i], start[i])
        return psi

    def settle(
        self, psi: NDArray[np.float64], z: NDArray[np.float64], most: int
    ) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Return the angles (N, g) at z (N, g) to which at most so many steps of Newton's method
        from ψ lead, shortened where they do not better the residual, and which do not settle.
        """
        psi = np.array(psi)
        residual = self.map(psi) - z
        open_ = np.arange(len(z))
        step_fraction = np.ones(len(z))
        for _ in range(most):
            checkpoint()
            size = np.max(np.abs(residual), axis=1)
            open_ = open_[size[open_] > _CONVERGED]
            if open_.size == 0:
                break
            try:
                step = np.linalg.solve(self.jacobian(psi[open_]), residual[open_][:, :, None])
            except np.linalg.LinAlgError:
                break
            trial = psi[open_] - step_fraction[open_, None] * step[:, :, 0]
            trial_residual = self.map(trial) - z[open_]
            better = np.max(np.abs(trial_residual), axis=1) < size[open_]
            accepted = open_[better]
            psi[accepted], residual[accepted] = trial[better], trial_residual[better]
            step_fraction[accepted] = np.minimum(1.0, 4 * step_fraction[accepted])
            step_fraction[open_[~better]] /= 4
            # A full step that no longer improves has met the rounding of the sums, which grows with
            # their length.
            open_ = open_[better | (size[open_] >= _STALLED)]
        return psi, open_

    def _continue_angles(
        self, z: NDArray[np.float64], psi: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the angles of one point, led there along the line of phases from those of ψ: the
        map is one-to-one.

        Next to a narrow gap the phases hardly move with the angles, and Newton's method from afar
        loses its way. It serves in a
        bent valley as narrow as the gap, which a tangent leaves at once: a cubic through the last
        two stations follows it.
        """
        begin = self.map(psi[None])[0]
        done = 0.0
        step = _FIRST_STRETCH
        stations: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = []
        while done < 1 and step > _LEAST_STRETCH:
            reached = min(1.0, done + step)
            guess = _extrapolate(stations, reached) if len(stations) == 2 else psi
            found, open_ = self.settle(
                guess[None], (begin + reached * (z - begin))[None], _NEAR_STEPS
            )
            if open_.size:
                step /= 4
                continue
            psi = found[0]
            done = reached
            step = 2 * step
            slope = np.linalg.lstsq(self.jacobian(psi[None])[0], z - begin, rcond=None)[0]
            stations = [*stations[-1:], (done, psi, slope)]
        if done == 1:
            return psi
        gap = self.periods.narrowest_gap
        if gap < NARROW_GAP:
            raise Unsolved(
                "narrow-gap",
                f"angles are ill-conditioned at a relative gap of {gap:.2g}; "
                f"{self.periods.without_angles}",
            )
        raise InternalContradiction(f"the Abel–Jacobi inversion came {done:.2g} of its way")

    def _enclose(self, z: Values, coarse: AbelJacobi[P]) -> Values:
        """Newton's method on midpoints, then Krawczyk's: a box that must hold a solution, and the
        map has but one.
        """
        xp: Any = self.arithmetic
        # series are kept with the digits in which they are first formed: all of them, not the few
        # of an early step
        _ = self._sines, self._cosines, self.periods.series_truncation
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


def _extrapolate(
    stations: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]], reached: float
) -> NDArray[np.float64]:
    """Return the value at ``reached`` of the cubic with the values and slopes of two stations
    (place, value, slope).
    """
    (first, early, rise), (second, late, climb) = stations
    length = second - first
    x = (reached - second) / length
    chord = (late - early) / length
    # The divided differences of Hermite's interpolation, at the second station twice, then at the
    # first.
    bend = climb - chord
    twist = climb - 2 * chord + rise
    return np.asarray(late + (reached - second) * (climb + x * (bend + (x + 1) * twist)))


def _inverses(matrices: Values, arithmetic: Any) -> Values:
    return np.stack(
        [
            arithmetic.midpoints(arithmetic.inverse(arithmetic.midpoints(matrix)))
            for matrix in matrices
        ]
    )


def _apply(matrices: Values, vectors: Values) -> Values:
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])
