"""What an orbit costs, and which time map is the cheaper for given times: seconds on one core, from
measurements.

The Fourier time map costs its modes once, and all of them again at every inversion; panels cost
evaluations all along the orbit, and their inversions nothing to speak of. A window of many times
(analytic.dense_output.interpolation) takes one sum of them, a single time an inversion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

__all__ = ["GUARDED_FROM", "GUARD_DIGITS", "PANEL_CYCLES", "Costs", "estimate_modes"]

#: Cycles of the fastest phase from which frequencies are computed with guard digits: before, one
#: rounding of them is below 1e-13.
GUARDED_FROM = 200.0

#: Digits of the frequencies then.
GUARD_DIGITS = 30

#: Cycles that panels are willing to cover: minutes.
PANEL_CYCLES = 5e4

#: Largest genus at which guard digits decide for the Fourier time map, which keeps them, whatever
#: it costs.
_GUARDED_GENUS = 3

#: Largest genus at which a Fourier time map is the last resort where panels do not reach, and modes
#: with which it is chosen before.
_LAST_RESORT_GENUS = 5
_MOST_MODES = 2e5

#: The coefficients fall below 4e-16 = e^−36 inside a convex body of volume (36/π)^g/det T times
#: this, half of it counted.
_EXPONENT = 36.0
_BODY = {1: 1.0, 2: 1.25, 3: 1.07, 4: 0.67}
_HIGH_BODY = 0.29

#: Modes of a time map that nobody takes: e to this, and no more are counted.
_LARGEST_EXPONENT = 70.0

#: Seconds: of a mode, and of one in an inversion, with what each begins with; of a cycle on panels,
#: by theta functions or in angles, and of an evaluation.
_MODE = 12e-6
_MODES = 1e-3
_MODE_INVERTED = 0.02e-6
_INVERSION = 1e-6
_PANEL_CYCLE = {1: 1.7e-5, 2: 2.5e-5, 3: 4e-5, 4: 6.5e-5, 5: 1.5e-4, 6: 4e-4}
_PANEL_CYCLE_IN_ANGLES = {1: 2.2e-5, 2: 2e-4, 3: 2.6e-4, 4: 4e-4, 5: 6e-4, 6: 8e-4}
_EVALUATION = {1: 0.8e-6, 2: 1.2e-6, 3: 2e-6, 4: 6e-6}
_HIGH_PANEL_CYCLE = 1e-3
_HIGH_EVALUATION = 1e-5

#: Cycles from which panels are longer ones of more nodes: what finding them takes in such cycles,
#: and what one costs then.
_LONG_STRETCH = 80.0
_PROBES = 48.0
_LONGER_PANELS = 0.4

#: An inversion on panels, and the cycles that these reach beyond the times.
_PANEL_INVERSION = 3e-6
_PANEL_MARGIN = 1.0


def estimate_modes(genus: int, log_determinant: float) -> float:
    """Return about how many modes the Fourier time map has, for the Riemann matrix iT
    with log det T.
    """
    exponent = genus * math.log(_EXPONENT / math.pi) - log_determinant
    return _BODY.get(genus, _HIGH_BODY) * math.exp(
        exponent if exponent < _LARGEST_EXPONENT else _LARGEST_EXPONENT
    )


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

    def fewest_in_window(self, nodes: int, time_map: str) -> int:
        """Return the times from which a window with so many nodes is cheaper than single times."""
        inversion = (
            _INVERSION + self.modes * _MODE_INVERTED if time_map == "fourier" else _PANEL_INVERSION
        )
        evaluation = _EVALUATION.get(self.genus, _HIGH_EVALUATION)
        return max(4, round((1.5 * inversion + nodes * evaluation) / (inversion + evaluation)))

    def seconds(self, time_map: str, inversions: int) -> float:
        """Return the seconds of a time map that is inverted so often; infinite where it is not
        taken of its own accord.
        """
        if time_map == "fourier":
            of_modes = self.modes * (_MODE + inversions * _MODE_INVERTED)
            return (
                _MODES + of_modes + inversions * _INVERSION
                if self.modes <= _MOST_MODES
                else math.inf
            )
        if self.cycles > PANEL_CYCLES:
            return math.inf
        cycles = (
            self.cycles if self.cycles < _LONG_STRETCH else _PROBES + _LONGER_PANELS * self.cycles
        )
        of_cycles = (_PANEL_CYCLE_IN_ANGLES if self.in_angles else _PANEL_CYCLE).get(
            self.genus, _HIGH_PANEL_CYCLE
        )
        of_panels = (cycles + _PANEL_MARGIN) * of_cycles
        return of_panels + inversions * _PANEL_INVERSION

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
