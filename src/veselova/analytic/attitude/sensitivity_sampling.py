"""What every motion asks of the frame, in one evaluation: a call costs what hundreds of points do.

These are the attitude at the start, those at half periods, from which theta quotients have their
constants, and the difference quotients that say how steep the frame is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.attitude.frame import Attitude, Differences, Frame
from veselova.analytic.attitude.sensitivity import Sensitivity
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.periods import Periods

__all__ = ["BETWEEN", "FEW", "SensitivitySampling", "sample_phases"]

Array = NDArray[np.float64]

#: Budget: points at which the steepness of the attitude is sampled; beyond a genus of FEW, at fewer
#: points in as many directions.
_SAMPLES = 48
FEW = 16
_FEW_SAMPLES = 4


#: Calibrated: by how much the steepness between the sampled points may be larger than at them.
BETWEEN = 1.25


@lru_cache
def _sample_angles(genus: int) -> Array:
    """Return the points of the torus at which the steepness is sampled, (N, g), always the same
    ones, read-only.
    """
    count = _SAMPLES if genus <= FEW else _FEW_SAMPLES
    result = np.random.default_rng(genus).uniform(0.0, 2 * np.pi, (count, genus))
    result.flags.writeable = False
    return np.asarray(result)


def sample_phases(genus: int) -> Array:
    """Return phases at which the steepness is sampled where angles do not serve, (N, g)."""
    return _sample_angles(genus) / np.pi


@dataclass(frozen=True)
class SensitivitySampling:
    """The frame around a torus, from the angles (g,) of its start.

    - rates: f, cycles per unit of τ₁, (g,)
    - sources: δ (g, S) of ``Sensitivity``
    - half_periods, steep: whether the attitudes at half periods, and the sensitivity, are wanted
    - point: what the positions q (N, m) are normals at, the point of a geodesic; None for other
      motions
    """

    frame: Frame
    inversion: AbelJacobi[Periods]
    angles: Array
    rates: Array
    sources: Array
    half_periods: bool
    steep: bool
    point: Callable[[Array], Array] | None = None

    @cached_property
    def _found(self) -> tuple[Attitude, Attitude | None, Sensitivity | None, Sensitivity | None]:
        start = self.angles[None, :]
        differences = self._differences() if self.steep else None
        half_periods = np.pi * self.frame.half_periods if self.half_periods else start[:0]
        ends = start[:0] if differences is None else differences.ends
        at_start, at_half_periods, at_ends = self.frame.at_each(start, half_periods, ends)
        sensitivity = (
            None
            if differences is None
            else self._sensitivity(BETWEEN * differences.slopes(at_ends))
        )
        of_point = None
        if differences is not None and self.point is not None:
            of_point = self._sensitivity(BETWEEN * differences.quotients(self.point(at_ends.q)))
        return at_start, at_half_periods if self.half_periods else None, sensitivity, of_point

    @property
    def start(self) -> Attitude:
        """Return the attitude at the start."""
        return self._found[0]

    @property
    def at_half_periods(self) -> Attitude | None:
        """Return the attitudes at the half periods of the frame; None where they are not wanted."""
        return self._found[1]

    @property
    def sensitivity(self) -> Sensitivity | None:
        """Return how fast the frame turns with the phases, and more for what lies between the
        sampled points; None as above.
        """
        return self._found[2]

    @property
    def sensitivity_of_point(self) -> Sensitivity | None:
        """Return how fast the point of ``point`` moves with the phases, in the same way; None where
        there is none.
        """
        return self._found[3]

    def _differences(self) -> Differences:
        genus = self.rates.size
        psi = np.concatenate([_sample_angles(genus), self.angles[None, :]])
        to_angles = np.linalg.inv(self.inversion.jacobian(psi))
        if genus > FEW:
            signs = np.sign(np.random.default_rng(genus).normal(size=(genus, FEW)))
            to_angles = to_angles @ np.column_stack([signs, self.rates])
        return Differences(psi, to_angles)

    def _sensitivity(self, slopes: Array) -> Sensitivity:
        genus = self.rates.size
        if genus <= FEW:
            return Sensitivity.at_points(slopes, self.rates, self.sources).largest()
        # Σ|a_k| ≤ √g √Σa_k², and the mean square of Σ ±a_k over random signs is Σa_k².
        spread = np.sqrt(np.max(np.mean(slopes[:, :, :-1] ** 2, axis=2)))
        by_phase = np.full(genus, spread / np.sqrt(genus))
        return Sensitivity(
            by_phase,
            np.max(np.abs(slopes[:, :, -1])),
            spread,
            np.abs(self.rates) @ by_phase,
            np.asarray(np.linalg.norm(by_phase @ np.abs(self.sources))),
        )
