"""Tunings: seconds on one core of what evaluation plans weigh against each other.

``python benchmarks/costs.py`` measures them again and prints the fits. A plan that is twice off
chooses the dearer way, whose answer is as good: no bound on an error depends on these numbers.
"""

from __future__ import annotations

__all__ = [
    "BALL_ENTRY",
    "BALL_INVERSION",
    "BALL_MODE",
    "BALL_THETA",
    "EVALUATION",
    "EVALUATION_IN_ANGLES",
    "MODE",
    "MODE_INVERTED",
    "PANEL_CYCLE",
    "PANEL_CYCLE_IN_ANGLES",
    "PANEL_INVERSION",
    "grow",
]

#: Tuning: a state by theta functions at genus 1, and its growth from one genus to the next; a
#: state in angles, per genus.
EVALUATION = (0.3e-6, 2.7)
EVALUATION_IN_ANGLES = 2e-6

#: Tuning: a cycle of the fastest phase on panels of dt/dτ₁, in the same way.
PANEL_CYCLE = (2.5e-5, 1.45)
PANEL_CYCLE_IN_ANGLES = 1.3e-4

#: Tuning: a Fourier mode, and one at every time that is inverted.
MODE = 11e-6
MODE_INVERTED = 0.015e-6

#: Tuning: a time inverted on panels that are there.
PANEL_INVERSION = 2e-6

#: Tuning: in balls of 60 digits: a term of an angle series of one point, dt/dτ₁ by theta functions
#: at genus 1 and its growth from one genus to the next, the same of a state, and a Fourier mode at
#: genus 3.
BALL_INVERSION = 0.7e-6
BALL_THETA = {"rate": (8e-5, 2.6), "state": (9e-5, 5.0)}
BALL_MODE = 1.2e-4

#: Tuning: an entry of the frame in balls, with the other series.
BALL_ENTRY = 6e-6


def grow(cost: tuple[float, float], genus: int) -> float:
    """Return a cost at a genus, from that at genus 1 and its growth."""
    first, growth = cost
    seconds: float = first * growth ** (genus - 1)
    return seconds
