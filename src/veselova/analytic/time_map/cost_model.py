"""What an orbit costs, and which time map is the cheaper for given times: seconds on one core.

The seconds of their parts are in ``veselova.tunings``.

The Fourier time map costs its modes once, and all of them again at every inversion; panels cost
evaluations all along the orbit, and their inversions nothing to speak of.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from veselova.tunings import (
    FIRST_MODES,
    LONGER_PANELS,
    MODE,
    MODE_INVERTED,
    PANEL_CYCLE,
    PANEL_CYCLE_IN_ANGLES,
    PANEL_INVERSION,
    PROBED_CYCLES,
    RATE_GENUS,
)

__all__ = [
    "GUARDED_FROM",
    "GUARD_DIGITS",
    "PANEL_CYCLES",
    "Costs",
    "estimate_modes",
    "grow",
]

#: Derived: cycles of the fastest phase from which frequencies are computed with guard digits;
#: before, one rounding of them is below 1e-13.
GUARDED_FROM = 200.0

#: Budget: digits of the frequencies then, enough for 1e28 cycles.
GUARD_DIGITS = 30

#: Budget: cycles that panels cover, minutes of work; and modes of a Fourier time map.
PANEL_CYCLES = 5e4
_MOST_MODES = 2e5

#: Budget: largest genus at which guard digits decide for the Fourier time map, which keeps them,
#: whatever it costs; and at which it is the last resort where panels do not reach.
_GUARDED_GENUS = 3
_LAST_RESORT_GENUS = 5

#: Derived: coefficients fall below 4e-16 = e^−36 outside a convex body. Its volume is about
#: (2.34·36/π)^g/(g! det T), as counts of modes up to genus 5 show; half of it counts.
_BODY = 2.34 * 36 / math.pi
_COUNTED_GENUS = 5

#: Derived: modes of a time map that nobody takes: e to this, and no more are counted.
_LARGEST_EXPONENT = 70.0


def grow(cost: tuple[float, float], genus: int) -> float:
    """Return a cost at a genus, from that at genus 1 and its growth."""
    first, growth = cost
    seconds: float = first * growth ** (genus - 1)
    return seconds


def estimate_modes(genus: int, log_determinant: float) -> float:
    """Return about how many modes the Fourier time map has, for the Riemann matrix iT
    with log det T.
    """
    counted = min(genus, _COUNTED_GENUS)
    exponent = genus * math.log(_BODY) - log_determinant
    exponent -= (genus - counted) * math.log(_BODY * math.pi / 36)
    return math.exp(min(exponent, _LARGEST_EXPONENT)) / (2 * math.factorial(counted))


@dataclass(frozen=True)
class Costs:
    """The costs of an orbit over so many cycles of its fastest phase.

    - modes: about how many the Fourier time map has
    - in_angles: whether panels take dt/dτ₁ from angles, not from theta functions
    """

    genus: int
    modes: float
    cycles: float
    in_angles: bool = False

    def seconds(self, time_map: str, inversions: int) -> float:
        """Return the seconds of a time map that is inverted so often; infinite where it is not
        taken of its own accord.
        """
        if time_map == "fourier":
            if self.modes > _MOST_MODES:
                return math.inf
            return (FIRST_MODES + self.modes) * (MODE + inversions * MODE_INVERTED)
        if self.cycles > PANEL_CYCLES:
            return math.inf
        cycles = min(self.cycles, PROBED_CYCLES + LONGER_PANELS * self.cycles) + 1
        by_theta = self.genus <= RATE_GENUS and not self.in_angles
        cycle = grow(PANEL_CYCLE, self.genus) if by_theta else PANEL_CYCLE_IN_ANGLES * self.genus
        return cycles * cycle + inversions * PANEL_INVERSION

    def estimates(self, inversions: int) -> dict[str, float]:
        """Return the seconds of either time map, those out of the question left out."""
        seconds = {name: self.seconds(name, inversions) for name in ("fourier", "panels")}
        return {name: round(value, 5) for name, value in seconds.items() if math.isfinite(value)}

    def cheaper_time_map(
        self, inversions: int, keeping: bool = True
    ) -> Literal["fourier", "panels"]:
        """Return the time map for so many inversions: the cheaper, but from GUARDED_FROM cycles on
        the one that keeps the digits.

        Not ``keeping``: the cheaper there too, as next to a separatrix, where modes are many and
        take more nodes each.
        """
        fourier, panels = (self.seconds(time_map, inversions) for time_map in ("fourier", "panels"))
        keeps = (
            keeping
            and self.cycles > GUARDED_FROM
            and self.genus <= _GUARDED_GENUS
            and fourier < math.inf
        )
        beyond = panels == math.inf and self.genus <= _LAST_RESORT_GENUS
        return "fourier" if keeps or beyond or fourier < panels else "panels"
