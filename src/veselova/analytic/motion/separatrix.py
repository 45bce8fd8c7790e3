"""How far motions part from a start on a separatrix: a bound that is a function of time alone.

A start a rounding away leaves the separatrix like e^(rate·|t|), and comes back to it when all
motions dwell at the same equilibrium. What is lost on the way stays lost. So the bound is the
largest difference from neighbouring motions at fixed instants up to the one after |t|, less that at
the start, where nothing is lost; it never decreases with |t|, and no other time that is asked for
enters it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.fixed_instants import fixed_instants

__all__ = ["DepartureBound"]

Array = NDArray[np.float64]

#: Budget: instants evaluated at once.
_BLOCK = 128

#: Calibrated: between instants a difference may be larger than at both; largest seen there over
#: that at the later one: 1.3.
_BETWEEN = 2.0


@dataclass
class DepartureBound:
    """The bound of one motion, extended when times ask for it.

    - motions: instants (N,) → the frames of the motion and of its neighbours, each (N, n, n),
      and the error of the motion's evaluation there, (N,)
    - apart: how far the neighbours are from the motion at t = 0
    - turning: radians a unit of time
    - lost: the difference beyond which nothing is known; instants after the first such one are
      not evaluated
    """

    motions: Callable[[Array], tuple[Sequence[Array], Array]]
    apart: float
    turning: float
    lost: float
    _known: dict[float, tuple[Array, Array]] = field(default_factory=dict, init=False)

    def at(self, times: Array) -> tuple[Array, Array]:
        """Return the bound at times (N,), infinite where nothing is known, and the largest error of
        the evaluation on the way there.
        """
        result = np.zeros((times.size, 2))
        for side in (1.0, -1.0):
            rows = times * side > 0
            if rows.any():
                instants, bounds = self._until(side, float(np.max(times[rows] * side)))
                places = np.searchsorted(instants, times[rows] * side)
                ends_before = (places >= len(bounds))[:, None]
                last = np.minimum(places, len(bounds) - 1)
                result[rows] = np.where(ends_before, np.inf, bounds[last])
        return result[:, 0], result[:, 1]

    def _until(self, side: float, farthest: float) -> tuple[Array, Array]:
        """Return the instants on one side, increasing from t = 0, and both bounds there, (N, 2), to
        the farthest time or the last digit.
        """
        instants, bounds = self._known.get(side, (np.zeros(0), np.zeros((0, 2))))
        while not instants.size or (instants[-1] < farthest and bounds[-1, 0] <= self.lost):
            further = fixed_instants(len(instants), _BLOCK) / self.turning
            in_order = slice(None, None, int(side))
            (first, *others), error = self.motions(further[in_order] * side)
            differences = np.max(
                [np.max(np.abs(other - first), axis=(1, 2)) for other in others], axis=0
            )
            parted = np.maximum(differences - self.apart, 0)
            found = np.stack([_BETWEEN * parted, error], axis=1)[in_order]
            found = np.vstack([bounds[-1:], np.nan_to_num(found, nan=np.inf)])
            largest = np.maximum.accumulate(found)[-further.size :]
            selected = int(np.searchsorted(largest[:, 0], self.lost, side="right")) + 1
            instants = np.append(instants, further[:selected])
            bounds = np.vstack([bounds, largest[:selected]])
        self._known[side] = instants, bounds
        return instants, bounds
