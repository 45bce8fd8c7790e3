"""States by theta quotients at the phases that the kernel's time maps give: every entry of the
attitude is one.
"""

from __future__ import annotations

import numpy as np

from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.quotients import Quotients
from veselova.analytic.closed.states import TIMES_AT_ONCE, StateFiller, States, blocks
from veselova.analytic.kernel.document import set_phases

__all__ = ["ByTheta"]

#: Calibrated: what the rounding of quotients, of the tables of problems, may miss.
_SAFETY = 2.0


class ByTheta:
    """What makes of states by angles those by theta functions. Raises Unsolved as ``Quotients``."""

    def __init__(self, motion: KernelMotion) -> None:
        self._motion = motion
        self._quotients = Quotients.of(motion)

    @property
    def terms(self) -> int:
        """Return the terms of a theta sum."""
        return round(self._quotients.theta.terms)

    def __call__(self, found: States, filler: StateFiller) -> States:
        """Return the states by theta functions; τ₁ and what the time map is off by stay."""
        frames, velocities = np.empty(found.frames.shape), np.empty(found.velocities.shape)
        for few in blocks(found.tau1.size, TIMES_AT_ONCE):
            z = np.empty(found.psi[few].shape)
            set_phases(self._motion.torus, found.psi[few], self._motion.room, z)
            at = self._quotients.at(z)
            frames[few], velocities[few] = filler.to_principal_axes(at.frames, at.velocities)
        errors = found.errors + _SAFETY * self._quotients.rounding
        return found._replace(frames=frames, velocities=velocities, errors=errors)
