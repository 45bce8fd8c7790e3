"""A body at rest in balls: the state that it keeps, to any number of digits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from veselova.analytic.enclosed_frame import frame_around
from veselova.analytic.enclosed_solution import series_of
from veselova.analytic.enclosure import resting_spheroconic
from veselova.analytic.precision import Values
from veselova.analytic.reduction import moving_part
from veselova.mechanics.errors import Unsolved
from veselova.mechanics.veselova import Veselova

__all__ = ["resting_series"]


def resting_series(problem: Veselova, count: int, arithmetic: Any) -> Mapping[str, Values]:
    """Return the series of a body with q̇ = 0, by name, at ``count`` times; raises Unsolved where no frame was given."""
    xp, exact = arithmetic, problem.exact
    if exact.frame is None:
        raise Unsolved("at-rest", "q_dot = 0: a resting body's natural frame is known in double precision only; give a frame")
    q, moving = xp.array(exact.q), moving_part(problem)
    frame = frame_around(q / xp.sqrt(np.sum(q * q)), exact.frame, xp)
    frames, coordinates = (np.stack([x] * count) for x in (frame, resting_spheroconic(moving, xp)))
    return series_of(moving, xp.array(np.zeros((count, problem.n))), frames, coordinates, xp.array(np.zeros(count)), xp)
