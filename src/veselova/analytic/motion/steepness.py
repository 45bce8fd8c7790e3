"""How much an error of the time costs: what the time map of a document leaves out moves its states
along the flow, at every time of the document.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.attitude.sensitivity_sampling import FEW, sample_phases
from veselova.analytic.motion.torus_solution import Solution

__all__ = ["steepness_in_time"]

Array = NDArray[np.float64]

#: Budget: the largest genus at which all half periods are looked at.
_CORNERS = 8


def _steepness_at(solution: Solution, z: Array) -> Array:
    """Return |dx/dτ₁| max(1, F_0/(dt/dτ₁)) at phases z (N, g), x an entry of the frame: what an
    error of the time over F_0 costs.
    """
    rates = solution.rate_at(z, in_angles=not solution.near_separatrix)
    slowness = np.maximum(1.0, solution.mean_rate / rates)
    return np.asarray(solution.sensitivities_at(z)[0].along_flow * slowness)


def steepness_in_time(solution: Solution) -> float:
    """Return the largest of them on the torus.

    On flat or needle-like ellipsoids dt/dτ₁ is far below its mean F_0 at some half period, where
    all λ_s are branch points; sampled phases miss the neighbourhood of such a point.
    """
    genus = solution.curve.genus
    z = [solution.in_tau1.start[None, :]]
    if genus <= FEW:
        z.append(sample_phases(genus))
    if genus <= _CORNERS:
        z.append(np.asarray(solution.frame.half_periods, dtype=np.float64) / 2)
    steepest = float(np.max(_steepness_at(solution, np.concatenate(z))))
    return max(steepest, float(solution.sensitivity.along_flow))
