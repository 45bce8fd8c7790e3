"""States by theta quotients at the phases that the kernel's time maps give: every entry of the
attitude is one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.quotients import Quotients
from veselova.analytic.closed.states import TIMES_AT_ONCE, StateFiller, States
from veselova.analytic.kernel.document import set_phases
from veselova.mechanics.core.budget import checkpoint

__all__ = ["ByTheta"]

Array = NDArray[np.float64]

#: Calibrated: what the rounding of quotients, of the tables of problems, may miss.
_SAFETY = 2.0


def tilted(torus: Any, frames: Array) -> Array:
    """Return the odd part of dt/dτ₁ over its even one, negative, at frames (N, m, m): of
    ``kernel.rate``.
    """
    if not torus.tilt[0]:
        return np.zeros(len(frames))
    last = torus.of_I[-1]
    parts = frames[:, :, 0] / torus.points[torus.of_I]
    across = (parts * frames[:, :, 1]) @ torus.d[torus.of_I, last] / torus.points[last]
    along = np.sum(parts * frames[:, :, 0], axis=1)
    return np.asarray(torus.tilt[0] * across / along)


class ByTheta:
    """What makes of states by angles those by theta functions. Raises Unsolved as ``Quotients``."""

    def __init__(self, motion: KernelMotion) -> None:
        self._motion = motion
        self._quotients = Quotients.of(motion)

    @property
    def terms(self) -> int:
        """Return the terms of a theta sum."""
        return self._quotients.theta.size

    def __call__(self, found: States, filler: StateFiller) -> States:
        """Return the states by theta functions; τ₁ and what the time map is off by stay."""
        frames, velocities = np.empty(found.frames.shape), np.empty(found.velocities.shape)
        for first in range(0, found.tau1.size, TIMES_AT_ONCE):
            checkpoint()
            few = slice(first, first + TIMES_AT_ONCE)
            z = np.empty(found.psi[few].shape)
            set_phases(self._motion.torus, found.psi[few], self._motion.room, z)
            along, velocity = self._quotients.at(z)
            velocity /= 1 - tilted(self._motion.torus, along)[:, None]
            frames[few], velocities[few] = filler.to_principal_axes(along, velocity)
        errors = found.errors + _SAFETY * self._quotients.rounding
        return found._replace(frames=frames, velocities=velocities, errors=errors)
