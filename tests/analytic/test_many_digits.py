"""Many times with many digits, and what their sums are made of."""

from __future__ import annotations

import numpy as np
import pytest

import veselova as vs
from veselova.mechanics.systems.veselova import Veselova

BODIES = {
    "three": Veselova([3, 2, "1.2"], ["0.6", 0, "0.8"], ["0.4", "0.7", "-0.3"]),
    "four": Veselova([4, 3, 2, 1], [1, 1, 1, 1], [1, -2, 3, 1], normalize=True),
    "equal": Veselova([3, 3, 2, 1], [1, 2, 1, 1], [2, -1, 3, 1], normalize=True),
    "frozen": Veselova([4, 3, 2, 1], [1, 1, 0, 1], [1, -2, 0, 1], normalize=True),
    "plane": Veselova([3, 2], ["0.6", "0.8"], ["0.8", "-0.6"]),
}


@pytest.mark.daily(3)
@pytest.mark.parametrize("name", BODIES)
def test_many_times_in_balls_are_the_motion_of_each(name: str) -> None:
    """A dense stretch before t = 0, one after it, and times between."""
    times = np.unique(
        np.concatenate(
            [np.linspace(-1, -0.5, 900), np.linspace(-0.4, 1, 30), np.linspace(1, 1.5, 900)]
        )
    )
    chosen = np.arange(0, times.size, 97)
    many = vs.solve(BODIES[name], times, digits=30)
    single = vs.solve(BODIES[name], times[chosen], digits=30)
    for series in ("frame", "q", "q_dot", "omega", "spheroconic", "tau1"):
        found, expected = many.decimals, single.decimals
        difference = np.abs(found.midpoints[series][chosen] - expected.midpoints[series])
        assert np.all(difference <= found.radii[series][chosen] + expected.radii[series]), series
    assert max(many.decimals.error) < 1e-30
