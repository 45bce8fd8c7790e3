"""The time map in ball arithmetic that costs least at given times: Chebyshev panels, a Fourier
series, or a change of units.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Values
from veselova.analytic.motion.torus_solution import WIDEST_RATE, Solution
from veselova.analytic.spectrum.moving_part import Moving
from veselova.analytic.time_map.analyticity_strip import Orbit
from veselova.analytic.time_map.fourier_balls import MOST_MODES, FourierTimeMapInBalls
from veselova.analytic.time_map.panels_balls import ChebyshevTimeMapInBalls, estimate_nodes
from veselova.mechanics.core.errors import Unsolved

__all__ = ["TimeMap", "UniformTimeMap", "choose_time_map", "require_few_modes"]

#: Milliseconds with some _DIGITS (fewer and more change all of them alike, about), by genus, the
#: last for all above: a node of panels; a mode of the Fourier time map at once, where no cut takes
#: more than _NODES in doubles, and with every time, which costs more as the genus grows; and a time
#: of that time map.
_NODE = {1: 0.05, 2: 0.1, 3: 0.35, 4: 0.8}
_MODE = {1: 1.0, 2: 0.22, 3: 0.22, 4: 0.6}
_MODE_AT_TIME = {1: 1.5e-4, 2: 1.5e-4, 3: 2e-4, 4: 6e-4}
_TIME = 0.1
_NODES = 36

#: The digits of those, by what power of them modes grow, whose sums are in balls for genus 1, and
#: milliseconds beyond which modes are not begun: minutes.
_DIGITS = 60
_GROWTH = {1: 2.5, 2: 1.5, 3: 1.5, 4: 1.5}
_LONGEST = 120_000


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


def _estimate_modes(coarse: Solution, digits: int, genus: int) -> tuple[float, float]:
    """Return about how many modes count to so many digits, and the milliseconds that they take."""
    modes = coarse.modes * (digits / DOUBLE.digits) ** genus
    # Next to a separatrix cuts take many nodes, and modes turn so much faster on them.
    nodes = max(1.0, max(coarse.rate.needed_nodes) / _NODES)
    return modes, modes * _MODE[min(genus, max(_MODE))] * nodes**2


def _is_formed_in_minutes(coarse: Solution, digits: int, genus: int) -> bool:
    modes, forming = _estimate_modes(coarse, digits, genus)
    growth = (digits / _DIGITS) ** _GROWTH[min(genus, max(_GROWTH))]
    return modes <= MOST_MODES and forming * growth <= _LONGEST


def require_few_modes(coarse: Solution, digits: int) -> None:
    """Raise Unsolved (``too-many-modes``) where the modes that count to so many digits take more
    than minutes.
    """
    genus = coarse.curve.genus
    if coarse.problem.time != "tau1" and not _is_formed_in_minutes(coarse, digits, genus):
        modes, _ = _estimate_modes(coarse, digits, genus)
        reason = f"with {digits} digits the time map has about {modes:.0f} modes; take fewer digits"
        raise Unsolved("too-many-modes", reason)


def choose_time_map(
    orbit: Orbit, approximate: NDArray[np.float64], coarse: Solution, moving: Moving
) -> TimeMap:
    """Return the time map of an orbit for approximate Neumann times (N,): the cheaper, or the other
    where it has too many terms.

    coarse: the solution in double precision · moving: what moves in balls. Only the truncation of
    panels is bounded. Raises Unsolved where neither reaches as far.
    """
    if moving.time == "tau1":
        return UniformTimeMap(orbit)
    xp: Any = orbit.rate.inversion.arithmetic
    genus = moving.size - 1
    times = approximate.size
    kind = min(genus, max(_NODE))
    modes, forming = _estimate_modes(coarse, xp.digits, genus)
    by_modes = forming + times * (modes * _MODE_AT_TIME[kind] + _TIME)
    by_panels = estimate_nodes(orbit, approximate) * _NODE[kind]
    maps: list[Callable[[], ChebyshevTimeMapInBalls | FourierTimeMapInBalls]] = [
        partial(ChebyshevTimeMapInBalls, orbit, approximate, xp.certified)
    ]
    # Of a direction that doubles do not see they say nothing.
    known = coarse.moving.size == moving.size and moving.rate_variation < WIDEST_RATE
    if known and _is_formed_in_minutes(coarse, xp.digits, genus) and not xp.certified:
        maps.insert(int(by_panels < by_modes), partial(FourierTimeMapInBalls, orbit))
    for time_map in maps[:-1]:
        with suppress(Unsolved):
            return time_map()
    return maps[-1]()
