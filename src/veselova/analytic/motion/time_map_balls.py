"""The time map in ball arithmetic that costs least at given times: Chebyshev panels, a Fourier
series, or a change of units.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Values
from veselova.analytic.motion.in_doubles import WIDEST_RATE, InDoubles
from veselova.analytic.spectrum.moving_part import Moving
from veselova.analytic.time_map.analyticity_strip import GeneralOrbit, Orbit
from veselova.analytic.time_map.cost_model_balls import CostsInBalls
from veselova.analytic.time_map.fourier_balls import MOST_MODES, FourierTimeMapInBalls
from veselova.analytic.time_map.panels_balls import ChebyshevTimeMapInBalls, estimate_nodes
from veselova.mechanics.core.errors import Unsolved
from veselova.tunings import BALL_ODD_PART

__all__ = ["TimeMap", "UniformTimeMap", "choose_time_map", "estimate_modes"]


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


def estimate_modes(coarse: InDoubles, digits: float, genus: int) -> float:
    """Return about how many modes count to so many digits."""
    count: float = coarse.modes * (digits / DOUBLE.digits) ** genus
    return count


def choose_time_map(
    orbit: Orbit,
    approximate: NDArray[np.float64],
    coarse: InDoubles,
    moving: Moving,
    costs: CostsInBalls,
    further: float = 0.0,
) -> TimeMap:
    """Return the time map of an orbit for approximate Neumann times (N,): the cheaper, or the other
    where it has too many terms.

    coarse: the solution in double precision · moving: what moves in balls · costs: what the parts
    take · further: the seconds of the work that follows. Only the truncation of panels is bounded.
    Raises Unsolved where neither reaches as far, or where the cheaper costs more than is allowed
    (OverBudget where there is a budget).
    """
    if moving.time == "tau1":
        costs.require_affordable(further)
        return UniformTimeMap(orbit)
    xp: Any = orbit.rate.inversion.arithmetic
    modes = estimate_modes(coarse, xp.digits, costs.genus)
    by_modes = math.inf
    # Of a direction that doubles do not see they say nothing.
    known = coarse.kernel.moving.size == moving.size and moving.rate_variation < WIDEST_RATE
    known = known and orbit.has_fourier_map
    if known and modes <= MOST_MODES and not xp.certified:
        by_modes = costs.modes(modes, coarse.nodes, approximate.size)
        by_modes *= BALL_ODD_PART if isinstance(orbit, GeneralOrbit) else 1
    has_modes = costs.is_affordable(by_modes + further)

    def require_nodes(count: float) -> None:
        by_panels = costs.rate * count
        mapping = by_panels if has_modes else min(by_panels, by_modes)
        if math.isfinite(mapping):  # more nodes than are kept are refused whatever they cost
            outcome = "too-far" if mapping > further else "too-costly"
            costs.require_affordable(mapping + further, outcome)

    maps: list[Callable[[], ChebyshevTimeMapInBalls | FourierTimeMapInBalls]] = [
        partial(ChebyshevTimeMapInBalls, orbit, approximate, xp.certified, require_nodes)
    ]
    if has_modes:
        by_panels = estimate_nodes(orbit, approximate) * costs.rate
        made = partial(FourierTimeMapInBalls, orbit, expected=modes)
        if isinstance(orbit, GeneralOrbit):
            assert orbit.fourier_map is not None
            made = partial(orbit.fourier_map, orbit, modes)
        maps.insert(int(by_panels < by_modes), made)
    for time_map in maps[:-1]:
        with suppress(Unsolved):
            return time_map()
    return maps[-1]()
