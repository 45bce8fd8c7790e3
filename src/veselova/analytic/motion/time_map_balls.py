"""The time map in ball arithmetic that costs least at given times: Chebyshev panels, a Fourier
series, or a change of units.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Values
from veselova.analytic.motion.in_doubles import WIDEST_RATE, InDoubles
from veselova.analytic.spectrum.moving_part import Moving
from veselova.analytic.time_map.analyticity_strip import GeneralOrbit, Orbit
from veselova.analytic.time_map.fourier_balls import MOST_MODES, FourierTimeMapInBalls
from veselova.analytic.time_map.panels_balls import ChebyshevTimeMapInBalls, estimate_nodes
from veselova.mechanics.core.errors import Unsolved
from veselova.tunings import (
    BALL_MODE,
    BALL_MODE_TERMS,
    BALL_MODE_TIMES,
    BALL_NODE_DIGITS,
    BALL_ODD_PART,
)

__all__ = ["TimeMap", "UniformTimeMap", "choose_time_map", "cost_of_modes"]


class UniformTimeMap:
    """The time map of a motion whose time is Neumann's, in its own unit: τ₁ is the time times
    dτ₁/d(time).
    """

    name = "uniform"

    def __init__(self, orbit: Orbit) -> None:
        self._rate = orbit.rate.inversion.arithmetic.number(orbit.spectrum.time_rate)

    @property
    def size(self) -> int:
        """Return 0: it has neither nodes nor modes."""
        return 0

    def tau1(self, times: Values, _approximate: NDArray[np.float64]) -> Values:
        """Return τ₁ at times (N,), given exactly."""
        return np.asarray(times * self._rate)


TimeMap: TypeAlias = ChebyshevTimeMapInBalls | FourierTimeMapInBalls | UniformTimeMap


def estimate_modes(coarse: InDoubles, digits: float) -> float:
    """Return about how many modes count to so many digits."""
    count: float = coarse.modes * (digits / DOUBLE.digits) ** coarse.kernel.genus
    return count


def cost_of_modes(coarse: InDoubles, digits: float, times: int) -> float:
    """Return about what a Fourier time map costs at so many times, in nodes of panels."""
    growth = BALL_MODE + (digits * coarse.nodes * BALL_MODE_TERMS) ** 2
    growth *= (1 + times * BALL_MODE_TIMES) / (2 + BALL_NODE_DIGITS * digits)
    return estimate_modes(coarse, digits) * growth


def choose_time_map(
    orbit: Orbit, approximate: NDArray[np.float64], coarse: InDoubles, moving: Moving
) -> TimeMap:
    """Return the time map of an orbit for approximate Neumann times (N,): the cheaper, or the other
    where it has too many terms.

    coarse: the solution in double precision · moving: what moves in balls. Only the truncation of
    panels is bounded. Raises Unsolved (``too-far``) where neither reaches as far.
    """
    if moving.time == "tau1":
        return UniformTimeMap(orbit)
    xp: Any = orbit.rate.inversion.arithmetic
    panels = partial(ChebyshevTimeMapInBalls, orbit, approximate, xp.certified)
    modes = estimate_modes(coarse, xp.digits)
    # of a direction that doubles do not see they say nothing
    known = coarse.kernel.moving.size == moving.size and moving.rate_variation < WIDEST_RATE
    if not (known and orbit.has_fourier_map) or modes > MOST_MODES or xp.certified:
        return panels()
    series: Callable[[], TimeMap] = partial(FourierTimeMapInBalls, orbit, expected=modes)
    cost = cost_of_modes(coarse, xp.digits, approximate.size)
    if isinstance(orbit, GeneralOrbit):
        assert orbit.fourier_map is not None
        series, cost = partial(orbit.fourier_map, orbit, modes), BALL_ODD_PART * cost
    cheaper = cost < estimate_nodes(orbit, approximate)
    try:
        return series() if cheaper else panels()
    except Unsolved:
        return panels() if cheaper else series()
